//! The scenario file: read, checked, completed, turned into networks.
//!
//! `load` merges file or preset, environment and flags into one document that remembers where every
//! value came from; `resolve` checks it and fills in what is left; `compile` makes the network of a
//! trial from it. An error is one sentence with place and remedy. The types that a user fills in, and
//! the keys' documentation, are `shared_types::scenario`. Not here: running anything.

mod capacity;
mod compile;
mod document;
mod draft;
mod error;
mod explain;
mod flags;
mod fleet;
pub mod generate;
mod levels;
mod links;
mod load;
mod mission;
mod names;
mod nearest;
mod offer;
mod positions;
mod preset;
mod process_faults;
mod reach;
mod resolve;
mod schema;
mod sharing;
mod stated_link;
mod sweep;
mod thinking;
mod validate;

pub use compile::compile;
pub use error::{Position, ScenarioError};
pub use fleet::Craft;
pub use load::{Base, Override, environment, load, load_simulated, load_text};
pub use names::NameTable;
pub(crate) use nearest::nearest;
pub use positions::LinkTable;
pub use preset::{PRESETS, Preset, find as find_preset};
pub use resolve::ResolvedScenario;
pub use schema::schema;
pub use sweep::{Axis, K_BETA, SIZES, grid, overrides, preset_axes};

#[cfg(test)]
mod tests;
