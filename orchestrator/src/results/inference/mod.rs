//! Whether one strategy is faster than another, said only where blocks carry it.
//!
//! Strategies are paired by block: a fresh fleet differs from the next by tens of percent, whatever it
//! runs, so only ratios within one block say something. The ratio is that of Hodges and Lehmann (the
//! median of the means of all pairs of logarithms), its interval comes from resampling blocks, its p
//! from flipping the signs of blocks, corrected for the number of comparisons by Holm (1979). A
//! difference below that of one strategy from itself, the A-A floor, is no difference. Intervals of
//! quantiles are in [`quantiles`]. Not here: where the values come from (`super::times`).

pub mod quantiles;

#[cfg(test)]
mod tests;

use super::statistics::{as_float, ratio_of_sums};
use serde::Serialize;
use shared_types::limits::WINNER_BLOCKS_MIN;
use shared_types::rng::Stream;

/// How often a bootstrap draws.
pub const RESAMPLES: usize = 1000;

/// Draws of a bootstrap that lie outside a 95 % interval on either side.
const RESAMPLES_OUTSIDE: usize = RESAMPLES / 40;

/// Fewest blocks that have an interval.
pub const INTERVAL_BLOCKS_MIN: usize = 3;

/// A difference that comes up by chance more often than this is none.
pub const SIGNIFICANCE: f64 = 0.05;

/// Up to so many blocks all sign patterns are tried, beyond as many as [`RANDOM_FLIPS`].
const ALL_FLIPS_BLOCKS_MAX: usize = 20;

/// Sign patterns drawn where there are too many to try.
const RANDOM_FLIPS: u32 = 99_999;

/// What may be said about a ratio of times.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// The faster of the two is.
    Winner,
    /// Enough blocks, and no difference that stands.
    Tie,
    /// No test can reach significance with so few.
    TooFewBlocks,
    /// Something else ran on the host: times name no winner.
    Noisy,
}

impl Verdict {
    /// The name in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Winner => "winner",
            Self::Tie => "tie",
            Self::TooFewBlocks => "too few blocks",
            Self::Noisy => "noisy",
        }
    }
}

/// Two strategies that are to be compared.
#[derive(Clone, Debug)]
pub struct Pairing {
    /// Logarithm of own time over the other's, a block.
    pub log_ratios: Vec<f64>,
    /// The same of one strategy over itself: the A-A floor.
    pub floor: Vec<f64>,
    /// Where draws come from.
    pub stream: Stream,
}

/// What came out of a comparison.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Own time over the other's.
    pub ratio: f64,
    /// Its 95 % interval; absent below [`INTERVAL_BLOCKS_MIN`] blocks.
    pub interval: Option<(f64, f64)>,
    /// How often chance alone gives such a ratio, corrected for all comparisons of the run.
    pub p_value: f64,
    /// The distance from 1 that one strategy has from itself, as a ratio of at least 1.
    pub floor: Option<f64>,
    /// Blocks that carry it.
    pub blocks: u64,
    /// What may be said.
    pub verdict: Verdict,
}

/// Compares every pair; `None` for one without a common block. Pairs are one family: each further
/// one makes the test of all of them stricter.
#[must_use]
pub fn compare(pairings: Vec<Pairing>, is_clean: bool) -> Vec<Option<Comparison>> {
    let needed = blocks_needed(pairings.iter().filter(|pair| !pair.log_ratios.is_empty()).count());
    let mut compared: Vec<Option<Comparison>> =
        pairings.into_iter().map(|pair| compare_one(pair, needed)).collect();
    let p_values: Vec<f64> = compared.iter().flatten().map(|one| one.p_value).collect();
    for (one, p_value) in compared.iter_mut().flatten().zip(holm(&p_values)) {
        one.p_value = p_value;
        one.verdict = match one.verdict {
            _ if !is_clean => Verdict::Noisy,
            Verdict::Winner if p_value >= SIGNIFICANCE => Verdict::Tie,
            verdict => verdict,
        };
    }
    compared
}

/// Everything but the correction: a winner so far is one before it.
fn compare_one(mut pair: Pairing, needed: usize) -> Option<Comparison> {
    let log_ratio = hodges_lehmann(&pair.log_ratios)?;
    let interval = interval(&pair.log_ratios, &mut pair.stream);
    let floor = hodges_lehmann(&pair.floor).map(f64::abs);
    let excludes_one = interval.is_some_and(|(low, high)| low > 0.0 || high < 0.0);
    let verdict = if pair.log_ratios.len().min(pair.floor.len()) < needed {
        Verdict::TooFewBlocks
    } else if excludes_one && floor.is_some_and(|floor| log_ratio.abs() > floor) {
        Verdict::Winner
    } else {
        Verdict::Tie
    };
    Some(Comparison {
        ratio: log_ratio.exp(),
        interval: interval.map(|(low, high)| (low.exp(), high.exp())),
        p_value: sign_flip(&pair.log_ratios, &mut pair.stream),
        floor: floor.map(f64::exp),
        blocks: pair.log_ratios.len() as u64,
        verdict,
    })
}

