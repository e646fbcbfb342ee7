//! Reports over made-up runs: shape, width, and that every form has every figure.

use super::compare::{Compare, PublishedMean};
use super::run::Mission;
use super::table::{Colour, WIDTH, exact, short};
use super::{Look, Report};
use crate::outcome::Outcome;
use crate::results::event::{Event, ProcessEnd};
use crate::results::figure::Figure;
use crate::results::load::{LoadRecovery, Saturation};
use crate::results::read::read_run;
use crate::results::record::{Cell, FinalFact, TrialEnd};
use crate::results::sample::{
    STRATEGIES, leave_blocks, leave_loads, leave_run, load, provenance, timing, trial,
};
use crate::results::statistics::{Distribution, histogram_of};
use crate::results::store::{Place, Store, TRIALS_FILE};
use crate::results::summary::Summary;
use serde_json::Value;
use shared_types::wire::StrategyKind;
use std::collections::{BTreeMap, BTreeSet};

pub(super) const ALL: Look = Look { colour: Colour::Never, all: true };
pub(super) const FIRST_SCREEN: Look = Look { colour: Colour::Never, all: false };

pub(super) fn sample(sizes: &[u32]) -> Summary {
    let place = tempfile::tempdir().unwrap();
    leave_run(place.path(), sizes)
}

fn published() -> Vec<PublishedMean> {
    let figure = Figure::count(Some(13.8), 10, "request", "published mean");
    [(StrategyKind::Full, true), (StrategyKind::Limited, false)]
        .into_iter()
        .map(|(strategy, is_explained)| PublishedMean {
            size: 2,
            strategy,
            figure: figure.clone(),
            is_explained,
        })
        .collect()
}

fn compare_of(summary: Summary) -> Compare {
    Compare {
        summary,
        published: published(),
        directory: "runs/paper/1-7".into(),
        program: "slateswarm".into(),
    }
}

fn mission_of(summary: Summary) -> Mission {
    Mission { summary, directory: "runs/own/1-7".into(), program: "slateswarm".into() }
}

/// A run of `fill` that ended with `outcome`.
fn run_of(outcome: Outcome, fill: impl FnOnce(&mut Store)) -> Summary {
    let place = tempfile::tempdir().unwrap();
    let mut store = Store::create(Place::Exactly(place.path()), &provenance(), "").unwrap();
    fill(&mut store);
    store.finish(outcome).unwrap()
}

pub(super) fn assert_narrow(text: &str) {
    for line in text.lines() {
        assert!(line.len() <= WIDTH, "{} columns: {line}", line.len());
        assert!(line.is_ascii(), "{line}");
    }
}

const SMALL_RUN: &str = "\
paper, seed 7: release build 0123456789ab on Linux 6.8.0, A processor
                     requests          means a trial  turn time, us  CPU
strategy         ours  publ.  trans deliv bytes hops  p50  p99 over over
2 crafts, 1.0-1.5 processes per core, 10 trials, 1000 turns timed
null              0.0=      -   0.0   0.0   0.0  0.0 27.0 31.9    -    -
full              4.6=  13.8    4.6   4.6   460  4.6 32.0 36.9  5.0  5.0
boundary          2.8=      -   2.8   2.8   280  2.8 37.0 41.9 10.0 10.0
limited           2.8=  13.8*   2.8   2.8   280  2.8 42.0 46.9 15.0 15.0
hierarchy         3.7=      -   3.7   3.7   370  3.7 47.0 51.9 20.0 20.0
central         473.2=      -   946   946   95k  473 57.0 61.9 30.0 30.0
central-batched  13.2=      -  26.4  26.4  2640 13.2 62.0 66.9 35.0 35.0

request       all changes of one firing over one hop; a multicast is one
= !           counts of all trials equal the independent replay's; or do not
trans         transmission: one sample published, replies of a centre included
deliv         delivery: one sample received by another craft
bytes, hops   published records and headers; hops of all final deliveries
publ.         mean of ten published runs (dissertation, Table 25)
*             source inconsistent: no rule explains this mean
turn time     a lockstep turn with its ledger; - if fewer than 10 lie beyond
over, CPU     excess over null, which sends nothing: of p50; of CPU a turn, us

results   runs/paper/1-7
next      slateswarm report runs/paper/1-7 --all
          slateswarm reproduce
          slateswarm run two-craft
";

