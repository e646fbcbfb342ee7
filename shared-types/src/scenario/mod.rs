//! The scenario file's types: what a user may write, with units and defaults.
//!
//! Plain data with serde and a JSON schema; keys are kebab-case and unknown ones are refused. Not
//! here: reading files, checking, names of presets, compiling to networks (orchestrator, `scenario`).

mod capacity;
mod fleet;
mod link;
mod load;
mod mission;
mod network;
mod one_or_many;
mod replication;
mod run;
mod trace;

pub use capacity::Capacity;
pub use fleet::{CraftCount, CraftEntry, Fleet, Pinning, Tier, TierCounts, TopologySection, Tree};
pub use link::{Blow, Faults, FromPositions, Link, Outage, ProcessFault, Restart};
pub use load::{LoadEntry, LoadStrategies};
pub use mission::{ActionEntry, BoundaryEntry, RuleEntry};
pub use network::{GeneratedNetwork, LinkingModel};
pub use one_or_many::OneOrMany;
pub use replication::{RECORD_BYTES_MIN, Replication, SendPolicy};
pub use run::{Run, RunMode};
pub use trace::Trace;

use crate::reasoning::Reasoning;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A scenario file. What crafts know is either generated (`[network]`) or written out (`[[rule]]`,
/// `[[action]]`, `[[boundary]]`).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct Scenario {
    /// What reports call it; default the name of the file or preset.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub name: String,
    /// What it is for, in a sentence.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub description: String,
    /// How many crafts, and how their processes share the machine.
    pub fleet: Fleet,
    /// Which strategies are run.
    pub replication: Replication,
    /// How often, how long, from which seed.
    pub run: Run,
    /// How crafts choose what they fire, and keep their boards small.
    pub reasoning: Reasoning,
    /// What is written and read in open mode.
    pub trace: Trace,
    /// What fleets are offered in open mode, load by load; left out, `run.rate-per-s` is the only one.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub load: Vec<LoadEntry>,
    /// The search for the highest load that each strategy bears.
    pub capacity: Capacity,
    /// The way between two crafts.
    pub link: Link,
    /// What happens to crafts.
    pub faults: Faults,
    /// The tree, and groups by number.
    pub topology: TopologySection,
    /// Generates the networks; left out where the mission is written out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub network: Option<GeneratedNetwork>,
    /// The crafts by name.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub craft: Vec<CraftEntry>,
    /// What crafts share.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub boundary: Vec<BoundaryEntry>,
    /// What crafts conclude.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub rule: Vec<RuleEntry>,
    /// What crafts do.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub action: Vec<ActionEntry>,
}
