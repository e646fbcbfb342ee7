//! Figures of open mode: one row per fleet size, load, strategy and asking interval.
//!
//! Blocks of one row are merged as those of turn times are; intervals resample blocks first and slices
//! of the measured time second, of all rows of a size the same blocks. A saturated row has no
//! percentiles. What a strategy costs is divided by the applications that the trace needs, the same for
//! all strategies. Comparisons are in [`super::load_pairs`].

mod costs;
mod hops;

pub use hops::{HOPS, OverHops};

use super::figure::Figures;
use super::histogram::STALENESS_TAG;
use super::inference::quantiles::{Resampler, Slice, interval};
use super::inference::ratio_resamples;
use super::load::{LoadRecord, Saturation};
use super::read::{LoadCell, RunData};
use super::record::Label;
use super::statistics::{Quantile, as_float, merged};
use super::times::SECOND_HALF_RATIO_MAX;
use hdrhistogram::Histogram;
use serde::Serialize;
use shared_types::limits::ORCHESTRATOR_CORE_SHARE_MAX;
use shared_types::rng::{Purpose, Stream};
use shared_types::wire::{Stage, StrategyKind};
use std::collections::{BTreeMap, BTreeSet};

/// Streams of the loads' intervals are numbered from here, apart from those of other figures.
const FIRST_STREAM: u32 = 4000;

/// What was measured of one label at one load and fleet size.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LoadFigures {
    /// Crafts, a centre not counted.
    pub size: u32,
    /// Name of the load.
    pub load: String,
    /// How changes were replicated.
    pub strategy: StrategyKind,
    /// As [`Label::again`].
    pub again: u32,
    /// Whether its times are of a virtual clock; then nothing is compared, and no processor time is known.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub is_simulated: bool,
    /// How often a client asks the centre, ns; `None` without a centre.
    pub asks_every_ns: Option<u64>,
    /// Whether other strategies are compared with this row, or this with another: of a central
    /// strategy only the middle asking interval.
    pub is_compared: bool,
    /// Why more than half of the blocks were above capacity; then there are no percentiles.
    pub saturated: Option<Saturation>,
    /// Blocks that were above capacity; up to half of them stand in the percentiles like the others.
    pub saturated_blocks: u64,
    /// Whether the second half of the interval was as fast as the first; absent without an event.
    pub is_stationary: Option<bool>,
    /// Whether the schedule's median lateness exceeds half of the median time to knowledge: then no
    /// winner on latency is named.
    pub is_late: bool,
    /// Whether the orchestrator used more than [`ORCHESTRATOR_CORE_SHARE_MAX`] of a core in an interval.
    pub is_disturbed: bool,
    /// By metric.
    pub figures: Figures,
}

impl LoadFigures {
    /// The label under which it was measured.
    #[must_use]
    pub const fn label(&self) -> Label {
        Label { strategy: self.strategy, again: self.again }
    }
}

/// What tells rows apart: size, load, strategy, entry, asking interval.
type Key = (u32, String, StrategyKind, u32, Option<u64>);

fn key_of(record: &LoadRecord) -> Key {
    let label = record.label();
    let load = record.load.clone();
    (record.cell.size, load, label.strategy, label.again, record.asks_every_ns)
}

/// Every row, ordered by size, load (as first met) and strategy.
#[must_use]
pub fn load_figures(run: &RunData) -> Vec<LoadFigures> {
    let seed = run.provenance.as_ref().map_or(0, |provenance| provenance.seed);
    let mut rows: BTreeMap<Key, Vec<&LoadCell>> = BTreeMap::new();
    let mut loads: Vec<&str> = Vec::new();
    for cell in &run.loads {
        rows.entry(key_of(&cell.record)).or_default().push(cell);
        if !loads.contains(&cell.record.load.as_str()) {
            loads.push(&cell.record.load);
        }
    }
    let merged: BTreeMap<Key, Merged<'_>> = (1..)
        .zip(rows)
        .map(|(number, (key, blocks))| {
            let blocks = Merged::of(blocks, seed, number);
            (key, blocks)
        })
        .collect();
    let floor_of = |key: &Key| {
        let (size, load, strategy, ..) = key;
        let floor = merged.get(&(*size, load.clone(), StrategyKind::Null, 0, None));
        floor.filter(|_| *strategy != StrategyKind::Null)
    };
    let mut figures: Vec<LoadFigures> = merged
        .iter()
        .map(|(key, own)| {
            let is_compared = is_compared(key, merged.keys());
            own.row(key, is_compared, floor_of(key))
        })
        .collect();
    let place = |load: &str| loads.iter().position(|&other| other == load);
    figures.sort_by_key(|row| (row.size, place(&row.load)));
    figures
}

