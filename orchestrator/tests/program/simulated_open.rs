//! Open mode on the virtual clock, as a user meets it.

use crate::invocation::Place;
use orchestrator::results::event::Event;
use orchestrator::results::load::LoadRecord;
use orchestrator::results::read::RunData;
use serde_json::Value;

/// Four crafts, half a second, over links that do everything.
const MISSION: &str = r#"
name = "lossy"
[fleet]
crafts = 4
[topology]
tree = "binary"
[network]
linking = "shared"
facts = 100
rules = 100
actions = 100
initial = 0
finals = 10
boundary-fraction = 0.4
sharers = 2
[replication]
strategies = ["null", "boundary", "full", "limited", "hierarchy", "central-batched"]
[run]
mode = "open"
rate-per-s = 400
duration-s = 0.5
asks-every-ms = [5]
[trace]
reads-per-s = 200
[link]
loss = 0.25
duplication = 0.1
delay-ms = 2.0
jitter-ms = 1.0
outages = [{ craft = "craft-2", from-ms = 100.0, until-ms = 150.0 }]
"#;

/// A place with [`MISSION`] and `more` in it.
fn place(more: &str) -> Place {
    let place = Place::new();
    place.write("lossy.toml", &format!("{MISSION}{more}"));
    place
}

/// The records that `words` leaves, which ends with `code`.
#[track_caller]
fn records(place: &Place, words: &[&str], code: i32) -> (RunData, Vec<LoadRecord>) {
    place.run(words).expect_code(code);
    let results = place.results().unwrap();
    assert_eq!(results.missing, []);
    let records = results.loads.iter().map(|cell| cell.record.clone()).collect();
    (results, records)
}

#[test]
fn one_seed_gives_the_same_counts_digests_and_virtual_times_byte_for_byte() {
    let place = place("");
    let simulated = |words: &[&str]| {
        let (results, records) = records(&place, words, 0);
        let file = |name: &str| std::fs::read(results.directory.join(name)).unwrap();
        (records, [file("loads.jsonl"), file("measurements.csv")])
    };
    let (first, files) = simulated(&["simulate", "lossy.toml"]);
    assert_eq!(first.len(), 6);
    for words in [&["simulate", "lossy.toml"][..], &["run", "lossy.toml", "--simulated"]] {
        let (again, files_again) = simulated(words);
        assert_eq!(first, again);
        assert!(files == files_again, "{words:?}");
    }
    // Whoever is played alone does the same as among others.
    let (alone, _) = simulated(&["simulate", "lossy.toml", "--strategies", "hierarchy"]);
    let among = first.iter().find(|record| record.cell.strategy == alone[0].cell.strategy).unwrap();
    assert_eq!(LoadRecord { place: among.place, ..alone[0].clone() }, *among);
    let (other, _) = simulated(&["simulate", "lossy.toml", "--seed", "2"]);
    for (one, other) in first.iter().zip(&other) {
        assert_ne!(one.simulated, other.simulated);
        assert_ne!(one.needed, other.needed);
    }
}

#[test]
fn what_is_sent_arrives_or_was_lost_and_every_change_is_known_at_last() {
    let place = place("");
    let (results, records) = records(&place, &["simulate", "lossy.toml"], 0);
    let disagrees = |event: &Event| matches!(event, Event::Discrepancy { .. });
    assert!(!results.events.iter().any(|line| disagrees(&line.event)));
    for record in &records {
        let (counts, overhead) = (record.counts.total(), record.overhead);
        let sent =
            counts.transmissions + overhead.repair.transmissions + overhead.ack.transmissions;
        let received = counts.deliveries + overhead.repair.deliveries + overhead.ack.deliveries;
        let recovery = record.recovery.unwrap();
        let links = recovery.links;
        let arrived = received + record.losses.repeats;
        let departed = arrived + links.lost + links.cut_off - links.doubled;
        match record.cell.strategy.name() {
            "null" => assert_eq!(counts.transmissions, 0),
            // A multicast goes to all three others.
            "full" => {
                assert_eq!(departed, sent + 2 * record.counts.replication.transmissions);
            }
            _ => assert_eq!(departed, sent, "{record:?}"),
        }
        if record.cell.strategy.name() != "null" {
            assert!(links.lost > 20 && links.cut_off > 0 && links.doubled > 0, "{links:?}");
            assert!(recovery.repeats > 20, "{recovery:?}");
            let known = record.applied_by_end + record.applied_after_end + record.censored;
            assert_eq!(known, record.needed);
            // What was not delivered was learnt from a state.
            assert!(record.censored <= recovery.learnt, "{record:?}");
        }
        assert_eq!((record.fleet_cpu_ns, record.sleeps, record.orchestrator_cpu_ns), (0, 0, 0));
        assert!(record.simulated.unwrap().virtual_ns >= record.duration_ns / 2);
    }
}

