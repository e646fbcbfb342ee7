//! A process as the supervisor sees it.

use crate::shared::{is_gone, until};
use crate::support::{next_end, watch_role, watch_roles};
use orchestrator::launch::craft_process::{HowEnded, SAID_BYTES_MAX};
use orchestrator::launch::os_process::{CraftErrors, Launcher};
use rustix::process::Signal;
use shared_types::ids::CraftId;

pub(crate) fn killed_process_is_noticed_through_its_pidfd() {
    let mut watch = watch_roles(&["sleep", "sleep"]);
    assert_eq!(watch.poll().unwrap(), []);
    watch.process(CraftId(1)).unwrap().signal(Signal::KILL).unwrap();
    let ended = next_end(&mut watch);
    assert_eq!((ended.craft, ended.how), (CraftId(1), HowEnded::Killed(9)));
    assert_eq!(ended.how.to_string(), "killed by signal 9 (SIGKILL)");
    assert!(watch.process(CraftId(1)).is_none() && watch.process(CraftId(0)).is_some());
}

pub(crate) fn stopped_process_is_paused_and_never_reported_dead() {
    let mut watch = watch_role("sleep");
    let craft = CraftId(0);
    assert!(!watch.process(craft).unwrap().is_stopped());
    watch.process(craft).unwrap().signal(Signal::STOP).unwrap();
    until("the stop", || watch.process(craft).unwrap().is_stopped().then_some(()));
    assert_eq!(watch.poll().unwrap(), []);
    watch.process(craft).unwrap().signal(Signal::CONT).unwrap();
    until("going on", || (!watch.process(craft).unwrap().is_stopped()).then_some(()));
    assert_eq!(watch.poll().unwrap(), []);
}

pub(crate) fn end_is_reported_with_what_the_process_said() {
    let mut watch = watch_role("fail");
    let ended = next_end(&mut watch);
    assert_eq!((ended.how, ended.said.as_str()), (HowEnded::Exited(7), "no fuel\n"));
    assert_eq!(ended.how.to_string(), "exit code 7");
    assert!(watch.is_empty());
}

pub(crate) fn process_that_says_too_much_is_cut_and_never_blocked() {
    let mut watch = watch_role("babble");
    let ended = next_end(&mut watch);
    assert_eq!(ended.how, HowEnded::Exited(0));
    let dropped = format!("[{} more bytes were dropped]", 1_000_000 - SAID_BYTES_MAX);
    assert!(ended.said.trim_end().ends_with(&dropped), "{}", &ended.said[SAID_BYTES_MAX..]);
}

pub(crate) fn dropped_watch_leaves_no_process() {
    let watch = watch_roles(&["sleep", "deaf"]);
    let pids: Vec<u32> = watch.living().map(|process| process.pid()).collect();
    drop(watch);
    for pid in pids {
        assert!(is_gone(pid), "process {pid} is still there");
    }
}

pub(crate) fn no_descriptor_is_inherited() {
    let file = tempfile::tempfile().unwrap();
    // A duplicate has no close-on-exec mark: as the transport's descriptors, a child would get it.
    let _leaking = rustix::io::dup(&file).unwrap();
    let mut watch = watch_role("descriptors");
    let ended = next_end(&mut watch);
    let numbers: Vec<&str> = ended.said.lines().filter_map(|line| line.split(' ').next()).collect();
    // The fourth is the directory that is being read.
    let expected: Vec<String> = (0..4).map(|number| format!("/proc/self/fd/{number}")).collect();
    assert_eq!(numbers, expected, "{}", ended.said);
    assert!(ended.said.contains("/proc/self/fd/0 /dev/null"));
}

pub(crate) fn executable_that_does_not_exist_is_named() {
    let launcher = Launcher::new("/no/such/program", CraftErrors::Kept);
    let error = launcher.spawn_program([], CraftId(5)).unwrap_err();
    let text = error.to_string();
    assert!(text.contains("craft 5") && text.contains("/no/such/program"), "{text}");
}