#[test]
fn the_first_screen_of_a_small_run_is_this() {
    let text = compare_of(sample(&[2])).table(FIRST_SCREEN);
    assert_eq!(text, SMALL_RUN, "\n{text}");
}

#[test]
fn no_table_is_wider_than_a_terminal() {
    let summary = sample(&[2, 3, 5, 10, 128]);
    for look in [FIRST_SCREEN, ALL] {
        assert_narrow(&compare_of(summary.clone()).table(look));
        assert_narrow(&mission_of(summary.clone()).table(look));
    }
    // Numbers of every magnitude, as a loaded machine and a large fleet bring them.
    let huge = run_of(Outcome::Success, |store| {
        for strategy in STRATEGIES {
            let mut record = trial(128, strategy, 0);
            for counts in [
                &mut record.deterministic.measured.replication,
                &mut record.deterministic.expected.replication,
            ] {
                counts.requests = 123_456_789;
                counts.transmissions = 123_456_789;
                counts.deliveries = 98_765_432_109;
                counts.bytes_sent = 9_876_543_210_987;
            }
            for craft in &mut record.deterministic.crafts {
                craft.measured = record.deterministic.measured;
                craft.hops = 98_765_432_109;
            }
            record.deterministic.crafts[0].name = "a-very-long-name-of-a-craft-indeed".into();
            store.append_trial(&record).unwrap();
            let (mut record, mut times) = timing(128, strategy, 20_000);
            times[0].push(59_999_999_999);
            let all = histogram_of(times.iter().flatten().copied());
            record.turn_time = Distribution::of(&all);
            record.fleet_cpu_ns *= 4000;
            store.append_timing(&record, &times).unwrap();
        }
    });
    for look in [FIRST_SCREEN, ALL] {
        assert_narrow(&compare_of(huge.clone()).table(look));
        assert_narrow(&mission_of(huge.clone()).table(look));
    }
    assert!(compare_of(huge).table(FIRST_SCREEN).contains("p99.9"), "20,000 turns carry p99.9");
}

#[test]
fn colour_is_only_there_when_asked_for() {
    let compare = compare_of(sample(&[2]));
    assert!(!compare.table(ALL).contains('\u{1b}'));
    let coloured = compare.table(Look { colour: Colour::Always, all: false });
    assert!(coloured.contains('\u{1b}'));
}

/// Every way in which a table may print `value`.
fn forms(value: f64) -> Vec<String> {
    let scaled = [1.0, 1e3, 1e6].map(|scale| Some(value / scale));
    let shortened = scaled.iter().flat_map(|&value| [4, 5, 6, 8].map(|signs| short(value, signs)));
    let plain = (0..4).map(|decimals| exact(Some(value), decimals));
    shortened.chain(plain).collect()
}

type Key = (u64, String);

fn add_forms(found: &mut BTreeMap<Key, BTreeSet<String>>, key: &Key, value: &Value) {
    match value {
        Value::Number(number) => {
            let set = found.entry(key.clone()).or_default();
            set.extend(forms(number.as_f64().unwrap()));
        }
        Value::Object(fields) => fields.values().for_each(|field| add_forms(found, key, field)),
        Value::Array(items) => items.iter().for_each(|item| add_forms(found, key, item)),
        Value::Null | Value::Bool(_) | Value::String(_) => {}
    }
}

/// All numbers of a JSON report by size and strategy, in every form.
fn numbers_in_json(text: &str) -> BTreeMap<Key, BTreeSet<String>> {
    let document: Value = serde_json::from_str(text).unwrap();
    let mut found = BTreeMap::new();
    for (part, list) in [
        ("deterministic", "cells"),
        ("deterministic", "crafts"),
        ("deterministic", "trials"),
        ("deterministic", "published"),
        ("timing", "cells"),
        ("timing", "loads"),
    ] {
        for entry in document[part][list].as_array().unwrap() {
            let strategy = entry["strategy"].as_str().unwrap().to_owned();
            add_forms(&mut found, &(entry["size"].as_u64().unwrap(), strategy), entry);
        }
    }
    found
}

fn numbers_in_csv(text: &str) -> BTreeMap<Key, BTreeSet<String>> {
    let mut found: BTreeMap<Key, BTreeSet<String>> = BTreeMap::new();
    for row in csv::Reader::from_reader(text.as_bytes()).records() {
        let row = row.unwrap();
        let set = found.entry((row[1].parse().unwrap(), row[2].to_owned())).or_default();
        for cell in [&row[3], &row[6], &row[7], &row[8], &row[9], &row[13]] {
            if let Ok(value) = cell.parse::<f64>() {
                set.extend(forms(value));
            }
        }
    }
    found
}

