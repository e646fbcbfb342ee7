//! The laws of the transport port, held against every adapter.
//!
//! A law is a function of a [`fleet::Fleet`]: five crafts (the last one the centre) and an
//! orchestrator, whatever carries their samples. Each adapter's file sets up such a fleet and runs
//! every law; what only one adapter can do (verdicts, virtual time, files in shared memory) is tested
//! in that file alone.

#[cfg(feature = "shell")]
mod crash_defects;
mod fleet;
#[cfg(feature = "shell")]
mod iceoryx;
mod laws;
mod memory;
#[cfg(feature = "shell")]
mod reclaim;
