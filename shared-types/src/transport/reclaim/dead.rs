//! What dead processes hold in a living fleet: places in services, tags, monitors, segments.

use super::files::{entries_of, files_below, is_of_the_dead, nodes_of, remove_file, segments_of};
use super::unfinished::is_still_written;
use super::{ReclaimError, Removed, Steps};
use crate::transport::paths::RunPaths;
use iceoryx2::node::{Node, NodeState, NodeView};
use iceoryx2::prelude::{CallbackProgression, LogLevel, ipc, set_log_level};
use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};

/// Frees and removes everything that dead processes of the run hold, as far as `steps` says. What was
/// never finished must have been swept: iceoryx2's part waits for ever on an empty segment.
///
/// Every step is about the same processes: those that are dead now. Of one that dies meanwhile a later step
/// would remove by hand what an earlier one has not freed yet, and its places would be lost.
pub(super) fn bury(paths: &RunPaths, steps: Steps) -> Result<Removed, ReclaimError> {
    bury_those(&of_the_dead(paths)?, paths, steps)
}

/// The same for the processes that `dead`, as of [`of_the_dead`], speaks of.
fn bury_those(
    dead: &BTreeSet<PathBuf>,
    paths: &RunPaths,
    steps: Steps,
) -> Result<Removed, ReclaimError> {
    let mut removed = Removed::default();
    if steps.tags {
        removed.files += forget_unfinished_tags(dead, paths)?;
    }
    let mut freed = BTreeSet::new();
    if steps.places {
        freed = free_places(dead, paths)?;
    }
    removed.nodes = freed.len();
    if steps.by_hand {
        remove_what_is_left(dead, &freed, paths, &mut removed)?;
    }
    Ok(removed)
}

/// Entries of processes that are gone: of nodes, of the run's root, of shared memory.
fn of_the_dead(paths: &RunPaths) -> Result<BTreeSet<PathBuf>, ReclaimError> {
    let entries = [entries_of(&nodes_of(paths))?, entries_of(&paths.root())?].into_iter().flatten();
    let all = entries.map(|(entry, _)| entry).chain(segments_of(paths)?);
    Ok(all.filter(|entry| is_of_the_dead(entry)).collect())
}

/// Removes the unfinished tags of `dead` processes. They finish nothing, however young their files
/// are, and one such tag makes iceoryx2 give up half-way and never try again.
fn forget_unfinished_tags(
    dead: &BTreeSet<PathBuf>,
    paths: &RunPaths,
) -> Result<usize, ReclaimError> {
    let mut removed = 0;
    for (node, is_directory) in entries_of(&nodes_of(paths))? {
        if !is_directory || !dead.contains(&node) {
            continue;
        }
        for tag in files_below(&node)? {
            if std::fs::symlink_metadata(&tag).is_ok_and(|found| is_still_written(&found)) {
                removed += usize::from(remove_file(&tag)?);
            }
        }
    }
    Ok(removed)
}

/// Lets iceoryx2 take every process among `dead` off the services; returns their numbers. One that has
/// no details was killed before it was a node: it has no port and no place, and iceoryx2 would look for it
/// at its default paths.
fn free_places(
    dead: &BTreeSet<PathBuf>,
    paths: &RunPaths,
) -> Result<BTreeSet<String>, ReclaimError> {
    set_log_level(LogLevel::Fatal);
    let config = paths.config()?;
    let mut found = Vec::new();
    Node::<ipc::Service>::list(&config, |state| {
        if let NodeState::Dead(view) = state {
            found.push(view);
        }
        CallbackProgression::Continue
    })
    .map_err(|error| ReclaimError::Nodes { count: 0, detail: format!("{error:?}") })?;
    let numbers: BTreeSet<String> =
        dead.iter().filter_map(|entry| number_in(entry, paths)).collect();
    let (mut freed, mut failed, mut detail) = (BTreeSet::new(), 0, String::new());
    for view in found {
        let number = view.id().value().to_string();
        if view.details().is_none() || !numbers.contains(&number) {
            continue;
        }
        match view.try_remove_stale_resources() {
            Ok(()) => {
                freed.insert(number);
            }
            Err(error) => {
                failed += 1;
                detail = error.to_string();
            }
        }
    }
    if failed == 0 { Ok(freed) } else { Err(ReclaimError::Nodes { count: failed, detail }) }
}

