//! How crafts think, as a user sees it: policies on real fleets, upkeep that changes nothing, and
//! explanations of what happened.

use crate::invocation::Place;
use serde_json::Value;

/// Runs `words` to exit code 0 (all counts are those of the replay) and returns the report.
#[track_caller]
fn report(place: &Place, words: &str) -> Value {
    let words: Vec<&str> = words.split(' ').chain(["--format", "json"]).collect();
    let finished = place.run(&words).expect_code(0);
    place.assert_nothing_left(&[]);
    serde_json::from_str(&finished.stdout).unwrap()
}

/// Path digests of all trials under all strategies.
fn paths(report: &Value) -> Vec<(String, String)> {
    let trials = report["deterministic"]["trials"].as_array().unwrap();
    let text = |value: &Value| value.to_string();
    trials.iter().map(|trial| (text(&trial["trial"]), text(&trial["path_digest"]))).collect()
}

#[test]
fn real_fleets_plan_as_the_replay_does_under_every_strategy() {
    let place = Place::for_fleets();
    let words = |verb: &str, policy: &str| {
        format!("{verb} planetary-survey --trials 2 --set reasoning.policy={policy}")
    };
    for policy in ["naive", "best-path"] {
        let real = report(&place, &words("run", policy));
        let simulated = report(&place, &words("simulate", policy));
        assert_eq!(real["deterministic"], simulated["deterministic"], "{policy}");
        let trials = real["deterministic"]["trials"].as_array().unwrap();
        assert!(trials.iter().all(|trial| trial["end"] == "finished"), "{policy}: {trials:#?}");
        let paths = paths(&real);
        assert!(paths.len() > 10 && paths.iter().all(|path| path.1 == paths[0].1), "{paths:?}");
    }
}

#[test]
fn a_planned_mission_takes_fewer_firings_than_a_drawn_one() {
    let place = Place::new();
    let firings = |policy: &str| -> u64 {
        let set = format!("--set reasoning.policy={policy}");
        let words = format!("simulate planetary-survey --trials 5 --strategy boundary {set}");
        let report = report(&place, &words);
        let trials = report["deterministic"]["trials"].as_array().unwrap();
        trials.iter().map(|trial| trial["firings"].as_u64().unwrap()).sum()
    };
    assert!(firings("best-path") < firings("random"));
}

#[test]
fn upkeep_costs_time_and_changes_nothing() {
    let place = Place::for_fleets();
    let words = "run planetary-survey --trials 2 --strategies boundary,hierarchy";
    let upkeep = "--set reasoning.prune-every-turns=2 --set reasoning.maintain-every-turns=3";
    let without = report(&place, words);
    let with = report(&place, &format!("{words} {upkeep}"));
    assert_eq!(with["deterministic"]["trials"], without["deterministic"]["trials"]);
    assert_eq!(without["timing"].get("reasoning"), None);
    let cells = with["timing"]["reasoning"].as_array().unwrap();
    assert_eq!(cells.len(), 2 * 9, "a cell for each craft and strategy");
    for cell in cells {
        let value = |metric: &str| cell["figures"][metric]["value"].as_f64().unwrap();
        assert!(value("reasoning-prunings") > 0.0 && value("reasoning-slices") > 0.0, "{cell}");
        assert!(value("reasoning-prune") > 0.0 && value("reasoning-maintain") > 0.0, "{cell}");
        assert!(value("reasoning-kept-facts") > 0.0, "{cell}");
    }
    let all = place.run(&["report", "runs/latest", "--all", "--pictures", "none"]).expect_code(0);
    assert!(all.stdout.contains("Thinking, a trial"), "{all}");
    let long = place.files().join("runs/latest/measurements.csv");
    assert!(std::fs::read_to_string(long).unwrap().contains("reasoning-slice-max"));
}

#[test]
fn a_finished_run_is_explained_from_its_directory() {
    let place = Place::new();
    place.run(&["simulate", "planetary-survey", "--trials", "2", "--seed", "5"]).expect_code(0);
    let why = |words: &[&str], code: i32| {
        let finished = place.run(&[&["explain", "runs/latest"], words].concat()).expect_code(code);
        let is_table = !words.contains(&"json");
        let mut lines = finished.stdout.lines().chain(finished.stderr.lines());
        assert!(!is_table || lines.all(|line| line.chars().count() <= 80), "{finished}");
        finished
    };
    let end = why(&[], 0).stdout;
    assert!(end.starts_with("orbiter: survey-complete holds, since turn"), "{end}");
    assert!(end.contains("from the start") && end.contains("orbiter: in-orbit"), "{end}");
    assert!(end.replace('\n', " ").contains("recorded path"), "{end}");
    let json = why(&["ground-1.core-drawn", "--trial", "1", "--format", "json"], 0).stdout;
    let json: Value = serde_json::from_str(&json).unwrap();
    assert_eq!((&json["is_recorded_path"], &json["trial"]), (&true.into(), &1.into()));
    assert!(!json["steps"].as_array().unwrap().is_empty());
    let other = why(&["ground-1.core-drown"], 2);
    assert!(other.stderr.contains("did you mean"), "{other}");
    place.run(&["explain", "nowhere"]).expect_code(2);
}

