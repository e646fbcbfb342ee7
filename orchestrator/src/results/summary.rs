//! Every figure of a run, computed from its records alone.
//!
//! `deterministic` holds what seed and scenario decide: no clock, host or path is in it, so that two
//! runs of one seed have the same bytes there. `timing` holds the rest: where the results come from,
//! times and costs, how the run ended, what is missing. Means and ratios are over the trials that
//! came to an end of their own; the others are counted.

use super::baseline::{BlockBaseline, baselines};
use super::crafts::{CraftCell, craft_cells};
use super::event::{Event, EventLine};
use super::faults::CampaignFigures;
use super::figure::Figures;
use super::host::HostReport;
use super::load::{CapacityRecord, LoadRecord};
use super::load_pairs::{ComparedLoad, Orders, StampEffect, compared_loads, orders, stamp_effects};
use super::loads::{LoadFigures, load_figures};
use super::pairs::{self, Compared, Control};
use super::provenance::Provenance;
use super::read::{Missing, RunData};
use super::reasoning::{ReasoningCell, reasoning_cells};
use super::record::{Cell, TimingRecord, TrialEnd, TrialFacts, TrialTiming};
use super::statistics::{as_float, mean, ratio_of_sums};
use super::times;
use crate::outcome::Outcome;
use serde::Serialize;
use shared_types::wire::StrategyKind;
use std::collections::BTreeMap;

/// Version of the summary's shape; larger when a reader must change.
pub const SUMMARY_FORMAT: u32 = 1;

/// Everything that reports show.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// [`SUMMARY_FORMAT`].
    pub format: u32,
    /// Decided by seed and scenario.
    pub deterministic: Deterministic,
    /// Measured on this host.
    pub timing: Timing,
}

/// What seed and scenario decide.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Deterministic {
    /// Name of the scenario, where the provenance could be read.
    pub scenario: Option<String>,
    /// Seed of the run, where the provenance could be read.
    pub seed: Option<u64>,
    /// Figures by fleet size and strategy.
    pub cells: Vec<CountedCell>,
    /// Sums by fleet size, strategy and craft.
    pub crafts: Vec<CraftCell>,
    /// Every trial, ordered by cell and number.
    pub trials: Vec<TrialFacts>,
}

/// Counts of one strategy at one fleet size.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CountedCell {
    /// Crafts, a centre not counted.
    pub size: u32,
    /// How changes were replicated.
    pub strategy: StrategyKind,
    /// How many trials ended how; ends that did not happen are left out.
    pub ends: BTreeMap<TrialEnd, u64>,
    /// Whether every count of every complete trial is that of the independent replay.
    pub agrees_with_oracle: bool,
    /// By metric.
    pub figures: Figures,
}

/// What was measured on this host.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Timing {
    /// Where the results come from, where that could be read.
    pub provenance: Option<Provenance>,
    /// How the run ended; absent if it was killed.
    pub outcome: Option<Outcome>,
    /// What could not be read.
    pub missing: Vec<Missing>,
    /// What went wrong or must be known, in the order in which it happened.
    pub incidents: Vec<EventLine>,
    /// Figures by fleet size and strategy.
    pub cells: Vec<TimedFigures>,
    /// Median turn times by size and strategy, paired by block with those of one strategy.
    pub compared: Vec<Compared>,
    /// Comparisons whose answer is known; empty unless `run.controls`.
    pub controls: Vec<Control>,
    /// Figures of open mode, ordered by size and load.
    pub loads: Vec<LoadFigures>,
    /// The same paired by block with those of one strategy.
    pub compared_loads: Vec<ComparedLoad>,
    /// What stamping every stage does to time to knowledge; empty unless `run.controls`.
    pub stamp_effects: Vec<StampEffect>,
    /// Strategies in order by count, CPU and time to knowledge, for each size and load.
    pub orders: Vec<Orders>,
    /// What the thinking of crafts came to and cost; absent where they only drew.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub reasoning: Vec<ReasoningCell>,
    /// Whether the host was quiet.
    pub host: HostReport,
    /// What a raw hop took around every block; absent where none was measured.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub baselines: Vec<BlockBaseline>,
    /// The timing cells as recorded.
    pub records: Vec<TimingRecord>,
    /// The cells of open mode as recorded.
    pub load_records: Vec<LoadRecord>,
    /// The searches for capacity as recorded.
    pub capacities: Vec<CapacityRecord>,
    /// Every trial's times and costs, in the order in which they were run.
    pub trials: Vec<TrialTimes>,
    /// Faults and what followed; campaigns only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub campaign: Option<CampaignFigures>,
}