/// Every number in a row of `table` with the size and strategy that it belongs to.
fn numbers_in_table(table: &str) -> Vec<(Key, String)> {
    let (mut size, mut strategy, mut found) = (0, None, Vec::new());
    for line in table.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        if let [number, crafts, rest @ ..] = words.as_slice()
            && crafts.starts_with("crafts")
        {
            size = number.parse().unwrap();
            strategy = rest.first().map(|word| word.trim_end_matches(',').to_owned());
            continue;
        }
        let Some(first) = words.first() else { continue };
        let named = STRATEGIES.iter().find(|kind| kind.name() == *first);
        let section =
            strategy.clone().filter(|name| STRATEGIES.iter().any(|kind| kind.name() == name));
        let Some(owner) = named.map(|kind| kind.name().to_owned()).or(section) else { continue };
        for word in &words[1..] {
            let word = word.trim_end_matches(['=', '!', '*']);
            let is_digest = word.len() == 16;
            if word.starts_with(|sign: char| sign.is_ascii_digit()) && !is_digest {
                found.push(((size, owner.clone()), word.to_owned()));
            }
        }
    }
    found
}

#[test]
fn every_number_of_the_tables_is_in_json_and_csv() {
    let compare = compare_of(sample(&[2, 3, 10]));
    let (json, csv) = (numbers_in_json(&compare.json()), numbers_in_csv(&compare.csv()));
    let printed = numbers_in_table(&compare.table(ALL));
    assert!(printed.len() > 1000, "{} numbers found", printed.len());
    for (key, number) in printed {
        assert!(json[&key].contains(&number), "{number} of {key:?} is not in the JSON form");
        assert!(csv[&key].contains(&number), "{number} of {key:?} is not in the CSV form");
    }
}

#[test]
fn the_json_form_has_its_promised_keys() {
    let document: Value = serde_json::from_str(&compare_of(sample(&[2])).json()).unwrap();
    assert_eq!(document["report"], "compare");
    assert_eq!(document["format"], 1);
    assert_eq!(document["deterministic"]["scenario"], "paper");
    assert_eq!(document["deterministic"]["seed"], 7);
    assert_eq!(document["timing"]["provenance"]["versions"]["iceoryx2"], "0.10.0");
    let figure = &document["deterministic"]["cells"][1]["figures"]["requests"];
    let keys: BTreeSet<&str> = figure.as_object().unwrap().keys().map(String::as_str).collect();
    assert_eq!(keys, BTreeSet::from(["value", "n", "low", "high", "unit", "load", "label"]));
    assert_eq!((figure["value"].as_f64(), figure["n"].as_u64()), (Some(4.6), Some(10)));
    let time = &document["timing"]["cells"][1]["figures"]["turn-time-p50"];
    assert_eq!((&time["unit"], &time["load"]), (&"ns".into(), &"lockstep".into()));
    let dash = &document["timing"]["cells"][1]["figures"]["turn-time-p99.9"]["value"];
    assert!(dash.is_null(), "a dash is null");
}

#[test]
fn a_report_of_a_directory_is_the_report_of_the_run() {
    let place = tempfile::tempdir().unwrap();
    let summary = leave_run(place.path(), &[2, 3]);
    let again = Summary::of(&read_run(place.path()).unwrap());
    assert_eq!(compare_of(again.clone()).table(ALL), compare_of(summary.clone()).table(ALL));
    assert_eq!(compare_of(again).json(), compare_of(summary).json());
}

#[test]
fn a_torn_directory_is_reported_with_what_it_lacks() {
    let place = tempfile::tempdir().unwrap();
    leave_run(place.path(), &[2]);
    let path = place.path().join(TRIALS_FILE);
    let whole = std::fs::read(&path).unwrap();
    std::fs::write(&path, &whole[..whole.len() - 9]).unwrap();
    let text = compare_of(Summary::of(&read_run(place.path()).unwrap())).table(FIRST_SCREEN);
    assert!(text.contains("! trials.jsonl: line 70 is torn"), "{text}");
    assert!(text.contains("9-10 trials"), "{text}");
}

