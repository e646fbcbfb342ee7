//! However a run ends: its exit code, what can be read afterwards, and that nothing is left.

use crate::invocation::{CraftSeen, Finished, Invocation, Place, RunsSeen, ignores};
use crate::shared::{is_gone, until};
use orchestrator::results::event::Event;
use orchestrator::supervision::heartbeat::SILENCE_NS;
use rustix::process::Signal;
use shared_types::transport::{RunPaths, clock};

/// A run that is under way: some epochs are done and many are to come.
struct UnderWay {
    place: Place,
    invocation: Invocation,
    runs: Vec<RunPaths>,
    crafts: Vec<CraftSeen>,
}

/// Longer than anybody waits.
const ENDLESS: &[&str] = &["compare", "--sizes", "5", "--no-timing", "--trials", "1000000"];

/// The same while turn times are measured.
const ENDLESS_TIMING: &[&str] =
    &["compare", "--sizes", "3", "--timing-only", "--set", "run.timing-epochs=1000000"];

impl UnderWay {
    fn of(words: &[&str]) -> Self {
        let place = Place::for_fleets();
        let invocation = place.start(words);
        place.await_epochs(5);
        let (runs, crafts) = (place.runs(), place.crafts());
        assert_eq!(runs.len(), 1);
        assert!(crafts.len() > 2 && !runs[0].segments().unwrap().is_empty());
        Self { place, invocation, runs, crafts }
    }

    /// Waits for the end with exit code `code`: nothing is left, and the results can be read.
    #[track_caller]
    fn ends(self, code: i32) -> (Place, Finished) {
        let Self { place, invocation, runs, crafts } = self;
        let finished = invocation.finish().expect_code(code);
        assert!(crafts.iter().all(|craft| is_gone(craft.pid)), "{crafts:?}");
        place.assert_nothing_left(&runs);
        assert_report_tells(&place, code);
        (place, finished)
    }
}

/// `report` prints what was measured before the end, and the record knows how the run ended.
#[track_caller]
fn assert_report_tells(place: &Place, code: i32) {
    let results = place.results().unwrap();
    assert_eq!(results.missing, []);
    assert_eq!(results.outcome().map(|outcome| i32::from(outcome.code())), Some(code));
    let report = place.run(&["report", "runs/latest"]).expect_code(0);
    assert!(report.stdout.contains("seed 1"), "{report}");
    let said = report.stdout.contains(&format!("exit code {code}"));
    assert_eq!(said, code != 0, "{report}");
}

#[test]
fn run_that_comes_to_its_end_leaves_nothing() {
    let place = Place::for_fleets();
    let mut invocation = place.start(&["run", "planetary-survey", "--trials", "3"]);
    let mut seen = RunsSeen::default();
    until("the end of the run", || {
        seen.look(&place);
        invocation.has_ended().then_some(())
    });
    let finished = invocation.finish().expect_code(0);
    assert_eq!(finished.stderr.lines().filter(|line| line.contains("lost")).count(), 0);
    let runs = seen.paths(&place);
    assert_eq!(runs.len(), 1);
    place.assert_nothing_left(&runs);
    assert_report_tells(&place, 0);
}

#[test]
fn interrupted_run_keeps_its_results_and_leaves_nothing() {
    for words in [ENDLESS, ENDLESS_TIMING] {
        let run = UnderWay::of(words);
        run.invocation.signal(Signal::INT);
        run.ends(130);
    }
}

#[test]
fn ctrl_c_of_a_terminal_reaches_the_crafts_too_and_changes_nothing() {
    let run = UnderWay::of(ENDLESS);
    run.invocation.signal_group(Signal::INT);
    let (place, finished) = run.ends(130);
    let lost = |event: &Event| matches!(event, Event::CraftLost { .. });
    assert!(!place.results().unwrap().events.iter().any(|line| lost(&line.event)), "{finished}");
}

#[test]
fn second_interrupt_ends_the_run_like_the_first() {
    let run = UnderWay::of(ENDLESS);
    run.invocation.signal_group(Signal::INT);
    run.invocation.signal_group(Signal::INT);
    run.ends(130);
}

#[test]
fn terminated_orchestrator_takes_its_crafts_with_it() {
    let run = UnderWay::of(ENDLESS);
    run.invocation.signal(Signal::TERM);
    run.ends(143);
}