/// Times and costs of one strategy at one fleet size.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TimedFigures {
    /// Crafts, a centre not counted.
    pub size: u32,
    /// How changes were replicated.
    pub strategy: StrategyKind,
    /// Whether the second half was as fast as the first; absent if too few turns tell.
    pub is_stationary: Option<bool>,
    /// By metric.
    pub figures: Figures,
}

/// Times and costs of one trial.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrialTimes {
    /// Where it belongs.
    #[serde(flatten)]
    pub cell: Cell,
    /// Trial of the seed.
    pub trial: u32,
    /// As recorded.
    #[serde(flatten)]
    pub timing: TrialTiming,
}

impl Summary {
    /// Every figure of `run`.
    #[must_use]
    pub fn of(run: &RunData) -> Self {
        let mut trials: Vec<TrialFacts> =
            run.trials.iter().map(|record| record.deterministic.clone()).collect();
        trials.sort_by_key(|facts| {
            (facts.cell.size, facts.cell.strategy, facts.cell.block, facts.trial)
        });
        let provenance = run.provenance.clone();
        let deterministic = Deterministic {
            scenario: provenance.as_ref().map(|provenance| provenance.scenario.clone()),
            seed: provenance.as_ref().map(|provenance| provenance.seed),
            cells: counted_cells(&trials),
            crafts: craft_cells(&trials),
            trials,
        };
        let host = HostReport::of(&run.events);
        let compared = pairs::compared(run, host.is_clean());
        let loads = load_figures(run);
        let timing = Timing {
            provenance,
            outcome: run.outcome(),
            missing: run.missing.clone(),
            incidents: run.events.iter().filter(|line| is_incident(&line.event)).cloned().collect(),
            cells: times::timed_figures(run, &compared),
            compared,
            controls: pairs::controls(run, host.is_clean()),
            compared_loads: compared_loads(run, &loads, host.is_clean()),
            stamp_effects: stamp_effects(run, &loads, host.is_clean()),
            orders: orders(&loads),
            loads,
            reasoning: reasoning_cells(&run.trials),
            host,
            baselines: baselines(&run.events),
            records: run.timings.iter().map(|timed| timed.record.clone()).collect(),
            load_records: run.loads.iter().map(|cell| cell.record.clone()).collect(),
            capacities: run.capacities.clone(),
            trials: run.trials.iter().map(trial_times).collect(),
            campaign: (!run.faults.is_empty()).then(|| CampaignFigures::of(&run.faults)),
        };
        Self { format: SUMMARY_FORMAT, deterministic, timing }
    }

    /// Fleet sizes of the run, ascending.
    #[must_use]
    pub fn sizes(&self) -> Vec<u32> {
        let counted = self.deterministic.cells.iter().map(|cell| cell.size);
        let timed = self.timing.cells.iter().map(|cell| cell.size);
        let sizes: std::collections::BTreeSet<u32> = counted.chain(timed).collect();
        sizes.into_iter().collect()
    }

    /// Strategies that ran at `size`, in the order of the tables.
    #[must_use]
    pub fn strategies(&self, size: u32) -> Vec<StrategyKind> {
        StrategyKind::ALL
            .into_iter()
            .filter(|&strategy| {
                self.counted(size, strategy).is_some() || self.timed(size, strategy).is_some()
            })
            .collect()
    }

    /// Counts of `strategy` at `size`.
    #[must_use]
    pub fn counted(&self, size: u32, strategy: StrategyKind) -> Option<&CountedCell> {
        self.deterministic.cells.iter().find(|cell| (cell.size, cell.strategy) == (size, strategy))
    }

    /// Times and costs of `strategy` at `size`.
    #[must_use]
    pub fn timed(&self, size: u32, strategy: StrategyKind) -> Option<&TimedFigures> {
        self.timing.cells.iter().find(|cell| (cell.size, cell.strategy) == (size, strategy))
    }

    /// Whether the counts of every complete trial are those of the independent replay.
    #[must_use]
    pub fn agrees_with_oracle(&self) -> bool {
        self.deterministic.cells.iter().all(|cell| cell.agrees_with_oracle)
    }
}

fn is_incident(event: &Event) -> bool {
    match event {
        Event::CraftLost { .. }
        | Event::CraftSilent { .. }
        | Event::CraftMute { .. }
        | Event::CraftRestarted { .. }
        | Event::Discrepancy { .. }
        | Event::Note { .. }
        | Event::Resumed { .. }
        | Event::Interrupted { .. } => true,
        Event::FleetStarted { .. }
        | Event::FleetReady { .. }
        | Event::FleetDone { .. }
        | Event::HostChecked { .. }
        | Event::BaselineMeasured { .. }
        | Event::EpochDone { .. }
        | Event::Ended { .. } => false,
    }
}

