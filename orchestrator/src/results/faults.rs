//! The records of a campaign of faults, one a fault, and the figures that are computed from them.
//!
//! A column of zeros is not a proof: of n faults without a failure, the failure's probability is below 3/n
//! at a confidence of 95 % (the rule of three), and that bound stands beside every zero.

use super::statistics::{Distribution, histogram_of};
use serde::{Deserialize, Serialize};
use shared_types::transport::WakeMode;
use shared_types::wire::StrategyKind;
use std::collections::BTreeMap;

/// What was done.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FaultKind {
    /// SIGKILL to a craft or the centre.
    KillCraft,
    /// SIGKILL to an orchestrator.
    KillOrchestrator,
    /// SIGSTOP to up to half the crafts, SIGCONT later.
    Pause,
    /// Links that lose, double, delay and cut off samples in all intervals of a round.
    Links,
}

impl FaultKind {
    /// Whether a process was killed.
    #[must_use]
    pub const fn is_kill(self) -> bool {
        matches!(self, Self::KillCraft | Self::KillOrchestrator)
    }
}

/// What is counted against a fault: any of these is a promise that was broken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Failure {
    /// A bound on waiting was reached.
    Hang,
    /// What the dead held could not be freed.
    CleanUp,
    /// No successor came into the place of the dead, or a paused craft was lost.
    Restart,
    /// Something was left in shared memory, on disk or in the process table.
    Left,
    /// A later trial sent, delivered or fired other than the independent replay, and counted no loss.
    UndetectedLoss,
    /// A later trial ended with boards that are not those of the independent replay, and counted no loss.
    WrongBoards,
}

impl Failure {
    /// All of them, in the order of tables.
    pub const ALL: [Self; 6] = [
        Self::Hang,
        Self::CleanUp,
        Self::Restart,
        Self::Left,
        Self::UndetectedLoss,
        Self::WrongBoards,
    ];

    /// The name in tables and files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Hang => "hangs",
            Self::CleanUp => "failed clean-ups",
            Self::Restart => "failed restarts",
            Self::Left => "things left",
            Self::UndetectedLoss => "undetected losses",
            Self::WrongBoards => "wrong boards",
        }
    }
}

/// What is timed of a recovery, from the kill on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Step {
    /// The supervisor has reaped the process.
    Noticed,
    /// The last of those who live has heard of it, by its own clock; in open mode.
    PeersNoticed,
    /// What it held is freed and removed.
    Reclaimed,
    /// Everybody who lives knows and has given the trial up; in open mode: has been told.
    Known,
    /// The successor's process is up.
    Restarted,
    /// The successor is connected in the next trial; in open mode: in the interval under way.
    Rejoined,
    /// The successor has everything that its predecessor had and that came since; in open mode.
    CaughtUp,
}

impl Step {
    /// All of them, in their order.
    pub const ALL: [Self; 7] = [
        Self::Noticed,
        Self::PeersNoticed,
        Self::Reclaimed,
        Self::Known,
        Self::Restarted,
        Self::Rejoined,
        Self::CaughtUp,
    ];

    /// The name in tables and files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Noticed => "noticed",
            Self::PeersNoticed => "peers-noticed",
            Self::Reclaimed => "reclaimed",
            Self::Known => "known",
            Self::Restarted => "restarted",
            Self::Rejoined => "rejoined",
            Self::CaughtUp => "caught-up",
        }
    }
}

/// One fault and what followed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FaultRecord {
    /// Number in the campaign, from 0.
    pub number: u32,
    /// Crafts of the fleet, a centre not counted.
    pub size: u32,
    /// How the fleet replicated.
    pub strategy: StrategyKind,
    /// How its processes waited.
    pub wake: WakeMode,
    /// Whether it played an interval of open mode; else trials.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub is_open: bool,
    /// Whether links failed in that interval.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub links_fail: bool,
    /// What was done.
    pub kind: FaultKind,
    /// Where: the name of a point, or `random`.
    pub point: String,
    /// To which process; absent for an orchestrator and for several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub craft: Option<u32>,
    /// Whether it was seen to take effect; one that did not is counted apart and proves nothing.
    pub took_effect: bool,
    /// What went wrong, and in which words.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub failures: Vec<(Failure, String)>,
    /// From the kill to each step of the recovery that was reached, ns.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub times_ns: BTreeMap<Step, u64>,
}

impl FaultRecord {
    /// Whether its recovery had to wait until a file was old enough to go.
    #[must_use]
    pub fn has_aged(&self) -> bool {
        self.point == CRASH_DEFECTS
    }
}

/// The word for an instant that was drawn.
pub const RANDOM: &str = "random";

/// The point of a kill after which files were planted that kills at rare moments leave. Among them is one
/// that must age before it may go.
pub const CRASH_DEFECTS: &str = "crash defects";

