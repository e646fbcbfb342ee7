//! What somebody began to make and never finished: segments that are empty or may not be read yet,
//! descriptions of services that may still be written.
//!
//! iceoryx2 says by permissions that something is finished: a segment gets the right to read last, a file
//! loses the right to write. Whose it is stands in the name: what only the living can have made is left to
//! them, for one that was stopped or got no core in the middle goes on with it, and would then share it with
//! nobody; what only the dead can have made needs no age. Of the rest finishing takes microseconds, so age
//! tells what was left behind.

use super::files::{Makers, files_below, makers_of, remove_file, segments_of};
use super::{ReclaimError, Removed, UNFINISHED_AGE};
use crate::transport::paths::RunPaths;
use std::fs::Metadata;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};

/// Removes segments and files of a run that were never finished and are left behind. Safe while the run
/// lives.
///
/// # Errors
/// Names the first file that cannot be removed, or says that some are too young to tell.
pub fn sweep_unfinished(paths: &RunPaths) -> Result<Removed, ReclaimError> {
    let mut removed = Removed::default();
    let mut pending = 0;
    for segment in segments_of(paths)? {
        match judge(&segment, is_still_made) {
            Verdict::LeftBehind => removed.segments += usize::from(remove_file(&segment)?),
            Verdict::Young => pending += 1,
            Verdict::Kept => {}
        }
    }
    for file in descriptions_of(paths)? {
        match judge(&file, is_still_written) {
            Verdict::LeftBehind => removed.files += usize::from(remove_file(&file)?),
            Verdict::Young => pending += 1,
            Verdict::Kept => {}
        }
    }
    if pending == 0 { Ok(removed) } else { Err(ReclaimError::Pending { count: pending }) }
}

/// What a sweep would remove now.
pub(super) fn left_unfinished(paths: &RunPaths) -> Result<Vec<PathBuf>, ReclaimError> {
    let is_left = |path: &PathBuf, is_unfinished: fn(&Metadata) -> bool| {
        matches!(judge(path, is_unfinished), Verdict::LeftBehind)
    };
    let mut left = segments_of(paths)?;
    left.retain(|segment| is_left(segment, is_still_made));
    let descriptions = descriptions_of(paths)?;
    left.extend(descriptions.into_iter().filter(|file| is_left(file, is_still_written)));
    Ok(left)
}

/// The descriptions of services. Tags, which lie among the nodes, are left behind with their node or not
/// at all.
fn descriptions_of(paths: &RunPaths) -> Result<Vec<PathBuf>, ReclaimError> {
    files_below(&paths.root().join("services"))
}

/// Permissions of a segment until it may be read.
const SEGMENT_IN_THE_MAKING: u32 = 0o200;

/// Permissions of a description or tag until it is complete.
const FILE_IN_THE_MAKING: u32 = 0o600;

/// Whether a segment has no size yet, or may not be read yet.
fn is_still_made(found: &Metadata) -> bool {
    found.len() == 0 || mode_of(found) == SEGMENT_IN_THE_MAKING
}

/// Whether a description or tag is not complete.
pub(super) fn is_still_written(found: &Metadata) -> bool {
    mode_of(found) == FILE_IN_THE_MAKING
}

fn mode_of(found: &Metadata) -> u32 {
    found.permissions().mode() & 0o777
}

/// What follows from a look at a file.
enum Verdict {
    /// Finished, or gone, or still in the hands of somebody who lives.
    Kept,
    /// Unfinished, and it may be that somebody is finishing it.
    Young,
    /// Unfinished for good.
    LeftBehind,
}

fn judge(path: &Path, is_unfinished: impl Fn(&Metadata) -> bool) -> Verdict {
    let Some(found) = std::fs::symlink_metadata(path).ok().filter(is_unfinished) else {
        return Verdict::Kept;
    };
    match makers_of(path) {
        Makers::Living => return Verdict::Kept,
        Makers::Gone => return Verdict::LeftBehind,
        Makers::SomeGone | Makers::Unnamed => {}
    }
    // A time that lies ahead is a clock that was set back: as old as now.
    let age = found.modified().ok().and_then(|touched| touched.elapsed().ok());
    if age.is_some_and(|age| age >= UNFINISHED_AGE) { Verdict::LeftBehind } else { Verdict::Young }
}
