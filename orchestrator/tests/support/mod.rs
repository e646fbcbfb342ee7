//! What tests of real processes share, whichever test executable they are in: the machine-wide lock, a
//! base of their own, waiting with a bound.

use rustix::event::{Timespec, poll};
use std::fs::File;

/// Looks after which a test fails that waits for something that must happen, instead of hanging: a
/// minute, and longer on a host that lets nobody run.
const LOOKS_MAX: u32 = 60_000;

/// Held while real processes are tested: two fleets on one small machine slow each other down.
pub(crate) fn machine_wide_lock() -> File {
    let path = std::env::temp_dir().join("slateswarm-real-processes.lock");
    let file = File::options().create(true).append(true).open(path).expect("temporary directory");
    file.lock().expect("lock");
    file
}

/// A directory of its own on tmpfs, removed with everything in it.
pub(crate) fn temporary_base() -> tempfile::TempDir {
    tempfile::Builder::new().prefix("ss").rand_bytes(4).tempdir_in("/dev/shm").expect("tmpfs")
}

/// Looks every millisecond whether `happened` says something; fails after [`LOOKS_MAX`] looks.
pub(crate) fn until<T>(what: &str, happened: impl FnMut() -> Option<T>) -> T {
    until_else(happened, || what.to_owned())
}

/// The same for what takes a look to be told.
pub(crate) fn until_else<T>(
    mut happened: impl FnMut() -> Option<T>,
    what: impl FnOnce() -> String,
) -> T {
    for _ in 0..LOOKS_MAX {
        if let Some(result) = happened() {
            return result;
        }
        poll(&mut [], Some(&Timespec { tv_sec: 0, tv_nsec: 1_000_000 })).expect("sleep");
    }
    panic!("waited in vain: {}", what())
}

/// Whether process `pid` runs no longer; one that nobody has reaped yet does not.
pub(crate) fn is_gone(pid: u32) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    stat.rsplit_once(')').is_none_or(|(_, rest)| rest.trim_start().starts_with(['Z', 'X']))
}
