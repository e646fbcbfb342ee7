//! The map: which strategy costs least, over fleet size and copies of a boundary change per firing.
//!
//! The second axis is k beta: sharers k of a boundary fact times the share beta of the writes that are
//! of boundary facts. A strategy that is chosen must stand as any winner does (see
//! [`super::inference`]): the panel of CPU and the panel of time to knowledge are a family of
//! comparisons each, and what does not stand is a tie. What the transmission count names is exact. Not
//! here: where the records come from (a sweep), and how the map is drawn.

use super::host::HostReport;
use super::inference::{Comparison, Pairing, Verdict, compare, hodges_lehmann};
use super::load::LoadRecord;
use super::read::RunData;
use super::record::Label;
use super::statistics::{Quantile, as_float};
use serde::Serialize;
use shared_types::rng::{Purpose, Stream};
use shared_types::wire::{Stage, StrategyKind};
use std::collections::{BTreeMap, BTreeSet};

/// Streams of the map's comparisons are numbered from here, apart from those of other figures.
const FIRST_STREAM: u32 = 3000;

/// What one strategy cost in one block of a cell.
#[derive(Clone, Debug, PartialEq)]
pub struct Observation {
    /// Crafts, a centre not counted.
    pub size: u32,
    /// Copies of a boundary change per firing: sharers times boundary fraction.
    pub k_beta: f64,
    /// Which launch of the cell's fleet.
    pub block: u32,
    /// What was measured.
    pub label: Label,
    /// CPU time of the fleet in the interval, ns.
    pub cpu_ns: u64,
    /// Applications that the trace needs.
    pub needed: u64,
    /// 99th percentile of time to knowledge, ns; absent where too few events carry it, or above
    /// capacity.
    pub p99_ns: Option<u64>,
    /// Samples published, replies included.
    pub transmissions: u64,
    /// Samples received by another craft, replies included.
    pub deliveries: u64,
    /// Whether its run had the host for itself.
    pub is_clean: bool,
}

impl Observation {
    /// What `record`, of a fleet with `k_beta`, says; of a run that was `is_clean` or not.
    #[must_use]
    pub fn of(k_beta: f64, record: &LoadRecord, is_clean: bool) -> Self {
        let knowledge = record.stages.get(&Stage::Knowledge);
        let p99_ns = knowledge.and_then(|knowledge| knowledge.quantile_ns(Quantile::P99));
        let total = record.counts.total();
        Self {
            size: record.cell.size,
            k_beta,
            block: record.cell.block,
            label: record.label(),
            cpu_ns: record.fleet_cpu_ns,
            needed: record.needed,
            p99_ns: p99_ns.filter(|_| record.saturated.is_none()),
            transmissions: total.transmissions,
            deliveries: total.deliveries,
            is_clean,
        }
    }
}

impl Observation {
    /// What `run`, of a fleet with `k_beta`, says at `load`. A central strategy that was measured at
    /// several asking intervals stands with the middle one, as everywhere beside others.
    #[must_use]
    pub fn of_run(k_beta: f64, run: &RunData, load: &str) -> Vec<Self> {
        let is_clean = HostReport::of(&run.events).is_clean();
        let records = || run.loads.iter().map(|cell| &cell.record).filter(|one| one.load == load);
        let mut intervals: BTreeMap<(u32, StrategyKind), BTreeSet<Option<u64>>> = BTreeMap::new();
        for one in records() {
            let key = (one.cell.size, one.cell.strategy);
            intervals.entry(key).or_default().insert(one.asks_every_ns);
        }
        let is_middle = |one: &&LoadRecord| {
            let asked = &intervals[&(one.cell.size, one.cell.strategy)];
            asked.iter().nth((asked.len() - 1) / 2) == Some(&one.asks_every_ns)
        };
        records().filter(is_middle).map(|one| Self::of(k_beta, one, is_clean)).collect()
    }
}

