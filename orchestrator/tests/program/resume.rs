//! A run that was killed goes on where it stood, and in the end cannot be told from one that was not.

use crate::invocation::Place;
use crate::shared::until;
use orchestrator::results::event::Event;
use orchestrator::results::read::RunData;
use rustix::process::Signal;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Three fleets of some tens of epochs each.
const COUNTS: &[&str] = &[
    "compare",
    "--sizes",
    "2,3,5",
    "--no-timing",
    "--trials",
    "12",
    "--strategies",
    "full,boundary",
];

/// Six fleets: two sizes, three blocks.
const TIMES: &[&str] = &[
    "compare",
    "--sizes",
    "2,3",
    "--blocks",
    "3",
    "--trials",
    "2",
    "--strategies",
    "null,boundary",
    "--set",
    "run.timing-epochs=2",
    "--set",
    "run.timing-turns=20",
];

/// How often `wanted` happened in the newest run.
fn count(place: &Place, wanted: fn(&Event) -> bool) -> usize {
    let events = place.results().map_or_else(Vec::new, |run| run.events);
    events.iter().filter(|line| wanted(&line.event)).count()
}

fn is_fleet_done(event: &Event) -> bool {
    matches!(event, Event::FleetDone { .. })
}

/// An instant of a run: so many fleets are complete, and of the next one so many epochs are done.
#[derive(Clone, Copy)]
struct Instant {
    fleets: usize,
    epochs: usize,
}

impl Instant {
    fn is_reached(self, place: &Place) -> bool {
        let events = place.results().map_or_else(Vec::new, |run| run.events);
        let last =
            events.iter().rposition(|line| is_fleet_done(&line.event)).map_or(0, |at| at + 1);
        let done = events[..last].iter().filter(|line| is_fleet_done(&line.event)).count();
        let is_epoch = |event: &Event| matches!(event, Event::EpochDone { .. });
        let epochs = events[last..].iter().filter(|line| is_epoch(&line.event)).count();
        done > self.fleets || (done == self.fleets && epochs >= self.epochs)
    }

    /// Starts `words` and kills them once the instant has come.
    fn kill(self, place: &Place, words: &[&str]) {
        let invocation = place.start(words);
        until("the instant of the kill", || self.is_reached(place).then_some(()));
        invocation.signal(Signal::KILL);
        invocation.finish().expect_signal(Signal::KILL);
        until("the crafts to end by themselves", || place.crafts().is_empty().then_some(()));
    }
}

/// The newest run's directory, as a user would name it.
fn directory(place: &Place) -> String {
    let latest = std::fs::read_link(place.files().join("runs/latest")).unwrap();
    format!("runs/{}", latest.display())
}

