//! The cheapest way to make a goal hold.
//!
//! A network is a directed graph whose edges have several tails: a rule leads from all its premises to
//! each of its outputs, and through an action to each of that action's. Costs of literals (a fact that
//! holds, or that is known absent) are the least that satisfies the rules of [`Costs`]. [`Solver`] finds
//! them exactly, after Knuth (1977, "A generalization of Dijkstra's algorithm"), and [`Repair`] keeps
//! them right when something changes, after Ramalingam and Reps (1996, "An incremental algorithm for a
//! generalization of the shortest-path problem"). [`sweep`] is the plain form that they are held against,
//! [`published`] the solver of the published tables.
//!
//! Under [`Combine::Sum`] a premise that two branches share is paid for in both: that is what makes the
//! costs computable one by one. A [`Plan`] says beside it what it costs when everything in it is run
//! once.

mod costs;
mod plan;
pub mod published;
mod queue;
mod repair;
mod solver;
pub mod sweep;
pub mod ways;

#[cfg(test)]
mod tests;

pub use costs::{Combine, CostError, Costs};
pub use plan::{Plan, Step};
pub use repair::Repair;
pub use solver::{Solver, Stopped, Via};
