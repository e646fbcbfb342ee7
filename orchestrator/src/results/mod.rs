//! What a run leaves behind, as plain records and as files: the waist between running and reporting.
//!
//! The run loop appends [`record`]s to a [`store::Store`]; [`read`] reads a directory back in whatever
//! state it was left; [`summary`] computes every figure from what was read, and nothing else does.
//! Reports (see [`crate::report`]) only show figures. Not here: how anything is measured.

pub mod baseline;
pub mod borne;
mod complete;
mod complete_faults;
pub mod crafts;
pub mod diff;
pub mod directory;
pub mod event;
pub mod faults;
pub mod figure;
pub mod histogram;
pub mod host;
pub mod inference;
pub mod load;
pub mod load_pairs;
pub mod loads;
pub mod map;
pub mod measurements;
pub mod networks;
pub mod pairs;
pub mod provenance;
pub mod read;
pub mod reasoning;
pub mod record;
pub mod recovered;
pub mod resume;
pub mod statistics;
pub mod store;
pub mod summary;
pub mod sweep;
pub mod times;

#[cfg(any(test, fuzzing))]
pub(crate) mod sample;
#[cfg(test)]
mod tests;
