//! The shell of a real craft: one operating-system process that owns clock, signals and ports and
//! drives the core's step with them. Nothing here decides what a craft does.

pub mod doom;
mod run;
pub mod session;
pub mod startup;

pub use run::{ProcessError, run};
