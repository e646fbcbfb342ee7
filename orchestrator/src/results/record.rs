//! The records of a run: one per trial, one per timing cell.
//!
//! A trial's record keeps what is `deterministic` (counts, digests, how it ended: the same bytes for the same
//! seed and scenario, on any machine, by any transport) apart from its `timing` (what comes from a clock, the
//! scheduler or the system). Files are [`super::store`]'s; no figure is computed here.

use super::statistics::Distribution;
use serde::{Deserialize, Serialize};
use shared_types::limits;
use shared_types::reasoning::ReasoningReport;
use shared_types::transport::link::LinkCounts;
use shared_types::wire::{CLASS_COUNT, Class, Losses, StrategyKind, Traffic};

/// Which cell of a run a measurement belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Cell {
    /// Which fresh launch of the fleet, from 0.
    pub block: u32,
    /// Crafts of the fleet, a centre not counted.
    pub size: u32,
    /// How changes were replicated.
    pub strategy: StrategyKind,
}

/// A strategy under one of its labels. One that enters a block several times differs from itself by
/// chance alone: that is the floor below which no difference counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Label {
    /// How changes are replicated.
    pub strategy: StrategyKind,
    /// 0 for the strategy itself, 1 for its second entry in a block, and so on.
    pub again: u32,
}

impl Label {
    /// The further entries that are controls: two of which each is like the other, and one that is
    /// slowed down on purpose.
    pub const CONTROLS: [u32; 3] = [2, 3, Self::SLOWED];

    /// Entry that is slowed down by [`limits::PLANTED_SLOWDOWN_PERCENT`].
    pub const SLOWED: u32 = 4;

    /// Entry under load in which time to knowledge is the only thing that crafts stamp and keep: what
    /// it differs by is the effect of measuring the stages.
    pub const UNSTAMPED: u32 = 5;

    /// `strategy` itself.
    #[must_use]
    pub const fn first(strategy: StrategyKind) -> Self {
        Self { strategy, again: 0 }
    }

    /// How much longer its turns take on purpose, percent.
    #[must_use]
    pub const fn planted_slowdown_percent(self) -> u64 {
        if self.again == Self::SLOWED { limits::PLANTED_SLOWDOWN_PERCENT } else { 0 }
    }
}

impl std::fmt::Display for Label {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.again {
            0 => write!(formatter, "{}", self.strategy),
            1 => write!(formatter, "{} (again)", self.strategy),
            Self::SLOWED => write!(formatter, "{} (slowed)", self.strategy),
            Self::UNSTAMPED => write!(formatter, "{} (unstamped)", self.strategy),
            times => write!(formatter, "{} (again {times})", self.strategy),
        }
    }
}

/// A digest, written as 16 hexadecimal digits: JSON numbers do not hold 64 bits everywhere.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Digest(pub u64);

impl std::fmt::Display for Digest {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{:016x}", self.0)
    }
}

impl Serialize for Digest {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Digest {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = std::borrow::Cow::<'de, str>::deserialize(deserializer)?;
        u64::from_str_radix(&text, 16).map(Self).map_err(serde::de::Error::custom)
    }
}

/// Traffic of the two classes for which identities hold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// What strategies send.
    pub replication: Traffic,
    /// What a centre answers.
    pub reply: Traffic,
}

impl Counts {
    /// Both classes together.
    #[must_use]
    pub fn total(&self) -> Traffic {
        let mut total = self.replication;
        total += self.reply;
        total
    }
}

impl From<&[Traffic; CLASS_COUNT]> for Counts {
    fn from(by_class: &[Traffic; CLASS_COUNT]) -> Self {
        Self {
            replication: by_class[Class::Replication as usize],
            reply: by_class[Class::Reply as usize],
        }
    }
}

impl std::ops::AddAssign for Counts {
    fn add_assign(&mut self, other: Self) {
        self.replication += other.replication;
        self.reply += other.reply;
    }
}

