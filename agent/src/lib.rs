//! The craft: what one robot knows, how it decides, and what it tells the others.
//!
//! [`craft::Craft`] is the core, free of clocks, files and transport: messages go in, plans come
//! out. Two shells drive it, `process` (one operating-system process per craft, feature `shell`) and
//! [`simulation`] (many crafts in one process on a virtual clock). [`oracle`] replays a trial without
//! any of this code, so that the two can be held against each other.

pub mod blackboard;
pub mod control;
pub mod craft;
pub mod lockstep;
pub mod metrics;
pub mod oracle;
#[cfg(feature = "shell")]
pub mod process;
pub mod reasoning;
pub mod replication;
pub mod simulation;