/// Whether a row stands for its strategy in comparisons: every push strategy, and `central-batched` at
/// the middle of its asking intervals (the lower one of an even number).
fn is_compared<'a>(key: &Key, all: impl Iterator<Item = &'a Key>) -> bool {
    let (size, load, strategy, again, asks) = key;
    if *again != 0 || *strategy == StrategyKind::Null {
        return false;
    }
    if !strategy.has_centre() {
        return true;
    }
    let intervals: BTreeSet<Option<u64>> = all
        .filter(|other| (other.0, &other.1, other.2) == (*size, load, *strategy))
        .map(|other| other.4)
        .collect();
    let middle = intervals.iter().nth((intervals.len() - 1) / 2);
    *strategy == StrategyKind::CentralBatched && middle == Some(asks)
}

/// All blocks of one row.
struct Merged<'a> {
    blocks: Vec<&'a LoadCell>,
    seed: u64,
    /// Number of the row among those of the run, from 1.
    number: u32,
    /// CPU time an application of resampled blocks; empty where there are too few.
    costs: Vec<f64>,
}

impl<'a> Merged<'a> {
    fn of(mut blocks: Vec<&'a LoadCell>, seed: u64, number: u32) -> Self {
        blocks.sort_by_key(|block| block.record.cell.block);
        let mut merged = Self { blocks, seed, number, costs: Vec::new() };
        merged.costs = merged.ratios(|record| (record.fleet_cpu_ns, record.needed));
        merged
    }

    fn records(&self) -> impl Iterator<Item = &LoadRecord> {
        self.blocks.iter().map(|block| &block.record)
    }

    /// Whether its times are of a virtual clock.
    fn is_simulated(&self) -> bool {
        self.records().any(|record| record.simulated.is_some())
    }

    fn sum(&self, part: fn(&LoadRecord) -> u64) -> u64 {
        self.records().map(part).sum()
    }

    fn n(&self) -> u64 {
        self.blocks.len() as u64
    }

    /// Draws of blocks: the same for all rows of a size.
    fn block_stream(&self) -> Stream {
        Stream::new(self.seed, self.size(), Purpose::Bootstrap, FIRST_STREAM)
    }

    fn size(&self) -> u32 {
        self.blocks[0].record.cell.size
    }

    /// Ratios of sums over resampled blocks.
    fn ratios(&self, parts: impl Fn(&LoadRecord) -> (u64, u64)) -> Vec<f64> {
        let blocks: Vec<(u64, u64)> = self.records().map(parts).collect();
        ratio_resamples(&blocks, &mut self.block_stream())
    }

    fn saturated(&self) -> Option<Saturation> {
        let is_most = 2 * self.saturated_blocks() > self.blocks.len() as u64;
        self.records().find_map(|record| record.saturated).filter(|_| is_most)
    }

    fn saturated_blocks(&self) -> u64 {
        self.records().filter(|record| record.saturated.is_some()).count() as u64
    }

    /// Median of `stage` over all blocks, whether or not it may be shown.
    fn median(&self, stage: Stage) -> Option<u64> {
        let all = self.all(|block| match stage {
            Stage::Knowledge => block.knowledge.as_ref(),
            stage => block.stages.get(&stage),
        });
        all.filter(|all| !all.is_empty()).map(|all| all.value_at_quantile(0.5))
    }

