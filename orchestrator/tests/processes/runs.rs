//! Runs beside each other, dead runs and what cleaning does to them.

use crate::roles::{HANGING_CRAFT, say};
use crate::shared::{is_gone, temporary_base};
use crate::support::{arguments, launcher, line_of, next_end};
use orchestrator::launch::run_root::{RunRoot, RunRootError, clean_dead_runs};
use orchestrator::supervision::watch::Watch;
use rustix::process::{Pid, Signal, kill_process};
use shared_types::ids::CraftId;
use shared_types::transport::RunPaths;
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;

/// What the role `orchestrator` does: a run below the directory of `ready` with two crafts.
pub(crate) fn play_orchestrator(ready: &Path) {
    let root = RunRoot::create_below(ready.parent().expect("base")).expect("run");
    let crafts = [0, HANGING_CRAFT].map(|craft| arguments(root.paths(), craft));
    let crafts = launcher().spawn_all(crafts).expect("spawn");
    for craft in &crafts {
        line_of(&root.paths().root().join(format!("craft-{}", craft.craft())));
    }
    say(ready, root.run());
    // Killed while it holds both; nothing is dropped.
    std::mem::forget((root, crafts));
}

fn name(paths: &RunPaths) -> String {
    paths.root().file_name().unwrap().to_str().unwrap().to_owned()
}

pub(crate) fn living_runs_are_private_and_never_cleaned() {
    let base = temporary_base();
    let first = RunRoot::create_below(base.path()).unwrap();
    let second = RunRoot::create_below(base.path()).unwrap();
    assert_ne!(first.run(), second.run());
    let report = clean_dead_runs(base.path()).unwrap();
    assert_eq!(report.living.len(), 2);
    assert!(report.removed.is_empty() && report.failed.is_empty());
    for root in [base.path(), &first.paths().root()] {
        assert_eq!(std::fs::metadata(root).unwrap().permissions().mode() & 0o7777, 0o700);
    }
    let gone = second.paths().root();
    second.remove().unwrap();
    assert!(!gone.exists() && first.paths().root().exists());
    let base = base.path().to_owned();
    drop(first);
    assert!(!base.exists(), "the last run takes the base with it");
}

pub(crate) fn dead_run_is_cleaned_with_its_segments_and_stopped_craft() {
    let base = temporary_base();
    let mut watch = Watch::new().unwrap();
    let line = ["play".into(), "orchestrator".into(), base.path().join("run").into()];
    watch.add(launcher().spawn_program(line, CraftId(0)).unwrap()).unwrap();
    let dead = RunPaths::below(base.path(), line_of(&base.path().join("run")).parse().unwrap());
    let pid = Pid::from_raw(line_of(&dead.root().join("craft-0")).parse().unwrap()).unwrap();
    std::fs::remove_file(base.path().join("run")).unwrap();
    let segment = Path::new("/dev/shm").join(format!("{}segment", dead.prefix()));
    std::fs::write(&segment, "data").unwrap();
    let living = RunRoot::create_below(base.path()).unwrap();
    // A stopped craft does not hear that its orchestrator is gone.
    kill_process(pid, Signal::STOP).unwrap();
    watch.process(CraftId(0)).unwrap().signal(Signal::KILL).unwrap();
    next_end(&mut watch);
    let report = clean_dead_runs(base.path()).unwrap();
    assert_eq!(report.removed, [name(&dead)]);
    assert_eq!(report.living, [name(living.paths())]);
    let pid = pid.as_raw_nonzero().get().unsigned_abs();
    assert!(report.killed.contains(&pid), "{report:?}");
    assert!(!dead.root().exists() && !segment.exists());
    assert!(is_gone(pid));
}

pub(crate) fn root_without_a_lock_file_is_a_dead_run() {
    let base = temporary_base();
    let half_made = RunPaths::below(base.path(), 7);
    std::fs::create_dir(half_made.root()).unwrap();
    assert_eq!(clean_dead_runs(base.path()).unwrap().removed, ["00000007"]);
    assert!(!half_made.root().exists());
}

pub(crate) fn base_that_is_a_link_is_refused() {
    let base = temporary_base();
    let link = base.path().join("link");
    std::os::unix::fs::symlink("/dev/shm", &link).unwrap();
    for error in [RunRoot::create_below(&link).map(drop), clean_dead_runs(&link).map(drop)] {
        assert!(matches!(error, Err(RunRootError::UnsafeBase { .. })), "{error:?}");
    }
    let file = base.path().join("file");
    std::fs::write(&file, "").unwrap();
    assert!(matches!(RunRoot::create_below(&file), Err(RunRootError::UnsafeBase { .. })));
}
