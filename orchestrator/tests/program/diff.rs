//! Two runs beside each other as a user does it: exit codes and the first lines.

use crate::invocation::{Finished, Place};

/// Leaves a simulated run in `out/compare/...` and returns its directory.
fn run(place: &Place, out: &str, words: &[&str]) -> String {
    let compare = ["compare", "--simulated", "--sizes", "2,3", "--trials", "3", "--out", out];
    place.run(&[&compare, words].concat()).expect_code(0);
    format!("{out}/latest")
}

#[track_caller]
fn check(place: &Place, words: [&str; 2], code: i32, said: &str) -> Finished {
    let finished = place.run(&[&["diff"], &words[..]].concat()).expect_code(code);
    let text: Vec<&str> = finished.stdout.split_whitespace().collect();
    assert!(text.join(" ").contains(said), "{said}: {finished}");
    assert!(finished.stdout.lines().all(|line| line.chars().count() <= 80), "{finished}");
    finished
}

#[test]
fn equal_counts_pass_and_one_that_differs_is_a_regression() {
    let place = Place::new();
    let [a, b] = ["a", "b"].map(|out| run(&place, out, &[]));
    check(&place, [&a, &b], 0, "counts equal in all 42 trials");
    let trials = place.files().join(&b).join("trials.jsonl");
    let text = std::fs::read_to_string(&trials).unwrap();
    let (was, is) = ("\"conflicts\":0", "\"conflicts\":7");
    std::fs::write(&trials, text.replacen(was, is, 1)).unwrap();
    let told = check(&place, [&a, &b], 4, "counts differ in 1 of 42 trials");
    let first = told.stdout.lines().nth(2).unwrap();
    assert!(first.contains("counts differ"), "counts come first: {told}");
    assert!(told.stdout.contains("conflicts 0 -> 7"), "{told}");
    let json = place.run(&["diff", &a, &b, "--format", "json"]).expect_code(4).stdout;
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(
        (&json["outcome"], &json["counts"][0]["after"]),
        (&"regression".into(), &"7".into())
    );
}

#[test]
fn another_seed_is_another_experiment() {
    let place = Place::new();
    let (a, b) = (run(&place, "a", &[]), run(&place, "b", &["--seed", "2"]));
    check(&place, [&a, &b], 0, "the seed is 1 and 2");
    let c = run(&place, "c", &["--set", "network.links=17"]);
    check(&place, [&a, &c], 0, "`links = 300` and `links = 17`");
    place.run(&["diff", &a, "nowhere"]).expect_code(2);
}
