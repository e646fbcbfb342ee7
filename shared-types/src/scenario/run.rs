//! `[run]`: how often, how long, from which seed.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[run]`: what is executed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct Run {
    /// How the fleet is run; default `lockstep`.
    pub mode: RunMode,
    /// Most turns of one trial; one that reaches no final fact by then is dropped and counted.
    /// Default 200.
    pub turns: u32,
    /// Trials for each strategy; default 10.
    pub trials: u32,
    /// The seed of everything that is drawn, 0 to 2^63 - 1; default 1.
    pub seed: u64,
    /// How long a turn may stay unbalanced before the trial ends, ms; default 5000.
    pub turn_limit_ms: u32,
    /// Epochs that only measure turn time, with the end condition off; default 0.
    pub timing_epochs: u32,
    /// Turns of one such epoch; default 200.
    pub timing_turns: u32,
    /// Fresh launches of each fleet over which turn times are measured; trials are played in the first.
    /// Default 1.
    pub blocks: u32,
    /// Whether every block also times two further entries of the strategy that others are compared
    /// with, and one that is slowed down on purpose: a comparison must find the second and no
    /// difference between the first two. Default `false`.
    pub controls: bool,
    /// Writes per second that the fleet is offered in open mode, where no `[[load]]` is stated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate_per_s: Option<f64>,
    /// Length of the measured interval in open mode, s; of a trace from a file default its own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<f64>,
    /// How often a client of the centre asks in open mode when it has no other reason to, ms: each
    /// interval is measured, the middle one compared with other strategies. Default `[1, 3, 10]`.
    pub asks_every_ms: Vec<f64>,
}

impl Default for Run {
    fn default() -> Self {
        Self {
            mode: RunMode::default(),
            turns: crate::limits::PUBLISHED_TURNS_MAX,
            trials: 10,
            seed: 1,
            turn_limit_ms: 5000,
            timing_epochs: 0,
            timing_turns: 200,
            blocks: 1,
            controls: false,
            rate_per_s: None,
            duration_s: None,
            asks_every_ms: vec![1.0, 3.0, 10.0],
        }
    }
}

/// How a fleet is run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RunMode {
    /// Real processes, turn by turn.
    #[default]
    Lockstep,
    /// The same turns in one process, on a virtual clock.
    Simulated,
    /// Real processes, a trace of writes replayed on its schedule.
    Open,
    /// The same trace in one process, on a virtual clock.
    SimulatedOpen,
}

impl RunMode {
    /// Whether all crafts live in one process, on a virtual clock.
    #[must_use]
    pub const fn is_simulated(self) -> bool {
        matches!(self, Self::Simulated | Self::SimulatedOpen)
    }

    /// Whether a trace is replayed and no trial is played.
    #[must_use]
    pub const fn is_open(self) -> bool {
        matches!(self, Self::Open | Self::SimulatedOpen)
    }

    /// What plays the same on a virtual clock.
    #[must_use]
    pub const fn simulated(self) -> Self {
        if self.is_open() { Self::SimulatedOpen } else { Self::Simulated }
    }
}