/// Figures of a campaign.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct CampaignFigures {
    /// By fleet size, ascending.
    pub sizes: Vec<SizeFigures>,
    /// All sizes together.
    pub all: SizeFigures,
    /// Kills by point.
    pub points: BTreeMap<String, u64>,
    /// Every failure in words.
    pub failures: Vec<String>,
}

/// Figures of one fleet size.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct SizeFigures {
    /// Crafts; 0 for all sizes together.
    pub size: u32,
    /// Kills that took effect.
    pub kills: u64,
    /// Orchestrators among the killed.
    pub orchestrators: u64,
    /// Kills among them at named points.
    pub named: u64,
    /// Pauses that took effect.
    pub pauses: u64,
    /// Rounds whose links failed.
    pub links: u64,
    /// Faults that did not take effect.
    pub without_effect: u64,
    /// By name of the failure: how many faults had it.
    pub failures: BTreeMap<&'static str, u64>,
    /// Upper bound, at 95 %, of the probability of a failure that never happened: 3 / faults.
    pub bound_of_zero: Option<f64>,
    /// Times of recoveries, from the kill on, by step, those apart in which a file had to age, and of
    /// catching up those in which links failed.
    pub times: BTreeMap<Step, Distribution>,
    /// From the kill to reclaimed where a file had to age ([`CRASH_DEFECTS`]).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reclaimed_after_ageing: Option<Distribution>,
    /// From the kill to caught up where links failed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub caught_up_on_failing_links: Option<Distribution>,
}

impl SizeFigures {
    fn of(size: u32, records: &[&FaultRecord]) -> Self {
        let effective: Vec<_> = records.iter().filter(|record| record.took_effect).collect();
        let count = |counts: &dyn Fn(&FaultRecord) -> bool| {
            effective.iter().filter(|record| counts(record)).count() as u64
        };
        let times_of = |step: Step, is_meant: &dyn Fn(&FaultRecord) -> bool| {
            let meant = effective.iter().filter(|record| is_meant(record));
            let times: Vec<u64> =
                meant.filter_map(|record| record.times_ns.get(&step).copied()).collect();
            (!times.is_empty()).then(|| Distribution::of(&histogram_of(times)))
        };
        let times = Step::ALL.into_iter().filter_map(|step| {
            // What passes over links is what the successor asks for, and nothing before.
            let is_slowed = |record: &FaultRecord| step == Step::CaughtUp && record.links_fail;
            let times = times_of(step, &|record| !record.has_aged() && !is_slowed(record))?;
            Some((step, times))
        });
        let failures = Failure::ALL.into_iter().map(|failure| {
            let has =
                |record: &&&FaultRecord| record.failures.iter().any(|(one, _)| *one == failure);
            (failure.name(), records.iter().filter(has).count() as u64)
        });
        Self {
            size,
            kills: count(&|record| record.kind.is_kill()),
            orchestrators: count(&|record| record.kind == FaultKind::KillOrchestrator),
            named: count(&|record| record.kind.is_kill() && record.point != RANDOM),
            pauses: count(&|record| record.kind == FaultKind::Pause),
            links: count(&|record| record.kind == FaultKind::Links),
            without_effect: (records.len() - effective.len()) as u64,
            failures: failures.collect(),
            bound_of_zero: bound_of_zero(effective.len()),
            times: times.collect(),
            reclaimed_after_ageing: times_of(Step::Reclaimed, &FaultRecord::has_aged),
            caught_up_on_failing_links: times_of(Step::CaughtUp, &|record| record.links_fail),
        }
    }
}

/// The rule of three.
fn bound_of_zero(faults: usize) -> Option<f64> {
    let faults = u32::try_from(faults).ok().filter(|&faults| faults > 0)?;
    Some((3.0 / f64::from(faults)).min(1.0))
}

impl CampaignFigures {
    /// The figures of `records`.
    #[must_use]
    pub fn of(records: &[FaultRecord]) -> Self {
        let mut by_size: BTreeMap<u32, Vec<&FaultRecord>> = BTreeMap::new();
        let mut points = BTreeMap::new();
        for record in records {
            by_size.entry(record.size).or_default().push(record);
            if record.took_effect && record.kind.is_kill() {
                *points.entry(record.point.clone()).or_default() += 1;
            }
        }
        let said = |record: &FaultRecord| {
            let (number, size, point) = (record.number, record.size, record.point.clone());
            let say = move |(failure, what): &(Failure, String)| {
                format!("fault {number}, {size} crafts, {point}: {}: {what}", failure.name())
            };
            record.failures.iter().map(say).collect::<Vec<_>>()
        };
        Self {
            sizes: by_size.iter().map(|(&size, records)| SizeFigures::of(size, records)).collect(),
            all: SizeFigures::of(0, &records.iter().collect::<Vec<_>>()),
            points,
            failures: records.iter().flat_map(said).collect(),
        }
    }

