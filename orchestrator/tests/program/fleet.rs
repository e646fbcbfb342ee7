//! Real fleets and simulated ones agree, run after run, byte for byte.

use crate::invocation::Place;
use serde_json::Value;
use shared_types::wire::StrategyKind;
use std::collections::{BTreeMap, BTreeSet};

/// The part of a JSON report that no clock, host or path may touch, as it was printed.
#[track_caller]
fn deterministic(report: &str) -> &str {
    let begin = report.find("\"deterministic\":").expect("a deterministic part");
    let length = report[begin..].find("\n  \"timing\":").expect("a part for what clocks say");
    &report[begin..begin + length]
}

/// Runs `words` with JSON output to exit code 0; nothing stays.
#[track_caller]
fn report(place: &Place, words: &str) -> String {
    let words: Vec<&str> = words.split(' ').chain(["--format", "json"]).collect();
    let finished = place.run(&words).expect_code(0);
    place.assert_nothing_left(&[]);
    finished.stdout
}

/// The first line in which two texts differ, for whoever reads the failure.
#[track_caller]
fn assert_same(left: &str, right: &str, what: &str) {
    let lines = (1..).zip(left.lines().zip(right.lines()));
    let difference = lines.clone().find(|(_, (left, right))| left != right);
    assert!(difference.is_none(), "{what}: line {difference:?}");
    assert_eq!(left.len(), right.len(), "{what}");
}

/// Real, real again and simulated: one deterministic part.
#[track_caller]
fn check_agreement(real: &str, simulated: &str) -> String {
    let place = Place::for_fleets();
    let first = report(&place, real);
    let trials = serde_json::from_str::<Value>(&first).unwrap()["deterministic"]["trials"].take();
    assert!(!trials.as_array().unwrap().is_empty(), "no trial was run");
    let again = report(&place, real);
    assert_same(deterministic(&first), deterministic(&again), "two real runs");
    let simulated = report(&place, simulated);
    assert_same(deterministic(&first), deterministic(&simulated), "real and simulated");
    first
}

#[test]
fn real_and_simulated_missions_agree_byte_for_byte() {
    for preset in ["two-craft", "planetary-survey", "hierarchy-13"] {
        check_agreement(
            &format!("run {preset} --trials 3 --seed 11"),
            &format!("simulate {preset} --trials 3 --seed 11"),
        );
    }
}

#[test]
fn real_and_simulated_comparisons_agree_byte_for_byte() {
    let words = "compare --sizes 2,5 --no-timing --trials 2 --seed 3";
    check_agreement(words, &format!("{words} --simulated"));
}

#[test]
fn every_strategy_walks_the_same_path() {
    let place = Place::for_fleets();
    for words in ["compare --sizes 2,5 --no-timing --trials 3", "run planetary-survey --trials 3"] {
        let document: Value = serde_json::from_str(&report(&place, words)).unwrap();
        let deterministic = &document["deterministic"];
        let mut paths: BTreeMap<(u64, u64), BTreeSet<&str>> = BTreeMap::new();
        let mut strategies = BTreeSet::new();
        for trial in deterministic["trials"].as_array().unwrap() {
            let number = |name: &str| trial[name].as_u64().unwrap();
            let digest = trial["path_digest"].as_str().unwrap();
            paths.entry((number("size"), number("trial"))).or_default().insert(digest);
            strategies.insert(trial["strategy"].as_str().unwrap());
        }
        assert!(strategies.len() > 5, "{words}: only {strategies:?}");
        for (trial, digests) in &paths {
            assert_eq!(digests.len(), 1, "{words}: size and trial {trial:?} under {strategies:?}");
        }
        let all: BTreeSet<_> = paths.values().collect();
        assert!(all.len() > 1, "{words}: the digest says nothing about the path: {all:?}");
        let cells = deterministic["cells"].as_array().unwrap();
        assert!(cells.iter().all(|cell| cell["agrees_with_oracle"] == true), "{words}");
    }
}

