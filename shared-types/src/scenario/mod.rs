//! The scenario file's types: what a user may write, with units and defaults.
//!
//! Plain data with serde and a JSON schema; keys are kebab-case and unknown ones are refused. Not
//! here: reading files, checking, names of presets, compiling to networks (orchestrator, `scenario`).

mod network;

pub use network::{GeneratedNetwork, LinkingModel};
