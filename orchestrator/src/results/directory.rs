//! Where the directory of a run, or of a sweep, is made, and what points at it.

use super::provenance::Provenance;
use super::store::{LATEST_LINK, StoreError};
use std::path::{Path, PathBuf};

/// Runs of one scenario and seed that may start within one second.
const SAME_SECOND_MAX: u32 = 1000;

/// Where a run's directory is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place<'a> {
    /// Below this directory, as `<scenario>/<stamp>-<seed>`, with `latest` pointing at it.
    Below(&'a Path),
    /// Here, in a directory that is empty or does not exist.
    Exactly(&'a Path),
}

/// Makes the directory of a run.
///
/// # Errors
/// If it cannot be made, or is not empty.
pub(super) fn make_directory(
    place: Place<'_>,
    provenance: &Provenance,
) -> Result<PathBuf, StoreError> {
    match place {
        Place::Exactly(path) => {
            let unwritable = |source| StoreError::Unwritable { path: path.to_owned(), source };
            std::fs::create_dir_all(path).map_err(unwritable)?;
            if std::fs::read_dir(path).map_err(unwritable)?.next().is_some() {
                return Err(StoreError::NotEmpty { path: path.to_owned() });
            }
            Ok(path.to_owned())
        }
        Place::Below(root) => {
            let parent = root.join(directory_name(&provenance.scenario));
            let unwritable =
                |path: &Path, source| StoreError::Unwritable { path: path.to_owned(), source };
            std::fs::create_dir_all(&parent).map_err(|source| unwritable(&parent, source))?;
            let name = format!("{}-{}", provenance.stamp(), provenance.seed);
            (1..=SAME_SECOND_MAX)
                .find_map(|copy| {
                    let suffix = if copy == 1 { String::new() } else { format!("-{copy}") };
                    let path = parent.join(format!("{name}{suffix}"));
                    match std::fs::create_dir(&path) {
                        Ok(()) => Some(Ok(path)),
                        Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => None,
                        Err(error) => Some(Err(unwritable(&path, error))),
                    }
                })
                .unwrap_or(Err(StoreError::NotEmpty { path: parent.join(name) }))
        }
    }
}

/// A scenario's name as one component of a path.
fn directory_name(scenario: &str) -> String {
    let name: String = scenario
        .chars()
        .map(|sign| if sign.is_ascii_alphanumeric() || "-_.".contains(sign) { sign } else { '-' })
        .collect();
    let name = name.trim_matches('.');
    if name.is_empty() || name == LATEST_LINK {
        format!("scenario-{name}")
    } else {
        name.to_owned()
    }
}

/// Makes `root/latest` a relative link to `directory`, in one step for whoever looks.
pub(super) fn point_latest_at(root: &Path, directory: &Path) -> std::io::Result<()> {
    let target = directory.strip_prefix(root).unwrap_or(directory);
    let temporary = root.join(format!(".{LATEST_LINK}-{}", std::process::id()));
    match std::fs::remove_file(&temporary) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(error),
        _ => {}
    }
    std::os::unix::fs::symlink(target, &temporary)?;
    std::fs::rename(&temporary, root.join(LATEST_LINK))
}