fn summary(place: &Place) -> Value {
    let path: PathBuf = place.files().join("runs/latest/summary.json");
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// The deterministic part, as bytes.
fn deterministic(place: &Place) -> String {
    serde_json::to_string_pretty(&summary(place)["deterministic"]).unwrap()
}

/// How many records each timing cell has.
fn timing_cells(run: &RunData) -> BTreeMap<(u32, u32, String), usize> {
    let mut cells = BTreeMap::new();
    for record in run.timings.iter().map(|timed| &timed.record) {
        let key = (record.cell.size, record.cell.block, record.label().to_string());
        *cells.entry(key).or_insert(0) += 1;
    }
    cells
}

/// Rows of measurements.csv by block, size, label, phase, trial, craft and metric.
fn rows(place: &Place) -> Vec<String> {
    let path = place.files().join("runs/latest/measurements.csv");
    let text = std::fs::read_to_string(path).unwrap();
    let key = |line: &str| line.split(',').take(9).collect::<Vec<_>>().join(",");
    // How many turns a trial needs is decided; how long each took is not, nor is its sample's name.
    let mut rows: Vec<String> = text.lines().map(key).collect();
    rows.sort();
    rows
}

/// Killed at `instants`, one after the other, a run ends as if nobody had touched it.
fn check_killed(words: &[&str], instants: &[Instant]) {
    let unbroken = Place::for_fleets();
    unbroken.run(words).expect_code(0);
    let (meant, meant_rows) = (deterministic(&unbroken), rows(&unbroken));
    let meant_cells = timing_cells(&unbroken.results().unwrap());
    drop(unbroken);
    let place = Place::for_fleets();
    instants[0].kill(&place, words);
    let directory = directory(&place);
    let resume = [words[0], "--resume", &directory];
    for instant in &instants[1..] {
        instant.kill(&place, &resume);
    }
    let fleets = count(&place, is_fleet_done);
    let finished = place.run(&resume).expect_code(0);
    place.run(&["clean"]).expect_code(0);
    place.assert_nothing_left(&[]);
    assert_eq!(deterministic(&place), meant, "{finished}");
    assert_eq!(rows(&place), meant_rows, "a row is missing or there twice");
    let run = place.results().unwrap();
    assert_eq!((timing_cells(&run), run.missing.clone()), (meant_cells, Vec::new()));
    let resumed: Vec<u64> =
        run.provenance.unwrap().resumed.iter().map(|once| once.fleets).collect();
    assert_eq!((resumed.len(), resumed.last().copied()), (instants.len(), Some(fleets as u64)));
    assert!(finished.stdout.contains("resumed after"), "{finished}");
    assert!(run.events.windows(2).all(|pair| pair[0].at_ns <= pair[1].at_ns), "time runs on");
}

#[test]
fn killed_inside_a_fleet_the_counts_are_those_of_an_unbroken_run() {
    check_killed(COUNTS, &[Instant { fleets: 1, epochs: 5 }]);
}

#[test]
fn killed_between_fleets_again_and_again_as_well() {
    let at = |fleets, epochs| Instant { fleets, epochs };
    check_killed(TIMES, &[at(0, 3), at(1, 0), at(2, 2), at(5, 0)]);
}

#[test]
fn interrupted_run_says_how_it_goes_on_and_does() {
    let place = Place::for_fleets();
    let invocation = place.start(COUNTS);
    until("an epoch", || Instant { fleets: 1, epochs: 1 }.is_reached(&place).then_some(()));
    invocation.signal(Signal::INT);
    let finished = invocation.finish();
    // It may have come to its end just before.
    if finished.code() != Some(0) {
        let finished = finished.expect_code(130);
        let resume = format!("compare --resume {}", directory(&place));
        assert!(finished.stderr.contains(&resume), "{finished}");
    }
    let again = place.run(&["compare", "--resume", "runs/latest"]).expect_code(0);
    assert_eq!(count(&place, is_fleet_done), 3, "{again}");
    assert_eq!(count(&place, |event| matches!(event, Event::Ended { .. })), 1);
    place.assert_nothing_left(&[]);
}

#[test]
fn what_would_not_belong_together_is_refused_by_name() {
    let place = Place::for_fleets();
    let words = ["run", "two-craft", "--trials", "2", "--simulated"];
    place.run(&words).expect_code(0);
    let refused = |words: &[&str], why: &str| {
        let finished = place.run(words).expect_code(2);
        assert!(finished.stderr.contains(why), "{finished}");
    };
    let resume = ["run", "--resume", "runs/latest"];
    refused(&[&resume[..], &["--trials", "3"]].concat(), "--trials");
    refused(&["compare", "--resume", "runs/latest"], "started by `slateswarm run`");
    refused(&["run", "--resume", "nowhere"], "nowhere");
    let change = |file: &str, from: &str, to: &str| {
        let path = place.files().join("runs/latest").join(file);
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.contains(from), "{text}");
        std::fs::write(path, text.replace(from, to)).unwrap();
    };
    let run = place.results().unwrap();
    let provenance = run.provenance.unwrap();
    for (now, then, what) in [
        (&provenance.versions.executable, "0123", "the executable was 0123"),
        (&provenance.host.kernel, "Linux 2.0", "the kernel was Linux 2.0"),
    ] {
        change("env.json", now, then);
        refused(&resume, what);
        change("env.json", then, now);
    }
    change("scenario.resolved.toml", "trials = 2", "trials = 3");
    refused(&resume, "the digest of");
    change("scenario.resolved.toml", "trials = 3", "trials = 2");
    place.run(&resume).expect_code(0);
}

#[test]
fn published_experiment_goes_on_as_well() {
    let place = Place::for_fleets();
    let words = ["reproduce", "table-21", "--simulated", "--trials", "3"];
    let unbroken = place.run(&words);
    let (meant, code) = (deterministic(&place), unbroken.code().unwrap());
    let events = place.files().join("runs/latest/events.jsonl");
    let text = std::fs::read_to_string(&events).unwrap();
    // Cut off before its only fleet was complete.
    let until = text.lines().position(|line| line.contains("fleet-done")).unwrap();
    let kept: Vec<&str> = text.lines().take(until).collect();
    std::fs::write(&events, kept.join("\n") + "\n").unwrap();
    std::fs::remove_file(place.files().join("runs/latest/summary.json")).unwrap();
    let refused = place.run(&["compare", "--resume", "runs/latest"]).expect_code(2);
    assert!(refused.stderr.contains("started by `slateswarm reproduce`"), "{refused}");
    place.run(&["reproduce", "--resume", "runs/latest", "--trials", "4"]).expect_code(2);
    let resumed = place.run(&["reproduce", "--resume", "runs/latest"]).expect_code(code);
    assert_eq!(resumed.stdout, unbroken.stdout);
    assert_eq!(deterministic(&place), meant);
}

#[test]
fn run_that_goes_on_is_left_alone() {
    let place = Place::for_fleets();
    let invocation =
        place.start(&["compare", "--sizes", "2", "--no-timing", "--trials", "1000000"]);
    place.await_epochs(1);
    let refused = place.run(&["compare", "--resume", "runs/latest"]).expect_code(2);
    assert!(refused.stderr.contains("still being written"), "{refused}");
    invocation.signal(Signal::INT);
    invocation.finish().expect_code(130);
}