#[test]
fn closed_terminal_ends_the_run() {
    let mut run = UnderWay::of(ENDLESS);
    // A terminal says so to the whole group, some of them twice.
    run.invocation.signal_group(Signal::HUP);
    run.invocation.signal_group(Signal::HUP);
    if ignores(std::process::id(), Signal::HUP) {
        // Started below `nohup`, and so is everything that the tests start.
        let epochs = run.place.epochs_done();
        run.place.await_epochs(epochs + 5);
        assert!(!run.invocation.has_ended());
        run.invocation.signal(Signal::TERM);
    }
    run.ends(143);
}

#[test]
fn time_limit_ends_the_run() {
    let run = UnderWay::of(&[ENDLESS, &["--time-limit-s", "2"]].concat());
    run.ends(124);
}

#[test]
fn stopped_craft_does_not_hold_up_the_end() {
    let run = UnderWay::of(ENDLESS);
    run.crafts[1].signal(Signal::STOP);
    until("the stop", || is_stopped(run.crafts[1].pid).then_some(()));
    run.invocation.signal(Signal::INT);
    run.ends(130);
}

#[test]
fn signals_while_the_fleet_starts_end_it_as_well() {
    for signal in [Signal::INT, Signal::TERM] {
        let place = Place::for_fleets();
        let invocation = place.start(&["compare", "--sizes", "30", "--trials", "1000000"]);
        until("the first craft", || (!place.crafts().is_empty()).then_some(()));
        let runs = place.runs();
        invocation.signal(signal);
        invocation.finish().expect_code(if signal == Signal::INT { 130 } else { 143 });
        place.assert_nothing_left(&runs);
    }
}

/// What `kill -9` of the orchestrator leaves is gone after `clean` or the next start.
#[track_caller]
fn check_killed_orchestrator(stops_a_craft: bool, cleaner: &[&str]) {
    let UnderWay { place, invocation, runs, crafts } = UnderWay::of(ENDLESS);
    if stops_a_craft {
        crafts[1].signal(Signal::STOP);
    }
    invocation.signal(Signal::KILL);
    invocation.finish().expect_signal(Signal::KILL);
    for craft in crafts.iter().skip(if stops_a_craft { 2 } else { 0 }) {
        until("the crafts to end by themselves", || is_gone(craft.pid).then_some(()));
    }
    assert_eq!(place.runs().len(), 1, "the dead run is still there");
    let killed = place.results().unwrap();
    assert_eq!(killed.outcome(), None);
    assert!(!killed.trials.is_empty());
    let report = place.run(&["report", "runs/latest"]).expect_code(0);
    assert!(report.stdout.contains("killed"), "{report}");
    let cleaned = place.run(cleaner).expect_code(0);
    assert!(crafts.iter().all(|craft| is_gone(craft.pid)), "{cleaned}");
    place.assert_nothing_left(&runs);
}

#[test]
fn killed_orchestrator_leaves_nothing_after_clean() {
    check_killed_orchestrator(false, &["clean"]);
}

#[test]
fn killed_orchestrator_leaves_nothing_after_the_next_start() {
    check_killed_orchestrator(false, &["run", "two-craft", "--trials", "1"]);
}

#[test]
fn stopped_craft_of_a_killed_orchestrator_is_cleaned_away() {
    check_killed_orchestrator(true, &["clean"]);
}

/// Whether process `pid` is stopped.
fn is_stopped(pid: u32) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    stat.rsplit_once(')').is_some_and(|(_, rest)| rest.trim_start().starts_with('T'))
}

#[test]
fn stopped_craft_is_paused_and_plays_on() {
    // Long turns, so that the stop falls into one.
    let words = ["compare", "--sizes", "5", "--no-timing", "--trials", "1000000", "--strategies"];
    let words = [&words[..], &["central,pipelined", "--set", "run.turn-limit-ms=400"]].concat();
    for wake in ["poll", "block"] {
        pause_and_continue(UnderWay::of(&[&words[..], &["--wake", wake]].concat()));
    }
}

fn pause_and_continue(run: UnderWay) {
    let craft = &run.crafts[1];
    craft.signal(Signal::STOP);
    until("the stop", || is_stopped(craft.pid).then_some(()));
    // Many times the limit of a turn, and longer than anybody who runs may be silent.
    let pause_ends = clock::now().plus(SILENCE_NS + 1_000_000_000);
    until("the pause", || (clock::now() >= pause_ends).then_some(()));
    let done = run.place.results().unwrap().events.len();
    craft.signal(Signal::CONT);
    run.place.await_epochs(done + 5);
    run.invocation.signal(Signal::INT);
    let (place, _) = run.ends(130);
    let events = place.results().unwrap().events;
    let is_taken_for_silent = |event: &Event| matches!(event, Event::CraftSilent { .. });
    assert!(!events.iter().any(|line| is_taken_for_silent(&line.event)), "{events:?}");
}
