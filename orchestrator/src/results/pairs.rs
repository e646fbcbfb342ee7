//! The turn times of strategies, paired by block with those of one that all are compared with.
//!
//! What is compared is the median turn time of a block; the floor is the same strategy once more in
//! the same block. The statistics are in [`super::inference`]. Not here: figures of single strategies.

use super::inference::{Comparison, Pairing, Verdict, compare};
use super::read::RunData;
use super::record::Label;
use super::statistics::{Quantile, as_float};
use serde::Serialize;
use shared_types::rng::{Purpose, Stream};
use shared_types::wire::StrategyKind;
use std::collections::BTreeMap;

/// Streams of comparisons are numbered from here, apart from those of quantiles.
const FIRST_STREAM: u32 = 1000;

/// Those of controls.
const FIRST_CONTROL_STREAM: u32 = 2000;

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

/// A comparison whose answer is known: a strategy beside itself, or beside itself slowed down.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Control {
    /// Crafts, a centre not counted.
    pub size: u32,
    /// The strategy.
    pub strategy: StrategyKind,
    /// By how much its turns were lengthened on purpose on the side above the line, percent; 0 for the
    /// strategy beside itself.
    pub planted_percent: u64,
    /// Whether the blocks say what they should: a winner exactly where a slowdown is planted. Absent
    /// where they are too few to say anything, or the host was noisy.
    pub is_right: Option<bool>,
    /// What they say.
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

/// Those of every label, by size.
fn medians_of(run: &RunData) -> BTreeMap<u32, BTreeMap<Label, Medians>> {
    let mut medians: BTreeMap<u32, BTreeMap<Label, Medians>> = BTreeMap::new();
    for record in run.timings.iter().map(|timed| &timed.record) {
        let Some(median) = record.turn_time.quantile_ns(Quantile::P50) else { continue };
        let of_size = medians.entry(record.cell.size).or_default();
        let blocks = of_size.entry(record.label()).or_default();
        blocks.insert(record.cell.block, as_float(median));
    }
    medians
}

/// The distance of the strategy of every label of `cells` from itself, where it enters twice.
fn floor_of(cells: &BTreeMap<Label, Medians>, strategy: StrategyKind) -> Vec<f64> {
    ratios_of(cells, Label { strategy, again: 1 }, Label::first(strategy))
}

fn ratios_of(cells: &BTreeMap<Label, Medians>, above: Label, below: Label) -> Vec<f64> {
    match (cells.get(&above), cells.get(&below)) {
        (Some(above), Some(below)) => log_ratios(above, below),
        _ => Vec::new(),
    }
}

/// The controls of every size that has them.
#[must_use]
pub fn controls(run: &RunData, is_clean: bool) -> Vec<Control> {
    let seed = run.provenance.as_ref().map_or(0, |provenance| provenance.seed);
    let (mut names, mut pairings) = (Vec::new(), Vec::new());
    for (&size, cells) in &medians_of(run) {
        let [third, fourth, slowed] = Label::CONTROLS;
        for (above, below) in [(fourth, third), (slowed, 0)] {
            let Some(strategy) = cells.keys().find(|label| label.again == above) else { continue };
            let of = |again| Label { again, ..*strategy };
            let log_ratios = ratios_of(cells, of(above), of(below));
            let floor = floor_of(cells, strategy.strategy);
            let stream = Stream::new(seed, size, Purpose::Bootstrap, FIRST_CONTROL_STREAM + above);
            names.push((size, of(above)));
            pairings.push(Pairing { log_ratios, floor, stream });
        }
    }
    let paired = names.into_iter().zip(compare(pairings, is_clean));
    paired
        .filter_map(|((size, label), comparison)| {
            let comparison = comparison?;
            let planted_percent = label.planted_slowdown_percent();
            let is_found = match comparison.verdict {
                Verdict::Winner => Some(comparison.ratio > 1.0 || planted_percent == 0),
                Verdict::Tie => Some(false),
                Verdict::TooFewBlocks | Verdict::Noisy => None,
            };
            let is_right = is_found.map(|is_found| is_found == (planted_percent > 0));
            let strategy = label.strategy;
            Some(Control { size, strategy, planted_percent, is_right, comparison })
        })
        .collect()
}

/// Every strategy of every size beside the one that all are compared with.
#[must_use]
pub fn compared(run: &RunData, is_clean: bool) -> Vec<Compared> {
    let seed = run.provenance.as_ref().map_or(0, |provenance| provenance.seed);
    let medians = medians_of(run);
    let (mut names, mut pairings) = (Vec::new(), Vec::new());
    for (&size, cells) in &medians {
        let strategies: Vec<StrategyKind> =
            cells.keys().filter(|label| label.again == 0).map(|label| label.strategy).collect();
        let Some(base) = base_of(&strategies) else { continue };
        let floor = floor_of(cells, base);
        for strategy in strategies {
            if strategy != base && strategy != StrategyKind::Null {
                let log_ratios = ratios_of(cells, Label::first(strategy), Label::first(base));
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
