//! Orchestrators that a campaign starts in order to kill them: where they live, and that they end with it.
//!
//! Such a one has a base of its own, so that what it leaves cannot be mistaken for anything else. The base
//! lies beside the campaign's and is named after it: should both be killed, [`clean_all`] finds it. Should
//! the campaign alone be killed, the orchestrator gets SIGTERM and ends its fleet as for anybody who asks.
//! Not here: starting it (`os_process`), and what is done to it (`campaign`).

use super::run_root::{CleanReport, RunRootError, clean_dead_runs};
use agent::process::startup::parent_is_alive;
use rustix::fs::lstat;
use rustix::process::{Signal, geteuid, set_parent_process_death_signal};
use std::path::{Path, PathBuf};

/// Names the process with which an orchestrator ends.
pub const PARENT_VARIABLE: &str = "SLATESWARM_PARENT";

/// Between the name of a base and the number of the process that has one beside it.
const SEPARATOR: char = '-';

/// The base beside `base` of what process `owner` starts; the next one has the same.
#[must_use]
pub fn base_beside(base: &Path, owner: u32) -> PathBuf {
    let mut name = base.as_os_str().to_owned();
    name.push(format!("{SEPARATOR}{owner:x}"));
    name.into()
}

/// Ends this process when the one that [`PARENT_VARIABLE`] names does, if it names one. To be called on the
/// main thread before anything is started.
///
/// # Errors
/// If that process is gone already, or the kernel refuses.
pub fn end_with_parent() -> Result<(), String> {
    let Some(parent) = std::env::var_os(PARENT_VARIABLE) else { return Ok(()) };
    set_parent_process_death_signal(Some(Signal::TERM))
        .map_err(|error| format!("prctl(PR_SET_PDEATHSIG) failed: {error}"))?;
    let number = parent.to_str().and_then(|parent| parent.parse().ok());
    match number {
        Some(number) if parent_is_alive(number) => Ok(()),
        _ => Err(format!(
            "{PARENT_VARIABLE} names {} and no living parent; campaigns set it, nobody else should",
            parent.display()
        )),
    }
}

/// Removes every dead run below `base` and below the bases beside it. Never touches a living one.
///
/// # Errors
/// If a base cannot be read or is not safe.
pub fn clean_all(base: &Path) -> Result<CleanReport, RunRootError> {
    let mut report = clean_dead_runs(base)?;
    for beside in bases_beside(base) {
        let CleanReport { removed, living, failed, killed } = clean_dead_runs(&beside)?;
        report.removed.extend(removed);
        report.living.extend(living);
        report.failed.extend(failed);
        report.killed.extend(killed);
        // One that was killed before it made a run has left its base alone; others are not empty.
        let _not_empty = std::fs::remove_dir(&beside);
    }
    Ok(report)
}

/// The bases of this user that somebody has beside `base`.
fn bases_beside(base: &Path) -> Vec<PathBuf> {
    let name = base.file_name().and_then(|name| name.to_str());
    let (Some(name), Some(parent)) = (name, base.parent()) else { return Vec::new() };
    let is_beside = |other: &Path| {
        let other = other.file_name().and_then(|other| other.to_str());
        let owner = other.and_then(|other| other.strip_prefix(name)?.strip_prefix(SEPARATOR));
        owner.is_some_and(|owner| u32::from_str_radix(owner, 16).is_ok())
    };
    let is_ours = |path: &Path| lstat(path).is_ok_and(|found| found.st_uid == geteuid().as_raw());
    let entries = std::fs::read_dir(parent).into_iter().flatten().flatten();
    let mut bases: Vec<PathBuf> = entries
        .map(|entry| entry.path())
        .filter(|path| is_beside(path) && is_ours(path) && path.is_dir())
        .collect();
    bases.sort();
    bases
}

#[cfg(test)]
mod tests {
    use super::{base_beside, bases_beside, clean_all};
    use shared_types::transport::RunPaths;
    use std::fs;

    #[test]
    fn only_what_is_named_after_a_base_lies_beside_it() {
        let place = tempfile::tempdir().expect("a folder");
        let base = place.path().join("slateswarm-1");
        let beside = base_beside(&base, 0x1f3a);
        assert_eq!(beside, place.path().join("slateswarm-1-1f3a"));
        for name in ["slateswarm-1", "slateswarm-10", "slateswarm-1-x", "slateswarm-1-", "other"] {
            fs::create_dir(place.path().join(name)).expect("made");
        }
        fs::write(base_beside(&base, 7), "no folder").expect("made");
        assert!(bases_beside(&base).is_empty());
        fs::create_dir(&beside).expect("made");
        assert_eq!(bases_beside(&base), [beside]);
    }

    #[test]
    fn dead_runs_beside_a_base_are_removed_with_those_below_it() {
        let place = tempfile::tempdir().expect("a folder");
        let base = place.path().join("b");
        let (other, empty) = (base_beside(&base, 41), base_beside(&base, 42));
        for paths in [RunPaths::below(&base, 1), RunPaths::below(&other, 2)] {
            fs::create_dir_all(paths.root()).expect("made");
        }
        fs::create_dir(&empty).expect("made");
        let report = clean_all(&base).expect("cleans");
        assert_eq!(report.removed, ["00000001", "00000002"]);
        assert!(!base.exists() && !other.exists() && !empty.exists());
        assert!(clean_all(&base).expect("nothing to do").removed.is_empty());
    }
}
