//! What the tests of launching and supervision share: roles under watch, a run of their own.

use crate::shared::until;
use agent::process::startup::AgentArguments;
use orchestrator::launch::os_process::{CraftErrors, Launcher};
use orchestrator::supervision::watch::{CraftEnded, Watch};
use shared_types::ids::{CraftId, Incarnation};
use shared_types::transport::{RunPaths, WakeMode};
use std::ffi::OsString;
use std::path::Path;

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
        beside: Vec::new(),
        doom: None,
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
