//! Where a run keeps its files, and which files in shared memory belong to it.
//!
//! Everything of a run lies below one root directory on tmpfs or carries one prefix in [`SHM`], the
//! directory of POSIX shared memory. Root and prefix both derive from the low 32 bits of the run id,
//! so that a root found on disk names the segments that belong to it; a run whose root is gone has
//! nothing left (the janitor removes the root last). Not here: removing anything (`reclaim`).

use crate::limits::{CREATION_PATIENCE_NS, RUN_PATH_BYTES_MAX};
use iceoryx2::config::Config;
use iceoryx2::prelude::{FileName, Path as IceoryxPath, SemanticString};
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Where Linux keeps POSIX shared memory.
pub const SHM: &str = "/dev/shm";

/// Overrides the directory below which runs keep their roots; for tests.
pub const BASE_VARIABLE: &str = "SLATESWARM_SHM";

/// Why a run cannot live at its paths.
#[derive(Debug, thiserror::Error)]
pub enum PathsError {
    /// Root and prefix would not fit a Unix socket address.
    #[error(
        "{needed} bytes of root and prefix, at most {RUN_PATH_BYTES_MAX} fit a socket address; \
         set {BASE_VARIABLE} to a shorter path"
    )]
    TooLong {
        /// Bytes of root and prefix.
        needed: usize,
    },
    /// The root is not a path that iceoryx2 accepts.
    #[error("`{0}` is not a valid root for shared memory")]
    Invalid(PathBuf),
}

/// Root directory, lock file and prefix of one run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RunPaths {
    run: u64,
    base: PathBuf,
}

impl RunPaths {
    /// The paths of `run`, below the base that [`BASE_VARIABLE`] names, else below a directory of
    /// this user in shared memory. Creates nothing.
    #[must_use]
    pub fn new(run: u64) -> Self {
        let base = std::env::var_os(BASE_VARIABLE).map_or_else(default_base, PathBuf::from);
        Self::below(base, run)
    }

    /// The paths of `run` below `base`.
    #[must_use]
    pub fn below(base: impl Into<PathBuf>, run: u64) -> Self {
        Self { run, base: base.into() }
    }

    /// The run id that these paths were made for.
    #[must_use]
    pub const fn run(&self) -> u64 {
        self.run
    }

    /// The directory that holds the roots of all runs of this user.
    #[must_use]
    pub fn base(&self) -> &Path {
        &self.base
    }

    /// The root directory of this run; it exists as long as anything of the run may be left.
    #[must_use]
    pub fn root(&self) -> PathBuf {
        self.base.join(self.short_name())
    }

    /// The file that the orchestrator holds locked for its life.
    #[must_use]
    pub fn lock_file(&self) -> PathBuf {
        self.root().join("lock")
    }

    /// The file in which every process of the run moves a counter of its own.
    #[must_use]
    pub fn beats_file(&self) -> PathBuf {
        self.root().join("beats")
    }

    /// How the name of every shared-memory file of this run begins.
    #[must_use]
    pub fn prefix(&self) -> String {
        format!("ss{}_", self.short_name())
    }

    /// The iceoryx2 configuration that all processes of the run share. Nobody reclaims dead nodes on
    /// the way: that is the janitor's work alone, and it would cost O(N^3) at the start.
    ///
    /// # Errors
    /// If root and prefix are longer than a socket address takes, or not valid.
    pub fn config(&self) -> Result<Config, PathsError> {
        let (root, prefix) = (self.root(), self.prefix());
        let needed = root.as_os_str().len() + prefix.len();
        if needed > RUN_PATH_BYTES_MAX {
            return Err(PathsError::TooLong { needed });
        }
        let root_path = IceoryxPath::new(root.as_os_str().as_encoded_bytes())
            .map_err(|_| PathsError::Invalid(root.clone()))?;
        let mut config = Config::default();
        config.global.set_root_path(&root_path);
        config.global.prefix =
            FileName::new(prefix.as_bytes()).map_err(|_| PathsError::Invalid(root))?;
        config.global.node.cleanup_dead_nodes_on_creation = false;
        config.global.node.cleanup_dead_nodes_on_destruction = false;
        config.global.service.cleanup_dead_nodes_on_open = false;
        config.global.creation_timeout = Duration::from_nanos(CREATION_PATIENCE_NS);
        Ok(config)
    }