/// Removes the directories, monitors and segments among `dead`: of processes that iceoryx2 does not know,
/// or of which it left something.
fn remove_what_is_left(
    dead: &BTreeSet<PathBuf>,
    freed: &BTreeSet<String>,
    paths: &RunPaths,
    removed: &mut Removed,
) -> Result<(), ReclaimError> {
    let mut orphans = BTreeSet::new();
    for (entry, is_directory) in entries_of(&nodes_of(paths))? {
        if !dead.contains(&entry) {
            continue;
        }
        orphans.extend(number_in(&entry, paths));
        if is_directory {
            for file in files_below(&entry)? {
                removed.files += usize::from(remove_file(&file)?);
            }
            remove_directory(entry)?;
        } else {
            removed.files += usize::from(remove_file(&entry)?);
        }
    }
    removed.nodes += orphans.difference(freed).count();
    for segment in segments_of(paths)? {
        if dead.contains(&segment) {
            removed.segments += usize::from(remove_file(&segment)?);
        }
    }
    for (file, is_directory) in entries_of(&paths.root())? {
        if !is_directory && dead.contains(&file) {
            removed.files += usize::from(remove_file(&file)?);
        }
    }
    Ok(())
}

/// The number of the node that an entry of [`nodes_of`] belongs to.
fn number_in(entry: &Path, paths: &RunPaths) -> Option<String> {
    let name = entry.file_name()?.to_str()?;
    let name = name.strip_prefix(&paths.prefix()).unwrap_or(name);
    Some(name.split('.').next()?.to_owned())
}

fn remove_directory(directory: PathBuf) -> Result<(), ReclaimError> {
    match std::fs::remove_dir(&directory) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            Err(ReclaimError::io(&directory)(error))
        }
        _ => Ok(()),
    }
}

/// What is there of processes that are gone, and of nobody else.
pub(super) fn left_of_the_dead(paths: &RunPaths) -> Result<Vec<PathBuf>, ReclaimError> {
    let files = segments_of(paths)?.into_iter().chain(files_below(&paths.root())?);
    Ok(files.filter(|file| is_of_the_dead(file)).collect())
}

#[cfg(test)]
mod tests {
    use super::{Steps, bury_those, nodes_of, of_the_dead};
    use crate::transport::paths::RunPaths;
    use std::collections::BTreeSet;
    use std::fs::{self, File, Permissions};
    use std::os::unix::fs::PermissionsExt as _;

    #[test]
    fn who_dies_while_others_are_buried_keeps_everything_until_the_next_time() {
        let base = tempfile::tempdir().expect("a folder");
        let paths = RunPaths::below(base.path(), 5);
        // No process has this number: the largest that Linux gives is 2^22.
        let node = nodes_of(&paths).join((7_u128 << 96 | 1 << 87 | 3).to_string());
        fs::create_dir_all(&node).expect("planted");
        let tag = node.join("unfinished.port_tag");
        File::create(&tag).expect("planted");
        fs::set_permissions(&tag, Permissions::from_mode(0o600)).expect("planted");
        let steps = Steps { places: false, ..Steps::ALL };
        let removed = bury_those(&BTreeSet::new(), &paths, steps).expect("nothing to do");
        assert_eq!((removed.files, removed.nodes), (0, 0));
        assert!(tag.exists(), "it was not dead when this began");
        let dead = of_the_dead(&paths).expect("listable");
        let removed = bury_those(&dead, &paths, steps).expect("removes");
        assert_eq!((removed.files, removed.nodes), (1, 1));
        assert!(!node.exists());
    }
}
