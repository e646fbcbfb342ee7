//! The janitor: what dead processes leave in shared memory, and how it goes.
//!
//! iceoryx2 is not crash-safe by itself. A process killed between making a segment and sizing it
//! leaves an empty one, and whoever opens that loops for ever, iceoryx2's own clean-up included; one
//! killed while a tag is written makes that clean-up fail. So the order is: sweep what is unfinished
//! ([`sweep_unfinished`]), then let iceoryx2 free what a dead process held in a living fleet
//! ([`reclaim_dead_nodes`]). Once all processes of a run are dead nothing needs to be understood any
//! more: everything with the run's prefix and the run's root goes ([`remove_run`]). Not here: who
//! decides that a process or run is dead (the holder of the run's lock).

use super::paths::RunPaths;
use iceoryx2::node::{Node, NodeState, NodeView};
use iceoryx2::prelude::{CallbackProgression, LogLevel, ipc, set_log_level};
use std::fs::Metadata;
use std::io;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// How old an unfinished file must be before it counts as left behind: finishing one takes
/// microseconds.
pub const UNFINISHED_AGE: Duration = Duration::from_millis(200);

/// What was removed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Removed {
    /// Files in shared memory with the run's prefix.
    pub segments: usize,
    /// Files below the run's root.
    pub files: usize,
    /// Dead processes whose slots were freed.
    pub nodes: usize,
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

/// Removes segments and tags of a run that were never finished and are older than
/// [`UNFINISHED_AGE`]: empty or write-only segments, write-only files below the root. Safe while the
/// run lives.
///
/// # Errors
/// Names the first file that cannot be removed, or says that some are too young to tell.
pub fn sweep_unfinished(paths: &RunPaths) -> Result<Removed, ReclaimError> {
    let mut removed = Removed::default();
    let mut pending = 0;
    for segment in segments_of(paths)? {
        match age_of(&segment, |found| found.len() == 0 || is_write_only(found)) {
            Some(Age::LeftBehind) => removed.segments += usize::from(remove_file(&segment)?),
            Some(Age::Young) => pending += 1,
            None => {}
        }
    }
    for file in files_below(&paths.root())? {
        match age_of(&file, is_write_only) {
            Some(Age::LeftBehind) => removed.files += usize::from(remove_file(&file)?),
            Some(Age::Young) => pending += 1,
            None => {}
        }
    }
    if pending == 0 { Ok(removed) } else { Err(ReclaimError::Pending { count: pending }) }
}

/// Frees what dead processes of a living run hold, so that a restarted craft finds its slots: sweeps
/// first, then lets iceoryx2 clean up every dead node. Takes milliseconds; never call it on the
/// loop that a measured run waits for. Call it again as long as files are pending.
///
/// # Errors
/// If a file cannot be removed or is pending, or a dead node stays.
pub fn reclaim_dead_nodes(paths: &RunPaths) -> Result<Removed, ReclaimError> {
    set_log_level(LogLevel::Fatal);
    let config = paths.config()?;
    let mut removed = sweep_unfinished(paths)?;
    let mut dead = Vec::new();
    Node::<ipc::Service>::list(&config, |state| {
        if let NodeState::Dead(view) = state {
            dead.push(view);
        }
        CallbackProgression::Continue
    })
    .map_err(|error| ReclaimError::Nodes { count: 0, detail: format!("{error:?}") })?;
    let (mut failed, mut detail) = (0, String::new());
    for view in dead {
        let number = view.id().value().to_string();
        removed.files += forget_unfinished_tags(paths, &number)?;
        if view.details().is_none() {
            // Killed before it was a node: it has no port and no slot, and iceoryx2 would look for it
            // at its default paths.
            removed.files += remove_node_files(paths, &number)?;
            removed.nodes += 1;
            continue;
        }
        match view.try_remove_stale_resources() {
            Ok(()) => removed.nodes += 1,
            Err(error) => {
                failed += 1;
                detail = error.to_string();
            }
        }
    }
    if failed == 0 { Ok(removed) } else { Err(ReclaimError::Nodes { count: failed, detail }) }
}

/// Removes the unfinished tags of the dead node `number`. The dead finish nothing, however young
/// their files are, and one such tag makes iceoryx2 give up half-way and never try again.
fn forget_unfinished_tags(paths: &RunPaths, number: &str) -> Result<usize, ReclaimError> {
    let mut removed = 0;
    for file in files_below(&nodes_of(paths).join(number))? {
        if age_of(&file, is_write_only).is_some() {
            removed += usize::from(remove_file(&file)?);
        }
    }
    Ok(removed)
}

/// Removes all files of the dead node `number`: its directory, and its monitor files beside it.
fn remove_node_files(paths: &RunPaths, number: &str) -> Result<usize, ReclaimError> {
    let (nodes, mut removed) = (nodes_of(paths), 0);
    let directory = nodes.join(number);
    let monitor = format!("{}{number}.", paths.prefix());
    for file in files_below(&nodes)? {
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        if file.starts_with(&directory) || name.starts_with(&monitor) {
            removed += usize::from(remove_file(&file)?);
        }
    }
    match std::fs::remove_dir(&directory) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            Err(ReclaimError::io(&directory)(error))
        }
        _ => Ok(removed),
    }
}

/// Where iceoryx2 keeps what it knows of the run's processes.
fn nodes_of(paths: &RunPaths) -> PathBuf {
    paths.root().join("nodes")
}

fn segments_of(paths: &RunPaths) -> Result<Vec<PathBuf>, ReclaimError> {
    paths.segments().map_err(ReclaimError::io(Path::new(super::paths::SHM)))
}

/// A file that iceoryx2 has made and not finished: it gives the right to read last.
fn is_write_only(found: &Metadata) -> bool {
    const WRITE_ONLY: u32 = 0o200;
    found.permissions().mode() & 0o777 == WRITE_ONLY
}

/// How long ago an unfinished file was touched.
enum Age {
    Young,
    LeftBehind,
}

/// The age of an unfinished file, `None` for a finished one or one that has just gone.
fn age_of(path: &Path, is_unfinished: impl Fn(&Metadata) -> bool) -> Option<Age> {
    let found = std::fs::symlink_metadata(path).ok().filter(is_unfinished)?;
    let touched = found.modified().ok()?;
    // A time that lies ahead is a clock that was set back: as old as now.
    let is_old = touched.elapsed().is_ok_and(|age| age >= UNFINISHED_AGE);
    Some(if is_old { Age::LeftBehind } else { Age::Young })
}

/// Removes a file; `false` if somebody else was faster.
fn remove_file(path: &Path) -> Result<bool, ReclaimError> {
    match std::fs::remove_file(path) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(ReclaimError::io(path)(error)),
    }
}

/// Everything below `directory` that is not a directory; nothing if it is not there.
fn files_below(directory: &Path) -> Result<Vec<PathBuf>, ReclaimError> {
    let mut files = Vec::new();
    let mut directories = vec![directory.to_owned()];
    while let Some(directory) = directories.pop() {
        let entries = match std::fs::read_dir(&directory) {
            Ok(entries) => entries,
            Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
            Err(error) => return Err(ReclaimError::io(&directory)(error)),
        };
        for entry in entries {
            let entry = entry.map_err(ReclaimError::io(&directory))?;
            let is_directory = entry.file_type().is_ok_and(|kind| kind.is_dir());
            if is_directory { &mut directories } else { &mut files }.push(entry.path());
        }
    }
    Ok(files)
}
