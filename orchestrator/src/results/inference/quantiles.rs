//! Intervals of quantiles of times: blocks are resampled first, the slices of each drawn block second.
//!
//! Values of one slice (an epoch, or a stretch of time) are not independent, those of one block even
//! less; so never single values are drawn. All values of a cell are sorted once; a resample weighs
//! the slices, and one pass over the sorted values finds every quantile. Blocks are drawn from a
//! stream of their own: cells that share it are resampled on the same blocks, so that the n-th
//! resamples of two strategies can be subtracted.

use super::{INTERVAL_BLOCKS_MIN, RESAMPLES, below, middle_of};
use crate::results::statistics::{Quantile, as_float};
use shared_types::rng::Stream;

/// How often each value occurs in one slice: (value, count).
pub type Slice = Vec<(u64, u64)>;

/// Quantiles of one resample, in the order of [`Quantile::ALL`].
pub type Resample = [f64; Quantile::ALL.len()];

/// The values of one cell, ready to be resampled.
#[derive(Debug)]
pub struct Resampler {
    /// Numbers of the slices of each block.
    blocks: Vec<Vec<usize>>,
    slice_count: usize,
    /// (value, slice, count), ascending.
    steps: Vec<(u64, usize, u64)>,
}

impl Resampler {
    /// Of the slices of each block; `None` if there are too few blocks for an interval, or an empty
    /// one.
    #[must_use]
    pub fn new(blocks: &[&[Slice]]) -> Option<Self> {
        if blocks.len() < INTERVAL_BLOCKS_MIN || blocks.iter().any(|slices| slices.is_empty()) {
            return None;
        }
        let (mut numbers, mut steps, mut slice_count) = (Vec::new(), Vec::new(), 0);
        for slices in blocks {
            numbers.push((slice_count..slice_count + slices.len()).collect());
            for slice in *slices {
                steps.extend(slice.iter().map(|&(value, count)| (value, slice_count, count)));
                slice_count += 1;
            }
        }
        steps.sort_unstable();
        Some(Self { blocks: numbers, slice_count, steps })
    }

    /// [`RESAMPLES`] resamples: blocks drawn from `of_blocks`, slices from `of_slices`.
    #[must_use]
    pub fn resamples(&self, mut of_blocks: Stream, mut of_slices: Stream) -> Vec<Resample> {
        let mut weights = vec![0_u64; self.slice_count];
        (0..RESAMPLES)
            .map(|_| {
                weights.fill(0);
                for _ in 0..self.blocks.len() {
                    let slices = &self.blocks[below(&mut of_blocks, self.blocks.len())];
                    for _ in 0..slices.len() {
                        weights[slices[below(&mut of_slices, slices.len())]] += 1;
                    }
                }
                self.quantiles(&weights)
            })
            .collect()
    }

    fn quantiles(&self, weights: &[u64]) -> Resample {
        let total: u64 = self.steps.iter().map(|&(_, slice, count)| weights[slice] * count).sum();
        let mut found = [0.0; Quantile::ALL.len()];
        // The rank that one value in so many lies beyond.
        let ranks = Quantile::ALL.map(|quantile| total - total / u64::from(quantile.one_beyond_in));
        let (mut place, mut passed) = (0, 0);
        for &(value, slice, count) in &self.steps {
            passed += weights[slice] * count;
            while place < ranks.len() && passed >= ranks[place] {
                found[place] = as_float(value);
                place += 1;
            }
        }
        found
    }
}

/// The 95 % interval of the quantile at `place` of [`Quantile::ALL`].
#[must_use]
pub fn interval(resamples: &[Resample], place: usize) -> Option<(f64, f64)> {
    middle_of(resamples.iter().map(|resample| resample[place]).collect())
}

/// The 95 % interval of how much the quantile at `place` exceeds that of `floor`, which was resampled
/// on the same blocks.
#[must_use]
pub fn excess_interval(
    resamples: &[Resample],
    floor: &[Resample],
    place: usize,
) -> Option<(f64, f64)> {
    let pairs = resamples.iter().zip(floor);
    middle_of(pairs.map(|(own, floor)| own[place] - floor[place]).collect())
}
