//! The published tables beside trials made up so that every identity holds, and beside broken ones.

use super::{HEADER, Reproduction};
use crate::outcome::Outcome;
use crate::report::Report as _;
use crate::report::published::{Published, PublishedRow};
use crate::report::ranges::{Sample, TrialCounts};
use crate::report::tests::{ALL, assert_narrow, sample as summary_of};
use crate::results::summary::Deterministic;
use shared_types::wire::StrategyKind;

const TABLES: [u32; 5] = [21, 22, 23, 24, 25];

fn ours(sizes: &[u32]) -> Deterministic {
    summary_of(sizes).deterministic
}

/// The published runs themselves as a sample: every published mean then lies in its range.
fn samples() -> Vec<Sample> {
    Published::embedded()
        .runs
        .iter()
        .map(|runs| Sample {
            crafts: runs.crafts,
            trials: runs
                .rows
                .iter()
                .map(|row| TrialCounts { turns: runs.turns(row).unwrap(), requests: *row })
                .collect(),
            dropped: 0,
        })
        .collect()
}

fn reproduction() -> Reproduction {
    Reproduction::new(&TABLES, 7, &ours(&[2, 3, 5, 10]), &samples())
}

#[test]
fn every_table_stands_within_a_terminal() {
    let text = reproduction().table(ALL);
    println!("{text}");
    assert_narrow(&text);
    for told in [
        "Table 21: 2 blackboards",
        "Table 24: 10 blackboards",
        "Table 25: means",
        "source inconsistent",
        "hierarchy 3.8 (N = 2), 1.4 (N = 3), 1.8 (N = 5), 3.0 (N = 10)",
        "limited   3.8 (N = 2), 2.0 (N = 3), 4.0 (N = 5), 9.0 (N = 10)",
        "central   392 (N = 2), 210 (N = 3), 143 (N = 5), 116 (N = 10)",
    ] {
        assert!(text.contains(told), "{told}");
    }
}

#[test]
fn only_the_tables_asked_for_are_shown() {
    let one = Reproduction::new(&[23], 7, &ours(&[5]), &[]);
    let text = one.table(ALL);
    assert!(text.contains("Table 23") && !text.contains("Table 21") && !text.contains("Table 25"));
    let document: serde_json::Value = serde_json::from_str(&one.json()).unwrap();
    assert_eq!(document["runs"].as_array().map(Vec::len), Some(1));
    assert!(document["means"].is_null());
}

#[test]
fn what_the_source_prints_never_fails() {
    assert_eq!(reproduction().outcome(), Outcome::Success);
    let far: Vec<Sample> = samples()
        .into_iter()
        .map(|sample| {
            let requests = PublishedRow {
                label: 0,
                proposed: 1000,
                full: 9000,
                limited: 9000,
                central: 9000,
                hierarchy: 9000,
            };
            Sample { trials: vec![TrialCounts { turns: 900, requests }; 10], ..sample }
        })
        .collect();
    let reproduction = Reproduction::new(&[25], 7, &ours(&[2]), &far);
    assert!(reproduction.table(ALL).contains("not reproduced"));
    assert_eq!(reproduction.outcome(), Outcome::Success);
}

#[test]
fn a_broken_identity_of_ours_fails() {
    let change = |change: fn(&mut crate::results::record::TrialFacts)| {
        let mut ours = ours(&[3]);
        let wrong = ours
            .trials
            .iter_mut()
            .find(|facts| facts.cell.strategy == StrategyKind::Limited && facts.trial == 4)
            .unwrap();
        change(wrong);
        Reproduction::new(&[22], 7, &ours, &[])
    };
    // Agrees with the replay, which is as wrong.
    let wrong_rule = change(|facts| {
        facts.measured.replication.requests += 1;
        facts.expected.replication.requests += 1;
    });
    let wrong_count = change(|facts| facts.measured.replication.requests += 1);
    for broken in [wrong_rule, wrong_count] {
        assert_eq!(broken.outcome(), Outcome::Broken);
        assert!(broken.table(ALL).contains("! an identity"), "{}", broken.table(ALL));
    }
}

#[test]
fn trials_that_were_not_run_are_dashes() {
    let reproduction = Reproduction::new(&TABLES, 7, &ours(&[3]), &[]);
    assert_narrow(&reproduction.table(ALL));
    assert_eq!(reproduction.outcome(), Outcome::Success);
}

#[test]
fn two_reproductions_of_one_seed_have_the_same_bytes_and_no_clock() {
    let (one, other) = (reproduction().json(), reproduction().json());
    assert_eq!(one, other);
    for word in ["_ns", "cpu", "\"date", "kernel", "path", "directory", "epoch", "host"] {
        assert!(!one.contains(word), "{word}");
    }
}

#[test]
fn json_and_csv_carry_every_figure() {
    let reproduction = reproduction();
    let document: serde_json::Value = serde_json::from_str(&reproduction.json()).unwrap();
    assert_eq!(document["report"], "reproduce");
    let row = &document["runs"][0]["rows"][1];
    assert_eq!(row["published"]["requests"]["central"], 1432);
    assert_eq!(row["published"]["verdicts"]["limited"], "source-inconsistent");
    assert_eq!(row["ours"]["requests"]["full"], 4);
    let mean = &document["means"]["rows"][1];
    assert_eq!((&mean["column"], &mean["published"]["value"]), (&"boundary".into(), &3.6.into()));
    assert_eq!(mean["verdict"], "reproduced");
    let text = reproduction.csv();
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    assert_eq!(reader.headers().unwrap().iter().collect::<Vec<_>>(), HEADER);
    let rows = reader.records().collect::<Result<Vec<_>, _>>().unwrap();
    // Two sides of ten runs of turns and five columns in four tables; ten columns of three sources in
    // four sizes.
    assert_eq!(rows.len(), 2 * 10 * 6 * 4 + 10 * 3 * 4);
}
