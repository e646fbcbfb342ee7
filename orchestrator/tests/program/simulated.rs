//! Campaigns on the virtual clock as a user meets them.

use crate::invocation::Place;
use serde_json::Value;

#[test]
fn a_campaign_keeps_every_law_and_says_what_it_took() {
    let place = Place::new();
    let words = ["simulate", "--campaign", "20", "--seed", "5", "--format", "json"];
    let document: Value = serde_json::from_str(&place.run(&words).expect_code(0).stdout).unwrap();
    let rows = document["strategies"].as_array().unwrap();
    assert_eq!(rows.len(), 7);
    for row in rows {
        assert_eq!((&row["seeds"], &row["broken"]), (&20.into(), &0.into()), "{row}");
        assert!(row["kills"].as_u64().unwrap() > 0, "{row}");
    }
    let one = ["simulate", "--campaign", "3", "--strategy", "hybrid"];
    let table = place.run(&one).expect_code(0).stdout;
    assert!(table.contains("hybrid") && !table.contains("full"), "{table}");
    assert!(table.lines().all(|line| line.chars().count() <= 80), "{table}");
}

#[test]
fn a_campaign_in_lockstep_plays_every_trial_as_without_faults() {
    let place = Place::new();
    let words = ["simulate", "--campaign", "20", "--lockstep", "--seed", "5", "--format", "json"];
    let document: Value = serde_json::from_str(&place.run(&words).expect_code(0).stdout).unwrap();
    let rows = document["strategies"].as_array().unwrap();
    assert_eq!(rows.len(), 8);
    for row in rows {
        assert_eq!((&row["seeds"], &row["broken"]), (&20.into(), &0.into()), "{row}");
        assert!(row["kills"].as_u64().unwrap() > 0, "{row}");
        assert!(row["trials"].as_u64().unwrap() > 20, "{row}");
    }
    let words = ["simulate", "--replay", "--lockstep", "--strategy", "pipelined", "--seed", "8"];
    let steps = place.run(&words).expect_code(0).stdout;
    assert!(steps.starts_with("pipelined, seed 8: "), "{steps}");
    assert!(steps.contains("trial 1 begins") && steps.contains("every law held"), "{steps}");
}

#[test]
fn a_replay_shows_the_same_steps_each_time() {
    let place = Place::new();
    let words = ["simulate", "--replay", "--strategy", "hierarchy", "--seed", "8"];
    let steps = place.run(&words).expect_code(0).stdout;
    assert_eq!(steps, place.run(&words).expect_code(0).stdout);
    assert!(steps.starts_with("hierarchy, seed 8: "), "{steps}");
    assert!(steps.contains(" gets Delta ") && steps.contains("every law held"), "{steps}");
}

#[test]
fn every_change_arrives_whatever_share_of_the_samples_is_lost() {
    let place = Place::new();
    let words = ["simulate", "--losses", "40", "--format", "json"];
    let document: Value = serde_json::from_str(&place.run(&words).expect_code(0).stdout).unwrap();
    let rows = document["rows"].as_array().unwrap();
    let losses: Vec<f64> = rows.iter().map(|row| row["loss_percent"].as_f64().unwrap()).collect();
    assert_eq!(losses, [0.0, 10.0, 25.0, 50.0, 75.0]);
    for row in rows {
        assert_eq!(row["needed"], row["delivered"], "{row}");
        assert_eq!(row["first_samples"], rows[0]["first_samples"], "{row}");
    }
    let table = place.run(&["simulate", "--losses", "5"]).expect_code(0).stdout;
    assert!(table.lines().all(|line| line.chars().count() <= 80), "{table}");
}

#[test]
fn what_makes_no_campaign_is_refused_with_the_remedy() {
    let place = Place::new();
    let refused = |words: &[&str], needed: &str| {
        let stderr = place.run(words).expect_code(2).stderr;
        assert!(stderr.contains(needed), "{stderr}");
    };
    refused(&["simulate"], "which scenario?");
    refused(&["simulate", "--campaign", "2", "--strategy", "null"], "`null` has no campaigns");
    refused(&["simulate", "two-craft", "--campaign", "2"], "cannot be used with");
    refused(&["simulate", "--replay", "--strategy", "full,boundary"], "name one");
}

#[test]
fn no_link_fault_changes_a_count_of_a_simulated_mission() {
    let place = Place::new();
    let counts = |more: &[&str]| {
        let words = ["simulate", "planetary-survey", "--trials", "2", "--format", "json"];
        let ran = place.run(&[&words[..], more].concat()).expect_code(0);
        let document: Value = serde_json::from_str(&ran.stdout).unwrap();
        document["deterministic"]["cells"].clone()
    };
    let lossless = counts(&[]);
    assert!(!lossless.as_array().unwrap().is_empty());
    let outage = "link.outages=[{ craft = 'aerial-1', from-ms = 0.0, until-ms = 40.0 }]";
    for keys in [
        &["link.loss=0.2"][..],
        &["link.duplication=0.5"],
        &["link.jitter-ms=3.0"],
        &["link.bandwidth-bits-per-s=64000.0"],
        &[outage],
        &["link.loss=0.1", "link.duplication=0.1", "link.jitter-ms=1.0", outage],
    ] {
        let words: Vec<&str> = keys.iter().flat_map(|&key| ["--set", key]).collect();
        assert_eq!(counts(&words), lossless, "{keys:?}");
    }
}

#[test]
fn what_links_do_to_samples_is_counted_in_the_files() {
    let place = Place::new();
    let keys = [
        "link.loss=0.1",
        "link.duplication=0.1",
        "link.jitter-ms=1.0",
        "link.outages=[{ between = ['orbiter', 'aerial-1'], from-ms = 0.0, until-ms = 40.0 }]",
    ];
    let mut words = vec!["simulate", "planetary-survey", "--trials", "1"];
    words.extend(keys.iter().flat_map(|&key| ["--set", key]));
    place.run(&words).expect_code(0);
    let rows = std::fs::read_to_string(place.files().join("runs/latest/measurements.csv")).unwrap();
    let sum = |metric: &str| -> u64 {
        let named = rows.lines().map(|row| row.split(',').collect::<Vec<_>>());
        named.filter(|row| row[8] == metric).map(|row| row[9].parse::<u64>().unwrap()).sum()
    };
    for metric in ["lost", "cut-off", "doubled", "delayed", "overtaken"] {
        assert!(sum(&format!("link-{metric}")) > 0, "{metric}");
    }
    assert_eq!(sum("loss-gaps"), 0, "everything was repeated");
    assert!(sum("duration") > 40_000_000, "some waited for the end of the outage");
}