#[test]
fn losses_and_broken_identities_are_told_before_the_legend() {
    let summary = run_of(Outcome::Broken, |store| {
        let end = ProcessEnd::Signal(9);
        let phase = "turn 3 of trial 0".into();
        store.event(Event::CraftLost { size: 3, name: "rover".into(), end, phase }).unwrap();
        let mut wrong = trial(3, StrategyKind::Full, 0);
        wrong.deterministic.measured.replication.requests += 1;
        wrong.deterministic.crafts[0].measured.replication.requests += 1;
        wrong.timing.losses.gaps = 2;
        store.append_trial(&wrong).unwrap();
    });
    let text = compare_of(summary).table(FIRST_SCREEN);
    assert_narrow(&text);
    let (before, _) = text.split_once("request       all").unwrap();
    for told in [
        "craft `rover` of the fleet of 3 was lost (signal 9) in turn 3 of trial 0",
        "requests 4 and 3",
        "crafts that differ:",
        "lost or refused: 2 missing",
        "exit code 1",
        "4.0!",
    ] {
        assert!(before.contains(told), "{told}\n{text}");
    }
}

#[test]
fn a_simulated_run_has_no_columns_of_times() {
    let summary = run_of(Outcome::Success, |store| {
        let mut record = trial(3, StrategyKind::Boundary, 0);
        record.timing.turn_times_ns.clear();
        store.append_trial(&record).unwrap();
    });
    for text in
        [compare_of(summary.clone()).table(FIRST_SCREEN), mission_of(summary).table(FIRST_SCREEN)]
    {
        assert!(!text.contains("p50"), "{text}");
        assert!(text.contains("boundary"), "{text}");
    }
}

#[test]
fn a_mission_says_who_reached_the_final_fact() {
    let summary = run_of(Outcome::Success, |store| {
        for (number, strategy) in
            [(0, StrategyKind::Full), (0, StrategyKind::Boundary), (1, StrategyKind::Boundary)]
        {
            let mut record = trial(2, strategy, number);
            record.deterministic.final_fact = Some(FinalFact {
                craft: "orbiter".into(),
                fact: "target-confirmed".into(),
                turn: 17,
            });
            store.append_trial(&record).unwrap();
        }
        let mut stalled = trial(2, StrategyKind::Limited, 0);
        stalled.deterministic.end = TrialEnd::Stalled;
        store.append_trial(&stalled).unwrap();
    });
    let text = mission_of(summary).table(FIRST_SCREEN);
    assert_narrow(&text);
    for told in [
        "full            finished in turn 17: `target-confirmed` became true on `orbiter`",
        "boundary        2 finished; mean turns 1.5; final fact reached by orbiter 2x",
        "limited         stalled after 1 turns",
        "1 stalled",
    ] {
        assert!(text.contains(told), "{told}\n{text}");
    }
}

#[test]
fn ratios_stand_beside_their_intervals_with_what_they_are_worth() {
    let place = tempfile::tempdir().unwrap();
    let summary = leave_blocks(&place.path().join("nine"), 7, 9, 1.2);
    let text = compare_of(summary.clone()).table(FIRST_SCREEN);
    assert_narrow(&text);
    for told in ["over that of boundary, and 95 % interval, 9 blocks", ">\n", "A-A floor", "+-%"] {
        assert!(text.contains(told), "{told}\n{text}");
    }
    let ratio = short(Some(summary.timing.compared[0].comparison.ratio), 4);
    assert!(text.contains(&format!(" {ratio} ")), "{ratio}\n{text}");
    let csv = compare_of(summary).csv();
    assert!(csv.contains("turn-time-p50-to-boundary-verdict,winner"), "{csv}");
    let few = compare_of(leave_blocks(&place.path().join("three"), 7, 3, 1.2));
    assert!(few.table(FIRST_SCREEN).contains("`--blocks 9` may"), "{}", few.table(FIRST_SCREEN));
    assert_narrow(&few.table(ALL));
}

fn loaded(blocks: u32) -> Summary {
    let place = tempfile::tempdir().unwrap();
    leave_loads(place.path(), 5, blocks, 2_000, 1.2)
}

#[test]
fn loads_stand_on_the_first_screen_line_by_line_with_what_comparisons_are_worth() {
    let text = compare_of(loaded(3)).table(FIRST_SCREEN);
    assert_narrow(&text);
    for told in [
        "host clean",
        "10 crafts, load common: 4000 writes/s, needed by 0.90 others, 3 blocks, n 6000",
        "10 crafts, load common, over boundary, and 95 % interval",
        "A-A floor",
        "among 6 comparisons: `--blocks 9` may",
        "knowledge     intended to applied",
    ] {
        assert!(text.contains(told), "{told}\n{text}");
    }
    for look in [FIRST_SCREEN, ALL] {
        assert_narrow(&mission_of(loaded(3)).table(look));
        assert_narrow(&compare_of(loaded(9)).table(look));
    }
    let text = mission_of(loaded(3)).table(FIRST_SCREEN);
    assert!(text.contains("load common") && !text.contains("request  "), "{text}");
}

