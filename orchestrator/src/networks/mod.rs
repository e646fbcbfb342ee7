//! The random networks of chapters V and VI of the source (Straub 2016), and what pruner and solvers
//! make of them.
//!
//! One stream a network, the same under every condition, so that conditions differ by what they vary.
//! Not here: the networks of fleets (`crate::scenario`), and what is published (`crate::report`).

mod draw;
mod measure;

#[cfg(test)]
mod tests;

pub use draw::{NetworkError, draw};
pub use measure::measure;