    /// Whether no promise was broken.
    #[must_use]
    pub const fn is_clean(&self) -> bool {
        self.failures.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::{
        BTreeMap, CRASH_DEFECTS, CampaignFigures, Failure, FaultKind, FaultRecord, RANDOM, Step,
        StrategyKind, WakeMode,
    };

    fn record(number: u32, size: u32, point: &str) -> FaultRecord {
        FaultRecord {
            number,
            size,
            strategy: StrategyKind::Full,
            wake: WakeMode::Poll,
            is_open: false,
            links_fail: false,
            kind: FaultKind::KillCraft,
            point: point.to_owned(),
            craft: Some(1),
            took_effect: true,
            failures: Vec::new(),
            times_ns: BTreeMap::from([(Step::Noticed, 1_000 * u64::from(number))]),
        }
    }

    #[test]
    fn kills_are_counted_by_size_and_zeros_have_a_bound() {
        let mut records = vec![record(1, 5, "loan"), record(2, 5, RANDOM), record(3, 10, "send")];
        records.push(FaultRecord { kind: FaultKind::Pause, ..record(4, 10, RANDOM) });
        records.push(FaultRecord { took_effect: false, ..record(5, 10, "shutdown") });
        let figures = CampaignFigures::of(&records);
        assert!(figures.is_clean());
        let all = &figures.all;
        assert_eq!((all.kills, all.named, all.pauses, all.without_effect), (3, 2, 1, 1));
        assert_eq!(all.bound_of_zero, Some(0.75));
        assert_eq!(all.times[&Step::Noticed].n, 4);
        assert_eq!(figures.sizes.iter().map(|row| row.size).collect::<Vec<_>>(), [5, 10]);
        assert_eq!(figures.points["loan"], 1);
        assert!(!figures.points.contains_key("shutdown"), "it took no effect");
    }

    #[test]
    fn recoveries_in_which_a_file_had_to_age_are_timed_apart() {
        let aged = BTreeMap::from([(Step::Reclaimed, 215_000_000)]);
        let aged = FaultRecord { times_ns: aged, ..record(1, 5, CRASH_DEFECTS) };
        let plain = BTreeMap::from([(Step::Reclaimed, 9_000_000)]);
        let plain = FaultRecord { times_ns: plain, ..record(2, 5, "loan") };
        let all = CampaignFigures::of(&[aged, plain]).all;
        assert_eq!(all.times[&Step::Reclaimed].n, 1);
        assert!(all.times[&Step::Reclaimed].max_ns < 10_000_000);
        assert!(all.reclaimed_after_ageing.is_some_and(|times| times.max_ns > 200_000_000));
    }

    #[test]
    fn who_catches_up_over_links_that_fail_is_timed_apart() {
        let times = BTreeMap::from([(Step::Reclaimed, 9_000_000), (Step::CaughtUp, 400_000_000)]);
        let slow = FaultRecord { links_fail: true, times_ns: times, ..record(1, 5, "loan") };
        let times = BTreeMap::from([(Step::Reclaimed, 8_000_000), (Step::CaughtUp, 40_000_000)]);
        let plain = FaultRecord { times_ns: times, ..record(2, 5, "loan") };
        let links =
            FaultRecord { kind: FaultKind::Links, links_fail: true, ..record(3, 5, RANDOM) };
        let all = CampaignFigures::of(&[slow, plain, links]).all;
        assert_eq!((all.kills, all.links), (2, 1), "links kill nobody");
        assert_eq!(all.times[&Step::Reclaimed].n, 2);
        assert_eq!(all.times[&Step::CaughtUp].n, 1);
        assert!(all.times[&Step::CaughtUp].max_ns < 50_000_000);
        assert!(all.caught_up_on_failing_links.is_some_and(|times| times.max_ns > 390_000_000));
    }

    #[test]
    fn a_failure_is_counted_once_a_fault_and_told_in_words() {
        let mut failed = record(7, 5, "loan");
        failed.failures = vec![
            (Failure::Left, "a segment".to_owned()),
            (Failure::Left, "another".to_owned()),
            (Failure::Hang, "no answer".to_owned()),
        ];
        let figures = CampaignFigures::of(&[failed, record(8, 5, RANDOM)]);
        assert!(!figures.is_clean());
        assert_eq!(figures.all.failures["things left"], 1);
        assert_eq!(figures.all.failures["hangs"], 1);
        assert_eq!(figures.all.failures["failed restarts"], 0);
        assert_eq!(figures.failures.len(), 3);
        assert!(figures.failures[2].contains("fault 7, 5 crafts, loan: hangs: no answer"));
    }

    #[test]
    fn records_read_as_they_are_written() {
        let record = record(1, 5, "loan");
        let text = serde_json::to_string(&record).unwrap();
        assert_eq!(serde_json::from_str::<FaultRecord>(&text).unwrap(), record);
    }
}
