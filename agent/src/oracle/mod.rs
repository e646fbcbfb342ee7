//! The independent replay: what a trial must do, and what every strategy must have sent for it.
//!
//! [`Replay::of`] runs a trial as plainly as it can be written: every turn every craft looks at all
//! its rules and actions, draws one, and what was written is merged at the turn's end. No strategy
//! and no transport takes part, so the path of a trial does not depend on how it is replicated.
//! [`Replay::expected`] then counts, from the firings alone, what each strategy has to send, and
//! [`compare`] holds the reports of a real or simulated run against that, [`compare_open`] those of an
//! interval of open mode, where the trace takes the place of the replay, and [`compare_recovered`] those of
//! one that recovered from deaths and losses.
//!
//! Nothing here is shared with the code that it judges: no blackboard, no strategy, no craft. Only
//! the vocabulary (networks, random streams, wire sizes) is common.

mod board;
mod central;
mod compare;
mod compare_open;
mod compare_recovered;
mod deliveries;
mod digest;
mod expected;
mod held;
mod history;
mod open;
mod policy;
mod replay;
mod routes;

#[cfg(test)]
mod tests;

pub use compare::{Discrepancy, Metric, Observed, compare};
pub use compare_open::{ObservedOpen, compare_open};
pub use compare_recovered::compare_recovered;
pub use deliveries::Deliveries;
pub use digest::{board_digest, path_digest, replica_digest};
pub use expected::{Expected, ExpectedCounts};
pub use history::{Cause, Entry, History, relays};
pub use open::{ExpectedOpen, disagreements};
pub use replay::{Fired, Replay, Turnout};
