//! The janitor: what dead processes leave in shared memory, and how it goes.
//!
//! iceoryx2 is not crash-safe by itself. A process killed between making a segment and sizing it
//! leaves an empty one, and whoever opens that waits for ever, iceoryx2's own clean-up included; one
//! killed while a service is made blocks its name; one killed while a tag is written makes the clean-up
//! fail, and later ones report success while they remove nothing; directories, monitors and segments of
//! the dead stay. So the order is: sweep what was never finished (`unfinished`), forget the tags that
//! the dead did not finish, let iceoryx2 free their places, remove by hand what is left (`dead`).
//! [`Steps`] names these steps, so that a test can show what happens without each. Once all processes of
//! a run are dead nothing needs to be understood any more: everything with the run's prefix and the
//! run's root goes ([`remove_run`]).
//!
//! Whose file it is stands in its name: iceoryx2 numbers ports and nodes with 128 bits that hold the
//! number of their process (`files`). Not here: who decides that a process or run is dead (the holder of
//! the run's lock), and descriptors that children inherit (the launcher).

mod dead;
mod files;
mod unfinished;

pub use unfinished::sweep_unfinished;

use super::clock;
use super::paths::RunPaths;
use files::{files_below, remove_file, segments_of};
use rustix::event::{Timespec, poll};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// How old an unfinished file must be before it counts as left behind: finishing one takes
/// microseconds.
pub const UNFINISHED_AGE: Duration = Duration::from_millis(200);

/// Between two attempts of [`reclaim_within`], ns.
const PAUSE_NS: i64 = 2_000_000;

/// Between two sweeps beside them, ns.
const SWEEP_PAUSE_NS: i64 = 20_000_000;

/// Which steps the janitor takes among living processes. All, except in tests that show what each is
/// for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Steps {
    /// Sweeps what was never finished.
    pub unfinished: bool,
    /// Forgets the tags that the dead did not finish.
    pub tags: bool,
    /// Lets iceoryx2 take the dead off the services.
    pub places: bool,
    /// Removes by hand what is left of the dead.
    pub by_hand: bool,
}

impl Steps {
    /// What everybody takes.
    pub const ALL: Self = Self { unfinished: true, tags: true, places: true, by_hand: true };
}

impl Default for Steps {
    fn default() -> Self {
        Self::ALL
    }
}

/// What was removed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Removed {
    /// Files in shared memory with the run's prefix.
    pub segments: usize,
    /// Files below the run's root.
    pub files: usize,
    /// Dead processes of which nothing is left.
    pub nodes: usize,
    /// Attempts before at which iceoryx2 could not clean up, and which by rights never are.
    pub refusals: usize,
}

/// Why something could not be removed.
#[derive(Debug, thiserror::Error)]
pub enum ReclaimError {
    /// A file that cannot be listed or removed.
    #[error("cannot reclaim `{}`: {source}", path.display())]
    Io {
        /// Which file or directory.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// Dead processes that iceoryx2 cannot clean up, or list.
    #[error("cannot free what {count} dead processes held: {detail}")]
    Nodes {
        /// How many.
        count: usize,
        /// What iceoryx2 said to the last of them.
        detail: String,
    },
    /// Files that look unfinished and are too young to tell; to be tried again after
    /// [`UNFINISHED_AGE`].
    #[error("{count} files may still be in the making")]
    Pending {
        /// How many.
        count: usize,
    },
    /// The run's paths are not usable.
    #[error(transparent)]
    Paths(#[from] super::paths::PathsError),
}

impl ReclaimError {
    fn io(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Io { path, source }
    }
}

/// Removes everything of a run: its segments, then its root, then the base if no other run is left
/// in it. All processes of the run must be dead, and the caller must hold the run's lock. Opens
/// nothing, so nothing that is damaged can stop it.
///
/// # Errors
/// Names the first file that cannot be removed.
pub fn remove_run(paths: &RunPaths) -> Result<Removed, ReclaimError> {
    let mut removed = Removed::default();
    for segment in segments_of(paths)? {
        removed.segments += usize::from(remove_file(&segment)?);
    }
    let root = paths.root();
    removed.files = files_below(&root)?.len();
    match std::fs::remove_dir_all(&root) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            return Err(ReclaimError::io(&root)(error));
        }
        _ => {}
    }
    match std::fs::remove_dir(paths.base()) {
        Err(error)
            if !matches!(
                error.kind(),
                io::ErrorKind::NotFound | io::ErrorKind::DirectoryNotEmpty
            ) =>
        {
            Err(ReclaimError::io(paths.base())(error))
        }
        _ => Ok(removed),
    }
}

/// Frees what dead processes of a living run hold, so that a restarted craft finds its places, and
/// removes what they left. One attempt, of milliseconds; call it again as long as files are pending, or
/// use [`reclaim_within`].
///
/// # Errors
/// If a file cannot be removed or is pending, or a dead process cannot be taken off its services.
pub fn reclaim_dead_nodes(paths: &RunPaths, steps: Steps) -> Result<Removed, ReclaimError> {
    let swept = if steps.unfinished { sweep_unfinished(paths)? } else { Removed::default() };
    let mut removed = dead::bury(paths, steps)?;
    removed.segments += swept.segments;
    removed.files += swept.files;
    Ok(removed)
}

/// The same, again and again until it is done, for at most `limit_ns`. Who dies meanwhile may leave a file
/// on which iceoryx2 waits for ever, so a second thread goes on sweeping. Never to be called on a loop
/// that a measured run waits for: that loop may itself be waiting on a file that this removes.
///
/// # Errors
/// What the last attempt said.
pub fn reclaim_within(
    paths: &RunPaths,
    steps: Steps,
    limit_ns: u64,
) -> Result<Removed, ReclaimError> {
    let given_up = clock::now().plus(limit_ns);
    let is_done = AtomicBool::new(false);
    std::thread::scope(|scope| {
        if steps.unfinished && steps.places {
            scope.spawn(|| {
                while !is_done.load(Ordering::Relaxed) {
                    pause(SWEEP_PAUSE_NS);
                    // What fails here fails in the attempts, too, and is told there.
                    let _told_elsewhere = sweep_unfinished(paths);
                }
            });
        }
        let mut refusals = 0;
        let ended = loop {
            let attempt = reclaim_dead_nodes(paths, steps);
            if attempt.is_ok() || clock::now() >= given_up {
                break attempt.map(|removed| Removed { refusals, ..removed });
            }
            refusals += usize::from(matches!(attempt, Err(ReclaimError::Nodes { .. })));
            pause(PAUSE_NS);
        };
        is_done.store(true, Ordering::Relaxed);
        ended
    })
}

/// Sleeps; one that a signal cuts short is as good.
fn pause(duration_ns: i64) {
    let _slept = poll(&mut [], Some(&Timespec { tv_sec: 0, tv_nsec: duration_ns }));
}

/// Files that belong to processes that are gone, and to nobody else, and those that nobody will finish:
/// none after the janitor was there.
///
/// # Errors
/// If something cannot be listed.
pub fn left_of_the_dead(paths: &RunPaths) -> Result<Vec<PathBuf>, ReclaimError> {
    let mut left = dead::left_of_the_dead(paths)?;
    left.extend(unfinished::left_unfinished(paths)?);
    left.sort_unstable();
    left.dedup();
    Ok(left)
}

/// The numbers of the processes that the name of a file of iceoryx2 speaks of.
pub fn processes_of(path: &Path) -> impl Iterator<Item = u32> + '_ {
    files::processes_of(path)
}
