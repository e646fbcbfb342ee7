//! A craft's first acts as a process, and the promise that it ends.
//!
//! [`take_first_steps`] runs before anything else of the process. It ties the craft's life to its
//! parent three times over, because each tie alone has a hole: `PR_SET_PDEATHSIG` misses a parent that
//! died before it was set (closed by the comparison with the expected parent), belongs to the thread
//! that spawned, and is of no use to a craft that never looks at its signals; so a small guard thread
//! watches a pidfd of the parent and the craft's own stop descriptor, and kills the process when an
//! ending that has begun is not over after a grace. What `alarm(2)` would do, without a handler.
//!
//! Not here: what the command line of `agent` looks like ([`arguments`]), the craft's loop, and closing
//! inherited descriptors: the launcher marks all of its own close-on-exec before it spawns, which is
//! sound where closing by number is not.

pub mod arguments;
mod guard;
#[cfg(test)]
mod tests;

pub use arguments::{AgentArguments, ArgumentError};
pub(super) use guard::kill_this_process;
pub use guard::{ABRUPT_END_MS, Ending, ORDERLY_END_MS};

use rustix::fs::{FlockOperation, flock};
use rustix::io::Errno;
use rustix::process::{Pid, Signal, getppid, set_parent_process_death_signal};
use rustix::thread::{CpuSet, sched_setaffinity, set_current_timer_slack, set_name};
use shared_types::transport::paths::RunPaths;
use std::fs::File;
use std::io;
use std::num::NonZeroU64;
use std::path::PathBuf;

/// Why a craft cannot start.
#[derive(Debug, thiserror::Error)]
pub enum StartupError {
    /// The process that spawned the craft has already ended, or somebody else started it.
    #[error(
        "the orchestrator (process {expected}) is gone: `agent` is started by `slateswarm run` \
         and `slateswarm compare`, never by hand"
    )]
    Orphaned {
        /// The parent that the command line names.
        expected: u32,
    },
    /// No orchestrator holds the run's lock.
    #[error("no run lives at {}: `agent` is started by the orchestrator, never by hand", root.display())]
    NoRun {
        /// Where the run was looked for.
        root: PathBuf,
    },
    /// The kernel refused one of the first acts.
    #[error("{operation} failed: {source}")]
    System {
        /// What was tried.
        operation: &'static str,
        /// What the kernel said.
        source: io::Error,
    },
}

impl StartupError {
    /// Turns the error of `operation` into this one.
    fn system<E: Into<io::Error>>(operation: &'static str) -> impl FnOnce(E) -> Self {
        move |source| Self::System { operation, source: source.into() }
    }
}

/// Ties the process to its parent, makes it deaf to the terminal's signals, sharpens its timers and
/// puts it on its cores. From here on the process ends when its parent does, whatever it is doing.
///
/// # Errors
/// If the parent is already gone, no run lives at the base, or the kernel refuses; the process must end
/// at once.
pub fn take_first_steps(arguments: &AgentArguments) -> Result<Ending, StartupError> {
    set_parent_process_death_signal(Some(Signal::TERM))
        .map_err(StartupError::system("prctl(PR_SET_PDEATHSIG)"))?;
    let parent = parent_of(arguments.parent_pid)?;
    let paths = RunPaths::below(&arguments.base, arguments.run);
    if !run_is_alive(&paths) {
        return Err(StartupError::NoRun { root: paths.root() });
    }
    if !arguments.cores.is_empty() {
        confine_to(&arguments.cores)?;
    }
    let ending = guard::install(parent)?;
    // Had the parent ended meanwhile, the guard might watch a stranger with the same number.
    parent_of(arguments.parent_pid)?;
    // Executed through a link, the process would be called after the link.
    set_name(c"slateswarm").map_err(StartupError::system("prctl(PR_SET_NAME)"))?;
    // A sleeping craft wakes when it asked to, not up to 50 us (the kernel's default slack) later.
    set_current_timer_slack(NonZeroU64::new(1))
        .map_err(StartupError::system("prctl(PR_SET_TIMERSLACK)"))?;
    Ok(ending)
}

/// Whether the process that spawned this one still lives: an orphan has another parent.
#[must_use]
pub fn parent_is_alive(parent_pid: u32) -> bool {
    getppid().is_some_and(|parent| parent.as_raw_nonzero().get().cast_unsigned() == parent_pid)
}

/// Whether an orchestrator holds the lock of the run: one that can be taken belongs to a dead run.
#[must_use]
pub fn run_is_alive(paths: &RunPaths) -> bool {
    File::open(paths.lock_file()).is_ok_and(|file| {
        // Closing the file gives back what this took from a dead run.
        matches!(flock(&file, FlockOperation::NonBlockingLockShared), Err(Errno::WOULDBLOCK))
    })
}

/// The parent named on the command line, if it is the one that the process has.
fn parent_of(parent_pid: u32) -> Result<Pid, StartupError> {
    getppid()
        .filter(|_| parent_is_alive(parent_pid))
        .ok_or(StartupError::Orphaned { expected: parent_pid })
}

/// Lets the calling thread run on `cores` only.
fn confine_to(cores: &[u32]) -> Result<(), StartupError> {
    let mut set = CpuSet::new();
    for &core in cores.iter().filter(|&&core| (core as usize) < CpuSet::MAX_CPU) {
        set.set(core as usize);
    }
    sched_setaffinity(None, &set).map_err(StartupError::system("sched_setaffinity"))
}