#[test]
fn a_virtual_time_is_shown_as_one_and_compared_with_nothing() {
    let place = place("");
    let table = place.run(&["simulate", "lossy.toml", "--blocks", "2"]).expect_code(0).stdout;
    let all = place.run(&["report", "runs/latest", "--all"]).expect_code(0).stdout;
    for text in [&table, &all] {
        assert!(text.contains("virtual ms") && text.contains("No processor took part"), "{text}");
        assert!(!text.contains("CPU  ") && !text.contains("A-A floor"), "{text}");
        assert!(text.lines().all(|line| line.len() <= 80 || line.contains('/')), "{text}");
    }
    assert!(all.contains("us of the virtual clock"), "{all}");
    let json = place.run(&["report", "runs/latest", "--format", "json"]).expect_code(0).stdout;
    let document: Value = serde_json::from_str(&json).unwrap();
    let timing = &document["timing"];
    for nothing in ["compared_loads", "orders", "baselines", "stamp_effects"] {
        assert!(timing[nothing].as_array().is_none_or(Vec::is_empty), "{nothing}");
    }
    for row in timing["loads"].as_array().unwrap() {
        assert_eq!((&row["is_simulated"], &row["again"]), (&true.into(), &0.into()), "{row}");
        assert!(row["figures"]["cpu-per-application"].is_null(), "{row}");
    }
}

#[test]
fn processes_die_and_stop_as_stated_and_only_where_nobody_follows_the_run_is_partial() {
    let faults = "[[faults.process]]\ncraft = \"craft-1\"\nat-s = 0.1\n\
                  [[faults.process]]\ncraft = \"craft-3\"\nat-s = 0.2\ndo = \"stop\"\nfor-s = 0.1\n";
    let followed = place(&format!("[faults]\nrestart = \"on-failure\"\n{faults}"));
    let (_, played) = records(&followed, &["simulate", "lossy.toml"], 0);
    for record in &played {
        let recovery = record.recovery.unwrap();
        assert_eq!(recovery.deaths, 1, "{record:?}");
        assert_eq!(recovery.states_missed, 0, "{record:?}");
    }
    let (_, again) = records(&followed, &["simulate", "lossy.toml"], 0);
    assert_eq!(played, again);
    let (results, played) = records(&place(faults), &["simulate", "lossy.toml"], 3);
    assert!(played.is_empty());
    assert!(results.events.iter().any(|line| matches!(line.event, Event::CraftLost { .. })));
}

#[test]
fn what_offers_loads_beside_its_trials_plays_both() {
    let place = place("[[load]]\nname = \"little\"\nrate-per-s = 100\n");
    let words = ["simulate", "lossy.toml", "--set", "run.mode=lockstep", "--trials", "2"];
    let (results, played) = records(&place, &words, 0);
    assert_eq!((results.trials.len(), played.len()), (12, 6));
    assert!(played.iter().all(|record| record.load == "little"));
    let compared = ["compare", "--simulated", "--sizes", "10", "--trials", "1"];
    let (_, played) = records(&place, &compared, 0);
    assert!(played.is_empty(), "`compare --simulated` is counts only");
}

#[test]
fn a_sweep_over_losses_is_a_table_of_what_they_cost() {
    let place = Place::new();
    let smaller = ["--set", "run.duration-s=0.3", "--set", "fleet.crafts=4"];
    let words = ["sweep", "lossy-links", "--simulated", "--strategies", "boundary,central-batched"];
    let table = place.run(&[&words[..], &smaller].concat()).expect_code(0).stdout;
    for loss in ["0", "0.1", "0.25", "0.5", "0.75"] {
        assert!(table.contains(&format!("link.loss={loss}\n")), "{table}");
    }
    assert!(table.contains("virtual ms") && table.contains("5 of 5 done"), "{table}");
    assert!(table.lines().all(|line| line.len() <= 80 || line.contains('/')), "{table}");
    let lost: Vec<u64> = table
        .lines()
        .filter(|line| line.starts_with("boundary "))
        .map(|line| line.split_whitespace().nth(6).unwrap().parse().unwrap())
        .collect();
    assert_eq!(lost[0], 0, "{table}");
    assert!(lost.len() == 5 && lost.is_sorted() && lost[4] > lost[1], "{table}");
}
