//! The executable as a user meets it: real fleets, how runs end, what kills do to them, and what is
//! refused.
//!
//! Every test starts the built executable with a base of its own in shared memory and a directory of
//! its own for results, waits with a bound, and leaves nothing behind, whether it passes or not. Tests
//! that start fleets hold the machine-wide lock. Not here: launching and supervision one by one
//! (`tests/processes`), and the text of every diagnostic (`scenario/tests`).

#![expect(clippy::unwrap_used, reason = "a test says so by failing")]

mod campaigns;
mod capacity;
mod diff;
mod endings;
mod fleet;
mod invocation;
mod kills;
mod opens;
mod pictures;
mod power_cut;
mod restarts;
mod resume;
#[path = "../support/mod.rs"]
mod shared;
mod simulated;
mod simulated_open;
mod stated_faults;
mod sweep;
mod terminal;
mod thinking;
mod usage;
