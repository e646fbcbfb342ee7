//! The orchestrator: what starts a fleet, runs it, keeps what it measured and shows it.
//!
//! [`cli`] is what a user may type, [`commands`] one file a verb. [`scenario`] turns a file into
//! networks, [`workload`] into traces of open mode, [`launch`] and [`supervision`] own processes, [`run`]
//! is the one loop that owns a run, [`results`] is what it leaves, and [`report`] reads nothing else.

pub mod campaign;
pub mod cli;
pub mod commands;
pub mod expectation;
pub mod explanation;
#[cfg(any(test, fuzzing))]
pub mod fuzzing;
pub mod launch;
pub mod networks;
pub mod outcome;
pub mod report;
pub mod results;
pub mod run;
pub mod scenario;
pub mod supervision;
pub mod workload;
