//! Strategies under equal load, paired by block with the one that all are compared with, and put in
//! order by what they cost.
//!
//! Compared are the median and the 99th percentile of time to knowledge and the CPU time a needed
//! application; all of them together are one family, apart from that of turn times. A cell above
//! capacity is compared with nothing. The statistics are in [`super::inference`]; which rows stand for
//! their strategy is decided in [`super::loads`].

use super::inference::{Comparison, Pairing, Verdict, compare};
use super::load::LoadRecord;
use super::loads::LoadFigures;
use super::pairs::base_of;
use super::read::RunData;
use super::record::Label;
use super::statistics::{Quantile, as_float};
use serde::Serialize;
use shared_types::rng::{Purpose, Stream};
use shared_types::wire::{Stage, StrategyKind};
use std::collections::BTreeMap;

/// Streams of these comparisons are numbered from here, apart from those of other figures.
const FIRST_STREAM: u32 = 5000;

/// Those of the effect of stamps.
const FIRST_STAMP_STREAM: u32 = 6000;

/// What strategies are compared by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LoadMetric {
    /// Median time to knowledge.
    KnowledgeP50,
    /// 99th percentile of time to knowledge.
    KnowledgeP99,
    /// CPU time of the fleet a needed application.
    CpuPerApplication,
}

impl LoadMetric {
    /// All of them, in the order of the tables.
    pub const ALL: [Self; 3] = [Self::KnowledgeP50, Self::KnowledgeP99, Self::CpuPerApplication];

    /// The name, that of its figure.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::KnowledgeP50 => "knowledge-p50",
            Self::KnowledgeP99 => "knowledge-p99",
            Self::CpuPerApplication => "cpu-per-application",
        }
    }

    const fn is_latency(self) -> bool {
        matches!(self, Self::KnowledgeP50 | Self::KnowledgeP99)
    }

    /// Its value in one cell; `None` where too few events carry it.
    fn of(self, record: &LoadRecord) -> Option<f64> {
        let quantile = |quantile| record.stages.get(&Stage::Knowledge)?.quantile_ns(quantile);
        match self {
            Self::KnowledgeP50 => quantile(Quantile::P50).map(as_float),
            Self::KnowledgeP99 => quantile(Quantile::P99).map(as_float),
            Self::CpuPerApplication => {
                (record.needed > 0).then(|| as_float(record.fleet_cpu_ns) / as_float(record.needed))
            }
        }
    }
}

/// A strategy beside another, by one metric at one load.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ComparedLoad {
    /// Crafts, a centre not counted.
    pub size: u32,
    /// Name of the load.
    pub load: String,
    /// By what.
    pub metric: LoadMetric,
    /// Whose value is above the line of the ratio.
    pub strategy: StrategyKind,
    /// How often its clients ask the centre, ns; `None` without a centre.
    pub asks_every_ns: Option<u64>,
    /// Whose value is below it.
    pub base: StrategyKind,
    /// Whether the schedule of one of the two was so late that no winner on latency is named.
    pub is_late: bool,
    /// The better one, where one may be named.
    pub winner: Option<StrategyKind>,
    /// What the blocks say.
    #[serde(flatten)]
    pub comparison: Comparison,
}

/// The strategies of one load in order, the least first, by value alone. Rows that are compared only;
/// those above capacity are in none.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Orders {
    /// Crafts, a centre not counted.
    pub size: u32,
    /// Name of the load.
    pub load: String,
    /// By samples published a needed application.
    pub by_count: Vec<StrategyKind>,
    /// By CPU time a needed application.
    pub by_cpu: Vec<StrategyKind>,
    /// By the 99th percentile of time to knowledge.
    pub by_p99: Vec<StrategyKind>,
    /// Whether the three are not the same.
    pub disagree: bool,
}

/// A metric by block.
type ByBlock = BTreeMap<u32, f64>;

/// Every row that stands for its strategy beside the one that all of its load are compared with.
#[must_use]
pub fn compared_loads(run: &RunData, rows: &[LoadFigures], is_clean: bool) -> Vec<ComparedLoad> {
    let seed = run.provenance.as_ref().map_or(0, |provenance| provenance.seed);
    let (mut names, mut pairings) = (Vec::new(), Vec::new());
    for metric in LoadMetric::ALL {
        for row in rows.iter().filter(|row| row.is_compared && row.saturated.is_none()) {
            let Some(base) = base_row(rows, row) else { continue };
            if base.strategy == row.strategy {
                continue;
            }
            let again = rows.iter().find(|other| is_beside(other, row) && is_again(other, base));
            let below = by_block(run, base, metric);
            let floor = again
                .map_or_else(Vec::new, |again| log_ratios(&by_block(run, again, metric), &below));
            let number = FIRST_STREAM + u32::try_from(names.len()).unwrap_or(u32::MAX);
            let stream = Stream::new(seed, row.size, Purpose::Bootstrap, number);
            let log_ratios = log_ratios(&by_block(run, row, metric), &below);
            names.push((metric, row, base));
            pairings.push(Pairing { log_ratios, floor, stream });
        }
    }
    let paired = names.into_iter().zip(compare(pairings, is_clean));
    paired
        .filter_map(|((metric, row, base), comparison)| {
            let comparison = comparison?;
            let is_late = metric.is_latency() && (row.is_late || base.is_late);
            let better = if comparison.ratio < 1.0 { row.strategy } else { base.strategy };
            let is_winner = comparison.verdict == Verdict::Winner && !is_late;
            Some(ComparedLoad {
                size: row.size,
                load: row.load.clone(),
                metric,
                strategy: row.strategy,
                asks_every_ns: row.asks_every_ns,
                base: base.strategy,
                is_late,
                winner: is_winner.then_some(better),
                comparison,
            })
        })
        .collect()
}