/// Traffic beside that of strategies: the ledger, and what repairs. The scheduler has a part in it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Overhead {
    /// What was lost, sent again.
    pub repair: Traffic,
    /// What was received.
    pub ack: Traffic,
    /// Counted when lost and never repaired.
    pub best_effort: Traffic,
    /// Turns, epochs, start and stop: the lockstep ledger.
    pub control: Traffic,
    /// Reports.
    pub telemetry: Traffic,
}

impl From<&[Traffic; CLASS_COUNT]> for Overhead {
    fn from(by_class: &[Traffic; CLASS_COUNT]) -> Self {
        let of = |class: Class| by_class[class as usize];
        Self {
            repair: of(Class::Repair),
            ack: of(Class::Ack),
            best_effort: of(Class::BestEffort),
            control: of(Class::Control),
            telemetry: of(Class::Telemetry),
        }
    }
}

impl std::ops::AddAssign for Overhead {
    fn add_assign(&mut self, other: Self) {
        self.repair += other.repair;
        self.ack += other.ack;
        self.best_effort += other.best_effort;
        self.control += other.control;
        self.telemetry += other.telemetry;
    }
}

/// How a trial ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TrialEnd {
    /// By its end condition.
    #[default]
    Finished,
    /// No final fact within the turns that the scenario allows; counted, in no mean.
    Dropped,
    /// All crafts idle with nothing in flight.
    Stalled,
    /// Something was lost; in no mean.
    Partial,
}

impl TrialEnd {
    /// All ends, in the order of the tables.
    pub const ALL: [Self; 4] = [Self::Finished, Self::Stalled, Self::Dropped, Self::Partial];

    /// The name in tables and files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Finished => "finished",
            Self::Dropped => "dropped",
            Self::Stalled => "stalled",
            Self::Partial => "partial",
        }
    }

    /// Whether the trial enters means and ratios.
    #[must_use]
    pub const fn is_in_means(self) -> bool {
        matches!(self, Self::Finished | Self::Stalled)
    }
}

/// The final fact that ended a trial.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FinalFact {
    /// Name of the craft on whose board it became true.
    pub craft: String,
    /// Name of the fact on that board.
    pub fact: String,
    /// The turn, from 0.
    pub turn: u32,
}

/// What one craft (or the centre) counted in one trial.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct CraftFacts {
    /// Its id; the centre is craft N.
    pub craft: u32,
    /// Its name in the scenario.
    pub name: String,
    /// Firings run.
    pub firings: u64,
    /// Firings that changed a boundary fact.
    pub boundary_firings: u64,
    /// What the independent replay says it must send and receive.
    pub expected: Counts,
    /// What it sent and received.
    pub measured: Counts,
    /// Sum of hop counts over what it received finally.
    pub hops: u64,
    /// Merges decided by the craft id.
    pub conflicts: u64,
    /// Its home board at the end, wherever that lives.
    pub board_digest: Digest,
}

/// The part of a trial's record that a seed and a scenario decide.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TrialFacts {
    /// Where it belongs.
    #[serde(flatten)]
    pub cell: Cell,
    /// Trial of the seed, from 0; the same number is the same experiment under every strategy.
    pub trial: u32,
    /// How it ended.
    pub end: TrialEnd,
    /// Turns run.
    pub turns: u32,
    /// Firings run, all crafts.
    pub firings: u64,
    /// Firings that changed a boundary fact.
    pub boundary_firings: u64,
    /// Turns of crafts without a candidate.
    pub idle_turns: u64,
    /// What ended it, where a final fact did.
    pub final_fact: Option<FinalFact>,
    /// Counts of the independent replay, all crafts.
    pub expected: Counts,
    /// Counts of the processes, all crafts and the centre.
    pub measured: Counts,
    /// Hops of the independent replay.
    pub expected_hops: u64,
    /// Sum of hop counts over all final deliveries.
    pub hops: u64,
    /// Merges decided by the craft id.
    pub conflicts: u64,
    /// Over (turn, craft, firing).
    pub path_digest: Digest,
    /// Over the home boards of all crafts.
    pub board_digest: Digest,
    /// Over the replica stores; 0 if the strategy keeps none.
    pub replica_digest: Digest,
    /// Craft by craft, the centre last.
    pub crafts: Vec<CraftFacts>,
}

