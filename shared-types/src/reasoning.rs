//! How crafts think during a trial: which rule or action they choose, and how they keep their boards
//! small. Both a section of the scenario and a part of what a craft is told of an epoch. Not here: the
//! thinking itself (agent, `reasoning`).

use rkyv::{Archive, Deserialize, Serialize};
use schemars::JsonSchema;

/// What a craft fires among what it could fire.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    Archive,
    Serialize,
    Deserialize,
    serde::Serialize,
    serde::Deserialize,
    JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Policy {
    /// Any of it, drawn from the seed. The published experiment.
    #[default]
    Random,
    /// A queued action if there is one, else the next rule in the order of the file, round and round.
    Naive,
    /// What lies on the cheapest way to a final fact, as far as the craft knows.
    BestPath,
}

impl Policy {
    /// The name in scenarios and in the output.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Random => "random",
            Self::Naive => "naive",
            Self::BestPath => "best-path",
        }
    }
}

/// `[reasoning]`: how crafts think.
#[derive(
    Clone,
    Copy,
    Debug,
    PartialEq,
    Eq,
    Archive,
    Serialize,
    Deserialize,
    serde::Serialize,
    serde::Deserialize,
    JsonSchema,
)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct Reasoning {
    /// What a craft fires among what it could fire; default `random`.
    pub policy: Policy,
    /// Turns from one pruning of a craft's board to the next, 0 for none; default 0. It is sound: it
    /// finds what no way to a final fact can need, and changes nothing of a trial's course.
    pub prune_every_turns: u32,
    /// Turns from one slice of maintenance to the next, 0 for none; default 0. It changes nothing of a
    /// trial's course either.
    pub maintain_every_turns: u32,
    /// Facts, rules and actions that one slice of maintenance looks at, at most; default 256.
    pub maintain_items: u32,
}

impl Default for Reasoning {
    fn default() -> Self {
        Self {
            policy: Policy::default(),
            prune_every_turns: 0,
            maintain_every_turns: 0,
            maintain_items: 256,
        }
    }
}

impl Reasoning {
    /// Whether crafts have anything to do between turns.
    #[must_use]
    pub const fn has_upkeep(&self) -> bool {
        self.prune_every_turns > 0 || self.maintain_every_turns > 0
    }
}

/// What a craft's thinking came to in one trial. Counts follow from seed and scenario, times do not.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    Archive,
    Serialize,
    Deserialize,
    serde::Serialize,
    serde::Deserialize,
)]
#[serde(default)]
pub struct ReasoningReport {
    /// Plans made, under `best-path`.
    pub plans: u64,
    /// Least costs of facts that changes have changed: the work of repairing plans.
    pub costs_changed: u64,
    /// Prunings.
    pub prunings: u64,
    /// Changes of facts that prunings and slices followed.
    pub changes_followed: u64,
    /// Facts, rules and actions of the board.
    pub items: [u32; 3],
    /// Those that some way to a final or shared fact can need, at the last pruning.
    pub kept: [u32; 3],
    /// Slices of maintenance.
    pub slices: u64,
    /// Items that slices looked at: current, stale, unused, unlikely to be used, used.
    pub statuses: [u64; 5],
    /// Items that went to another place: the board, an archive, the ancillary store.
    pub moved: u64,
    /// Facts that need not be collected, after the last slice.
    pub do_not_collect: u32,
    /// Facts at hand in the ancillary store, after the last slice.
    pub available: u32,
    /// Time of following changes and of pruning, ns; 0 in simulation.
    pub prune_ns: u64,
    /// Time of slices of maintenance, ns; 0 in simulation.
    pub maintain_ns: u64,
    /// Time of the longest slice, ns; 0 in simulation.
    pub slice_ns_max: u64,
}
