//! The orchestrator.

pub mod cli;
pub mod expectation;
pub mod launch;
pub mod outcome;
pub mod report;
pub mod results;
pub mod scenario;
pub mod supervision;
