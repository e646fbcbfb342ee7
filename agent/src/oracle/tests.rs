//! The replay against missions small enough to be worked out by hand, and laws on random fleets.

mod fleets;
mod hand;
mod laws;
mod open;
mod simulated;
mod verdicts;
