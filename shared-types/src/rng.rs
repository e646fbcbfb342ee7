//! All randomness: named ChaCha streams of one seed.
//!
//! A stream is named by trial, purpose and craft. Two streams never overlap, and drawing from one
//! never moves another, so a change of one strategy or one craft leaves every other draw as it was.
//! Bounded draws are our own (Lemire 2019, "Fast random integer generation in an interval"), so no
//! update of a library can change a published path.

use crate::ids::CraftId;
use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

/// What a stream is drawn for. The numbers are part of the results' meaning and never change.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u16)]
pub enum Purpose {
    /// Rules, actions, initial and final facts of one board.
    Board = 1,
    /// The links between boards (one stream for the fleet).
    Links = 2,
    /// Which candidate a craft fires.
    Firing = 3,
    /// Order of delivery in the simulator.
    Delivery = 4,
    /// Faults of a campaign.
    Faults = 5,
    /// Order of strategies and placement of processes.
    Order = 6,
    /// Bootstrap resampling.
    Bootstrap = 7,
    /// Traces of open mode.
    Trace = 8,
    /// Tests and campaigns of our own.
    Test = 9,
    /// Random networks for pruner and solvers, and what is asked of them.
    Networks = 10,
    /// Whether an action of a craft brings about what it presumes.
    Outcomes = 11,
}

/// One named stream of random numbers.
#[derive(Clone, Debug)]
pub struct Stream {
    generator: ChaCha8Rng,
}

impl Stream {
    /// The stream of `purpose` for `craft` (0 where the purpose has no craft) in `trial` of `seed`.
    #[must_use]
    pub fn new(seed: u64, trial: u32, purpose: Purpose, craft: u32) -> Self {
        Self::keyed((seed, trial, 0), purpose, craft)
    }

    /// The stream of `purpose` for the way from one craft to another in `trial` of `seed`.
    #[must_use]
    pub fn of_way(seed: u64, trial: u32, purpose: Purpose, (from, to): (CraftId, CraftId)) -> Self {
        // 0 is what the streams of single crafts have in this place.
        Self::keyed((seed, trial, from.0.saturating_add(1)), purpose, to.0)
    }

    fn keyed((seed, trial, from): (u64, u32, u32), purpose: Purpose, craft: u32) -> Self {
        let mut key = [0_u8; 32];
        key[0..8].copy_from_slice(&seed.to_le_bytes());
        key[8..12].copy_from_slice(&trial.to_le_bytes());
        key[12..16].copy_from_slice(&from.to_le_bytes());
        key[16..26].copy_from_slice(b"slateswarm");
        let mut generator = ChaCha8Rng::from_seed(key);
        generator.set_stream((u64::from(purpose as u16) << 32) | u64::from(craft));
        Self { generator }
    }

    /// The next 32 random bits.
    #[inline]
    pub fn bits(&mut self) -> u32 {
        self.generator.next_u32()
    }

    /// The next 64 random bits.
    #[inline]
    pub fn bits_wide(&mut self) -> u64 {
        self.generator.next_u64()
    }

    /// A number of `0..bound`, each equally likely.
    ///
    /// # Panics
    /// If `bound` is 0.
    #[inline]
    #[expect(clippy::cast_possible_truncation, reason = "the low half is meant")]
    pub fn below(&mut self, bound: u32) -> u32 {
        assert!(bound > 0, "invariant: a draw needs at least one possibility");
        let mut product = u64::from(self.bits()) * u64::from(bound);
        if (product as u32) < bound {
            let threshold = bound.wrapping_neg() % bound;
            while (product as u32) < threshold {
                product = u64::from(self.bits()) * u64::from(bound);
            }
        }
        (product >> 32) as u32
    }

    /// A number of `low..=high`.
    #[inline]
    pub fn between(&mut self, low: u32, high: u32) -> u32 {
        low + self.below(high - low + 1)
    }

    /// A number in `[0, 1)` with 53 random bits.
    #[inline]
    #[expect(clippy::cast_precision_loss, reason = "53 bits fit an f64 exactly")]
    pub fn unit(&mut self) -> f64 {
        (self.bits_wide() >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
    }

    /// Puts `items` into a random order (Fisher and Yates).
    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for last in (1..items.len()).rev() {
            let bound = u32::try_from(last + 1).expect("invariant: tables stay below 2^32 rows");
            items.swap(last, self.below(bound) as usize);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{CraftId, Purpose, Stream};

    #[test]
    fn draws_are_fixed_for_ever() {
        let mut stream = Stream::new(7, 3, Purpose::Firing, 2);
        let drawn: Vec<u32> = (0..6).map(|_| stream.below(1000)).collect();
        let mut again = Stream::new(7, 3, Purpose::Firing, 2);
        assert_eq!(drawn, (0..6).map(|_| again.below(1000)).collect::<Vec<_>>());
        assert_eq!(drawn, PINNED);
    }

    /// Drawn once by this code; a change here would change every published path.
    const PINNED: [u32; 6] = [25, 745, 405, 573, 379, 764];

    #[test]
    fn streams_of_other_names_differ() {
        let first = Stream::new(7, 3, Purpose::Firing, 2).bits_wide();
        assert_ne!(first, Stream::new(8, 3, Purpose::Firing, 2).bits_wide());
        assert_ne!(first, Stream::new(7, 4, Purpose::Firing, 2).bits_wide());
        assert_ne!(first, Stream::new(7, 3, Purpose::Board, 2).bits_wide());
        assert_ne!(first, Stream::new(7, 3, Purpose::Firing, 3).bits_wide());
        let way = |from, to| {
            let ends = (CraftId(from), CraftId(to));
            Stream::of_way(7, 3, Purpose::Firing, ends).bits_wide()
        };
        assert_ne!(first, way(0, 2));
        assert_ne!(way(0, 2), way(2, 0));
        assert_ne!(way(0, 2), way(1, 2));
    }

    #[test]
    fn every_value_of_a_small_bound_comes_equally_often() {
        let mut stream = Stream::new(1, 0, Purpose::Test, 0);
        let mut counts = [0_u32; 7];
        for _ in 0..70_000 {
            counts[stream.below(7) as usize] += 1;
        }
        // Four standard deviations of a binomial count with n = 70,000 and p = 1/7.
        assert!(counts.iter().all(|&count| count.abs_diff(10_000) < 371), "{counts:?}");
    }
}
