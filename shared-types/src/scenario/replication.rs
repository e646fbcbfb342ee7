//! `[replication]`: which strategies are run, and what they send.

use super::one_or_many::OneOrMany;
use crate::wire::{DELTA_BYTES, StrategyKind};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[replication]`: which strategies are run, one after the other on the same seeds.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct Replication {
    /// The strategies, a name or a list (`strategy = ".."` says the same); default `null`, `full`,
    /// `boundary`, `limited`, `hierarchy`, `central`, `central-batched`, and `hybrid` where groups
    /// are stated.
    #[serde(alias = "strategy", skip_serializing_if = "Option::is_none")]
    pub strategies: Option<OneOrMany<StrategyKind>>,
    /// Whether every output of a firing is sent or only those that alter a value; default `outputs`.
    pub send: SendPolicy,
    /// Whether a final fact ends the trial only if a firing on its own board newly asserts it (the
    /// published experiment), and not when it is delivered; default false.
    pub own_firing_only: bool,
    /// Bytes of one record on the wire, at least 16; what is above 16 is padding. Default 16.
    pub record_bytes: u32,
}

impl Default for Replication {
    fn default() -> Self {
        Self {
            strategies: None,
            send: SendPolicy::default(),
            own_firing_only: false,
            record_bytes: RECORD_BYTES_MIN,
        }
    }
}

/// Bytes of a record without padding.
#[expect(clippy::cast_possible_truncation, reason = "a record is a few bytes long")]
pub const RECORD_BYTES_MIN: u32 = DELTA_BYTES as u32;

/// Which outputs of a firing are sent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SendPolicy {
    /// All of them, whether they alter the value or not. The published experiment.
    #[default]
    Outputs,
    /// Only those that alter the value on the writer's board.
    Altered,
}
