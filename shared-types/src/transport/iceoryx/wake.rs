//! Waiting: a process whose inboxes are empty yields, then sleeps on its bell.
//!
//! Sleeping is one `ppoll` on the descriptor of the own bell, and on others that the caller names, to
//! an exact deadline; iceoryx2's timed waits round up to kernel ticks. A bell stays rung until it is
//! heard, and it is heard right before the sleep, not after it: who finds it rung looks at its inboxes
//! once more, who finds it silent sleeps, and whatever rings from then on makes the descriptor ready
//! (docs/decisions/0015). No sleep is longer than [`SLEEP_NS_MAX`], so that a process sees within a
//! second that its orchestrator is gone.

use super::endpoint::IceoryxEndpoint;
use super::{Listener, descriptor};
use crate::limits::{OUTBOX_RETRY_NS, SLEEP_NS_MAX, YIELDS_BEFORE_SLEEP};
use crate::time::Nanos;
use crate::transport::{SendError, WakeMode, clock};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::os::fd::BorrowedFd;

/// Why a wait ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wake {
    /// Somebody rang, or it was only a yield: look at the inboxes.
    Bell,
    /// One of the caller's descriptors is ready.
    Descriptor,
    /// The deadline, or the longest sleep, has passed.
    Timeout,
}

/// Sleeps until the bell of `listener` rings, one of `others` is readable, or `until`; not at all if
/// it has rung since it was last heard.
pub(super) fn sleep(
    listener: &Listener,
    until: Option<Nanos>,
    others: &[BorrowedFd<'_>],
) -> Result<Wake, SendError> {
    // iceoryx2 keeps beside the descriptor whether the bell has rung, and whoever rings again does not
    // touch the descriptor. The two may disagree after a ring that met a hearing half-way: rung, and
    // nothing to read. Hearing first brings them together again.
    let heard = listener
        .try_wait(|_| ())
        .map_err(|error| super::peers::transport_error("hearing", error))?;
    if heard > 0 {
        return Ok(Wake::Bell);
    }
    let bell = PollFd::from_borrowed_fd(descriptor::of(listener), PollFlags::IN);
    let longest = clock::now().plus(SLEEP_NS_MAX);
    let until = until.map_or(longest, |until| until.min(longest));
    let readable = |other| PollFd::from_borrowed_fd(other, PollFlags::IN);
    match *others {
        [] => wait_for(&mut [bell], until),
        // What a craft waits with: nothing is allocated for it.
        [other] => wait_for(&mut [bell, readable(other)], until),
        _ => {
            let mut all = Vec::with_capacity(1 + others.len());
            all.push(bell);
            all.extend(others.iter().copied().map(readable));
            wait_for(&mut all, until)
        }
    }
}

/// Waits for one of `descriptors`, the bell first.
fn wait_for(descriptors: &mut [PollFd<'_>], until: Nanos) -> Result<Wake, SendError> {
    const NANOS_PER_SECOND: u64 = 1_000_000_000;
    let left_ns = until.since(clock::now());
    let timeout = Timespec {
        tv_sec: i64::try_from(left_ns / NANOS_PER_SECOND).unwrap_or(i64::MAX),
        tv_nsec: i64::try_from(left_ns % NANOS_PER_SECOND).unwrap_or(0),
    };
    match poll(descriptors, Some(&timeout)) {
        Ok(0) => Ok(Wake::Timeout),
        Ok(_) if descriptors[1..].iter().any(|other| !other.revents().is_empty()) => {
            Ok(Wake::Descriptor)
        }
        Ok(_) | Err(rustix::io::Errno::INTR) => Ok(Wake::Bell),
        Err(error) => Err(super::peers::transport_error("sleeping", error)),
    }
}

/// What a process does between two looks at its inboxes, by wake mode.
#[derive(Clone, Copy, Debug)]
pub struct IdleWait {
    mode: WakeMode,
    yields: u32,
}

impl IdleWait {
    /// A wait in `mode`.
    #[must_use]
    pub const fn new(mode: WakeMode) -> Self {
        Self { mode, yields: 0 }
    }

    /// There was something to do: the next wait starts with yields again.
    #[inline]
    pub const fn reset(&mut self) {
        self.yields = 0;
    }

    /// There was nothing to do: yields the core, or sleeps until the bell rings, one of `others` is
    /// readable or `until` has come. What still waits in the outbox is to be tried again soon, since
    /// nobody rings when an inbox has room again.
    ///
    /// # Errors
    /// If the bell is broken.
    pub fn wait(
        &mut self,
        endpoint: &mut IceoryxEndpoint,
        until: Option<Nanos>,
        others: &[BorrowedFd<'_>],
    ) -> Result<Wake, SendError> {
        let still_yields = match self.mode {
            WakeMode::Poll => true,
            WakeMode::Adaptive => self.yields < YIELDS_BEFORE_SLEEP,
            WakeMode::Block => false,
        };
        if still_yields {
            self.yields = self.yields.saturating_add(1);
            rustix::thread::sched_yield();
            return Ok(Wake::Bell);
        }
        let until = if endpoint.waiting() > 0 {
            let soon = clock::now().plus(OUTBOX_RETRY_NS);
            Some(until.map_or(soon, |until| until.min(soon)))
        } else {
            until
        };
        endpoint.wait(until, others)
    }
}
