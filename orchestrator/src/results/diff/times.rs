//! Times and costs of two runs, paired by block.

use super::Common;
use crate::results::inference::{Comparison, Pairing, Verdict, compare, hodges_lehmann};
use crate::results::read::RunData;
use crate::results::record::Label;
use crate::results::statistics::{Quantile, as_float};
use serde::Serialize;
use shared_types::rng::{Purpose, Stream};
use shared_types::wire::{Stage, StrategyKind};
use std::collections::BTreeMap;

/// Streams of these comparisons are numbered from here, apart from those of other figures.
const FIRST_STREAM: u32 = 5000;

/// A time or cost of the second run over that of the first.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TimeDifference {
    /// Crafts, a centre not counted.
    pub size: u32,
    /// How changes were replicated.
    pub strategy: StrategyKind,
    /// Name of the load, `lockstep` for turns.
    pub load: String,
    /// How often clients of the centre asked, ns.
    pub asks_every_ns: Option<u64>,
    /// What was measured.
    pub metric: &'static str,
    /// Whether both sides were divided by `null` of their own host first.
    pub is_relative: bool,
    /// What the blocks say.
    #[serde(flatten)]
    pub comparison: Comparison,
    /// Whether it is worse beyond doubt.
    pub is_regression: bool,
}

/// What is measured of a block: size, load, asking interval, metric.
type What = (u32, String, Option<u64>, &'static str);

/// By what, then label, then block.
type Values = BTreeMap<What, BTreeMap<Label, BTreeMap<u32, f64>>>;

/// Comparisons that are corrected for each other.
#[derive(Default)]
struct Family {
    names: Vec<(What, StrategyKind)>,
    pairings: Vec<Pairing>,
}

/// Every time that both runs have; between two hosts only what has a floor on its own host.
pub(super) fn differences(
    before: &RunData,
    after: &RunData,
    common: &Common,
) -> Vec<TimeDifference> {
    let is_relative = !common.hosts.is_empty();
    let (then, now) = (values(before), values(after));
    // What is measured alike is one family of comparisons.
    let mut families: BTreeMap<&'static str, Family> = BTreeMap::new();
    let mut number = FIRST_STREAM;
    let seed = before.provenance.as_ref().map_or(0, |provenance| provenance.seed);
    for (what, before) in &then {
        let Some(after) = now.get(what) else { continue };
        let floor = floor(before, after);
        for (label, values_before) in before.iter().filter(|(label, _)| label.again == 0) {
            let Some(values_after) = after.get(label) else { continue };
            let (then, now) = if is_relative {
                let is_floor = label.strategy == StrategyKind::Null;
                let null = Label::first(StrategyKind::Null);
                let (Some(then), Some(now)) = (before.get(&null), after.get(&null)) else {
                    continue;
                };
                if is_floor {
                    continue;
                }
                (over(values_before, then), over(values_after, now))
            } else {
                (values_before.clone(), values_after.clone())
            };
            number += 1;
            let stream = Stream::new(seed, what.0, Purpose::Bootstrap, number);
            let log_ratios = over(&now, &then).into_values().map(f64::ln).collect();
            let family = families.entry(what.3).or_default();
            family.names.push((what.clone(), label.strategy));
            family.pairings.push(Pairing { log_ratios, floor: floor.clone(), stream });
        }
    }
    let compared = families.into_values().flat_map(|Family { names, pairings }| {
        names.into_iter().zip(compare(pairings, common.is_clean))
    });
    compared
        .filter_map(|(((size, load, asks_every_ns, metric), strategy), comparison)| {
            let comparison = comparison?;
            let is_regression = comparison.verdict == Verdict::Winner && comparison.ratio > 1.0;
            Some(TimeDifference {
                size,
                strategy,
                load,
                asks_every_ns,
                metric,
                is_relative,
                comparison,
                is_regression,
            })
        })
        .collect()
}

/// The distance of one strategy from itself in the run in which it is larger, block by block.
fn floor(
    before: &BTreeMap<Label, BTreeMap<u32, f64>>,
    after: &BTreeMap<Label, BTreeMap<u32, f64>>,
) -> Vec<f64> {
    let floors = [before, after].map(|run| {
        let again = run.iter().find(|(label, _)| label.again == 1);
        again.map_or_else(Vec::new, |(label, again)| {
            let first = run.get(&Label::first(label.strategy)).cloned().unwrap_or_default();
            over(again, &first).into_values().map(f64::ln).collect()
        })
    });
    let distance = |floor: &Vec<f64>| hodges_lehmann(floor).map_or(0.0, f64::abs);
    let [before, after] = floors;
    if distance(&after) > distance(&before) { after } else { before }
}

/// Of the blocks that both have.
fn over(above: &BTreeMap<u32, f64>, below: &BTreeMap<u32, f64>) -> BTreeMap<u32, f64> {
    let both = above.iter().filter_map(|(block, above)| Some((*block, above / below.get(block)?)));
    both.filter(|(_, ratio)| ratio.is_finite() && *ratio > 0.0).collect()
}

/// Everything that a run measured with a clock.
fn values(run: &RunData) -> Values {
    let mut values = Values::new();
    let mut add = |what: What, label: Label, block: u32, value: Option<f64>| {
        let blocks = values.entry(what).or_default().entry(label).or_default();
        blocks.extend(value.map(|value| (block, value)));
    };
    for record in run.timings.iter().map(|timed| &timed.record) {
        let what = |metric| (record.cell.size, "lockstep".to_owned(), None, metric);
        let (label, block) = (record.label(), record.cell.block);
        for (metric, quantile) in
            [("turn time p50", Quantile::P50), ("turn time p99", Quantile::P99)]
        {
            let time = record.turn_time.quantile_ns(quantile).map(as_float);
            add(what(metric), label, block, time);
        }
        let cpu =
            (record.turns > 0).then(|| as_float(record.fleet_cpu_ns) / as_float(record.turns));
        add(what("CPU a turn"), label, block, cpu);
    }
    for record in run.loads.iter().map(|loaded| &loaded.record) {
        let what = |metric| (record.cell.size, record.load.clone(), record.asks_every_ns, metric);
        let (label, block) = (record.label(), record.cell.block);
        let knowledge = record.stages.get(&Stage::Knowledge).filter(|_| record.saturated.is_none());
        for (metric, quantile) in
            [("knowledge p50", Quantile::P50), ("knowledge p99", Quantile::P99)]
        {
            let time = knowledge.and_then(|knowledge| knowledge.quantile_ns(quantile));
            add(what(metric), label, block, time.map(as_float));
        }
        let needed = as_float(record.needed);
        let cpu = (record.needed > 0).then(|| as_float(record.fleet_cpu_ns) / needed);
        add(what("CPU an application"), label, block, cpu);
    }
    for record in &run.capacities {
        let load = format!("capacity, burst {}", record.burst);
        let what = (record.cell.size, load, record.asks_every_ns, "time a write at capacity");
        let rate = record.capacity().map(|probe| probe.offered_per_s);
        let time = rate.filter(|&rate| rate > 0.0).map(|rate| 1e9 / rate);
        add(what, Label::first(record.cell.strategy), record.cell.block, time);
    }
    values
}
