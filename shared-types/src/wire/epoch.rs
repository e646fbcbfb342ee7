//! What a craft must know of an epoch besides the networks.

use super::{LinkSpec, OpenSpec, RecoverySpec};
use crate::reasoning::Reasoning;
use rkyv::{Archive, Deserialize, Serialize};
use schemars::JsonSchema;

/// A replication strategy, as scenarios and tables name it.
#[derive(
    Clone,
    Copy,
    Debug,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    Archive,
    Serialize,
    Deserialize,
    serde::Serialize,
    serde::Deserialize,
    JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
#[rkyv(derive(Clone, Copy, Debug))]
#[repr(u8)]
pub enum StrategyKind {
    /// Nothing is replicated; the floor under every time.
    Null,
    /// Every firing's changes by one multicast.
    Full,
    /// Changes of boundary facts to each sharing peer.
    Boundary,
    /// The same changes to each other craft.
    Limited,
    /// The same changes hop by hop along the tree.
    Hierarchy,
    /// Direct inside a group, between groups along the tree of leaders.
    Hybrid,
    /// One blackboard at a centre, round trips one by one.
    Central,
    /// The centre checks for termination itself.
    CentralBatched,
    /// As central, with many round trips in flight.
    Pipelined,
}

impl StrategyKind {
    /// All strategies in the order of the tables.
    pub const ALL: [Self; 9] = [
        Self::Null,
        Self::Full,
        Self::Boundary,
        Self::Limited,
        Self::Hierarchy,
        Self::Hybrid,
        Self::Central,
        Self::CentralBatched,
        Self::Pipelined,
    ];

    /// The name on the command line, in scenarios and in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Null => "null",
            Self::Full => "full",
            Self::Boundary => "boundary",
            Self::Limited => "limited",
            Self::Hierarchy => "hierarchy",
            Self::Hybrid => "hybrid",
            Self::Central => "central",
            Self::CentralBatched => "central-batched",
            Self::Pipelined => "pipelined",
        }
    }

    /// Whether the boards live at a centre, one more process.
    #[must_use]
    pub const fn has_centre(self) -> bool {
        matches!(self, Self::Central | Self::CentralBatched | Self::Pipelined)
    }

    /// Whether it multicasts.
    #[must_use]
    pub const fn multicasts(self) -> bool {
        matches!(self, Self::Full)
    }

    /// Whether it plays traces in open mode. There every request awaits its reply, so that `pipelined`
    /// would be `central` under another name.
    #[must_use]
    pub const fn plays_traces(self) -> bool {
        !matches!(self, Self::Pipelined)
    }

    /// Whether receivers keep what others told in a replica store.
    #[must_use]
    pub const fn keeps_replicas(self) -> bool {
        matches!(self, Self::Full | Self::Limited)
    }
}

impl std::fmt::Display for StrategyKind {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.pad(self.name())
    }
}

impl std::str::FromStr for StrategyKind {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        Self::ALL.into_iter().find(|kind| kind.name() == name).ok_or_else(|| {
            let known: Vec<&str> = Self::ALL.iter().map(|kind| kind.name()).collect();
            format!("unknown strategy `{name}`; known: {}", known.join(", "))
        })
    }
}

/// One epoch: which trial is run, how. Sent to every craft before the epoch's first turn.
#[derive(Clone, Debug, PartialEq, Eq, Archive, Serialize, Deserialize)]
pub struct EpochSpec {
    /// Number of the epoch on this fleet.
    pub epoch: u32,
    /// Epoch whose `world` sample holds the networks: this one, or an earlier one of the same trial.
    pub network: u32,
    /// Seed of the run.
    pub seed: u64,
    /// Trial of the seed; names the random streams.
    pub trial: u32,
    /// How changes are replicated.
    pub strategy: StrategyKind,
    /// Whether a final fact counts only if a firing on its own board newly asserts it (the published
    /// experiment); else a delivery counts as well.
    pub own_firing_only: bool,
    /// Whether the trial runs on past final facts (timing epochs).
    pub ignores_finals: bool,
    /// Whether only changes that alter the value are sent.
    pub sends_altered_only: bool,
    /// Bytes of one record on the wire, padding included.
    pub record_bytes: u32,
    /// Firings that this epoch may reach at most per craft, so that nothing grows while it runs.
    pub turns_max: u32,
    /// How crafts choose what they fire, and keep their boards small.
    pub reasoning: Reasoning,
    /// How the trace is played that travels with the networks; `None` in lockstep.
    pub open: Option<OpenSpec>,
    /// How losses are repaired; `None` if they are detected and counted only.
    pub recovery: Option<RecoverySpec>,
    /// What links do in an interval of real processes; `None` if nothing happens on them. Simulated
    /// networks are told of theirs beforehand.
    pub link: Option<LinkSpec>,
}