/// The strategy that a cell chooses by one measure.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Choice {
    /// The best, `None` where none stands out.
    pub strategy: Option<StrategyKind>,
    /// The best by value alone, whether or not it stands.
    pub best: StrategyKind,
    /// The one after it.
    pub runner_up: StrategyKind,
    /// Value of the runner-up over that of the best, paired by block.
    pub margin: f64,
    /// Lower end of the margin's 95 % interval; the margin itself below three blocks.
    pub low: f64,
    /// Upper end of it.
    pub high: f64,
    /// Why a strategy is named, or none is.
    pub verdict: Verdict,
}

/// One cell of the map.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MapCell {
    /// Crafts, a centre not counted.
    pub size: u32,
    /// Copies of a boundary change per firing.
    pub k_beta: f64,
    /// Blocks measured.
    pub n: u64,
    /// The least CPU time per needed application; absent where nothing can be compared.
    pub by_cpu: Option<Choice>,
    /// The least 99th percentile of time to knowledge at equal load.
    pub by_p99: Option<Choice>,
    /// The fewest samples published.
    pub by_count: StrategyKind,
}

/// The map of a sweep.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Map {
    /// The load that it is of.
    pub load: String,
    /// Other loads that the sweep measured: costs at another load are another map.
    pub other_loads: Vec<String>,
    /// Ordered by size, then by copies.
    pub cells: Vec<MapCell>,
    /// Fleet sizes, ascending.
    pub sizes: Vec<u32>,
    /// Copies of a boundary change per firing, ascending.
    pub k_betas: Vec<f64>,
    /// CPU time of sending one sample and of receiving one, ns, from all fleets together; absent where
    /// they do not follow.
    pub sample_costs: Option<SampleCosts>,
    /// Where the cost of samples alone would have strategies change places: (size, k beta), one a size
    /// whose costs follow from the fleets of the other sizes.
    pub predicted_cpu: Vec<(u32, f64)>,
}

/// What one sample costs, as a line fits it: excess CPU a sample published, over receivers a sample.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SampleCosts {
    /// Publishing it once, ns.
    pub send_ns: f64,
    /// Receiving it at one craft, ns.
    pub receive_ns: f64,
}

impl SampleCosts {
    /// The k beta at which a multicast to `size` - 1 crafts costs as much as the unicasts to sharers.
    #[must_use]
    pub fn crossing(self, size: u32) -> f64 {
        let receivers = f64::from(size.saturating_sub(1));
        (self.send_ns + receivers * self.receive_ns) / (self.send_ns + self.receive_ns)
    }
}

/// A value by block.
type ByBlock = BTreeMap<u32, f64>;

/// Observations of one cell of the map.
type OfCell<'a> = Vec<&'a Observation>;

/// A measure of an observation, the less the better.
type Measure = fn(&Observation) -> Option<f64>;

impl Map {
    /// The map of `observations`. Draws come from `seed`; in a cell whose run was not clean no strategy
    /// is named by a clock.
    #[must_use]
    pub fn of(observations: &[Observation], seed: u64) -> Self {
        let mut cells: BTreeMap<(u32, Place), OfCell<'_>> = BTreeMap::new();
        for one in observations.iter().filter(|one| one.k_beta.is_finite()) {
            cells.entry((one.size, Place(one.k_beta))).or_default().push(one);
        }
        // Without a strategy that sends there is nothing to choose.
        cells.retain(|_, cell| cell.iter().any(|one| sends(one)));
        let by_cpu = choices(&cells, cpu_per_needed, seed, 0);
        let by_p99 = choices(&cells, |one| one.p99_ns.map(as_float), seed, 1);
        let sizes: BTreeSet<u32> = cells.keys().map(|&(size, _)| size).collect();
        let k_betas: BTreeSet<Place> = cells.keys().map(|&(_, place)| place).collect();
        let predicted = |&size: &u32| {
            let others = |one: &&Observation| one.size != size;
            let costs = sample_costs(observations.iter().filter(others))?;
            Some((size, costs.crossing(size)))
        };
        Self {
            load: String::new(),
            other_loads: Vec::new(),
            predicted_cpu: sizes.iter().filter_map(predicted).collect(),
            sample_costs: sample_costs(observations.iter()),
            sizes: sizes.into_iter().collect(),
            k_betas: k_betas.into_iter().map(|place| place.0).collect(),
            cells: cells
                .iter()
                .zip(by_cpu.into_iter().zip(by_p99))
                .map(|((&(size, place), cell), (by_cpu, by_p99))| MapCell {
                    size,
                    k_beta: place.0,
                    n: cell.iter().map(|one| one.block).collect::<BTreeSet<u32>>().len() as u64,
                    by_cpu,
                    by_p99,
                    by_count: fewest_samples(cell),
                })
                .collect(),
        }
    }
}

