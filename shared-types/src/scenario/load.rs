//! `[[load]]`: the loads that fleets are offered in open mode.

use crate::wire::StrategyKind;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// One entry of `[[load]]`: writes that come on their own schedule, whatever the fleet makes of them.
/// How long, what is written and on which networks stands where it does for every mode.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct LoadEntry {
    /// What tables call it.
    pub name: String,
    /// Writes per second that the fleet is offered.
    pub rate_per_s: f64,
    /// Who bears it; default `all`.
    #[serde(default)]
    pub strategies: LoadStrategies,
}

/// Which strategies bear a load.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum LoadStrategies {
    /// All that the scenario runs.
    #[default]
    All,
    /// Those of them that push changes to others: all without a centre.
    Push,
}

impl LoadStrategies {
    /// Whether `strategy` bears the load.
    #[must_use]
    pub const fn include(self, strategy: StrategyKind) -> bool {
        matches!(self, Self::All) || !strategy.has_centre()
    }
}