    /// All runs of this user that left a root below `base`, living and dead, in order of their id.
    ///
    /// # Errors
    /// If the base exists and cannot be read.
    pub fn list(base: &Path) -> io::Result<Vec<Self>> {
        let mut runs: Vec<Self> = names_in(base)?
            .iter()
            .filter(|name| name.len() == SHORT_NAME_BYTES)
            .filter_map(|name| u64::from_str_radix(name, 16).ok())
            .map(|run| Self::below(base, run))
            .collect();
        runs.sort_by_key(|paths| paths.run);
        Ok(runs)
    }

    /// The shared-memory files with this run's prefix, sorted.
    ///
    /// # Errors
    /// If shared memory cannot be listed.
    pub fn segments(&self) -> io::Result<Vec<PathBuf>> {
        let prefix = self.prefix();
        let mut segments: Vec<PathBuf> = names_in(Path::new(SHM))?
            .into_iter()
            .filter(|name| name.starts_with(&prefix))
            .map(|name| Path::new(SHM).join(name))
            .collect();
        segments.sort();
        Ok(segments)
    }

    fn short_name(&self) -> String {
        format!("{:08x}", self.run & 0xffff_ffff)
    }
}

const SHORT_NAME_BYTES: usize = 8;

/// The base of this user's runs when nothing overrides it.
fn default_base() -> PathBuf {
    Path::new(SHM).join(format!("slateswarm-{}", rustix::process::getuid().as_raw()))
}

/// Names of the entries of `directory`; none if it does not exist.
fn names_in(directory: &Path) -> io::Result<Vec<String>> {
    let entries = match std::fs::read_dir(directory) {
        Ok(entries) => entries,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => return Err(error),
    };
    let mut names = Vec::new();
    for entry in entries {
        // A name that is not UTF-8 is none of ours.
        names.extend(entry?.file_name().into_string());
    }
    Ok(names)
}

#[cfg(test)]
mod tests {
    use super::{PathsError, RunPaths};
    use std::path::Path;

    #[test]
    fn root_and_prefix_carry_the_same_eight_digits() {
        let paths = RunPaths::below("/dev/shm/slateswarm-7", 0x1_0000_00ab);
        assert_eq!(paths.root(), Path::new("/dev/shm/slateswarm-7/000000ab"));
        assert_eq!(paths.lock_file(), Path::new("/dev/shm/slateswarm-7/000000ab/lock"));
        assert_eq!(paths.prefix(), "ss000000ab_");
    }

    #[test]
    fn configuration_uses_root_and_prefix_and_reclaims_nothing() {
        let config = RunPaths::below("/dev/shm/slateswarm-7", 3).config().expect("short enough");
        assert_eq!(config.global.root_path().to_string(), "/dev/shm/slateswarm-7/00000003");
        assert_eq!(config.global.prefix.to_string(), "ss00000003_");
        assert!(!config.global.node.cleanup_dead_nodes_on_creation);
        assert!(!config.global.node.cleanup_dead_nodes_on_destruction);
        assert!(!config.global.service.cleanup_dead_nodes_on_open);
    }

    #[test]
    fn a_base_that_no_socket_address_takes_is_refused_with_the_bytes_needed() {
        let base = format!("/tmp/{}", "x".repeat(60));
        let refused = RunPaths::below(&base, 0).config();
        assert!(matches!(refused, Err(PathsError::TooLong { needed: 85 })), "{refused:?}");
    }

    #[test]
    fn only_directories_named_like_runs_are_listed() {
        let base = std::env::temp_dir().join(format!("ss-list-{}", std::process::id()));
        for name in ["0000002a", "00000007", "notes", "123456789"] {
            std::fs::create_dir_all(base.join(name)).expect("temporary directory");
        }
        let listed = RunPaths::list(&base);
        std::fs::remove_dir_all(&base).expect("temporary directory");
        let runs: Vec<u64> = listed.expect("readable").iter().map(RunPaths::run).collect();
        assert_eq!(runs, [7, 42]);
        assert!(RunPaths::list(&base).expect("a missing base holds no run").is_empty());
    }
}
