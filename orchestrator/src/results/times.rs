//! Figures of times and costs, and their excess over the floor that strategy `null` sets.
//!
//! Blocks of one cell are merged: histograms are added up, costs summed and divided by all turns.
//! Intervals come from resampling blocks, of all strategies of a size the same ones.
//! The excess of a quantile is the difference of two quantiles of separate epochs; it may be
//! negative where a strategy costs less than the noise.

use super::figure::Figures;
use super::inference::quantiles::{self, Resample, Resampler, Slice};
use super::inference::{middle_of, ratio_resamples};
use super::pairs::Compared;
use super::read::{RunData, TimedCell};
use super::record::TimingRecord;
use super::statistics::{Distribution, Quantile, as_float, time_histogram};
use super::summary::TimedFigures;
use hdrhistogram::Histogram;
use shared_types::rng::{Purpose, Stream};
use shared_types::wire::StrategyKind;
use std::collections::BTreeMap;

/// Above this ratio of second half to first half a cell is not stationary.
pub const SECOND_HALF_RATIO_MAX: f64 = 1.1;

/// One row of figures per (size, strategy) that was timed or tried.
#[must_use]
pub fn timed_figures(run: &RunData, compared: &[Compared]) -> Vec<TimedFigures> {
    let mut rows: BTreeMap<Key, TimedFigures> = BTreeMap::new();
    let seed = run.provenance.as_ref().map_or(0, |provenance| provenance.seed);
    let merged = merged_cells(&run.timings, seed);
    let cores = run.provenance.as_ref().map(|provenance| provenance.cores_used);
    for (&(size, strategy), own) in &merged {
        let floor = merged.get(&(size, StrategyKind::Null));
        let row = row_of(&mut rows, (size, strategy));
        row.is_stationary = own.second_half_ratio.map(|ratio| ratio <= SECOND_HALF_RATIO_MAX);
        own.add_figures(floor.filter(|_| strategy != StrategyKind::Null), cores, &mut row.figures);
    }
    for (key, (times, cpu_ns)) in trial_times(run) {
        add_trial_figures(&times, cpu_ns, &mut row_of(&mut rows, key).figures);
    }
    for pair in compared {
        let row = row_of(&mut rows, (pair.size, pair.strategy));
        add_comparison(pair, &mut row.figures);
    }
    rows.into_values().collect()
}

type Key = (u32, StrategyKind);

fn row_of(rows: &mut BTreeMap<Key, TimedFigures>, key: Key) -> &mut TimedFigures {
    let (size, strategy) = key;
    let empty =
        || TimedFigures { size, strategy, is_stationary: None, figures: Figures::default() };
    rows.entry(key).or_insert_with(empty)
}

/// The ratio to the strategy that others are compared with, and what it is worth.
fn add_comparison(pair: &Compared, figures: &mut Figures) {
    let (base, comparison) = (pair.base, &pair.comparison);
    let n = comparison.blocks;
    let metric = format!("turn-time-p50-to-{base}");
    let label = format!("median turn time over that of {base}, by block");
    figures.lockstep(&metric, Some(comparison.ratio), n, "1", &label);
    figures.within(&metric, comparison.interval);
    let label = format!("chance of such a distance from {base}, corrected");
    figures.lockstep(&format!("{metric}-p"), Some(comparison.p_value), n, "1", &label);
    let label = format!("distance of {base} from itself, the A-A floor");
    figures.lockstep(&format!("{metric}-floor"), comparison.floor, n, "1", &label);
}

fn merged_cells(cells: &[TimedCell], seed: u64) -> BTreeMap<Key, Merged> {
    let mut blocks: BTreeMap<Key, Vec<&TimedCell>> = BTreeMap::new();
    // Further labels of a strategy are there to be compared with it, not to add to it.
    for timed in cells.iter().filter(|timed| timed.record.again == 0) {
        let cell = timed.record.cell;
        blocks.entry((cell.size, cell.strategy)).or_default().push(timed);
    }
    blocks.into_iter().map(|(key, blocks)| (key, Merged::of(&blocks, seed))).collect()
}

/// Turn times and CPU time of the trials themselves, where they have a clock. They are short and cold:
/// shown for a mission that was run once, never compared between strategies.
fn trial_times(run: &RunData) -> BTreeMap<Key, (Histogram<u64>, u64)> {
    let mut times: BTreeMap<Key, (Histogram<u64>, u64)> = BTreeMap::new();
    for record in run.trials.iter().filter(|record| record.deterministic.end.is_in_means()) {
        if record.timing.turn_times_ns.is_empty() {
            continue;
        }
        let cell = record.deterministic.cell;
        let (histogram, cpu_ns) =
            times.entry((cell.size, cell.strategy)).or_insert_with(|| (time_histogram(), 0));
        record.timing.turn_times_ns.iter().for_each(|&time| histogram.saturating_record(time));
        *cpu_ns += record.timing.processes.iter().map(|process| process.cpu_ns).sum::<u64>();
    }
    times
}

