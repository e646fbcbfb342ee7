//! Files of a run as the janitor sees them: which there are, whose they are, and removing them.

use super::ReclaimError;
use crate::transport::paths::RunPaths;
use std::io;
use std::path::{Path, PathBuf};

/// What has become of the processes that a file's name speaks of, one of which made it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Makers {
    /// It speaks of none.
    Unnamed,
    /// All live, and finish what they have begun, however long they are stopped or get no core.
    Living,
    /// Some live, some are gone.
    SomeGone,
    /// All are gone: not there any more, or only as something to be reaped.
    Gone,
}

/// The processes that a file's path speaks of. A number of iceoryx2 stands alone between dots and
/// underscores; its bits 64 to 95 are the number of the process that made it.
pub(super) fn processes_of(path: &Path) -> impl Iterator<Item = u32> + '_ {
    let parts = path.iter().filter_map(|part| part.to_str());
    let words = parts.flat_map(|part| part.split(['.', '_']));
    words.filter_map(process_in)
}

/// The process in a number of iceoryx2; `None` if `word` is none.
fn process_in(word: &str) -> Option<u32> {
    let number: u128 = word.parse().ok()?;
    let process = u32::try_from(number >> 64 & u128::from(u32::MAX)).ok()?;
    (process != 0).then_some(process)
}

/// What has become of the processes that `path` speaks of.
pub(super) fn makers_of(path: &Path) -> Makers {
    let (mut living, mut gone) = (0, 0);
    for process in processes_of(path) {
        *(if is_gone(process) { &mut gone } else { &mut living }) += 1;
    }
    match (living, gone) {
        (0, 0) => Makers::Unnamed,
        (_, 0) => Makers::Living,
        (0, _) => Makers::Gone,
        _ => Makers::SomeGone,
    }
}

/// Whether `path` speaks of processes, and all of them are gone.
pub(super) fn is_of_the_dead(path: &Path) -> bool {
    makers_of(path) == Makers::Gone
}

fn is_gone(process: u32) -> bool {
    is_gone_below(Path::new("/proc"), process)
}

/// Whether `proc` says that `process` is gone. The state of a process is that of its first thread, which may
/// have ended while others go on and hold all that the process held; so of one that seems gone every thread
/// is asked.
fn is_gone_below(proc: &Path, process: u32) -> bool {
    let process = proc.join(process.to_string());
    let threads = || std::fs::read_dir(process.join("task")).into_iter().flatten().flatten();
    has_ended(&process) && threads().all(|thread| has_ended(&thread.path()))
}

/// Whether the file `stat` of a process or thread says that it has ended, or is not there.
fn has_ended(directory: &Path) -> bool {
    let stat = std::fs::read_to_string(directory.join("stat")).unwrap_or_default();
    // The name in parentheses may hold anything, so the state is what follows the last one.
    let state = stat.rsplit_once(')').and_then(|(_, rest)| rest.trim_start().chars().next());
    matches!(state, None | Some('Z' | 'X'))
}

/// The run's segments in shared memory.
pub(super) fn segments_of(paths: &RunPaths) -> Result<Vec<PathBuf>, ReclaimError> {
    let shared_memory = Path::new(crate::transport::paths::SHM);
    paths.segments().map_err(ReclaimError::io(shared_memory))
}

/// Where iceoryx2 keeps what it knows of the run's processes.
pub(super) fn nodes_of(paths: &RunPaths) -> PathBuf {
    paths.root().join("nodes")
}

/// Removes a file; `false` if somebody else was faster.
pub(super) fn remove_file(path: &Path) -> Result<bool, ReclaimError> {
    match std::fs::remove_file(path) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(ReclaimError::io(path)(error)),
    }
}

