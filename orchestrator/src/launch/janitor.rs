//! The janitor at work in a living fleet, on a thread of its own.
//!
//! The loop that owns the run must not do this itself: it may be the very one that waits, inside the
//! transport, on a segment which a killed craft left empty and which only the janitor removes. Its
//! descriptor becomes readable when it is done, so that a loop can wait for it beside everything else.

use shared_types::time::Nanos;
use shared_types::transport::reclaim::{ReclaimError, Removed, Steps, reclaim_within};
use shared_types::transport::{RunPaths, clock};
use std::io::{self, PipeReader, pipe};
use std::os::fd::{AsFd, BorrowedFd};
use std::thread::JoinHandle;

/// How long the janitor may try, ns: twenty times what the largest fleet needs, and the age that an
/// unfinished file must have.
const LIMIT_NS: u64 = 10_000_000_000;

/// How long it may take altogether, ns: one that is not done by then waits for ever on something that
/// was never finished.
pub const PATIENCE_NS: u64 = 3 * LIMIT_NS;

/// What the janitor achieved, and when it was done.
#[derive(Debug)]
pub struct Reclaimed {
    /// What it removed, or why it could not.
    pub result: Result<Removed, ReclaimError>,
    /// When.
    pub done: Nanos,
}

/// A janitor at work.
#[derive(Debug)]
pub struct Janitor {
    thread: JoinHandle<Reclaimed>,
    /// At its end once the thread is.
    done: PipeReader,
}

impl Janitor {
    /// Starts to reclaim what dead processes of the run at `paths` hold.
    ///
    /// # Errors
    /// If no thread or descriptor is left.
    pub fn start(paths: &RunPaths, steps: Steps) -> io::Result<Self> {
        let (done, still_works) = pipe()?;
        let paths = paths.clone();
        let thread = std::thread::Builder::new().name("janitor".into()).spawn(move || {
            let result = reclaim_within(&paths, steps, LIMIT_NS);
            let reclaimed = Reclaimed { result, done: clock::now() };
            drop(still_works);
            reclaimed
        })?;
        Ok(Self { thread, done })
    }

    /// Whether it is done, so that [`Self::finish`] does not wait.
    #[must_use]
    pub fn is_done(&self) -> bool {
        self.thread.is_finished()
    }

    /// Waits for it.
    ///
    /// # Errors
    /// If it panicked, with what it was about.
    pub fn finish(self) -> Result<Reclaimed, String> {
        self.thread.join().map_err(|_| "the janitor panicked; its message is above".to_owned())
    }
}

impl AsFd for Janitor {
    /// Readable when it is done.
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.done.as_fd()
    }
}
