//! The place in shared memory that a raw measurement uses, and its cleaning.
//!
//! By default there is one area per user, held by a lock on its directory for as long as a
//! measurement runs: two measurements would spoil each other, so the second waits. Whoever gets the lock
//! first removes what a killed predecessor left; on drop everything goes. The directory lies on tmpfs
//! because iceoryx2 creates many small files in it.

use super::RawError;
use iceoryx2::prelude::{Config, FileName, Path as IceoryxPath, SemanticString};
use rustix::fs::{FlockOperation, flock};
use rustix::io::Errno;
use std::fmt;
use std::fs::{self, DirBuilder, File};
use std::io;
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Where shared-memory objects appear as files.
const SHARED_MEMORY: &str = "/dev/shm";

/// Longest name of an area: directory and prefix both carry it and have to fit a socket address.
const NAME_BYTES_MAX: usize = 24;

/// What an area is called. Parent and children of a measurement share one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AreaName(String);

impl AreaName {
    /// The area that all measurements of this user share.
    #[must_use]
    pub fn of_this_user() -> Self {
        Self(format!("slateswarm-raw-{}", rustix::process::getuid().as_raw()))
    }

    fn root(&self) -> PathBuf {
        Path::new(SHARED_MEMORY).join(&self.0)
    }

    /// The socket that process `index` receives datagrams on.
    pub(super) fn socket(&self, index: u32) -> PathBuf {
        self.root().join(format!("datagrams-{index}"))
    }

    fn prefix(&self) -> String {
        format!("{}_", self.0)
    }

    /// What everybody in this area configures iceoryx2 with.
    ///
    /// # Errors
    /// If iceoryx2 does not accept the names.
    pub fn config(&self) -> Result<Config, RawError> {
        let root = IceoryxPath::new(self.root().as_os_str().as_encoded_bytes())
            .map_err(RawError::iceoryx("root path"))?;
        let prefix =
            FileName::new(self.prefix().as_bytes()).map_err(RawError::iceoryx("prefix"))?;
        let mut config = Config::default();
        config.global.set_root_path(&root);
        config.global.prefix = prefix;
        // Cleaning is ours alone; on each open it would cost a walk over all nodes.
        config.global.node.cleanup_dead_nodes_on_creation = false;
        config.global.node.cleanup_dead_nodes_on_destruction = false;
        config.global.service.cleanup_dead_nodes_on_open = false;
        Ok(config)
    }
}

impl fmt::Display for AreaName {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.0)
    }
}

impl FromStr for AreaName {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'-';
        if (1..=NAME_BYTES_MAX).contains(&name.len()) && name.bytes().all(is_plain) {
            Ok(Self(name.to_owned()))
        } else {
            Err(format!("an area has 1 to {NAME_BYTES_MAX} letters, digits and hyphens"))
        }
    }
}

/// An area that is locked.
#[derive(Debug)]
pub struct Area {
    name: AreaName,
    _lock: File,
}

impl Area {
    /// Claims the area `name`, empty. `on_wait` is called once if another measurement holds it; this call
    /// then waits for its end.
    ///
    /// # Errors
    /// If the directory cannot be made, locked or emptied, or belongs to somebody else.
    pub fn claim(name: &AreaName, on_wait: impl FnOnce()) -> Result<Self, RawError> {
        let root = name.root();
        let mut on_wait = Some(on_wait);
        let failed = |source| RawError::Area { path: root.display().to_string(), source };
        loop {
            make_directory(&root).map_err(failed)?;
            // A holder that ends removes the directory, at any point between these lines.
            let found = match fs::symlink_metadata(&root) {
                Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
                found => found.map_err(failed)?,
            };
            if !found.is_dir() || found.uid() != rustix::process::getuid().as_raw() {
                return Err(RawError::Foreign(root.display().to_string()));
            }
            let lock = match File::open(&root) {
                Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
                lock => lock.map_err(failed)?,
            };
            match flock(&lock, FlockOperation::NonBlockingLockExclusive) {
                Err(Errno::WOULDBLOCK) => {
                    on_wait.take().into_iter().for_each(|on_wait| on_wait());
                    flock(&lock, FlockOperation::LockExclusive)
                }
                locked => locked,
            }
            .map_err(|error| failed(error.into()))?;
            if is_same_file(&root, &lock) {
                remove_segments(&name.prefix()).map_err(failed)?;
                remove_contents(&root).map_err(failed)?;
                return Ok(Self { name: name.clone(), _lock: lock });
            }
        }
    }
}

impl Drop for Area {
    fn drop(&mut self) {
        // Nothing can be done about a failure here; the next claim cleans again and reports it.
        let _ = remove_segments(&self.name.prefix());
        let _ = fs::remove_dir_all(self.name.root());
    }
}

/// Makes the directory `root`, for this user alone, unless it exists.
fn make_directory(root: &Path) -> io::Result<()> {
    match DirBuilder::new().mode(0o700).create(root) {
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => Ok(()),
        made => made,
    }
}

/// Whether `path` still names the file that was opened.
fn is_same_file(path: &Path, opened: &File) -> bool {
    fs::metadata(path)
        .is_ok_and(|named| opened.metadata().is_ok_and(|own| named.ino() == own.ino()))
}

/// Removes every shared-memory object whose name begins with `prefix`.
fn remove_segments(prefix: &str) -> io::Result<()> {
    for entry in fs::read_dir(SHARED_MEMORY)? {
        let entry = entry?;
        if entry.file_name().as_encoded_bytes().starts_with(prefix.as_bytes()) {
            fs::remove_file(entry.path())?;
        }
    }
    Ok(())
}

/// Empties the directory `root` and keeps it, because its lock is held.
fn remove_contents(root: &Path) -> io::Result<()> {
    for entry in fs::read_dir(root)? {
        let entry = entry?;
        if entry.file_type()?.is_dir() {
            fs::remove_dir_all(entry.path())?;
        } else {
            fs::remove_file(entry.path())?;
        }
    }
    Ok(())
}
