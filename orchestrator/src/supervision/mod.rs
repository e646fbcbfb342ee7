//! The supervisor's view of the fleet: processes as the operating system sees them.
//!
//! It learns of ends from pidfds, of requests to end from signals, and ends a fleet within bounds.
//! Whether a craft that runs is well is judged elsewhere, from heartbeats, by its peers.

pub mod restart;
pub mod shutdown;
pub mod signals;
pub mod watch;