#[test]
fn every_number_of_the_tables_of_loads_is_in_json_and_csv() {
    let compare = compare_of(loaded(3));
    let (json, csv) = (numbers_in_json(&compare.json()), numbers_in_csv(&compare.csv()));
    let mut tables = super::loads::main_table(&compare.summary).render(Colour::Never);
    for (_, table) in super::loads::details(&compare.summary) {
        tables += &table.render(Colour::Never);
    }
    let printed = numbers_in_table(&tables.replace('%', ""));
    assert!(printed.len() > 100, "{} numbers found", printed.len());
    for (key, number) in printed {
        assert!(json[&key].contains(&number), "{number} of {key:?} is not in the JSON form");
        assert!(csv[&key].contains(&number), "{number} of {key:?} is not in the CSV form");
    }
}

#[test]
fn what_recovery_did_is_shown_under_all_where_it_did_anything() {
    const TITLE: &str = "What recovery did, sums over blocks";
    let text = mission_of(loaded(3)).table(ALL);
    let (_, table) = text.split_once(TITLE).unwrap();
    let rows: Vec<&str> = table.lines().filter(|line| line.starts_with("full ")).collect();
    let words: Vec<&str> = rows[0].split_whitespace().collect();
    assert_eq!(words, ["full", "6", "93", "123", "15", "171", "9", "33", "3"]);
    assert!(!mission_of(loaded(3)).table(FIRST_SCREEN).contains(TITLE));
    let without = run_of(Outcome::Success, |store| {
        let cell = Cell { block: 0, size: 10, strategy: StrategyKind::Full };
        let (mut record, histograms) = load(cell, 0, "high", 2_000, 1.0);
        record.recovery = Some(LoadRecovery::default());
        store.append_load(&record, &histograms).unwrap();
    });
    assert!(!mission_of(without).table(ALL).contains(TITLE), "all are zero");
}

#[test]
fn orders_that_disagree_are_said_before_any_table() {
    let mut summary = loaded(3);
    let orders = &mut summary.timing.orders[0];
    (orders.by_count, orders.disagree) =
        (vec![StrategyKind::Full, StrategyKind::Boundary, StrategyKind::CentralBatched], true);
    for text in
        [compare_of(summary.clone()).table(FIRST_SCREEN), mission_of(summary).table(FIRST_SCREEN)]
    {
        assert_narrow(&text);
        let (before, _) = text.split_once("strategy ").unwrap();
        assert!(before.contains("counting messages and measuring disagree"), "{text}");
        assert!(before.contains("by samples  full < boundary < central-batched"), "{text}");
    }
}

#[test]
fn what_is_saturated_late_or_not_stationary_is_said_and_has_no_percentiles() {
    let summary = run_of(Outcome::Success, |store| {
        for strategy in [StrategyKind::Null, StrategyKind::Boundary, StrategyKind::Full] {
            let cell = Cell { block: 0, size: 10, strategy };
            let (mut record, histograms) = load(cell, 0, "high", 2_000, 1.0);
            if strategy == StrategyKind::Full {
                record.saturated = Some(Saturation::Unapplied);
                record.second_half_ratio = Some(1.32);
                record.orchestrator_cpu_ns = 5_000_000;
            }
            store.append_load(&record, &histograms).unwrap();
        }
    });
    assert_narrow(&mission_of(summary.clone()).table(ALL));
    let text = compare_of(summary).table(FIRST_SCREEN);
    assert_narrow(&text);
    for told in [
        "! full at high: saturated, below 99.9 % known by the end",
        "! full at high: not stationary, second half 1.32 of the first",
        "! full at high: the orchestrator used 1.00 % of a core",
    ] {
        assert!(text.contains(told), "{told}\n{text}");
    }
    let row = text.lines().find(|line| line.starts_with("full ")).unwrap();
    let words: Vec<&str> = row.split_whitespace().collect();
    assert_eq!(words[1..4], ["saturated", "-", "-"], "{row}");
}