const ROVER: &str = r#"[[craft]]
name = "rover"
initial = ["on", "battery = 80"]
final = ["sample-held"]

[[craft]]
name = "drone"
initial = ["airborne"]

[[boundary]]
fact = "rock-seen"

[[rule]]
craft = "rover"
if = ["on", "battery >= 50"]
run = ["look-around"]

[[action]]
craft = "rover"
name = "look-around"
then = ["rock-seen", "battery = 40"]
cost = 4
likelihood = 0.8
duration = 3

[[rule]]
craft = "drone"
if = ["airborne"]
run = ["fly-over"]

[[action]]
craft = "drone"
name = "fly-over"
then = ["rock-seen"]
cost = 1.8
likelihood = 0.9
duration = 2

[[rule]]
craft = "rover"
if = ["rock-seen", "battery >= 30"]
run = ["take-sample"]

[[action]]
craft = "rover"
name = "take-sample"
then = ["sample-held"]
"#;

#[test]
fn a_plan_weighs_likelihoods_and_says_what_else_there_is() {
    let place = Place::new();
    std::fs::write(place.files().join("rover.toml"), ROVER).unwrap();
    let solve = |words: &[&str]| -> Value {
        let words = [&["solve", "rover.toml", "--format", "json"], words].concat();
        serde_json::from_str(&place.run(&words).expect_code(0).stdout).unwrap()
    };
    let best = solve(&["--ways", "3", "--outcomes", "3"]);
    // Rule, fly-over at 1.8 / 0.9, telling; rule, action: 1 + 2 + 1 + 1 + 1.
    assert_eq!((&best["cost"], &best["turns"]), (&6.0.into(), &5.into()));
    let way = &best["ways"][0];
    assert_eq!((&way["cost"], best["ways"].as_array().unwrap().len()), (&8.0.into(), 1));
    assert_eq!(way["steps"][0]["craft"], "rover");
    let outcomes = best["outcomes"].as_array().unwrap();
    assert_eq!(outcomes.len(), 2, "only one action can fail: {outcomes:?}");
    assert_eq!((&outcomes[0]["likelihood"], &outcomes[0]["cost"]), (&0.9.into(), &6.0.into()));
    let failing = (&outcomes[1]["failing"][0], &outcomes[1]["cost"]);
    assert_eq!(failing, (&"drone: fly-over".into(), &8.0.into()));
    let alone = solve(&["--absent", "drone.airborne"]);
    assert_eq!((&alone["cost"], &alone["turns"]), (&8.0.into(), &6.into()));
    let seen = solve(&["--known", "drone.rock-seen"]);
    assert_eq!(seen["cost"], 2.0, "a shared fact is known to all that share it: {seen}");
    let lost = solve(&["--absent", "rover.rock-seen"]);
    assert_eq!(lost["cost"], Value::Null, "{lost}");
    place.run(&["solve", "rover.toml", "--absent", "rover.sample-held"]).expect_code(2);
    place.run(&["solve", "rover.toml", "--absent", "rover.rock"]).expect_code(2);
    let table = place.run(&["solve", "rover.toml", "--ways", "2", "--outcomes", "2"]);
    let table = table.expect_code(0);
    assert!(table.stdout.lines().all(|line| line.chars().count() <= 80), "{table}");
    // Crafts plan with the same costs, and levels are facts like others.
    let words = ["simulate", "rover.toml", "--trials", "2", "--set", "reasoning.policy=best-path"];
    place.run(&words).expect_code(0);
}

#[test]
fn actions_that_take_turns_and_fail_go_alike_everywhere_and_under_every_strategy() {
    let place = Place::for_fleets();
    let doubtful = ROVER.replace("likelihood = 0.8", "likelihood = 0.4");
    let doubtful = doubtful.replace("likelihood = 0.9", "likelihood = 0.3");
    std::fs::write(place.files().join("rover.toml"), doubtful).unwrap();
    for policy in ["random", "best-path"] {
        let words =
            |verb: &str| format!("{verb} rover.toml --trials 12 --set reasoning.policy={policy}");
        let real = report(&place, &words("run"));
        let simulated = report(&place, &words("simulate"));
        assert_eq!(real["deterministic"], simulated["deterministic"], "{policy}");
        let trials = real["deterministic"]["trials"].as_array().unwrap();
        let ended = |end: &str| trials.iter().filter(|trial| trial["end"] == end).count();
        assert!(ended("finished") > 0 && ended("stalled") > 0, "{policy}: {trials:#?}");
        assert_eq!(ended("finished") + ended("stalled"), trials.len(), "{policy}");
    }
    // What was in vain is told.
    let explained = |trial: usize| {
        let trial = trial.to_string();
        let words = ["explain", "runs/latest", "drone.fly-over", "--trial", &trial];
        place.run(&words).expect_code(0).stdout
    };
    let all: Vec<String> = (0..12).map(explained).collect();
    assert!(all.iter().any(|text| text.contains("ran in vain in turn 2")), "{all:#?}");
    assert!(all.iter().any(|text| text.contains("ran in turn 2")), "{all:#?}");
}
