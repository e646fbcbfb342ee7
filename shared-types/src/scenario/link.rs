//! `[link]` and `[faults]`: what the way between two crafts, and a craft itself, suffers.

use super::one_or_many::OneOrMany;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[link]`: the way between two crafts. Acts in simulation and, between real processes, in intervals of
/// open mode.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct Link {
    /// Share of samples that are lost, 0 to 0.9; default 0. What is lost is repeated.
    pub loss: f64,
    /// Share of samples that arrive twice, 0 to 1; default 0. The second has no effect.
    pub duplication: f64,
    /// Delay of every sample, ms; default 0. Propagation from positions comes on top.
    pub delay_ms: f64,
    /// Each sample takes a random time up to this on top, ms, and later ones may overtake it; default 0.
    pub jitter_ms: f64,
    /// What a link carries from one craft to another, bits per second; what follows waits. Default
    /// without limit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bandwidth_bits_per_s: Option<f64>,
    /// Times in which nothing passes between some crafts and the others.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub outages: Vec<Outage>,
    /// Takes range and propagation delay from the crafts' positions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from_positions: Option<FromPositions>,
}

/// `[[link.outages]]`: crafts are cut off from the others, or two from each other, for a time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Outage {
    /// A craft or a list of crafts that neither hear nor reach any other; among them all passes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub craft: Option<OneOrMany<String>>,
    /// In place of that, the two crafts between which nothing passes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub between: Option<[String; 2]>,
    /// When it begins, ms from the start of each trial (virtual time) or interval.
    pub from_ms: f64,
    /// When it is over, likewise.
    pub until_ms: f64,
}

/// `[link.from-positions]`: who is in range, and how long a sample travels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct FromPositions {
    /// How far a radio reaches, m. Crafts that share a boundary fact must be in range of each other.
    pub range_m: f64,
    /// Speed of propagation, m/s; default that of light.
    #[serde(default = "speed_of_light")]
    pub propagation_m_per_s: f64,
}

const fn speed_of_light() -> f64 {
    crate::limits::SPEED_OF_LIGHT_M_PER_S
}

/// `[faults]`: what happens to crafts, and what follows from it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct Faults {
    /// Whether a craft whose process ends is followed by a new life of it; default `never`.
    pub restart: Restart,
    /// Restarts of one craft within the window, before it is lost for good; default 5.
    pub restart_limit: u32,
    /// Length of that window, s; default 60.
    pub restart_window_s: u32,
    /// Pause before the second restart within the window, ms, doubled for each further one; the first
    /// comes at once. Default 50.
    pub restart_pause_ms: u32,
    /// Processes that are killed or stopped.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub process: Vec<ProcessFault>,
}

impl Default for Faults {
    fn default() -> Self {
        Self {
            restart: Restart::Never,
            restart_limit: 5,
            restart_window_s: 60,
            restart_pause_ms: 50,
            process: Vec::new(),
        }
    }
}

/// Whether a craft whose process ends is restarted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Restart {
    /// The run ends as partial.
    #[default]
    Never,
    /// The trial under way is lost, the fleet goes on with a new life of the craft.
    OnFailure,
}

/// `[[faults.process]]`: one craft fails, in every trial or in every measured interval.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct ProcessFault {
    /// The craft.
    pub craft: String,
    /// When it fails in an interval of open mode, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at_s: Option<f64>,
    /// The turn of a trial in which it fails.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at_turn: Option<u32>,
    /// What befalls it; left out: it is killed.
    #[serde(default, rename = "do")]
    pub what: Blow,
    /// How long it is stopped, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub for_s: Option<f64>,
}

/// What befalls a process.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Blow {
    /// It ends at once, by SIGKILL.
    #[default]
    Kill,
    /// It is stopped for a while, by SIGSTOP and SIGCONT.
    Stop,
}
