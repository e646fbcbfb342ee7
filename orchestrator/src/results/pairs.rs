//! The turn times of strategies, paired by block with those of one that all are compared with.
//!
//! What is compared is the median turn time of a block; the floor is the same strategy once more in
//! the same block. The statistics are in [`super::inference`]. Not here: figures of single strategies.

use super::inference::{Comparison, Pairing, Verdict, compare};
use super::read::RunData;
use super::statistics::{Quantile, as_float};
use serde::Serialize;
use shared_types::rng::{Purpose, Stream};
use shared_types::wire::StrategyKind;
use std::collections::BTreeMap;

/// Streams of comparisons are numbered from here, apart from those of quantiles.
const FIRST_STREAM: u32 = 1000;

/// A strategy's median turn time beside that of another.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Compared {
    /// Crafts, a centre not counted.
    pub size: u32,
    /// Whose time is above the line of the ratio.
    pub strategy: StrategyKind,
    /// Whose time is below it.
    pub base: StrategyKind,
    /// The faster one, where one may be named.
    pub winner: Option<StrategyKind>,
    /// What the blocks say.
    #[serde(flatten)]
    pub comparison: Comparison,
}

/// The strategy that others are compared with: `boundary`, or the first that sends anything.
#[must_use]
pub fn base_of(strategies: &[StrategyKind]) -> Option<StrategyKind> {
    let mut candidates = strategies.iter().copied().filter(|&kind| kind != StrategyKind::Null);
    let first = candidates.clone().next();
    candidates.find(|&strategy| strategy == StrategyKind::Boundary).or(first)
}

/// Median turn time by block.
type Medians = BTreeMap<u32, f64>;

/// Every strategy of every size beside the one that all are compared with.
#[must_use]
pub fn compared(run: &RunData, is_clean: bool) -> Vec<Compared> {
    let seed = run.provenance.as_ref().map_or(0, |provenance| provenance.seed);
    let mut medians: BTreeMap<u32, BTreeMap<(StrategyKind, u32), Medians>> = BTreeMap::new();
    for record in run.timings.iter().map(|timed| &timed.record) {
        let Some(median) = record.turn_time.quantile_ns(Quantile::P50) else { continue };
        let of_size = medians.entry(record.cell.size).or_default();
        let label = record.label();
        let blocks = of_size.entry((label.strategy, label.again)).or_default();
        blocks.insert(record.cell.block, as_float(median));
    }
    let (mut names, mut pairings) = (Vec::new(), Vec::new());
    for (&size, cells) in &medians {
        let strategies: Vec<StrategyKind> =
            cells.keys().filter(|(_, again)| *again == 0).map(|&(strategy, _)| strategy).collect();
        let Some(base) = base_of(&strategies) else { continue };
        let nothing = Medians::new();
        let below = &cells[&(base, 0)];
        let floor = log_ratios(cells.get(&(base, 1)).unwrap_or(&nothing), below);
        for strategy in strategies {
            if strategy != base && strategy != StrategyKind::Null {
                let log_ratios = log_ratios(&cells[&(strategy, 0)], below);
                let number = FIRST_STREAM + strategy as u32;
                let stream = Stream::new(seed, size, Purpose::Bootstrap, number);
                names.push((size, strategy, base));
                pairings.push(Pairing { log_ratios, floor: floor.clone(), stream });
            }
        }
    }
    let paired = names.into_iter().zip(compare(pairings, is_clean));
    paired
        .filter_map(|((size, strategy, base), comparison)| {
            let comparison = comparison?;
            let faster = if comparison.ratio < 1.0 { strategy } else { base };
            let winner = (comparison.verdict == Verdict::Winner).then_some(faster);
            Some(Compared { size, strategy, base, winner, comparison })
        })
        .collect()
}

/// Of the blocks that both have.
fn log_ratios(above: &Medians, below: &Medians) -> Vec<f64> {
    let shared = above.iter().filter_map(|(block, time)| Some((time, below.get(block)?)));
    shared
        .filter(|&(above, below)| *above > 0.0 && *below > 0.0)
        .map(|(a, b)| (a / b).ln())
        .collect()
}