fn trial_times(record: &super::record::TrialRecord) -> TrialTimes {
    let facts = &record.deterministic;
    TrialTimes { cell: facts.cell, trial: facts.trial, timing: record.timing.clone() }
}

/// One cell per (size, strategy) of trials that are ordered so.
fn counted_cells(trials: &[TrialFacts]) -> Vec<CountedCell> {
    let same = |one: &TrialFacts, other: &TrialFacts| {
        (one.cell.size, one.cell.strategy) == (other.cell.size, other.cell.strategy)
    };
    let mut cells: Vec<CountedCell> = trials.chunk_by(same).map(counted_cell).collect();
    let sums: BTreeMap<(u32, StrategyKind), BTreeMap<(u32, u32), u64>> =
        trials.chunk_by(same).map(requests_by_trial).collect();
    for cell in &mut cells {
        let own = &sums[&(cell.size, cell.strategy)];
        for other in [StrategyKind::Full, StrategyKind::Boundary] {
            let Some(base) = sums.get(&(cell.size, other)) else { continue };
            // Only trials that both completed: the same experiments on both sides.
            let pairs: Vec<(u64, u64)> = own
                .iter()
                .filter_map(|(trial, &requests)| Some((requests, *base.get(trial)?)))
                .collect();
            cell.figures.count(
                &format!("requests-to-{other}"),
                ratio_of_sums(pairs.iter().copied()),
                pairs.len() as u64,
                "1",
                &format!("requests over those of {other}, ratio of sums"),
            );
        }
    }
    cells
}

type RequestsByTrial = BTreeMap<(u32, u32), u64>;

fn requests_by_trial(trials: &[TrialFacts]) -> ((u32, StrategyKind), RequestsByTrial) {
    let cell = trials[0].cell;
    let by_trial = trials
        .iter()
        .filter(|facts| facts.end.is_in_means())
        .map(|facts| ((facts.cell.block, facts.trial), facts.measured.replication.requests))
        .collect();
    ((cell.size, cell.strategy), by_trial)
}

fn counted_cell(trials: &[TrialFacts]) -> CountedCell {
    let mut ends = BTreeMap::new();
    for facts in trials {
        *ends.entry(facts.end).or_insert(0) += 1;
    }
    let complete: Vec<&TrialFacts> =
        trials.iter().filter(|facts| facts.end.is_in_means()).collect();
    let cell = trials[0].cell;
    CountedCell {
        size: cell.size,
        strategy: cell.strategy,
        ends,
        agrees_with_oracle: trials
            .iter()
            .all(|facts| facts.end == TrialEnd::Partial || facts.agrees_with_oracle()),
        figures: count_figures(&complete),
    }
}

/// A count of one trial.
type CountOf = fn(&TrialFacts) -> u64;

/// Metric, unit, label and source of every mean a trial.
const MEANS: [(&str, &str, &str, CountOf); 14] = [
    ("turns", "turn", "turns", |facts| u64::from(facts.turns)),
    ("firings", "firing", "firings", |facts| facts.firings),
    ("boundary-firings", "firing", "firings that changed a boundary fact", |facts| {
        facts.boundary_firings
    }),
    ("idle-turns", "turn", "turns of crafts without a candidate", |facts| facts.idle_turns),
    ("requests", "request", "requests sent", |facts| facts.measured.replication.requests),
    ("requests-expected", "request", "requests by the independent replay", |facts| {
        facts.expected.replication.requests
    }),
    ("replies", "sample", "replies of the centre", |facts| facts.measured.reply.transmissions),
    ("transmissions", "sample", "samples published, replies included", |facts| {
        facts.measured.total().transmissions
    }),
    ("deliveries", "sample", "samples received, replies included", |facts| {
        facts.measured.total().deliveries
    }),
    ("deliveries-expected", "sample", "deliveries by the independent replay", |facts| {
        facts.expected.total().deliveries
    }),
    ("bytes", "byte", "records and headers published", |facts| facts.measured.total().bytes_sent),
    ("bytes-received", "byte", "records and headers received", |facts| {
        facts.measured.total().bytes_received
    }),
    ("hops", "hop", "hop counts over all final deliveries", |facts| facts.hops),
    ("conflicts", "merge", "merges decided by the craft id", |facts| facts.conflicts),
];

fn count_figures(complete: &[&TrialFacts]) -> Figures {
    let mut figures = Figures::default();
    let n = complete.len() as u64;
    for (metric, unit, label, count_of) in MEANS {
        let value = mean(complete.iter().map(|facts| count_of(facts)));
        figures.count(metric, value, n, unit, &format!("{label}, mean a trial"));
    }
    figures.count("trials", Some(as_float(n)), n, "trial", "trials in the means");
    figures
}
