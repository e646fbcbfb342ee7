//! What kills leave at moments that last microseconds, planted on purpose.
//!
//! A kill at such a moment is too rare to meet in a campaign of some hundred, and each of the janitor's
//! steps is there for one of them. So once a round, after a craft was killed and before the janitor comes,
//! the files are made that kills at all of these moments would have left: an empty segment on which
//! iceoryx2 may wait for ever, a service that was never finished and blocks its name, a tag that was never
//! finished, and things of a node that iceoryx2 does not know of. Without any one step the campaign is
//! broken.

use shared_types::transport::RunPaths;
use shared_types::transport::paths::SHM;
use shared_types::transport::reclaim::{UNFINISHED_AGE, processes_of};
use std::collections::BTreeSet;
use std::fs::{self, File, FileTimes};
use std::io;
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};

/// The point of such a kill.
pub(super) use crate::results::faults::CRASH_DEFECTS as POINT;

/// Permissions of a description or tag that is not complete.
const FILE_IN_THE_MAKING: u32 = 0o600;

/// A service that nobody has: names of descriptions are hashes.
const SERVICE: &str = "0123456789abcdef0123456789abcdef01234567.service";

/// Plants what process `victim` of the run at `paths`, which is dead, might have left. Says `false` and
/// plants nothing if it had no node or was not connected to anybody.
///
/// # Errors
/// If a file cannot be made.
pub(super) fn plant(paths: &RunPaths, victim: u32) -> io::Result<bool> {
    let segments = paths.segments()?;
    let ports: BTreeSet<u128> = segments.iter().filter_map(|path| port_of(path, victim)).collect();
    let nodes = paths.root().join("nodes");
    let Some(node) = node_of(&nodes, victim)?.filter(|_| !ports.is_empty()) else {
        return Ok(false);
    };
    let prefix = paths.prefix();
    let segment = |name: String| Path::new(SHM).join(format!("{prefix}{name}"));
    let number = number_of(victim);
    // Between a port of the victim and one of somebody who lives: has no size. Which of its ports it still
    // had is not to be seen here, and what those that it had dropped leave is waited for by nobody.
    let living = number_of(std::process::id());
    for port in ports {
        File::create(segment(format!("{port}_{living}.connection")))?;
    }
    let service =
        make_unfinished(&paths.root().join("services").join(format!("{prefix}{SERVICE}")))?;
    // From before: what is not swept is seen at once.
    let long_ago = service.metadata()?.modified()? - 2 * UNFINISHED_AGE;
    service.set_times(FileTimes::new().set_modified(long_ago))?;
    make_unfinished(&node.join(format!("{prefix}{number}.port_tag")))?;
    // A node and a connection that are written down nowhere.
    let orphan = nodes.join(number.to_string());
    fs::create_dir(&orphan)?;
    File::create(orphan.join("node.details"))?;
    fs::write(segment(format!("{number}_{}.connection", number + 1)), b"anything")?;
    Ok(true)
}

/// A number as iceoryx2 gives to ports and nodes of a process, and to no other.
fn number_of(process: u32) -> u128 {
    99 << 96 | u128::from(process) << 64 | 4_000_000_000
}

/// The port of `victim` from which the connection at `path` goes to another process.
fn port_of(path: &Path, victim: u32) -> Option<u128> {
    let name = path.file_name()?.to_str()?.strip_suffix(".connection")?;
    let mut ports = name.rsplitn(3, '_');
    let (_receiver, sender) = (ports.next()?, ports.next()?);
    let is_the_victims = processes_of(Path::new(sender)).eq([victim]);
    if is_the_victims { sender.parse().ok() } else { None }
}

/// The directory of the node of `victim`.
fn node_of(nodes: &Path, victim: u32) -> io::Result<Option<PathBuf>> {
    for entry in fs::read_dir(nodes)? {
        let path = entry?.path();
        let name = path.file_name().map(Path::new);
        if path.is_dir() && name.is_some_and(|name| processes_of(name).eq([victim])) {
            return Ok(Some(path));
        }
    }
    Ok(None)
}

fn make_unfinished(path: &Path) -> io::Result<File> {
    File::options().write(true).create_new(true).mode(FILE_IN_THE_MAKING).open(path)
}

#[cfg(test)]
mod tests {
    use super::{number_of, plant, port_of};
    use shared_types::transport::RunPaths;
    use std::path::Path;

    #[test]
    fn only_a_connection_from_the_victim_names_its_port() {
        let (victim, other) = (number_of(41), number_of(42));
        let of = |name: String| port_of(Path::new(&name), 41);
        assert_eq!(of(format!("/dev/shm/ss0000002a_{victim}_{other}.connection")), Some(victim));
        assert_eq!(of(format!("/dev/shm/ss0000002a_{other}_{victim}.connection")), None);
        assert_eq!(of(format!("/dev/shm/ss0000002a_{victim}.data")), None);
    }

    #[test]
    fn nothing_is_planted_for_who_left_nothing() {
        let base = tempfile::tempdir().expect("a folder");
        let paths = RunPaths::below(base.path(), 7);
        std::fs::create_dir_all(paths.root().join("nodes")).expect("made");
        assert!(!plant(&paths, 41).expect("looked"));
    }
}
