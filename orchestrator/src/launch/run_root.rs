//! The place of a run on tmpfs: made private, locked for the orchestrator's life, removed with it.
//!
//! A run lives exactly as long as its lock is held. The kernel gives the lock back when the
//! orchestrator dies, however it dies; a lock that can be taken therefore belongs to a dead run, whose
//! files may go ([`clean_dead_runs`], which also runs at every start). Maker and cleaner may meet: a
//! maker that finds its lock taken, or its root replaced under it, tries another run id; a cleaner
//! removes only while it holds the lock. Not here: what removing a run's files takes
//! (`shared_types::transport::reclaim`), and finding processes that outlived their run (`leftovers`).

use super::leftovers::{self, Leftover};
use rustix::fs::{FlockOperation, Mode, chmod, flock, fstat, lstat, mkdir, stat};
use rustix::io::Errno;
use rustix::process::geteuid;
use rustix::rand::{GetRandomFlags, getrandom};
use shared_types::transport::RunPaths;
use shared_types::transport::reclaim::{ReclaimError, Removed, remove_run};
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

/// Run ids tried before giving up: each failure needs a cleaner at just that moment, or one chance in
/// four billion.
const ATTEMPTS: usize = 16;

/// Only the owner may look inside.
const PRIVATE: Mode = Mode::RWXU;

/// Why a run has no place.
#[derive(Debug, thiserror::Error)]
pub enum RunRootError {
    /// The base is not a directory, or one that somebody else could have put there.
    #[error(
        "`{}` {problem}; remove it, or set SLATESWARM_SHM to a directory of your own on tmpfs",
        base.display()
    )]
    UnsafeBase {
        /// The base.
        base: PathBuf,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// The kernel refused.
    #[error("{operation} `{}`: {source}", path.display())]
    System {
        /// What was tried.
        operation: &'static str,
        /// On what.
        path: PathBuf,
        /// What the kernel said.
        source: io::Error,
    },
    /// Every id that was tried was taken away by a cleaner.
    #[error("no run could be made below `{}` in {ATTEMPTS} attempts", base.display())]
    Contended {
        /// The base.
        base: PathBuf,
    },
}

impl RunRootError {
    /// Turns the error of `operation` on `path` into this one.
    fn system<E: Into<io::Error>>(operation: &'static str, path: &Path) -> impl FnOnce(E) -> Self {
        let path = path.to_owned();
        move |source| Self::System { operation, path, source: source.into() }
    }
}

/// The root of a living run. Dropping it removes everything that the run left behind, so it must be
/// dropped last: after the crafts are reaped and the transport is closed.
#[derive(Debug)]
pub struct RunRoot {
    paths: RunPaths,
    /// Held until the files are gone; `None` once they are.
    lock: Option<File>,
}

impl RunRoot {
    /// Makes the root of a new run with a random id below the base of this user.
    ///
    /// # Errors
    /// If the base is not safe or the kernel refuses.
    pub fn create() -> Result<Self, RunRootError> {
        Self::create_below(RunPaths::new(0).base())
    }

    /// Makes the root of a new run with a random id below `base`.
    ///
    /// # Errors
    /// If the base is not safe or the kernel refuses.
    pub fn create_below(base: &Path) -> Result<Self, RunRootError> {
        for _ in 0..ATTEMPTS {
            make_base(base)?;
            let paths = RunPaths::below(base, random_run_id()?);
            let root = paths.root();
            match mkdir(&root, PRIVATE) {
                Ok(()) => {}
                // The id is taken, or the last run's end has just removed the base.
                Err(Errno::EXIST | Errno::NOENT) => continue,
                Err(error) => return Err(RunRootError::system("cannot make", &root)(error)),
            }
            if let Some(lock) = take_lock(&paths)? {
                return Ok(Self { paths, lock: Some(lock) });
            }
        }
        Err(RunRootError::Contended { base: base.to_owned() })
    }

    /// Where everything of the run lies.
    #[must_use]
    pub const fn paths(&self) -> &RunPaths {
        &self.paths
    }

    /// The run's id.
    #[must_use]
    pub const fn run(&self) -> u64 {
        self.paths.run()
    }

    /// Removes everything that the run left behind, and says so if something cannot be removed.
    ///
    /// # Errors
    /// If something cannot be removed; the next start tries again.
    pub fn remove(mut self) -> Result<Removed, ReclaimError> {
        self.remove_files()
    }