/// Everything below `directory` that is not a directory; nothing if it is not there.
pub(super) fn files_below(directory: &Path) -> Result<Vec<PathBuf>, ReclaimError> {
    let mut files = Vec::new();
    let mut directories = vec![directory.to_owned()];
    while let Some(directory) = directories.pop() {
        for (path, is_directory) in entries_of(&directory)? {
            if is_directory { &mut directories } else { &mut files }.push(path);
        }
    }
    Ok(files)
}

/// What lies in `directory`, and whether it is a directory; nothing if it is not there.
pub(super) fn entries_of(directory: &Path) -> Result<Vec<(PathBuf, bool)>, ReclaimError> {
    let entries = match std::fs::read_dir(directory) {
        Ok(entries) => entries,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => return Err(ReclaimError::io(directory)(error)),
    };
    entries
        .map(|entry| {
            let entry = entry.map_err(ReclaimError::io(directory))?;
            let is_directory = entry.file_type().is_ok_and(|kind| kind.is_dir());
            Ok((entry.path(), is_directory))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::{Makers, is_gone, is_gone_below, is_of_the_dead, makers_of, processes_of};
    use std::path::Path;

    /// A number as iceoryx2 makes them, of `process`.
    fn number(process: u32) -> u128 {
        7 << 96 | u128::from(process) << 64 | 123_456_789
    }

    #[test]
    fn names_tell_whose_a_file_is() {
        let (one, other) = (number(41), number(42));
        let named = |path: &str| processes_of(Path::new(path)).collect::<Vec<u32>>();
        assert_eq!(named(&format!("/dev/shm/ss00000001_{one}.data")), [41]);
        assert_eq!(named(&format!("/dev/shm/ss00000001_{one}_{other}.connection")), [41, 42]);
        assert_eq!(named(&format!("nodes/{other}/{one}.port_tag")), [42, 41]);
        let hash = "a1b2c3d4e5f60718293a4b5c6d7e8f9001122334";
        assert_eq!(named(&format!("services/ss00000001_{hash}.service")), [0; 0]);
        assert_eq!(named("nodes/17/lock.0_10_0"), [0; 0]);
    }

    #[test]
    fn a_process_whose_first_thread_alone_has_ended_lives() {
        let proc = tempfile::tempdir().expect("a folder");
        let say = |path: &str, state: char| {
            let directory = proc.path().join(path);
            std::fs::create_dir_all(&directory).expect("made");
            let stat = format!("41 (a ) b) {state} 1 41 41 0");
            std::fs::write(directory.join("stat"), stat).expect("written");
        };
        let is_gone = || is_gone_below(proc.path(), 41);
        assert!(is_gone());
        for path in ["41", "41/task/41"] {
            say(path, 'Z');
        }
        assert!(is_gone(), "it is only to be reaped");
        say("41/task/43", 'X');
        assert!(is_gone());
        for state in ['S', 'T', 'R', 'D'] {
            say("41/task/42", state);
            assert!(!is_gone());
        }
    }

    #[test]
    fn a_file_is_of_the_dead_only_if_nobody_it_names_lives() {
        let living = number(std::process::id());
        // No process has this number: the largest that Linux gives is 2^22.
        let dead = number(1 << 23);
        assert!(is_gone(1 << 23) && !is_gone(std::process::id()));
        let makers = |name: &str| makers_of(Path::new(name));
        assert_eq!(makers("x_lock"), Makers::Unnamed);
        assert_eq!(makers(&format!("x_{living}_{living}.connection")), Makers::Living);
        assert_eq!(makers(&format!("x_{living}_{dead}.connection")), Makers::SomeGone);
        assert_eq!(makers(&format!("x_{dead}_{dead}.connection")), Makers::Gone);
        assert!(is_of_the_dead(Path::new(&format!("x_{dead}.data"))));
        assert!(!is_of_the_dead(Path::new(&format!("x_{living}.data"))));
        assert!(!is_of_the_dead(Path::new(&format!("x_{dead}_{living}.connection"))));
        assert!(!is_of_the_dead(Path::new("x_lock")));
    }
}
