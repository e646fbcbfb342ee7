//! Capacity, the preset `paper` and the map, small: what is searched, offered, kept and drawn.

use crate::invocation::Place;
use orchestrator::results::load::SearchEnd;
use serde_json::Value;
use std::collections::BTreeSet;

/// What makes the search short: its ceiling is a rate that every machine bears.
const SHORT: &[&str] = &[
    "--set",
    "capacity.probe-s=0.2",
    "--set",
    "capacity.first-per-s=200",
    "--set",
    "capacity.highest-per-s=400",
    "--set",
    "run.duration-s=0.2",
];

#[test]
fn small_paper_searches_capacity_and_offers_shares_of_it() {
    let place = Place::for_fleets();
    let words = [
        "compare",
        "paper",
        "--sizes",
        "3",
        "--blocks",
        "1",
        "--trials",
        "2",
        "--strategies",
        "null,boundary,central-batched",
        "--set",
        "run.timing-epochs=1",
        "--set",
        "run.timing-turns=20",
        "--set",
        "capacity.bursts=[1,4]",
        "--set",
        "capacity.loads-percent=[50]",
    ];
    let ran = place.run(&[&words[..], SHORT].concat()).expect_code(0);
    place.assert_nothing_left(&[]);
    let run = place.results().unwrap();
    assert_eq!(run.missing, [], "{ran}");
    let searched: BTreeSet<String> = run
        .capacities
        .iter()
        .map(|one| {
            format!("{} {} {} {}", one.cell.size, one.cell.block, one.cell.strategy, one.burst)
        })
        .collect();
    assert_eq!(searched.len(), 2 * 2, "strategies, bursts: {searched:?}");
    assert!(!searched.iter().any(|one| one.contains("null")), "nothing is sent there");
    for one in &run.capacities {
        assert_eq!(one.end() == SearchEnd::Nothing, one.capacity().is_none());
        assert!(one.probes.iter().all(|probe| probe.offered_per_s <= 400.0), "{one:?}");
        let is_central = one.cell.strategy.has_centre();
        assert_eq!(one.asks_every_ns.is_some(), is_central);
        assert!(is_central || one.end() == SearchEnd::Ceiling, "{one:?}");
    }
    let half = run.loads.iter().map(|cell| &cell.record).find(|record| record.load == "50%");
    let offered = half.expect("half of a capacity").offered_per_s;
    assert!((100.0..320.0).contains(&offered), "half of 400, as random as it is: {offered}");
    let latest = std::fs::read_link(place.files().join("runs/latest")).unwrap();
    let directory = format!("runs/{}", latest.display());
    let report = place.run(&["report", &directory, "--pictures", "none"]).expect_code(0);
    assert_eq!(report.stdout, ran.stdout);
    assert!(ran.stdout.contains("thousands of applied changes a second"), "{ran}");
}

#[test]
fn paper_says_how_long_it_takes_before_it_starts() {
    let place = Place::for_fleets();
    let invocation = place.start(&["compare", "paper"]);
    crate::shared::until("its length to be said", || {
        invocation.said().contains("this takes about").then_some(())
    });
    invocation.signal(rustix::process::Signal::INT);
    let finished = invocation.finish().expect_code(130);
    assert!(finished.stderr.contains("compare --resume runs/paper/"), "{finished}");
    place.assert_nothing_left(&[]);
}

#[test]
fn small_map_is_drawn_from_its_directory() {
    let place = Place::for_fleets();
    let words = [
        "sweep",
        "map-small",
        "--vary",
        "fleet.crafts=3,4",
        "--vary",
        "k-beta=0.5,3",
        "--blocks",
        "2",
        "--set",
        "run.duration-s=0.2",
        "--set",
        "run.rate-per-s=500",
    ];
    let ran = place.run(&words).expect_code(0);
    assert!(ran.stderr.contains("3 cells, "), "of three crafts, two others share at most: {ran}");
    assert!(ran.stdout.contains("Where counting messages"), "{ran}");
    let report = place.run(&["report", "runs/latest", "--format", "json"]).expect_code(0);
    let report: Value = serde_json::from_str(&report.stdout).unwrap();
    let cells = report["map"]["cells"].as_array().unwrap();
    assert_eq!(cells.len(), 3, "{report}");
    for cell in cells {
        let by_count = if cell["k_beta"] == 0.5 { "boundary" } else { "full" };
        assert_eq!((&cell["by_count"], &cell["n"]), (&by_count.into(), &2.into()), "{cell}");
        assert_eq!(cell["by_cpu"]["strategy"], Value::Null, "two blocks name nobody: {cell}");
    }
    place.run(&["report", "runs/latest"]).expect_code(0);
    let picture = place.files().join("runs/latest/pictures/map.svg");
    assert!(std::fs::read_to_string(picture).unwrap().contains("<svg"));
    place.assert_nothing_left(&[]);
}
