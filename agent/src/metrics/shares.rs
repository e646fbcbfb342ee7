//! How the parts of time to knowledge share it, as counts.
//!
//! Parts do not add up as percentiles, so every event is counted by the class of its total and, for
//! each part, by the part's share of it. Whoever reads the table takes the events whose total lies at
//! or above a percentile and looks for the median share of each part among them. Classes of totals
//! split every octave into eight equal steps; shares go in steps of 5 %.

/// Classes of totals in each octave of ns.
pub const TOTAL_CLASSES_PER_OCTAVE: u32 = 8;

/// Steps of a share; the whole total is step [`SHARE_STEPS`].
pub const SHARE_STEPS: u32 = 20;

/// Octaves of totals: the last begins above nine minutes.
const OCTAVES: u32 = 40;

const PARTS: u32 = 3;
const SHARES: u32 = SHARE_STEPS + 1;
const CELLS: u32 = OCTAVES * TOTAL_CLASSES_PER_OCTAVE * PARTS * SHARES;

/// The name of a part in tables; `None` if there is no such part.
///
/// `origin` is everything before the send (relay work and, under central strategies, the wait for the
/// reply included), `wake` the time under way, `apply` from there to knowledge.
#[must_use]
pub fn share_part_name(part: u32) -> Option<&'static str> {
    ["origin", "wake", "apply"].get(part as usize).copied()
}

/// The least total, ns, that a class holds.
#[must_use]
pub const fn class_floor_ns(class: u32) -> u64 {
    let (octave, step) = (class / TOTAL_CLASSES_PER_OCTAVE, class % TOTAL_CLASSES_PER_OCTAVE);
    ((TOTAL_CLASSES_PER_OCTAVE as u64 + step as u64) << octave) / TOTAL_CLASSES_PER_OCTAVE as u64
}

/// Whether a row of a table names a class, a part and a share that there are.
#[must_use]
pub const fn is_share_row([class, part, step, _]: [u32; 4]) -> bool {
    class < OCTAVES * TOTAL_CLASSES_PER_OCTAVE && part < PARTS && step < SHARES
}

/// A table of counts by class of the total, part and share.
#[derive(Clone, Debug, Default)]
pub struct Shares {
    counts: Vec<u32>,
}

impl Shares {
    /// Forgets everything.
    pub(super) fn reset(&mut self) {
        self.counts.clear();
        self.counts.resize(CELLS as usize, 0);
    }

    /// Counts `times` events of `total_ns`, of which `wake_ns` were spent under way and `apply_ns`
    /// behind it.
    #[inline]
    pub(super) fn count(&mut self, total_ns: u64, wake_ns: u64, apply_ns: u64, times: u32) {
        let total_ns = total_ns.max(1);
        let class = class_of(total_ns);
        // A time that was cut off on its way must not exceed the whole.
        let apply_ns = apply_ns.min(total_ns);
        let wake_ns = wake_ns.min(total_ns - apply_ns);
        let origin_ns = total_ns - apply_ns - wake_ns;
        for (part, part_ns) in (0..).zip([origin_ns, wake_ns, apply_ns]) {
            let step = part_ns.saturating_mul(u64::from(SHARE_STEPS)) / total_ns;
            let step = u32::try_from(step).unwrap_or(SHARE_STEPS).min(SHARE_STEPS);
            let cell = (class * PARTS + part) * SHARES + step;
            let count = &mut self.counts[cell as usize];
            *count = count.saturating_add(times);
        }
    }

    /// Rows of (class of the total, part, share in steps, events) that have events, in this order.
    pub(super) fn rows(&self) -> Vec<[u32; 4]> {
        let filled = (0_u32..).zip(&self.counts).filter(|&(_, &count)| count > 0);
        filled
            .map(|(cell, &count)| {
                let (row, step) = (cell / SHARES, cell % SHARES);
                [row / PARTS, row % PARTS, step, count]
            })
            .collect()
    }
}

/// The class of a total of at least 1 ns.
#[inline]
fn class_of(total_ns: u64) -> u32 {
    let octave = total_ns.ilog2().min(OCTAVES - 1);
    // The three binary digits behind the first.
    let digits = ((u128::from(total_ns) << 3) >> octave) & 7;
    octave * TOTAL_CLASSES_PER_OCTAVE + u32::try_from(digits).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::{SHARE_STEPS, Shares, class_floor_ns, class_of};

    #[test]
    fn every_total_lies_in_the_class_whose_floor_is_the_last_at_or_below_it() {
        for total_ns in (1..5000).chain([123_456_789, 1 << 30, (1 << 31) - 1, 59_999_999_999]) {
            let class = class_of(total_ns);
            assert!(class_floor_ns(class) <= total_ns, "{total_ns}");
            assert!(total_ns < 8 || class_floor_ns(class + 1) > total_ns, "{total_ns}");
        }
    }

    #[test]
    fn the_parts_of_an_event_are_counted_by_their_shares() {
        let mut shares = Shares::default();
        shares.reset();
        // 25 % origin, 70 % under way, 5 % apply.
        shares.count(1_000, 700, 50, 3);
        let class = class_of(1_000);
        assert_eq!(shares.rows(), [[class, 0, 5, 3], [class, 1, 14, 3], [class, 2, 1, 3]]);
    }

    #[test]
    fn parts_that_exceed_the_whole_are_cut() {
        let mut shares = Shares::default();
        shares.reset();
        shares.count(100, u64::MAX, 40, 1);
        let steps: Vec<u32> = shares.rows().iter().map(|row| row[2]).collect();
        assert_eq!(steps, [0, 12, 8]);
        assert!(steps.iter().sum::<u32>() <= SHARE_STEPS);
    }
}