/// Fewest blocks with which the smallest possible p, all blocks on one side, stays significant after
/// the correction for `comparisons`.
#[must_use]
pub fn blocks_needed(comparisons: usize) -> usize {
    let smallest = |blocks: usize| {
        let exponent = i32::try_from(blocks).unwrap_or(i32::MAX);
        as_float(comparisons as u64) * 2.0 * 0.5_f64.powi(exponent)
    };
    let mut blocks = WINNER_BLOCKS_MIN as usize;
    while smallest(blocks) >= SIGNIFICANCE {
        blocks += 1;
    }
    blocks
}

/// The median of the means of all pairs of `values`, each with itself included; `None` of nothing.
#[must_use]
pub fn hodges_lehmann(values: &[f64]) -> Option<f64> {
    let mut means = Vec::with_capacity(values.len() * (values.len() + 1) / 2);
    for (place, &one) in values.iter().enumerate() {
        means.extend(values[place..].iter().map(|&other| f64::midpoint(one, other)));
    }
    let middle = means.len() / 2;
    if means.is_empty() {
        return None;
    }
    let is_even = means.len().is_multiple_of(2);
    let (below, &mut upper, _) = means.select_nth_unstable_by(middle, f64::total_cmp);
    let lower = below.iter().copied().max_by(f64::total_cmp).filter(|_| is_even);
    Some(lower.map_or(upper, |lower| f64::midpoint(lower, upper)))
}

/// The 95 % interval of [`hodges_lehmann`] over resampled blocks.
fn interval(values: &[f64], stream: &mut Stream) -> Option<(f64, f64)> {
    if values.len() < INTERVAL_BLOCKS_MIN {
        return None;
    }
    let mut drawn = vec![0.0; values.len()];
    let estimates = (0..RESAMPLES).filter_map(|_| {
        drawn.iter_mut().for_each(|value| *value = values[below(stream, values.len())]);
        hodges_lehmann(&drawn)
    });
    middle_of(estimates.collect())
}

/// [`RESAMPLES`] ratios of sums over resampled blocks of (above, below); empty below
/// [`INTERVAL_BLOCKS_MIN`] blocks.
#[must_use]
pub fn ratio_resamples(blocks: &[(u64, u64)], stream: &mut Stream) -> Vec<f64> {
    if blocks.len() < INTERVAL_BLOCKS_MIN {
        return Vec::new();
    }
    let resample = |_| {
        let drawn: Vec<_> = blocks.iter().map(|_| blocks[below(stream, blocks.len())]).collect();
        ratio_of_sums(drawn)
    };
    (0..RESAMPLES).filter_map(resample).collect()
}

/// The 95 % in the middle of a bootstrap's estimates.
#[must_use]
pub fn middle_of(mut estimates: Vec<f64>) -> Option<(f64, f64)> {
    estimates.sort_unstable_by(f64::total_cmp);
    let last = estimates.len().checked_sub(RESAMPLES_OUTSIDE)?;
    Some((*estimates.get(RESAMPLES_OUTSIDE - 1)?, *estimates.get(last)?))
}

/// How often the sum of `values` is as far from 0 if the sign of each is chance: both sides, exact up
/// to `ALL_FLIPS_BLOCKS_MAX` values. 1 of nothing.
#[must_use]
pub fn sign_flip(values: &[f64], stream: &mut Stream) -> f64 {
    let Some((first, rest)) = values.split_first() else { return 1.0 };
    let size: f64 = values.iter().map(|value| value.abs()).sum();
    // Sums that differ by rounding alone are the same sum.
    let observed = values.iter().sum::<f64>().abs() - size * 1e-9;
    if values.len() > ALL_FLIPS_BLOCKS_MAX {
        let flipped =
            |stream: &mut Stream, &value: &f64| if stream.below(2) == 0 { value } else { -value };
        let as_far = (0..RANDOM_FLIPS)
            .filter(|_| {
                values.iter().map(|value| flipped(stream, value)).sum::<f64>().abs() >= observed
            })
            .count();
        return as_float(as_far as u64 + 1) / f64::from(RANDOM_FLIPS + 1);
    }
    // The sign of the first is free: each pattern stands for itself and its mirror image.
    let patterns = 1_u32 << rest.len();
    let sum_of = |pattern: u32| {
        let sign = |place: usize| if pattern >> place & 1 == 0 { 1.0 } else { -1.0 };
        rest.iter().enumerate().map(|(place, value)| sign(place) * value).sum::<f64>()
    };
    let as_far = (0..patterns).filter(|&pattern| (first + sum_of(pattern)).abs() >= observed);
    as_float(as_far.count() as u64) / f64::from(patterns)
}

/// `p_values` corrected for their number (Holm 1979), in their order.
#[must_use]
pub fn holm(p_values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p_values.len()).collect();
    order.sort_by(|&one, &other| p_values[one].total_cmp(&p_values[other]));
    let mut corrected = vec![1.0; p_values.len()];
    let mut largest = 0.0_f64;
    for (rank, &place) in order.iter().enumerate() {
        let remaining = as_float((p_values.len() - rank) as u64);
        largest = largest.max(p_values[place] * remaining).min(1.0);
        corrected[place] = largest;
    }
    corrected
}

/// A place of `0..length`.
fn below(stream: &mut Stream, length: usize) -> usize {
    let bound = u32::try_from(length).expect("invariant: tables stay below 2^32 rows");
    stream.below(bound) as usize
}
