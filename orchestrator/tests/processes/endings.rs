//! How crafts and fleets end, asked to and not.

use crate::roles::{HANGING_CRAFT, REFUSED};
use crate::shared::{is_gone, temporary_base, until};
use crate::support::{all_ends, arguments, launcher, line_of, next_end, watch_role, watch_roles};
use orchestrator::launch::craft_process::HowEnded;
use orchestrator::launch::run_root::RunRoot;
use orchestrator::outcome::Outcome;
use orchestrator::supervision::shutdown::{Graces, end_fleet};
use orchestrator::supervision::signals::{Signals, Urgency};
use orchestrator::supervision::watch::Watch;
use rustix::process::{Signal, getpid, kill_process};
use shared_types::ids::CraftId;
use shared_types::transport::RunPaths;

/// Long enough for whoever ends by himself on a busy machine; nobody in a test waits it out.
const LONG: Graces = Graces { orderly_ms: 20_000, terminate_ms: 20_000, kill_ms: 20_000 };

pub(crate) fn obedient_crafts_end_orderly() {
    let mut watch = watch_roles(&["quit", "quit", "quit"]);
    let report = end_fleet(&mut watch, LONG, None).unwrap();
    assert!(report.is_orderly() && watch.is_empty(), "{report:?}");
    assert_eq!(report.ended.len(), 3);
}

pub(crate) fn stragglers_are_terminated_and_then_killed() {
    let mut watch = watch_roles(&["quit", "sleep", "deaf"]);
    let graces = Graces { orderly_ms: 200, terminate_ms: 200, ..LONG };
    let mut report = end_fleet(&mut watch, graces, None).unwrap();
    assert!(!report.is_orderly() && watch.is_empty());
    report.ended.sort_by_key(|ended| ended.craft);
    let ends: Vec<HowEnded> = report.ended.iter().map(|ended| ended.how).collect();
    assert_eq!(ends, [HowEnded::Exited(0), HowEnded::Killed(15), HowEnded::Killed(9)]);
    assert_eq!(report.terminated, [CraftId(1), CraftId(2)]);
    assert_eq!(report.killed, [CraftId(2)]);
    assert_eq!(report.left, []);
}

pub(crate) fn stopped_craft_does_not_hold_up_the_end() {
    let mut watch = watch_role("sleep");
    watch.process(CraftId(0)).unwrap().signal(Signal::STOP).unwrap();
    let report = end_fleet(&mut watch, LONG, None).unwrap();
    assert_eq!(report.terminated, [CraftId(0)]);
    assert_eq!(report.killed, [], "SIGCONT lets it hear SIGTERM");
    assert_eq!(report.ended[0].how, HowEnded::Killed(15));
}

pub(crate) fn second_signal_cuts_the_graces() {
    let mut signals = Signals::install().unwrap();
    assert_eq!(signals.poll().unwrap(), None);
    kill_process(getpid(), Signal::TERM).unwrap();
    let request = until("the signal", || signals.poll().unwrap());
    assert_eq!((request.urgency, request.outcome), (Urgency::Orderly, Outcome::Terminated));
    kill_process(getpid(), Signal::INT).unwrap();
    let mut watch = watch_role("sleep");
    let report = end_fleet(&mut watch, LONG, Some(&mut signals)).unwrap();
    assert_eq!((report.terminated, report.killed), (vec![], vec![CraftId(0)]));
    let request = signals.poll().unwrap().unwrap();
    assert_eq!((request.urgency, request.outcome), (Urgency::Immediate, Outcome::Terminated));
}

pub(crate) fn crafts_end_when_their_orchestrator_is_killed() {
    let base = temporary_base();
    let mut watch = Watch::new().unwrap();
    let line = ["play".into(), "orchestrator".into(), base.path().join("run").into()];
    watch.add(launcher().spawn_program(line, CraftId(0)).unwrap()).unwrap();
    let run = line_of(&base.path().join("run")).parse().unwrap();
    let root = RunPaths::below(base.path(), run).root();
    // One craft that waits for its end, one that hangs and never looks.
    let crafts = [0, HANGING_CRAFT].map(|craft| line_of(&root.join(format!("craft-{craft}"))));
    watch.process(CraftId(0)).unwrap().signal(Signal::KILL).unwrap();
    assert_eq!(next_end(&mut watch).how, HowEnded::Killed(9));
    for pid in crafts {
        let pid = pid.parse().unwrap();
        until("the craft to end", || is_gone(pid).then_some(()));
    }
}

pub(crate) fn craft_hears_the_orchestrator_and_not_the_terminal() {
    let base = temporary_base();
    let root = RunRoot::create_below(base.path()).unwrap();
    let mut watch = Watch::new().unwrap();
    for process in launcher().spawn_all([arguments(root.paths(), 1)]).unwrap() {
        watch.add(process).unwrap();
    }
    line_of(&root.paths().root().join("craft-1"));
    let process = watch.process(CraftId(1)).unwrap();
    let name = std::fs::read_to_string(format!("/proc/{}/comm", process.pid())).unwrap();
    assert_eq!(name.trim(), "slateswarm");
    let slack = std::fs::read_to_string(format!("/proc/{}/timerslack_ns", process.pid())).unwrap();
    assert_eq!(slack.trim(), "1");
    for signal in [Signal::INT, Signal::HUP, Signal::TERM] {
        process.signal(signal).unwrap();
    }
    let ended = next_end(&mut watch);
    assert_eq!(ended.how, HowEnded::Exited(0), "{}", ended.said);
}

pub(crate) fn craft_refuses_a_dead_run_and_a_foreign_parent() {
    let base = temporary_base();
    let root = RunRoot::create_below(base.path()).unwrap();
    let foreign = {
        let mut arguments = arguments(root.paths(), 0);
        arguments.parent_pid = 1;
        arguments
    };
    let dead = arguments(&RunPaths::below(base.path(), root.run() ^ 1), 1);
    let mut watch = Watch::new().unwrap();
    for process in launcher().spawn_all([foreign, dead]).unwrap() {
        watch.add(process).unwrap();
    }
    let ends = all_ends(&mut watch);
    assert!(ends.iter().all(|ended| ended.how == HowEnded::Exited(REFUSED.into())), "{ends:?}");
    assert!(ends[0].said.contains("(process 1) is gone"), "{}", ends[0].said);
    assert!(ends[1].said.contains("no run lives at"), "{}", ends[1].said);
}
