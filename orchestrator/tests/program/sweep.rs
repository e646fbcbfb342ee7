//! A sweep: every cell is a run, bad grids start nothing, and a kill costs one fleet at most.

use crate::invocation::Place;
use crate::shared::until;
use rustix::process::Signal;
use serde_json::Value;
use std::path::PathBuf;

/// Four cells of two strategies.
const SWEEP: &[&str] = &[
    "sweep",
    "two-craft",
    "--vary",
    "run.seed=5,6",
    "--vary",
    "run.trials=3,40",
    "--strategies",
    "full,boundary",
];

fn cells(place: &Place) -> Vec<PathBuf> {
    let folder = place.files().join("runs/latest/cells");
    let mut cells: Vec<PathBuf> = std::fs::read_dir(folder)
        .map(|entries| entries.map(|entry| entry.unwrap().path()).collect())
        .unwrap_or_default();
    cells.sort();
    cells
}

/// The deterministic part of every cell, as bytes.
fn deterministic(place: &Place) -> Vec<String> {
    let part = |cell: &PathBuf| {
        let text = std::fs::read_to_string(cell.join("summary.json")).unwrap();
        let summary: Value = serde_json::from_str(&text).unwrap();
        serde_json::to_string(&summary["deterministic"]).unwrap()
    };
    cells(place).iter().map(part).collect()
}

#[test]
fn every_cell_is_a_run_and_the_table_has_them_all() {
    let place = Place::for_fleets();
    let ran = place.run(SWEEP).expect_code(0);
    assert!(ran.stderr.contains("4 cells, "), "{ran}");
    place.assert_nothing_left(&[]);
    let names: Vec<String> = cells(&place)
        .iter()
        .map(|cell| cell.file_name().unwrap().to_string_lossy().into_owned())
        .collect();
    assert_eq!(
        names,
        [
            "000-seed-5-trials-3",
            "001-seed-5-trials-40",
            "002-seed-6-trials-3",
            "003-seed-6-trials-40"
        ]
    );
    for heading in ["run.seed=5 run.trials=3", "run.seed=6 run.trials=40", "4 of 4 done"] {
        assert!(ran.stdout.contains(heading), "{heading}: {ran}");
    }
    let report = |words: &[&str]| place.run(&[&["report", "runs/latest"], words].concat());
    let directory = std::fs::canonicalize(place.files().join("runs/latest")).unwrap();
    let table = report(&[]).expect_code(0).stdout;
    let without_place = |text: &str| {
        text.lines().filter(|line| !line.contains("runs/")).collect::<Vec<_>>().join("\n")
    };
    let shown = without_place(&table.replace(&directory.display().to_string(), "runs/"));
    assert_eq!(shown, without_place(&ran.stdout));
    let json = report(&["--format", "json", "--metrics", "turns"]).expect_code(0).stdout;
    let json: Value = serde_json::from_str(&json).unwrap();
    let cell = &json["cells"][3];
    assert_eq!(
        (&cell["values"]["run.seed"], &cell["state"]["done"]),
        (&"6".into(), &"success".into())
    );
    let figures = &cell["rows"][0]["figures"];
    assert_eq!(figures.as_object().unwrap().keys().collect::<Vec<_>>(), ["turns"]);
    assert_eq!(figures["turns"]["n"], 40);
    let csv = report(&["--format", "csv", "--metrics", "turns"]).expect_code(0).stdout;
    let lines: Vec<&str> = csv.lines().collect();
    assert!(lines[0].starts_with("cell,run.seed,run.trials,size,strategy,"), "{csv}");
    assert_eq!(lines.len(), 1 + 4 * 2, "{csv}");
    let refused = report(&["--metrics", "turn"]).expect_code(2);
    assert!(refused.stderr.contains("did you mean `turns`?"), "{refused}");
    place.run(&["report", &cells(&place)[1].display().to_string()]).expect_code(0);
}

#[test]
fn killed_sweep_goes_on_and_ends_as_an_unbroken_one() {
    let unbroken = Place::for_fleets();
    unbroken.run(SWEEP).expect_code(0);
    let meant = deterministic(&unbroken);
    drop(unbroken);
    let place = Place::for_fleets();
    for (words, begun) in [(SWEEP, 2), (&["sweep", "--resume", "runs/latest"][..], 4)] {
        let invocation = place.start(words);
        until("a cell to be under way", || {
            let epochs = |cell: &PathBuf| std::fs::read_to_string(cell.join("trials.jsonl")).ok();
            let cells = cells(&place);
            let last = cells.get(begun - 1).and_then(epochs)?;
            (last.lines().count() > 1).then_some(())
        });
        invocation.signal(Signal::KILL);
        invocation.finish().expect_signal(Signal::KILL);
        let report = place.run(&["report", "runs/latest"]).expect_code(0);
        assert!(report.stdout.contains("sweep --resume"), "{report}");
    }
    let finished = place.run(&["sweep", "--resume", "runs/latest"]).expect_code(0);
    place.run(&["clean"]).expect_code(0);
    until("crafts of the killed to end", || place.crafts().is_empty().then_some(()));
    assert_eq!(deterministic(&place), meant, "{finished}");
    assert!(finished.stdout.contains("4 of 4 done"), "{finished}");
    // Nothing is left to do, and nothing is done.
    place.run(&["sweep", "--resume", "runs/latest"]).expect_code(0);
    assert_eq!(deterministic(&place), meant);
}

#[test]
fn interrupted_sweep_says_how_it_goes_on() {
    let place = Place::for_fleets();
    let words = ["sweep", "two-craft", "--vary", "run.seed=1,2", "--trials", "1000000"];
    let invocation = place.start(&words);
    until("the first cell", || {
        let first = cells(&place).first()?.join("trials.jsonl");
        (std::fs::read_to_string(first).ok()?.lines().count() > 2).then_some(())
    });
    let again = place.run(&["sweep", "--resume", "runs/latest"]).expect_code(2);
    assert!(again.stderr.contains("still being written"), "{again}");
    invocation.signal_group(Signal::INT);
    let finished = invocation.finish().expect_code(130);
    assert!(finished.stderr.contains("sweep --resume runs/sweep-two-craft/"), "{finished}");
    assert!(finished.stdout.contains("run.seed=1 (cut off)"), "{finished}");
    assert!(finished.stdout.contains("run.seed=2 (not started)"), "{finished}");
    assert!(finished.stdout.contains("0 of 2 done"), "{finished}");
    place.assert_nothing_left(&[]);
}

#[test]
fn grid_that_cannot_be_run_starts_nothing() {
    let place = Place::new();
    for (vary, why) in [
        ("run.trails=1,2", "did you mean `trials`?"),
        ("run.trials=1,zwei", "run.trials=zwei"),
        ("run.trials", "varies nothing"),
        ("replication.strategy=full,hybrid", "`hybrid` needs groups"),
    ] {
        let finished = place.run(&["sweep", "two-craft", "--vary", vary]).expect_code(2);
        assert!(finished.stderr.contains(why), "{finished}");
        assert!(!place.files().join("runs").exists(), "{finished}");
    }
    let twice = ["sweep", "two-craft", "--vary", "run.seed=1", "--vary", "run.seed=2"];
    assert!(place.run(&twice).expect_code(2).stderr.contains("varied twice"));
}