impl TrialFacts {
    /// Whether every count that the independent replay knows is the measured one, in sum and craft by
    /// craft.
    #[must_use]
    pub fn agrees_with_oracle(&self) -> bool {
        self.measured == self.expected
            && self.hops == self.expected_hops
            && self.crafts.iter().all(|craft| craft.measured == craft.expected)
    }
}

/// What one process cost in one epoch.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ProcessCost {
    /// The craft's id; the centre is craft N.
    pub craft: u32,
    /// Its name in the scenario.
    pub name: String,
    /// CPU time from the epoch's first turn to its report, ns; 0 in simulation.
    pub cpu_ns: u64,
    /// Resident memory at the report, bytes; 0 in simulation.
    pub resident_bytes: u64,
    /// What its thinking came to and cost; absent where it only draws.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reasoning: Option<ReasoningReport>,
}

/// The part of a trial's record that comes from clocks, the scheduler or the operating system.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TrialTiming {
    /// Number of the epoch on its fleet.
    pub epoch: u32,
    /// From GO to the last report, ns.
    pub duration_ns: u64,
    /// Time of every turn, ns; empty in simulation.
    pub turn_times_ns: Vec<u64>,
    /// CPU time of the orchestrator in the epoch, ns.
    pub orchestrator_cpu_ns: u64,
    /// What each process cost.
    pub processes: Vec<ProcessCost>,
    /// Traffic of the ledger and of repair.
    pub overhead: Overhead,
    /// What was lost, refused or had to wait, all processes.
    pub losses: Losses,
    /// What the links did on purpose; absent where nothing happened on them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub links: Option<LinkCounts>,
}

/// Everything that one trial leaves.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TrialRecord {
    /// Decided by seed and scenario.
    pub deterministic: TrialFacts,
    /// Measured on this host.
    pub timing: TrialTiming,
}

/// Everything that one timing cell leaves, besides its histogram.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimingRecord {
    /// Where it belongs.
    #[serde(flatten)]
    pub cell: Cell,
    /// As [`Label::again`]; absent in files for 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub again: u32,
    /// Place in the order in which its block was measured, from 0.
    #[serde(default)]
    pub place: u32,
    /// Fresh epochs measured.
    pub epochs: u32,
    /// Turns measured, all epochs.
    pub turns: u64,
    /// Turns run before measuring began.
    pub warm_up_turns: u64,
    /// How long that took, ns.
    pub warm_up_ns: u64,
    /// Median turn time of the measured second half over that of the first, where both have turns.
    pub second_half_ratio: Option<f64>,
    /// Turn times, ns: from the command that opens a turn to the ledger that closes it.
    pub turn_time: Distribution,
    /// CPU time of all crafts and the centre in the measured turns, ns.
    pub fleet_cpu_ns: u64,
    /// CPU time of the orchestrator in the measured turns, ns.
    pub orchestrator_cpu_ns: u64,
    /// Processes of the fleet, a centre counted.
    pub processes: u32,
    /// Resident memory of all crafts and the centre, bytes.
    pub resident_bytes: u64,
    /// Resident memory of the largest of them, bytes.
    pub resident_bytes_max: u64,
    /// From the first spawn to GO of the fleet, ns.
    pub ready_ns: u64,
    /// Traffic of classes replication and reply in the measured turns.
    pub counts: Counts,
    /// Traffic of the ledger and of repair in the measured turns.
    pub overhead: Overhead,
    /// What was lost, refused or had to wait, all processes.
    pub losses: Losses,
}

impl TimingRecord {
    /// The name, without extension, of the files that hold the cell's histogram.
    #[must_use]
    pub fn file_stem(&self) -> String {
        let Cell { block, size, strategy } = self.cell;
        let again = if self.again == 0 { String::new() } else { format!("-again-{}", self.again) };
        format!("turn-time-block-{block}-crafts-{size}-{strategy}{again}")
    }

    /// The label under which it was measured.
    #[must_use]
    pub const fn label(&self) -> Label {
        Label { strategy: self.cell.strategy, again: self.again }
    }
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "the shape that serde asks for")]
const fn is_zero(number: &u32) -> bool {
    *number == 0
}