/// A k beta as a place on its axis.
#[derive(Clone, Copy, Debug)]
struct Place(f64);

impl PartialEq for Place {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Place {}

impl PartialOrd for Place {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Place {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

fn sends(one: &Observation) -> bool {
    one.label.again == 0 && one.label.strategy != StrategyKind::Null
}

/// CPU time of the whole fleet, floor included: the floor is the same for all, so that it moves no
/// border and only brings margins nearer to 1, and no difference of noise is ever divided by.
fn cpu_per_needed(one: &Observation) -> Option<f64> {
    (one.needed > 0).then(|| as_float(one.cpu_ns) / as_float(one.needed))
}

/// The strategy with the fewest samples over the blocks that all have; the first of equals.
fn fewest_samples(cell: &OfCell<'_>) -> StrategyKind {
    let mut sums: BTreeMap<StrategyKind, (u64, u64)> = BTreeMap::new();
    for one in cell.iter().filter(|one| sends(one)) {
        let (samples, needed) = sums.entry(one.label.strategy).or_default();
        *samples += one.transmissions;
        *needed += one.needed;
    }
    let per_needed = |&(samples, needed): &(u64, u64)| as_float(samples) / as_float(needed.max(1));
    let best =
        sums.iter().min_by(|(_, one), (_, other)| per_needed(one).total_cmp(&per_needed(other)));
    best.map_or(StrategyKind::Null, |(&strategy, _)| strategy)
}

/// What every cell chooses by `measure`, all cells one family of comparisons.
fn choices(
    cells: &BTreeMap<(u32, Place), OfCell<'_>>,
    measure: Measure,
    seed: u64,
    panel: u32,
) -> Vec<Option<Choice>> {
    let (mut names, mut pairings) = (Vec::new(), Vec::new());
    for (number, cell) in (0..).zip(cells.values()) {
        let stream = Stream::new(seed, FIRST_STREAM + panel, Purpose::Bootstrap, number);
        let pair = pair_of(cell, measure, stream);
        names.push(pair.as_ref().map(|(best, runner_up, _)| (*best, *runner_up)));
        pairings.extend(pair.map(|(_, _, pairing)| pairing));
    }
    let mut compared = compare(pairings, true).into_iter();
    let choice = |(cell, names): (&OfCell<'_>, Option<(StrategyKind, StrategyKind)>)| {
        let (best, runner_up) = names?;
        let mut comparison = compared.next().flatten()?;
        if cell.iter().any(|one| !one.is_clean) {
            comparison.verdict = Verdict::Noisy;
        }
        Some(choice_of(best, runner_up, &comparison))
    };
    cells.values().zip(names).map(choice).collect()
}

fn choice_of(best: StrategyKind, runner_up: StrategyKind, comparison: &Comparison) -> Choice {
    let (low, high) = comparison.interval.unwrap_or((comparison.ratio, comparison.ratio));
    let strategy = (comparison.verdict == Verdict::Winner).then_some(best);
    let verdict = comparison.verdict;
    Choice { strategy, best, runner_up, margin: comparison.ratio, low, high, verdict }
}

/// The best two strategies of a cell, and their values side by side.
fn pair_of(
    cell: &OfCell<'_>,
    measure: Measure,
    stream: Stream,
) -> Option<(StrategyKind, StrategyKind, Pairing)> {
    let mut values: BTreeMap<Label, ByBlock> = BTreeMap::new();
    for one in cell {
        let value = measure(one).filter(|&value| value > 0.0);
        let of_label = values.entry(one.label).or_default();
        of_label.extend(value.map(|value| (one.block, value)));
    }
    let base = values.keys().find(|label| label.again > 0).map(|label| label.strategy);
    let floor = base.map_or_else(Vec::new, |strategy| {
        log_ratios(values.get(&Label { strategy, again: 1 }), values.get(&Label::first(strategy)))
    });
    let strategies = || values.keys().filter(|l| l.again == 0 && l.strategy != StrategyKind::Null);
    let any = values.get(strategies().next()?);
    let mut ranked: Vec<(f64, Label)> = strategies()
        .filter_map(|&label| Some((hodges_lehmann(&log_ratios(values.get(&label), any))?, label)))
        .collect();
    ranked.sort_by(|(one, _), (other, _)| one.total_cmp(other));
    let [(_, best), (_, runner_up), ..] = ranked[..] else { return None };
    let log_ratios = log_ratios(values.get(&runner_up), values.get(&best));
    Some((best.strategy, runner_up.strategy, Pairing { log_ratios, floor, stream }))
}

/// Of the blocks that both have.
fn log_ratios(above: Option<&ByBlock>, below: Option<&ByBlock>) -> Vec<f64> {
    let (Some(above), Some(below)) = (above, below) else { return Vec::new() };
    let both = above.iter().filter_map(|(block, value)| Some((value, below.get(block)?)));
    both.map(|(above, below)| (above / below).ln()).collect()
}

/// Fits the CPU time a sample, beyond that of a fleet that sends nothing in the same block, over the
/// number of its receivers: what is left without receivers is the sending. `None` without a floor,
/// with a single number of receivers, or where a cost comes out below zero.
fn sample_costs<'a>(observations: impl Iterator<Item = &'a Observation>) -> Option<SampleCosts> {
    let mut floors: BTreeMap<(u32, Place, u32), u64> = BTreeMap::new();
    let mut senders = Vec::new();
    for one in observations.filter(|one| one.label.again == 0) {
        if one.label.strategy == StrategyKind::Null {
            floors.insert((one.size, Place(one.k_beta), one.block), one.cpu_ns);
        } else if one.transmissions > 0 && !one.label.strategy.has_centre() {
            senders.push(one);
        }
    }
    let points: Vec<(f64, f64)> = senders
        .into_iter()
        .filter_map(|one| {
            let floor = *floors.get(&(one.size, Place(one.k_beta), one.block))?;
            let samples = as_float(one.transmissions);
            let excess = as_float(one.cpu_ns) - as_float(floor);
            Some((as_float(one.deliveries) / samples, excess / samples))
        })
        .collect();
    let (send_ns, receive_ns) = line_through(&points)?;
    (send_ns > 0.0 && receive_ns > 0.0).then_some(SampleCosts { send_ns, receive_ns })
}

/// Height at 0 and slope of the line with the least squares; `None` if the points are all above each
/// other.
fn line_through(points: &[(f64, f64)]) -> Option<(f64, f64)> {
    let n = as_float(points.len() as u64);
    let mean = |part: fn(&(f64, f64)) -> f64| points.iter().map(part).sum::<f64>() / n;
    let (x, y) = (mean(|point| point.0), mean(|point| point.1));
    let spread: f64 = points.iter().map(|point| (point.0 - x).powi(2)).sum();
    let together: f64 = points.iter().map(|point| (point.0 - x) * (point.1 - y)).sum();
    if spread.is_nan() || spread <= 1e-9 {
        return None;
    }
    let slope = together / spread;
    Some((y - slope * x, slope))
}

#[cfg(test)]
mod tests;
