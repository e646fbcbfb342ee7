//! Raw transports between processes: what they cost before Slateswarm adds anything. iceoryx2 is the
//! one that Slateswarm stands on, Unix datagrams are what most programs would use.
//!
//! A program of this kind starts itself again once per process. The parent ([`fleet`]) claims an
//! [`area`] in shared memory, spawns the children, prepares what they share, leads everybody through a
//! start barrier over pipes and then waits; it takes no part in what is measured. The children open
//! one [`link`] each (iceoryx2: [`port`], sockets: [`datagram`]), poll with `sched_yield` and exchange
//! samples ([`round`], [`one_way`], [`capacity`]); child 0 records the times and hands them to the parent
//! at the end.
//!
//! Nothing of Slateswarm's transport, header or ledger is used here on purpose: this is the yardstick.

pub mod area;
pub mod capacity;
pub mod child;
pub mod command;
pub mod datagram;
pub mod fleet;
pub mod link;
pub mod one_way;
pub mod port;
pub mod round;

use std::process::ExitStatus;

/// Why a raw measurement gave no result.
#[derive(Debug, thiserror::Error)]
pub enum RawError {
    /// The place in shared memory could not be claimed or cleaned.
    #[error("{path}: {source}")]
    Area {
        /// What was touched.
        path: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// Something stands where the raw programs keep their files, and it is not ours.
    #[error("{0} exists and does not belong to this user; remove it")]
    Foreign(String),
    /// A child could not be started, reached or pinned.
    #[error("{operation}: {source}")]
    Process {
        /// What was tried.
        operation: &'static str,
        /// What the system said.
        source: std::io::Error,
    },
    /// A process ended before the measurement was complete.
    #[error("process {index} ended early ({status})")]
    Ended {
        /// Which child.
        index: usize,
        /// How it ended.
        status: ExitStatus,
    },
    /// The user or the system asked to stop.
    #[error("stopped by signal {0}")]
    Signal(i32),
    /// iceoryx2 refused an operation.
    #[error("iceoryx2: {operation}: {detail}")]
    Iceoryx {
        /// What was tried.
        operation: &'static str,
        /// What iceoryx2 said.
        detail: String,
    },
    /// What is measured failed, where it is not a transport of this module.
    #[error("{0}")]
    Measured(String),
    /// A sample did not reach every subscriber.
    #[error("sample {number} reached {reached} of {expected} subscribers")]
    Lost {
        /// Number of the sample.
        number: u32,
        /// Subscribers that took it.
        reached: usize,
        /// Subscribers of the service.
        expected: usize,
    },
    /// A sample or a line that cannot come at this point.
    #[error("unexpected {0}")]
    Unexpected(String),
}

impl RawError {
    /// Turns a refusal of iceoryx2 into an error that names the operation.
    fn iceoryx<E: std::fmt::Debug>(operation: &'static str) -> impl FnOnce(E) -> Self {
        move |error| Self::Iceoryx { operation, detail: format!("{error:?}") }
    }

    /// Turns a refusal of the system into an error that names the operation.
    fn process<E: Into<std::io::Error>>(operation: &'static str) -> impl FnOnce(E) -> Self {
        move |error| Self::Process { operation, source: error.into() }
    }

    /// The exit code: 128 + signal if a signal ended the measurement, else 1.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Signal(signal) => u8::try_from(128 + signal).unwrap_or(1),
            _ => 1,
        }
    }
}

/// A histogram of nanoseconds up to one minute, three significant digits.
///
/// # Panics
/// Never: the bounds are valid.
#[must_use]
pub fn empty_histogram() -> hdrhistogram::Histogram<u64> {
    hdrhistogram::Histogram::new_with_bounds(1, 60_000_000_000, 3)
        .expect("invariant: the bounds of the histogram are valid")
}

/// Now, in ns of `CLOCK_MONOTONIC`.
fn now_ns() -> u64 {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::Monotonic);
    now.tv_sec.unsigned_abs() * 1_000_000_000 + now.tv_nsec.unsigned_abs()
}
