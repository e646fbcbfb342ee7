//! What the tests share: the machine-wide lock, waiting with a bound, a run of their own.

use agent::process::startup::AgentArguments;
use orchestrator::launch::os_process::{CraftErrors, Launcher};
use orchestrator::supervision::watch::{CraftEnded, Watch};
use rustix::event::{Timespec, poll};
use shared_types::ids::{CraftId, Incarnation};
use shared_types::transport::{RunPaths, WakeMode, clock};
use std::ffi::OsString;
use std::fs::File;
use std::path::Path;

/// How long a test waits for something that must happen, before it fails instead of hanging, ns.
pub(crate) const PATIENCE_NS: u64 = 20_000_000_000;

/// Held while real processes are tested: two fleets on one small machine slow each other down.
pub(crate) fn machine_wide_lock() -> File {
    let path = std::env::temp_dir().join("slateswarm-real-processes.lock");
    let file = File::options().create(true).append(true).open(path).expect("temporary directory");
    file.lock().expect("lock");
    file
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

/// Waits until everybody in `watch` has ended; says how, in order of the crafts.
pub(crate) fn all_ends(watch: &mut Watch) -> Vec<CraftEnded> {
    let mut ends: Vec<CraftEnded> = Vec::new();
    until("all processes to end", || {
        ends.extend(watch.poll().expect("watch"));
        watch.is_empty().then_some(())
    });
    ends.sort_by_key(|ended| ended.craft);
    ends
}

/// Waits for one end, of whichever of several processes it is.
pub(crate) fn next_end(watch: &mut Watch) -> CraftEnded {
    let mut ends = until("a process to end", || {
        Some(watch.poll().expect("watch")).filter(|ends| !ends.is_empty())
    });
    assert_eq!(ends.len(), 1, "one end was expected: {ends:?}");
    ends.remove(0)
}

/// A launcher of this test executable.
pub(crate) fn launcher() -> Launcher {
    Launcher::new(std::env::current_exe().expect("own path"), CraftErrors::Kept)
}

/// A watch over one process that plays `role`.
pub(crate) fn watch_role(role: &str) -> Watch {
    watch_roles(&[role])
}

/// A watch over crafts 0, 1, ... that play `roles`, once each of them has started to play.
pub(crate) fn watch_roles(roles: &[&str]) -> Watch {
    let directory = tempfile::tempdir().expect("temporary directory");
    let mut watch = Watch::new().expect("watch");
    for (number, role) in (0..).zip(roles) {
        let ready = directory.path().join(format!("{number}"));
        let line = ["play".into(), OsString::from(role), ready.clone().into()];
        let process = launcher().spawn_program(line, CraftId(number)).expect("spawn");
        watch.add(process).expect("watch");
        until("the role to begin", || ready.exists().then_some(()));
    }
    watch
}

/// The arguments of craft `craft` of this process in the run at `paths`.
pub(crate) fn arguments(paths: &RunPaths, craft: u32) -> AgentArguments {
    AgentArguments {
        run: paths.run(),
        base: paths.base().to_owned(),
        craft: CraftId(craft),
        craft_count: 4,
        incarnation: Incarnation(0),
        parent_pid: std::process::id(),
        wake: WakeMode::Adaptive,
        cores: Vec::new(),
    }
}

/// What `path` says, once it says a whole line.
pub(crate) fn line_of(path: &Path) -> String {
    until("a line in a file", || {
        std::fs::read_to_string(path).ok().filter(|text| text.ends_with('\n'))
    })
    .trim()
    .to_owned()
}

/// Whether process `pid` runs no longer; one that nobody has reaped yet does not.
pub(crate) fn is_gone(pid: u32) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    stat.rsplit_once(')').is_none_or(|(_, rest)| rest.trim_start().starts_with(['Z', 'X']))
}