fn add_trial_figures(times: &Histogram<u64>, cpu_ns: u64, figures: &mut Figures) {
    let n = times.len();
    for quantile in [Quantile::P50, Quantile::P99] {
        let (metric, value) =
            (format!("trial-turn-time-{}", quantile.name), quantile.of(times).map(as_float));
        let label = format!("turn time in the trials, {}", quantile.name);
        figures.lockstep(&metric, value, n, "ns", &label);
    }
    let max = Some(as_float(times.max()));
    figures.lockstep("trial-turn-time-max", max, n, "ns", "turn time in the trials, largest");
    let cpu = Some(as_float(cpu_ns) / as_float(n));
    let label = "CPU time of the fleet a turn in the trials";
    figures.lockstep("trial-cpu-per-turn", cpu, n, "ns", label);
}

/// All blocks of one cell.
struct Merged {
    /// `None` if several blocks cannot be merged because a histogram is lost.
    turn_time: Option<Distribution>,
    turns: u64,
    epochs: u64,
    blocks: u64,
    warm_up_turns: u64,
    second_half_ratio: Option<f64>,
    fleet_cpu_ns: u64,
    orchestrator_cpu_ns: u64,
    processes: u32,
    resident_bytes: u64,
    resident_bytes_max: u64,
    ready_ns: u64,
    control_samples: u64,
    control_bytes: u64,
    /// Which blocks these are: resamples of two cells are pairs only if both have the same.
    block_numbers: Vec<u32>,
    /// Quantiles of resampled blocks; empty where there are too few.
    quantiles: Vec<Resample>,
    /// CPU time a turn of resampled blocks.
    costs: Vec<f64>,
}

impl Merged {
    fn of(blocks: &[&TimedCell], seed: u64) -> Self {
        let cell = blocks[0].record.cell;
        // Blocks are drawn alike for all strategies of a size, epochs for each its own.
        let stream = |number| Stream::new(seed, cell.size, Purpose::Bootstrap, number);
        let slices: Vec<&[Slice]> = blocks.iter().map(|block| block.slices.as_slice()).collect();
        let quantiles = Resampler::new(&slices).map_or_else(Vec::new, |resampler| {
            resampler.resamples(stream(0), stream(1 + cell.strategy as u32))
        });
        let costs: Vec<(u64, u64)> =
            blocks.iter().map(|block| (block.record.fleet_cpu_ns, block.record.turns)).collect();
        let records = || blocks.iter().map(|block| &block.record);
        let sum = |part: fn(&TimingRecord) -> u64| records().map(part).sum::<u64>();
        let largest = |part: fn(&TimingRecord) -> u64| records().map(part).max().unwrap_or(0);
        Self {
            turn_time: turn_time(blocks),
            turns: sum(|record| record.turns),
            epochs: sum(|record| u64::from(record.epochs)),
            blocks: blocks.len() as u64,
            warm_up_turns: sum(|record| record.warm_up_turns),
            second_half_ratio: records()
                .filter_map(|record| record.second_half_ratio)
                .max_by(f64::total_cmp),
            fleet_cpu_ns: sum(|record| record.fleet_cpu_ns),
            orchestrator_cpu_ns: sum(|record| record.orchestrator_cpu_ns),
            processes: records().map(|record| record.processes).max().unwrap_or(0),
            resident_bytes: largest(|record| record.resident_bytes),
            resident_bytes_max: largest(|record| record.resident_bytes_max),
            ready_ns: largest(|record| record.ready_ns),
            control_samples: sum(|record| record.overhead.control.transmissions),
            control_bytes: sum(|record| record.overhead.control.bytes_sent),
            block_numbers: records().map(|record| record.cell.block).collect(),
            quantiles,
            costs: ratio_resamples(&costs, &mut stream(0)),
        }
    }

    fn per_turn(&self, total: u64) -> Option<f64> {
        (self.turns > 0).then(|| as_float(total) / as_float(self.turns))
    }

    fn cpu_per_turn(&self) -> Option<f64> {
        self.per_turn(self.fleet_cpu_ns)
    }

    fn quantile(&self, quantile: Quantile) -> Option<f64> {
        self.turn_time.as_ref()?.quantile_ns(quantile).map(as_float)
    }

    fn add_figures(&self, floor: Option<&Self>, cores: Option<u32>, figures: &mut Figures) {
        self.turn_time_figures(floor, figures);
        self.cost_figures(floor, figures);
        let per_core = cores
            .filter(|&cores| cores > 0)
            .map(|cores| f64::from(self.processes) / f64::from(cores));
        let label = "processes of the fleet per core that it may use";
        figures.lockstep("processes-per-core", per_core, self.blocks, "1", label);
    }

