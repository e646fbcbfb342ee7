//! The orchestrator.

pub mod cli;
pub mod outcome;
pub mod report;
pub mod results;
pub mod scenario;