/// What a strategy needs must not come from another one of the same run.
#[test]
fn every_strategy_runs_alone_however_processes_wait() {
    let place = Place::for_fleets();
    for strategy in StrategyKind::ALL {
        for wake in ["poll", "adaptive", "block"] {
            let words = ["run", "planetary-survey", "--trials", "2", "--strategy", strategy.name()];
            place.run(&[&words[..], &["--wake", wake]].concat()).expect_code(0);
        }
    }
    place.assert_nothing_left(&[]);
}

/// Nothing is delivered under `null`, which must play to the same end all the same.
#[test]
fn mission_that_a_delivery_ends_agrees_under_every_strategy() {
    let mission = r#"
        craft = [{ name = "scout", initial = ["up"] }, { name = "base", final = ["seen"] }]
        boundary = [{ fact = "seen", crafts = ["scout", "base"] }]
        rule = [{ craft = "scout", if = ["up"], then = ["seen"] }]
    "#;
    let place = Place::for_fleets();
    place.write("mission.toml", mission);
    let ran = report(&place, "run mission.toml --trials 2");
    assert_same(
        deterministic(&ran),
        deterministic(&report(&place, "simulate mission.toml --trials 2")),
        "real and simulated",
    );
    let document: Value = serde_json::from_str(&ran).unwrap();
    for cell in document["deterministic"]["cells"].as_array().unwrap() {
        assert_eq!(cell["ends"]["finished"], 2, "{cell}");
    }
}

#[test]
fn a_seed_decides_what_happens() {
    let place = Place::new();
    let of_seed = |seed: u32| {
        report(&place, &format!("compare --simulated --sizes 3 --trials 2 --seed {seed}"))
    };
    assert_eq!(deterministic(&of_seed(5)), deterministic(&of_seed(5)));
    assert_ne!(deterministic(&of_seed(5)), deterministic(&of_seed(6)));
}

#[test]
fn reproduced_tables_know_no_clock_host_or_path() {
    let words = "reproduce --simulated --trials 2 table-22";
    let [here, there] = [Place::new(), Place::new()];
    let first = report(&here, words);
    let second = report(&there, &format!("{words} --out elsewhere/results"));
    assert_eq!(first, second);
    let host = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap();
    for word in [host.trim(), "/tmp", "/dev/shm", "elsewhere", "_ns", "2026-", "linux"] {
        assert!(!first.contains(word), "{word} in {first}");
    }
    assert!(there.files().join("elsewhere/results/latest").exists());
}

#[test]
fn report_prints_what_the_run_printed() {
    let place = Place::for_fleets();
    for words in ["run two-craft --trials 3", "compare --sizes 2,3 --no-timing --trials 2"] {
        let ran = place.run(&words.split(' ').collect::<Vec<_>>()).expect_code(0);
        let latest = std::fs::read_link(place.files().join("runs/latest")).unwrap();
        let directory = format!("runs/{}", latest.display());
        let again = place.run(&["report", &directory]).expect_code(0);
        assert_eq!(ran.stdout, again.stdout);
        let json = |words: &[&str]| place.run(&[words, &["--format", "json"]].concat());
        let report = json(&["report", &directory]).expect_code(0).stdout;
        let summary = std::fs::read_to_string(place.files().join(directory).join("summary.json"));
        let summary: Value = serde_json::from_str(&summary.unwrap()).unwrap();
        let report: Value = serde_json::from_str(&report).unwrap();
        for part in ["cells", "crafts", "trials", "seed", "scenario"] {
            assert_eq!(report["deterministic"][part], summary["deterministic"][part], "{part}");
        }
        place.assert_nothing_left(&[]);
    }
}

#[test]
fn runs_beside_each_other_do_not_meet() {
    let place = Place::for_fleets();
    let words = |out| ["run", "hierarchy-13", "--trials", "20", "--format", "json", "--out", out];
    let [left, right] = ["left", "right"].map(|out| place.start(&words(out)));
    // Both live below one base, and each start cleans what is dead there.
    crate::shared::until("both to be there", || (place.runs().len() == 2).then_some(()));
    let runs = place.runs();
    let [left, right] = [left.finish().expect_code(0), right.finish().expect_code(0)];
    assert_same(deterministic(&left.stdout), deterministic(&right.stdout), "two at the same time");
    assert_eq!((left.stderr, right.stderr), (String::new(), String::new()));
    place.assert_nothing_left(&runs);
}