/// What measuring the stages does to time to knowledge: crafts that stamp nothing else beside those that
/// stamp everything, in the same blocks.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StampEffect {
    /// Crafts, a centre not counted.
    pub size: u32,
    /// Name of the load.
    pub load: String,
    /// Which quantile.
    pub metric: LoadMetric,
    /// Whether the whole interval lies within [`STAMP_EFFECT_MAX`]; absent without an interval.
    pub is_within: Option<bool>,
    /// Stamped over unstamped.
    #[serde(flatten)]
    pub comparison: Comparison,
}

/// How far from 1 the effect of stamps may be.
pub const STAMP_EFFECT_MAX: f64 = 0.05;

/// The effect of stamps at every load that has unstamped entries (`run.controls`).
#[must_use]
pub fn stamp_effects(run: &RunData, rows: &[LoadFigures], is_clean: bool) -> Vec<StampEffect> {
    let seed = run.provenance.as_ref().map_or(0, |provenance| provenance.seed);
    let (mut names, mut pairings) = (Vec::new(), Vec::new());
    for metric in [LoadMetric::KnowledgeP50, LoadMetric::KnowledgeP99] {
        for row in rows.iter().filter(|row| row.again == Label::UNSTAMPED) {
            let entry = |again| {
                rows.iter().find(|other| {
                    is_beside(other, row) && (other.strategy, other.again) == (row.strategy, again)
                })
            };
            let (Some(stamped), Some(again)) = (entry(0), entry(1)) else { continue };
            let below = by_block(run, row, metric);
            let above = by_block(run, stamped, metric);
            let number = FIRST_STAMP_STREAM + u32::try_from(names.len()).unwrap_or(u32::MAX);
            names.push((metric, row));
            pairings.push(Pairing {
                log_ratios: log_ratios(&above, &below),
                floor: log_ratios(&by_block(run, again, metric), &above),
                stream: Stream::new(seed, row.size, Purpose::Bootstrap, number),
            });
        }
    }
    let compared = names.into_iter().zip(compare(pairings, is_clean));
    compared
        .filter_map(|((metric, row), comparison)| {
            let comparison = comparison?;
            let is_within = comparison
                .interval
                .map(|(low, high)| low >= 1.0 - STAMP_EFFECT_MAX && high <= 1.0 + STAMP_EFFECT_MAX);
            let (size, load) = (row.size, row.load.clone());
            Some(StampEffect { size, load, metric, is_within, comparison })
        })
        .collect()
}

fn is_beside(one: &LoadFigures, other: &LoadFigures) -> bool {
    (one.size, &one.load) == (other.size, &other.load)
}

fn is_again(one: &LoadFigures, base: &LoadFigures) -> bool {
    (one.strategy, one.again, one.asks_every_ns) == (base.strategy, 1, base.asks_every_ns)
        && one.saturated.is_none()
}

/// The row that `row` is compared with.
fn base_row<'a>(rows: &'a [LoadFigures], row: &LoadFigures) -> Option<&'a LoadFigures> {
    let beside = || rows.iter().filter(|other| is_beside(other, row) && other.is_compared);
    let strategies: Vec<StrategyKind> = beside().map(|other| other.strategy).collect();
    let base = base_of(&strategies)?;
    beside().find(|other| other.strategy == base && other.saturated.is_none())
}

fn by_block(run: &RunData, row: &LoadFigures, metric: LoadMetric) -> ByBlock {
    let records = run.loads.iter().map(|cell| &cell.record).filter(|record| {
        (record.cell.size, &record.load) == (row.size, &row.load)
            && record.label() == row.label()
            && record.asks_every_ns == row.asks_every_ns
    });
    records.filter_map(|record| Some((record.cell.block, metric.of(record)?))).collect()
}

/// Of the blocks that both have.
fn log_ratios(above: &ByBlock, below: &ByBlock) -> Vec<f64> {
    let shared = above.iter().filter_map(|(block, value)| Some((*value, *below.get(block)?)));
    shared.filter(|&(above, below)| above > 0.0 && below > 0.0).map(|(a, b)| (a / b).ln()).collect()
}

/// The orders of every size and load that has more than one row to put in order.
#[must_use]
pub fn orders(rows: &[LoadFigures]) -> Vec<Orders> {
    let mut orders = Vec::new();
    for beside in rows.chunk_by(is_beside) {
        let rows: Vec<&LoadFigures> =
            beside.iter().filter(|row| row.is_compared && row.saturated.is_none()).collect();
        let by = |metric: &str| {
            let value = |row: &&LoadFigures| Some((row.figures.value(metric)?, row.strategy));
            let mut valued: Vec<(f64, StrategyKind)> = rows.iter().filter_map(value).collect();
            valued.sort_by(|one, other| one.0.total_cmp(&other.0));
            valued.into_iter().map(|(_, strategy)| strategy).collect::<Vec<_>>()
        };
        let by_count = by("transmissions-per-application");
        let (by_cpu, by_p99) = (by("cpu-per-application"), by("knowledge-p99"));
        // Where too few events carry a 99th percentile, its order is of fewer strategies.
        let among = |order: &[StrategyKind], all: &[StrategyKind]| -> Vec<StrategyKind> {
            all.iter().copied().filter(|strategy| order.contains(strategy)).collect()
        };
        let disagree = by_count != by_cpu
            || by_p99 != among(&by_p99, &by_count)
            || by_p99 != among(&by_p99, &by_cpu);
        if by_count.len() > 1 {
            let (size, load) = (beside[0].size, beside[0].load.clone());
            orders.push(Orders { size, load, by_count, by_cpu, by_p99, disagree });
        }
    }
    orders
}
