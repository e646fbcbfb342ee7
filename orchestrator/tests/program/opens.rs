//! Open mode as a user meets it: traces as files, loads on real fleets, and what is refused.

use crate::invocation::Place;
use serde_json::Value;

/// Three crafts, half a second, two blocks.
const MISSION: &str = r#"
name = "offered"
[fleet]
crafts = 3
cores = 2
[network]
links = 100
[replication]
strategies = ["null", "full", "boundary", "central-batched"]
[run]
mode = "open"
rate-per-s = 600
duration-s = 0.4
asks-every-ms = [2, 5]
blocks = 2
[trace]
reads-per-s = 200
"#;

/// A place with [`MISSION`] in it.
fn place() -> Place {
    let place = Place::for_fleets();
    place.write("offered.toml", MISSION);
    place
}

#[test]
fn a_recorded_trace_is_the_same_each_time_and_another_with_another_seed() {
    let place = place();
    let record = |more: &[&str]| {
        let words = [&["record", "offered.toml"], more].concat();
        place.run(&words).expect_code(0).stdout
    };
    let trace = record(&[]);
    assert_eq!(trace, record(&[]));
    assert_ne!(trace, record(&["--seed", "2"]));
    let mut lines = trace.lines();
    assert_eq!(lines.next(), Some("time_ns,craft,fact,value"));
    let rows: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    // 320 on average.
    assert!((200..450).contains(&rows.len()), "{}", rows.len());
    let times: Vec<u64> = rows.iter().map(|row| row[0].parse().unwrap()).collect();
    assert!(times.is_sorted() && times.iter().all(|&time| time < 400_000_000));
    assert!(["true", "false", "read"].iter().all(|value| rows.iter().any(|row| row[3] == *value)));
    let unstated = place.run(&["record", "two-craft"]).expect_code(2);
    assert!(unstated.stderr.contains("`run.rate-per-s` is not stated"), "{}", unstated.stderr);
}

#[test]
fn every_strategy_bears_the_load_and_is_held_against_the_replay() {
    let place = place();
    let finished = place.run(&["run", "offered.toml", "--format", "json"]).expect_code(0);
    place.assert_nothing_left(&[]);
    let document: Value = serde_json::from_str(&finished.stdout).unwrap();
    let rows = document["timing"]["loads"].as_array().unwrap();
    let labels: Vec<(&str, u64, Option<u64>)> = rows
        .iter()
        .map(|row| {
            let again = row["again"].as_u64().unwrap();
            (row["strategy"].as_str().unwrap(), again, row["asks_every_ns"].as_u64())
        })
        .collect();
    let expected = [
        ("null", 0, None),
        ("full", 0, None),
        ("boundary", 0, None),
        ("boundary", 1, None),
        ("central-batched", 0, Some(2_000_000)),
        ("central-batched", 0, Some(5_000_000)),
    ];
    assert_eq!(labels, expected);
    let records = document["timing"]["load_records"].as_array().unwrap();
    assert_eq!(records.len(), 2 * expected.len());
    for record in records {
        let count = |key: &str| record[key].as_u64().unwrap();
        let of_block = records.iter().find(|other| other["block"] == record["block"]).unwrap();
        assert_eq!(
            (&record["needed"], &record["writes"]),
            (&of_block["needed"], &of_block["writes"])
        );
        let known = count("applied_by_end") + count("applied_after_end") + count("censored");
        let is_null = record["strategy"] == "null";
        assert_eq!(known, if is_null { 0 } else { count("needed") }, "{record}");
        if !record["expected"].is_null() {
            assert_eq!(record["expected"], record["counts"], "{record}");
        }
    }
    let table = place.run(&["report", "runs/latest"]).expect_code(0).stdout;
    assert!(table.contains("3 crafts, load stated: "), "{table}");
    assert!(table.lines().all(|line| line.len() <= 80 || line.contains('/')), "{table}");
}

#[test]
fn a_trace_from_a_file_is_played_as_it_stands() {
    let place = place();
    let row = |craft: &str| format!("time_ns,craft,fact,value\n1000000,{craft},5,true\n");
    place.write("trace.csv", &(row("craft-0") + "2000000,craft-1,5,false\n"));
    let file = "trace.file=\"trace.csv\"";
    let words =
        ["run", "offered.toml", "--set", file, "--blocks", "1", "--strategies", "null,boundary"];
    let finished = place.run(&[&words[..], &["--format", "json"]].concat()).expect_code(0);
    let document: Value = serde_json::from_str(&finished.stdout).unwrap();
    for record in document["timing"]["load_records"].as_array().unwrap() {
        assert_eq!((&record["load"], &record["writes"]), (&"file".into(), &2.into()), "{record}");
    }
    place.write("trace.csv", &row("craft-9"));
    let refused = place.run(&words).expect_code(2);
    assert!(refused.stderr.contains("trace.csv:2"), "{}", refused.stderr);
    place.assert_nothing_left(&[]);
}
