//! `[capacity]`: the search for the highest load that each strategy bears.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[capacity]`: after the loads, every strategy is offered more and more until it bears no more, once
/// for each burst; then the stated shares of what it bore.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct Capacity {
    /// Writes of one craft that are due together, one search each; default none, which searches
    /// nothing.
    pub bursts: Vec<u32>,
    /// How long each rate is offered, s; default 2.
    pub probe_s: f64,
    /// The rate that is tried first, writes per second; default 20000.
    pub first_per_s: f64,
    /// The highest rate that is tried, writes per second; default 4000000.
    pub highest_per_s: f64,
    /// Loads in percent of a strategy's own capacity at the first burst; default none.
    pub loads_percent: Vec<u32>,
}

impl Default for Capacity {
    fn default() -> Self {
        Self {
            bursts: Vec::new(),
            probe_s: 2.0,
            first_per_s: 20_000.0,
            highest_per_s: 4e6,
            loads_percent: Vec::new(),
        }
    }
}
