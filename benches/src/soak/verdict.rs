//! What drifted over a soak.
//!
//! The first third of the looks is warm-up. After it, nothing may grow: the largest value of the last
//! third is held against the largest of the middle one, process by process. Counters are held against
//! each other in every part. Times are shown and not judged: the host may have others to serve.

use super::Soaked;
use super::watch::{Cost, Look, Looks};
use orchestrator::results::load::LoadRecord;
use std::fmt;

/// What memory may grow by in the last third and still be flat: what allocators and page tables move
/// by, bytes.
const GROWTH_BYTES_MAX: u64 = 1 << 20;

/// Fewest looks that show a drift.
const LOOKS_MIN: usize = 9;

/// Something that is not as it was, or not as it must be.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Drift(String);

impl fmt::Display for Drift {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.0)
    }
}

/// A quantity at the end of each third: the largest value in it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Thirds(pub [u64; 3]);

impl Thirds {
    /// The largest `value` of each third of `looks`.
    #[must_use]
    pub fn of(looks: &[Look], value: impl Fn(&Look) -> Option<u64>) -> Self {
        let third = looks.len().div_ceil(3).max(1);
        let mut thirds = [0; 3];
        for (largest, looks) in thirds.iter_mut().zip(looks.chunks(third)) {
            *largest = looks.iter().filter_map(&value).max().unwrap_or(0);
        }
        Self(thirds)
    }

    /// By how much the last third is above the middle one.
    const fn growth(self) -> u64 {
        self.0[2].saturating_sub(self.0[1])
    }
}

/// Everything that drifted; nothing if the soak is passed. A fleet with planted faults `may_lose`.
#[must_use]
pub fn drifts(soaked: &Soaked, may_lose: bool) -> Vec<Drift> {
    let mut drifts = of_looks(&soaked.looks);
    for load in &soaked.run.loads {
        drifts.extend(of_part(&load.record, may_lose));
    }
    drifts.extend(
        soaked.run.missing.iter().map(|lack| Drift(format!("{}: {}", lack.file, lack.what))),
    );
    drifts
}

/// A quantity of a process: its name, its unit, its value, and by how much it may grow.
type Quantity = (&'static str, &'static str, fn(&Cost) -> u64, u64);

const OF_PROCESSES: [Quantity; 3] = [
    ("resident memory", "bytes", |cost| cost.resident_bytes, GROWTH_BYTES_MAX),
    ("proportional memory", "bytes", |cost| cost.proportional_bytes, GROWTH_BYTES_MAX),
    ("descriptors", "open", |cost| cost.descriptors, 0),
];

fn of_looks(looks: &Looks) -> Vec<Drift> {
    if looks.len() < LOOKS_MIN {
        return vec![Drift(format!("{} looks show no drift; {LOOKS_MIN} may", looks.len()))];
    }
    let mut drifts = Vec::new();
    let mut judge = |name: String, unit: &str, thirds: Thirds, growth_max: u64| {
        if thirds.growth() > growth_max {
            let [_, before, after] = thirds.0;
            drifts.push(Drift(format!("{name} grew from {before} to {after} {unit}")));
        }
    };
    // Who is there at the end was there all the time, or since it was restarted.
    let at_end = looks.last().map(|look| look.crafts.keys().copied().collect::<Vec<_>>());
    for life in at_end.unwrap_or_default() {
        let own: Vec<Look> =
            looks.iter().filter(|look| look.crafts.contains_key(&life)).cloned().collect();
        if own.len() < LOOKS_MIN {
            continue;
        }
        for (name, unit, value, growth_max) in OF_PROCESSES {
            let thirds = Thirds::of(&own, |look| look.crafts.get(&life).map(value));
            judge(format!("{name} of craft {}", life.0), unit, thirds, growth_max);
        }
    }
    let files = Thirds::of(looks, |look| Some(look.shared_files));
    judge("shared memory".to_owned(), "files", files, 0);
    let bytes = Thirds::of(looks, |look| Some(look.shared_bytes));
    judge("shared memory".to_owned(), "bytes", bytes, GROWTH_BYTES_MAX);
    drifts
}