    fn remove_files(&mut self) -> Result<Removed, ReclaimError> {
        match self.lock.take() {
            Some(_held_until_the_files_are_gone) => remove_run(&self.paths),
            None => Ok(Removed::default()),
        }
    }
}

impl Drop for RunRoot {
    fn drop(&mut self) {
        // Nobody is left to hear of a failure; the lock is given back all the same, so the next start
        // finds a dead run and removes it.
        let _cleaned_later = self.remove_files();
    }
}

/// What a cleaning found.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct CleanReport {
    /// Dead runs whose files are gone.
    pub removed: Vec<String>,
    /// Runs that an orchestrator holds; untouched.
    pub living: Vec<String>,
    /// Dead runs of which something could not be removed, and why.
    pub failed: Vec<(String, String)>,
    /// Processes of dead runs that did not end by themselves and were killed.
    pub killed: Vec<u32>,
}

/// Removes every dead run below `base`: processes first, then files. Never touches a living one.
///
/// # Errors
/// If the base cannot be read or is not safe.
pub fn clean_dead_runs(base: &Path) -> Result<CleanReport, RunRootError> {
    let mut report = CleanReport::default();
    match lstat(base) {
        Ok(_) => check_base(base)?,
        Err(Errno::NOENT) => return Ok(report),
        Err(error) => return Err(RunRootError::system("cannot look at", base)(error)),
    }
    let runs = RunPaths::list(base).map_err(RunRootError::system("cannot list", base))?;
    for paths in runs {
        let name = paths.root().file_name().map(|name| name.to_string_lossy().into_owned());
        let name = name.expect("invariant: a root has a name");
        let Some(_held_until_the_files_are_gone) = take_lock(&paths)? else {
            report.living.push(name);
            continue;
        };
        report.killed.extend(leftovers::end_all(&paths).iter().map(Leftover::pid));
        match remove_run(&paths) {
            Ok(_) => report.removed.push(name),
            Err(error) => report.failed.push((name, error.to_string())),
        }
    }
    Ok(report)
}

/// Makes the base, or checks the one that is there.
fn make_base(base: &Path) -> Result<(), RunRootError> {
    match mkdir(base, PRIVATE) {
        Ok(()) | Err(Errno::EXIST) => check_base(base),
        Err(error) => Err(RunRootError::system("cannot make", base)(error)),
    }
}

/// Refuses a base through which somebody else could reach the run: shared memory is for the user who
/// started the run alone, and everybody may write where the base lies.
fn check_base(base: &Path) -> Result<(), RunRootError> {
    let found = lstat(base).map_err(RunRootError::system("cannot look at", base))?;
    let refuse = |problem| Err(RunRootError::UnsafeBase { base: base.to_owned(), problem });
    if rustix::fs::FileType::from_raw_mode(found.st_mode) != rustix::fs::FileType::Directory {
        return refuse("is not a directory (links are not followed)");
    }
    if found.st_uid != geteuid().as_raw() {
        return refuse("belongs to another user");
    }
    if Mode::from_raw_mode(found.st_mode) != PRIVATE {
        chmod(base, PRIVATE).map_err(RunRootError::system("cannot make private", base))?;
    }
    Ok(())
}

/// A run id from the kernel, never from a seed: two runs of one seed must not meet.
fn random_run_id() -> Result<u64, RunRootError> {
    let mut bytes = [0; 8];
    getrandom(&mut bytes, GetRandomFlags::empty())
        .map_err(RunRootError::system("cannot draw a run id from", Path::new("getrandom")))?;
    Ok(u64::from_le_bytes(bytes))
}

/// Takes the lock of the run at `paths`; `None` if somebody holds it or has just removed the run.
fn take_lock(paths: &RunPaths) -> Result<Option<File>, RunRootError> {
    let path = paths.lock_file();
    let file = match File::options().create(true).append(true).open(&path) {
        Ok(file) => file,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(RunRootError::system("cannot open", &path)(error)),
    };
    match flock(&file, FlockOperation::NonBlockingLockExclusive) {
        Ok(()) => {}
        Err(Errno::WOULDBLOCK) => return Ok(None),
        Err(error) => return Err(RunRootError::system("cannot lock", &path)(error)),
    }
    // Whoever held the lock before may have removed the file while this one waited in line for it.
    let held = fstat(&file).map_err(RunRootError::system("cannot look at", &path))?;
    let is_there =
        stat(&path).is_ok_and(|there| (there.st_dev, there.st_ino) == (held.st_dev, held.st_ino));
    Ok(is_there.then_some(file))
}
