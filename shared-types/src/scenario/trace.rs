//! `[trace]`: what is written and read in open mode, beside rate and duration in `[run]`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// `[trace]`: how a trace is drawn, or the file that holds one. `run.rate-per-s`, `run.duration-s` and
/// `replication.record-bytes` stand where they do for every mode.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct Trace {
    /// A CSV file (`time_ns,craft,fact,value`; `slateswarm record` writes one) that is replayed instead
    /// of a drawn trace, relative to the current directory.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<PathBuf>,
    /// Writes of one craft that are due at the same time; bursts come at random. Default 1.
    pub burst: u32,
    /// Share of the writes that are of boundary facts, 0 to 1; left out, every fact of a board is as
    /// likely as any other.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub boundary_fraction: Option<f64>,
    /// Boundary facts are written only if so many other crafts share them; left out, all may be. Acts
    /// with `boundary-fraction`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sharers: Option<u32>,
    /// Reads per second of the fleet, each at a random time; default 0.
    pub reads_per_s: f64,
}

impl Default for Trace {
    fn default() -> Self {
        Self { file: None, burst: 1, boundary_fraction: None, sharers: None, reads_per_s: 0.0 }
    }
}