/// What of a part's ledger does not add up.
fn of_part(record: &LoadRecord, may_lose: bool) -> Vec<Drift> {
    let total = record.counts.total();
    let losses = record.losses;
    // What a host that was too busy for the load left undone is counted, and no drift.
    let kept_up = record.saturated.is_none();
    let complaints = [
        (losses.is_partial(), format!("something was lost: {losses:?}")),
        (
            record.expected.is_some_and(|expected| expected != record.counts),
            "the counts are not those that the trace demands".to_owned(),
        ),
        (
            record.expected.is_none() && total.transmissions != total.deliveries,
            format!("{} samples sent, {} delivered", total.transmissions, total.deliveries),
        ),
        (kept_up && record.censored > 0, format!("{} changes never arrived", record.censored)),
        (kept_up && record.unplayed > 0, format!("{} writes were not made", record.unplayed)),
    ];
    let broken = complaints.into_iter().filter(|(is_so, _)| *is_so && !may_lose);
    broken.map(|(_, what)| Drift(format!("part {}: {what}", record.load))).collect()
}

#[cfg(test)]
mod tests {
    use super::{Drift, GROWTH_BYTES_MAX, Thirds, of_looks};
    use crate::soak::watch::{Cost, Look, Looks};
    use shared_types::ids::{CraftId, Incarnation};

    /// `count` looks at two crafts; the second has `costs` more at each.
    fn looks(count: u64, more: impl Fn(u64) -> Cost) -> Looks {
        let plain = Cost { resident_bytes: 9 << 20, proportional_bytes: 3 << 20, descriptors: 30 };
        let look = |number: u64| {
            let more = more(number);
            let other = Cost {
                resident_bytes: plain.resident_bytes + more.resident_bytes,
                proportional_bytes: plain.proportional_bytes + more.proportional_bytes,
                descriptors: plain.descriptors + more.descriptors,
            };
            let life = |craft| (CraftId(craft), Incarnation(0));
            Look {
                crafts: [(life(0), plain), (life(1), other)].into(),
                shared_files: 40,
                shared_bytes: 5 << 20,
            }
        };
        (0..count).map(look).collect()
    }

    fn told(looks: &Looks) -> Vec<String> {
        of_looks(looks).iter().map(Drift::to_string).collect()
    }

    #[test]
    fn what_is_flat_after_the_warm_up_has_not_drifted() {
        let warm_up = |number: u64| Cost { resident_bytes: number.min(9) << 20, ..Cost::default() };
        assert_eq!(told(&looks(30, warm_up)), [""; 0]);
        let waves = |number: u64| Cost { descriptors: number % 2, ..Cost::default() };
        assert_eq!(told(&looks(30, waves)), [""; 0]);
    }

    #[test]
    fn every_leak_is_named_with_its_craft() {
        let leak =
            |number: u64| Cost { resident_bytes: number * GROWTH_BYTES_MAX / 8, ..Cost::default() };
        let found = told(&looks(30, leak));
        assert!(found.len() == 1 && found[0].contains("resident memory of craft 1"), "{found:?}");
        let leak = |number: u64| Cost { descriptors: number / 20, ..Cost::default() };
        let found = told(&looks(30, leak));
        assert!(found.len() == 1 && found[0].contains("descriptors of craft 1"), "{found:?}");
        let mut files = looks(30, |_| Cost::default());
        files[29].shared_files += 1;
        assert_eq!(told(&files), ["shared memory grew from 40 to 41 files"]);
    }

    #[test]
    fn too_few_looks_are_no_verdict() {
        assert_eq!(told(&looks(8, |_| Cost::default())).len(), 1);
        assert_eq!(Thirds::of(&[], |_| Some(1)), Thirds([0; 3]));
    }
}
