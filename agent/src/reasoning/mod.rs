//! What a craft thinks with: which parts of its network still matter, and how a goal is reached.
//!
//! [`prune`] finds what can be left out, [`best_path`] the cheapest way to a goal,
//! [`naive`] any way, [`maintenance`] what a board can do without for now. [`outcomes`] and
//! [`schedule`] say what may become of a plan and how long it takes. [`planner`] keeps the plans of one
//! craft, [`upkeep`] its board between turns. [`whole`] makes one network of a fleet's boards, for plans
//! that people read. Everything here reads a [`BoardView`] and owns its results; nothing draws, sends or
//! reads a clock. Beside each fast form stands a plain one in a module `reference`, and tests hold the two
//! against each other.
//!
//! [`BoardView`]: shared_types::knowledge::BoardView

pub mod best_path;
mod kept;
pub mod maintenance;
pub mod naive;
pub mod outcomes;
pub mod planner;
mod producers;
pub mod prune;

#[cfg(test)]
mod sample;
pub mod schedule;
pub mod upkeep;
pub mod whole;

pub use kept::Kept;
pub use producers::Producers;
