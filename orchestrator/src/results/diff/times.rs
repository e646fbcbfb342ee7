//! Times and costs of two runs, paired by block.
//!
//! Between two hosts each is first divided by what its own host takes without us: turns and CPU by
//! `null` in the same block, time to knowledge by the block's raw hop. What has no such yardstick, or
//! whose run lacks it, is named and not compared.

use super::Common;
use crate::results::baseline::raw_hops;
use crate::results::inference::{Comparison, Pairing, Verdict, compare, hodges_lehmann};
use crate::results::read::RunData;
use crate::results::record::Label;
use crate::results::statistics::{Quantile, as_float};
use serde::Serialize;
use shared_types::rng::{Purpose, Stream};
use shared_types::wire::{Stage, StrategyKind};
use std::collections::{BTreeMap, BTreeSet};

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
    /// What of their own hosts both sides were divided by first; absent on one host.
    pub over: Option<Yardstick>,
    /// What the blocks say.
    #[serde(flatten)]
    pub comparison: Comparison,
    /// Whether it is worse beyond doubt.
    pub is_regression: bool,
}

/// What a host takes without us.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Yardstick {
    /// The same processes, wake-ups and ledger under strategy `null`, which sends nothing.
    Null,
    /// A datagram between two threads that sleep until it comes.
    RawHop,
}

impl Yardstick {
    /// The name in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Null => "null",
            Self::RawHop => "raw hop",
        }
    }

    /// That of `metric`; `None` where there is none.
    fn of(metric: &str) -> Option<Self> {
        match metric {
            "knowledge p50" | "knowledge p99" => Some(Self::RawHop),
            "time a write at capacity" => None,
            _ => Some(Self::Null),
        }
    }
}

/// What both runs measured and is not compared, because a host's own yardstick is missing.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct Uncompared {
    /// What was measured.
    pub metric: &'static str,
    /// Crafts, a centre not counted.
    pub size: u32,
    /// What is missing.
    pub why: &'static str,
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

/// Every time that both runs have, and what of it is not compared: between two hosts only what has a
/// yardstick on its own host is.
pub(super) fn differences(
    before: &RunData,
    after: &RunData,
    common: &Common,
) -> (Vec<TimeDifference>, Vec<Uncompared>) {
    let is_relative = !common.hosts.is_empty();
    let (then, now) = (values(before), values(after));
    let mut uncompared = BTreeSet::new();
    // What is measured alike is one family of comparisons.
    let mut families: BTreeMap<&'static str, Family> = BTreeMap::new();
    let mut number = FIRST_STREAM;
    let seed = before.provenance.as_ref().map_or(0, |provenance| provenance.seed);
    for (what, of_before) in &then {
        let Some(of_after) = now.get(what) else { continue };
        let floor = floor(of_before, of_after);
        let yardsticks = if is_relative {
            let both = yardstick(before, &then, what)
                .and_then(|before| Ok((before, yardstick(after, &now, what)?)));
            match both {
                Ok(both) => Some(both),
                Err(why) => {
                    uncompared.insert(Uncompared { metric: what.3, size: what.0, why });
                    continue;
                }
            }
        } else {
            None
        };
        for (label, values_before) in of_before.iter().filter(|(label, _)| label.again == 0) {
            let Some(values_after) = of_after.get(label) else { continue };
            let (then, now) = match &yardsticks {
                // It is its own yardstick, or sends nothing that could be known.
                Some(_) if label.strategy == StrategyKind::Null => continue,
                Some((then, now)) => (over(values_before, then), over(values_after, now)),
                None => (values_before.clone(), values_after.clone()),
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
    let compared = compared
        .filter_map(|(((size, load, asks_every_ns, metric), strategy), comparison)| {
            let comparison = comparison?;
            let is_regression = comparison.verdict == Verdict::Winner && comparison.ratio > 1.0;
            Some(TimeDifference {
                size,
                strategy,
                load,
                asks_every_ns,
                metric,
                over: if is_relative { Yardstick::of(metric) } else { None },
                comparison,
                is_regression,
            })
        })
        .collect();
    (compared, uncompared.into_iter().collect())
}

/// By block what the host of `run` takes for `what` without us, or why that is not known.
fn yardstick(
    run: &RunData,
    values: &Values,
    what: &What,
) -> Result<BTreeMap<u32, f64>, &'static str> {
    let (size, load, _, metric) = what;
    match Yardstick::of(metric) {
        None => Err("has no yardstick of the host alone"),
        Some(Yardstick::Null) => {
            // It asks no centre.
            let beside = values.get(&(*size, load.clone(), None, *metric));
            let null = beside.and_then(|labels| labels.get(&Label::first(StrategyKind::Null)));
            null.filter(|blocks| !blocks.is_empty()).cloned().ok_or("a run has no strategy `null`")
        }
        Some(Yardstick::RawHop) => {
            let hops = raw_hops(&run.events, *size);
            if hops.is_empty() { Err("a run has no raw baseline") } else { Ok(hops) }
        }
    }
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
    // What was simulated has no times.
    let measured = run.loads.iter().map(|loaded| &loaded.record);
    for record in measured.filter(|record| record.simulated.is_none()) {
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