    /// One quantity of all blocks together; `None` if no block has it, or a log was lost.
    fn all(
        &self,
        of: impl Fn(&'a LoadCell) -> Option<&'a Histogram<u64>>,
    ) -> Option<Histogram<u64>> {
        if self.blocks.iter().any(|block| block.knowledge.is_none()) {
            return None;
        }
        let parts: Vec<&Histogram<u64>> =
            self.blocks.iter().filter_map(|&block| of(block)).collect();
        (!parts.is_empty()).then(|| merged(parts))
    }

    fn row(&self, key: &Key, is_compared: bool, floor: Option<&Self>) -> LoadFigures {
        let (size, load, strategy, again, asks_every_ns) = key.clone();
        let late = self.median(Stage::Schedule).zip(self.median(Stage::Knowledge));
        let halves = self.records().filter_map(|record| record.second_half_ratio);
        let second_half_ratio = halves.max_by(f64::total_cmp);
        let disturbed = |record: &LoadRecord| {
            as_float(record.orchestrator_cpu_ns)
                > ORCHESTRATOR_CORE_SHARE_MAX * as_float(record.duration_ns)
        };
        let mut row = LoadFigures {
            size,
            load: load.clone(),
            strategy,
            again,
            is_simulated: self.is_simulated(),
            asks_every_ns,
            is_compared: is_compared && !self.is_simulated(),
            saturated: self.saturated(),
            saturated_blocks: self.saturated_blocks(),
            is_stationary: second_half_ratio.map(|ratio| ratio <= SECOND_HALF_RATIO_MAX),
            is_late: late.is_some_and(|(lateness, total)| 2 * lateness > total),
            is_disturbed: self.records().any(disturbed),
            figures: Figures::default(),
        };
        let mut add = Adding { load: &load, figures: &mut row.figures };
        self.add_times(&mut add);
        let ratio_label = "median time to knowledge of the second half over that of the first";
        add.figure("second-half-ratio", second_half_ratio, self.n(), "1", ratio_label);
        self.add_costs(floor, &mut add);
        self.add_counts(&mut add);
        self.add_recovery(&mut add);
        row
    }

    /// Quantiles of time to knowledge, of every stage, and of staleness.
    fn add_times(&self, add: &mut Adding<'_>) {
        let is_shown = self.saturated().is_none();
        let slices: Vec<&[Slice]> =
            self.blocks.iter().map(|block| block.slices.as_slice()).collect();
        if let Some(all) = self.all(|block| block.knowledge.as_ref()).filter(|all| !all.is_empty())
        {
            self.quantiles(add, ("knowledge", "ns", "time to knowledge"), &all, &slices, is_shown);
            let median = add.figures.get("knowledge-p50");
            let spread = median.and_then(|median| {
                let (value, low, high) = (median.value?, median.low?, median.high?);
                (value > 0.0).then(|| 50.0 * (high - low) / value)
            });
            let label = "half the width of the interval of the median, of the median";
            add.figure("knowledge-p50-spread", spread, all.len(), "%", label);
        }
        for stage in Stage::ALL {
            let Some(all) = self.all(|block| block.stages.get(&stage)) else { continue };
            let unit = if stage == Stage::RecordsPerSample { "record" } else { "ns" };
            let of_block = |block: &&LoadCell| block.stages.get(&stage).map(slice_of);
            let name = stage.name();
            self.of_blocks(add, (name, unit, name), &all, &of_block, is_shown);
        }
        if let Some(all) = self.all(|block| block.staleness.as_ref()) {
            let of_block = |block: &&LoadCell| block.staleness.as_ref().map(slice_of);
            let label = "age of what a stale read did not see";
            self.of_blocks(add, (STALENESS_TAG, "ns", label), &all, &of_block, true);
        }
    }

    /// Of a quantity that has no slices: each block is one.
    fn of_blocks(
        &self,
        add: &mut Adding<'_>,
        name: (&str, &'static str, &str),
        all: &Histogram<u64>,
        of_block: &dyn Fn(&&LoadCell) -> Option<Slice>,
        is_shown: bool,
    ) {
        let blocks: Vec<Vec<Slice>> =
            self.blocks.iter().map(|block| of_block(block).into_iter().collect()).collect();
        let slices: Vec<&[Slice]> = blocks.iter().map(Vec::as_slice).collect();
        self.quantiles(add, name, all, &slices, is_shown);
    }

    fn quantiles(
        &self,
        add: &mut Adding<'_>,
        (name, unit, label): (&str, &'static str, &str),
        all: &Histogram<u64>,
        slices: &[&[Slice]],
        is_shown: bool,
    ) {
        let number = FIRST_STREAM + self.number;
        let stream = Stream::new(self.seed, self.size(), Purpose::Bootstrap, number);
        let resamples = Resampler::new(slices)
            .filter(|_| is_shown)
            .map_or_else(Vec::new, |resampler| resampler.resamples(self.block_stream(), stream));
        for (place, quantile) in Quantile::ALL.into_iter().enumerate() {
            let value = quantile.of(all).filter(|_| is_shown).map(as_float);
            let metric = format!("{name}-{}", quantile.name);
            add.figure(&metric, value, all.len(), unit, &format!("{label}, {}", quantile.name));
            add.figures.within(&metric, interval(&resamples, place));
        }
        let max = (is_shown && !all.is_empty()).then(|| as_float(all.max()));
        add.figure(&format!("{name}-max"), max, all.len(), unit, &format!("{label}, largest"));
    }
}

/// The figures of one row, all under one load.
struct Adding<'a> {
    load: &'a str,
    figures: &'a mut Figures,
}

impl Adding<'_> {
    fn figure(
        &mut self,
        metric: &str,
        value: Option<f64>,
        n: u64,
        unit: &'static str,
        label: &str,
    ) {
        self.figures.under(self.load, metric, value, n, unit, label);
    }
}

/// All events of `histogram` as one slice.
fn slice_of(histogram: &Histogram<u64>) -> Slice {
    let steps = histogram.iter_recorded();
    steps.map(|step| (step.value_iterated_to(), step.count_at_value())).collect()
}

#[cfg(test)]
mod tests;
