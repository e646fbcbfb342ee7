//! The ending of a craft, bounded in time whatever its main thread is doing.
//!
//! One thread with a small stack sleeps on three descriptors: the stop pipe, which the SIGTERM handler
//! writes; a pidfd of the parent; and the begin pipe, which [`Ending::begin`] writes. The first that
//! becomes readable starts a countdown; when it has passed and the process still exists, the thread
//! kills it. A craft that hangs in its transport therefore still ends within [`ABRUPT_END_MS`] of its
//! orchestrator's death.

use super::StartupError;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::process::{Pid, PidfdFlags, Signal, getpid, kill_process, pidfd_open};
use shared_types::time::Nanos;
use shared_types::transport::clock;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use std::io::{PipeReader, PipeWriter, Write as _, pipe};
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// How long a craft may take to end once it got SIGTERM or lost its parent, ms: crafts are gone within
/// a second of their orchestrator's death.
pub const ABRUPT_END_MS: u64 = 700;

/// How long a craft may take to drop its ports after an orderly stop, ms. Longer than the grace that
/// the orchestrator gives, which then says who had to be killed.
pub const ORDERLY_END_MS: u64 = 5_000;

/// The guard calls nothing deep: a quarter of the smallest default stack is plenty.
const GUARD_STACK_BYTES: usize = 64 * 1024;

/// Whether the process shall end, and the promise that it then does.
///
/// Its descriptor becomes readable, and stays so, when an ending was asked for from outside: a craft
/// polls it together with its bell.
#[derive(Debug)]
pub struct Ending {
    is_requested: Arc<AtomicBool>,
    stop: Arc<PipeReader>,
    begin: PipeWriter,
}

impl Ending {
    /// Whether SIGTERM arrived or the parent is gone. One relaxed load: cheap enough for every step.
    #[inline]
    #[must_use]
    pub fn is_requested(&self) -> bool {
        self.is_requested.load(Ordering::Relaxed)
    }

    /// The process begins to end by itself: it is killed if it still exists [`ORDERLY_END_MS`] later.
    /// To be called before ports are dropped.
    pub fn begin(&self) {
        if (&self.begin).write(&[1]).is_err() {
            kill_this_process();
        }
    }
}

impl AsFd for Ending {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.stop.as_fd()
    }
}

/// Installs signal handlers and the guard thread of a process whose parent is `parent`.
pub(super) fn install(parent: Pid) -> Result<Ending, StartupError> {
    let (stop, stop_writer) = pipe().map_err(StartupError::system("pipe"))?;
    let (begun, begin) = pipe().map_err(StartupError::system("pipe"))?;
    let stop = Arc::new(stop);
    let is_requested = Arc::new(AtomicBool::new(false));
    handle_signals(&stop_writer, &is_requested)?;
    let guard = Guard {
        parent: pidfd_open(parent, PidfdFlags::empty())
            .map_err(StartupError::system("pidfd_open of the parent"))?,
        is_requested: Arc::clone(&is_requested),
        stop: Arc::clone(&stop),
        stop_writer,
        begun,
    };
    std::thread::Builder::new()
        .name("guard".into())
        .stack_size(GUARD_STACK_BYTES)
        .spawn(move || guard.watch())
        .map_err(StartupError::system("starting the guard thread"))?;
    Ok(Ending { is_requested, stop, begin })
}

/// SIGTERM sets the flag and writes the stop pipe. SIGINT and SIGHUP reach every process of the
/// terminal, but only the orchestrator may act on them: here they set a flag that nobody reads.
fn handle_signals(stop: &PipeWriter, is_requested: &Arc<AtomicBool>) -> Result<(), StartupError> {
    let unread = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGHUP] {
        signal_hook::flag::register(signal, Arc::clone(&unread))
            .map_err(StartupError::system("sigaction"))?;
    }
    signal_hook::flag::register(SIGTERM, Arc::clone(is_requested))
        .map_err(StartupError::system("sigaction(SIGTERM)"))?;
    let writer = stop.try_clone().map_err(StartupError::system("dup"))?;
    signal_hook::low_level::pipe::register(SIGTERM, writer)
        .map_err(StartupError::system("sigaction(SIGTERM)"))?;
    Ok(())
}

/// What the guard thread owns.
struct Guard {
    parent: OwnedFd,
    is_requested: Arc<AtomicBool>,
    stop: Arc<PipeReader>,
    stop_writer: PipeWriter,
    begun: PipeReader,
}

impl Guard {
    /// Sleeps until an ending begins, then kills the process when it takes too long.
    fn watch(mut self) {
        let mut deadline = None;
        loop {
            let [stopped, orphaned, begun] = self.wait(deadline);
            if orphaned && !stopped {
                // Wakes the main thread as SIGTERM would have.
                self.is_requested.store(true, Ordering::Relaxed);
                if self.stop_writer.write(&[1]).is_err() {
                    kill_this_process();
                }
            }
            if stopped || orphaned {
                sleep_until(in_ms(ABRUPT_END_MS));
                kill_this_process();
            }
            match deadline {
                None if begun => deadline = Some(in_ms(ORDERLY_END_MS)),
                Some(deadline) if clock::now() >= deadline => kill_this_process(),
                _ => {}
            }
        }
    }

    /// Waits until `deadline` or for what has not happened yet; says which of stop, parent's death
    /// and begin have.
    fn wait(&self, deadline: Option<Nanos>) -> [bool; 3] {
        let mut watched = [
            PollFd::new(&*self.stop, PollFlags::IN),
            PollFd::new(&self.parent, PollFlags::IN),
            PollFd::new(&self.begun, PollFlags::IN),
        ];
        // A begun ending stays readable: from then on only the other two and the time are news.
        let count = if deadline.is_some() { 2 } else { 3 };
        let timeout = deadline.map(|deadline| timespec(deadline.since(clock::now())));
        match poll(&mut watched[..count], timeout.as_ref()) {
            Ok(_) | Err(Errno::INTR) => {}
            Err(_) => kill_this_process(),
        }
        watched.map(|descriptor| !descriptor.revents().is_empty())
    }
}

/// Sleeps until `deadline`, through signals.
fn sleep_until(deadline: Nanos) {
    loop {
        let left_ns = deadline.since(clock::now());
        if left_ns == 0 {
            return;
        }
        match poll(&mut [], Some(&timespec(left_ns))) {
            Ok(_) | Err(Errno::INTR) => {}
            Err(_) => return,
        }
    }
}

/// Ends the process without running anything: exit handlers may be what hangs.
pub(in crate::process) fn kill_this_process() {
    // Sending SIGKILL to oneself is always permitted, and does not return.
    kill_process(getpid(), Signal::KILL).expect("invariant: a process may kill itself");
}

/// The point of the monotonic clock that lies `duration_ms` ahead.
fn in_ms(duration_ms: u64) -> Nanos {
    clock::now().plus(duration_ms * 1_000_000)
}

fn timespec(duration_ns: u64) -> Timespec {
    Timespec {
        tv_sec: (duration_ns / 1_000_000_000).cast_signed(),
        tv_nsec: (duration_ns % 1_000_000_000).cast_signed(),
    }
}