    fn turn_time_figures(&self, floor: Option<&Self>, figures: &mut Figures) {
        let time = self.turn_time.as_ref();
        let n = time.map_or(0, |time| time.n);
        for (place, quantile) in Quantile::ALL.into_iter().enumerate() {
            let (name, own) = (quantile.name, self.quantile(quantile));
            let metric = format!("turn-time-{name}");
            figures.lockstep(&metric, own, n, "ns", &format!("turn time, {name}"));
            let within = quantiles::interval(&self.quantiles, place);
            figures.within(&metric, within);
            let excess = floor.and_then(|floor| Some(own? - floor.quantile(quantile)?));
            let metric = format!("turn-time-{name}-over-null");
            figures.lockstep(
                &metric,
                excess,
                n,
                "ns",
                &format!("turn time, {name}, excess over null"),
            );
            let within = self.paired(floor).and_then(|floor| {
                quantiles::excess_interval(&self.quantiles, &floor.quantiles, place)
            });
            figures.within(&metric, within);
        }
        let any = time.filter(|time| time.n > 0);
        self.spread_figure(figures, n);
        let min = any.map(|time| as_float(time.min_ns));
        figures.lockstep("turn-time-min", min, n, "ns", "turn time, smallest");
        let mean = any.map(|time| time.mean_ns);
        figures.lockstep("turn-time-mean", mean, n, "ns", "turn time, mean");
        let max = any.map(|time| as_float(time.max_ns));
        figures.lockstep("turn-time-max", max, n, "ns", "turn time, largest");
        figures.lockstep(
            "second-half-ratio",
            self.second_half_ratio,
            n,
            "1",
            "median turn time of the second half over that of the first",
        );
    }

    /// How wide the interval of the median is, for tables that are short of columns.
    fn spread_figure(&self, figures: &mut Figures, n: u64) {
        let median = figures.get("turn-time-p50");
        let spread = median.and_then(|median| {
            let (value, low, high) = (median.value?, median.low?, median.high?);
            (value > 0.0).then(|| 50.0 * (high - low) / value)
        });
        let label = "half the width of the interval of the median turn time, of the median";
        figures.lockstep("turn-time-p50-spread", spread, n, "%", label);
    }

    /// `floor`, if its resamples are of the same blocks as these.
    fn paired<'a>(&self, floor: Option<&'a Self>) -> Option<&'a Self> {
        floor.filter(|floor| floor.block_numbers == self.block_numbers)
    }

    fn cost_figures(&self, floor: Option<&Self>, figures: &mut Figures) {
        let (n, blocks) = (self.turns, self.blocks);
        let cpu = self.cpu_per_turn();
        figures.lockstep("cpu-per-turn", cpu, n, "ns", "CPU time of the fleet a turn");
        figures.within("cpu-per-turn", middle_of(self.costs.clone()));
        let excess = floor.and_then(|floor| Some(cpu? - floor.cpu_per_turn()?));
        let label = "CPU time of the fleet a turn, excess over null";
        figures.lockstep("cpu-per-turn-over-null", excess, n, "ns", label);
        let differences = self.paired(floor).map_or_else(Vec::new, |floor| {
            self.costs.iter().zip(&floor.costs).map(|(own, floor)| own - floor).collect()
        });
        figures.within("cpu-per-turn-over-null", middle_of(differences));
        let orchestrator = self.per_turn(self.orchestrator_cpu_ns);
        let label = "CPU time of the orchestrator a turn";
        figures.lockstep("orchestrator-cpu-per-turn", orchestrator, n, "ns", label);
        let samples = self.per_turn(self.control_samples);
        figures.lockstep("control-per-turn", samples, n, "sample", "ledger samples a turn");
        let bytes = self.per_turn(self.control_bytes);
        figures.lockstep("control-bytes-per-turn", bytes, n, "byte", "ledger bytes a turn");
        let mut whole = |metric: &str, value: u64, n: u64, unit: &'static str, label: &str| {
            figures.lockstep(metric, Some(as_float(value)), n, unit, label);
        };
        whole("turns", n, n, "turn", "turns measured");
        whole("epochs", self.epochs, self.epochs, "epoch", "fresh epochs measured");
        whole("warm-up-turns", self.warm_up_turns, blocks, "turn", "turns run before measuring");
        whole("processes", u64::from(self.processes), blocks, "process", "processes of the fleet");
        whole("resident", self.resident_bytes, blocks, "byte", "resident memory of the fleet");
        let label = "resident memory of the largest process of the fleet";
        whole("resident-max", self.resident_bytes_max, blocks, "byte", label);
        whole("ready", self.ready_ns, blocks, "ns", "from the first spawn to GO");
    }
}

/// The turn times of all blocks together, from the histograms; a single block whose histogram is
/// lost still has what its record says.
fn turn_time(blocks: &[&TimedCell]) -> Option<Distribution> {
    let mut all: Option<Histogram<u64>> = None;
    for block in blocks {
        match (&block.turn_times, &mut all) {
            (None, _) if blocks.len() == 1 => return Some(block.record.turn_time.clone()),
            (None, _) => return None,
            (Some(times), None) => all = Some(times.clone()),
            (Some(times), Some(all)) => all.add(times).ok()?,
        }
    }
    all.map(|all| Distribution::of(&all))
}
