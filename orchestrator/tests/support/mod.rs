//! What tests of real processes share, whichever test executable they are in: the machine-wide lock, a
//! base of their own, waiting with a bound.

use rustix::event::{Timespec, poll};
use shared_types::transport::clock;
use std::fs::File;

/// How long a test waits for something that must happen, before it fails instead of hanging, ns.
pub(crate) const PATIENCE_NS: u64 = 20_000_000_000;

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

/// Looks every millisecond whether `happened` says something; fails after [`PATIENCE_NS`].
pub(crate) fn until<T>(what: &str, mut happened: impl FnMut() -> Option<T>) -> T {
    let deadline = clock::now().plus(PATIENCE_NS);
    loop {
        if let Some(result) = happened() {
            return result;
        }
        assert!(clock::now() < deadline, "waited in vain: {what}");
        poll(&mut [], Some(&Timespec { tv_sec: 0, tv_nsec: 1_000_000 })).expect("sleep");
    }
}

/// Whether process `pid` runs no longer; one that nobody has reaped yet does not.
pub(crate) fn is_gone(pid: u32) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    stat.rsplit_once(')').is_none_or(|(_, rest)| rest.trim_start().starts_with(['Z', 'X']))
}
