//! The supervisor's view of the fleet: processes as the operating system sees them.
//!
//! It learns of ends from pidfds, of requests to end from signals, of processes that run and do not go on
//! from their heartbeats, and ends a fleet within bounds.

pub mod heartbeat;
pub mod restart;
pub mod shutdown;
pub mod signals;
pub mod watch;
