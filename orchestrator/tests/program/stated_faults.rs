//! Faults that a scenario states, and losses on links, as a user meets them.

use crate::invocation::Place;
use orchestrator::results::event::Event;
use orchestrator::results::load::LoadRecovery;
use orchestrator::results::record::TrialEnd;
use shared_types::transport::link::LinkCounts;

/// Four crafts, a second, one block.
const MISSION: &str = r#"
name = "struck"
[fleet]
crafts = 4
[network]
links = 100
[run]
mode = "open"
rate-per-s = 800
duration-s = 1.0
asks-every-ms = [2]
blocks = 1
"#;

const EVERY: &str = "full,boundary,hierarchy,central-batched";

/// Runs [`MISSION`] with `more` under `strategies` to exit code 0; nothing stays. Returns the events and
/// what recovery did in each interval.
#[track_caller]
fn run(strategies: &str, more: &str) -> (Vec<Event>, Vec<LoadRecovery>) {
    let place = Place::for_fleets();
    place.write("struck.toml", &format!("{MISSION}{more}"));
    let finished = place.run(&["run", "struck.toml", "--strategies", strategies]).expect_code(0);
    place.assert_nothing_left(&[]);
    let results = place.results().unwrap();
    let events: Vec<Event> = results.events.into_iter().map(|line| line.event).collect();
    let broken = events.iter().find(|event| matches!(event, Event::Discrepancy { .. }));
    assert!(broken.is_none(), "{broken:?}\n{finished}");
    let records = results.loads.iter().map(|cell| &cell.record);
    let recovered: Vec<LoadRecovery> = records
        .map(|record| {
            assert!(!record.losses.is_partial(), "{record:?}");
            record.recovery.expect("the fleet recovers")
        })
        .collect();
    assert!(recovered.len() >= strategies.split(',').count(), "{finished}");
    (events, recovered)
}

#[test]
fn interval_with_a_stated_death_goes_on_and_its_successor_catches_up() {
    let (events, recovered) = run(
        EVERY,
        "[faults]\nrestart = \"on-failure\"\nrestart-limit = 50\n\
         restart-pause-ms = 1\n[[faults.process]]\ncraft = \"craft-1\"\nat-s = 0.3\n",
    );
    for recovery in &recovered {
        assert_eq!(recovery.deaths, 1, "{recovery:?}");
        assert!(recovery.records_missed > 0, "{recovery:?}");
        assert_eq!(recovery.states_missed, 0, "{recovery:?}");
    }
    let lost = events.iter().filter(|event| matches!(event, Event::CraftLost { .. }));
    assert_eq!(lost.count(), recovered.len());
    let mut lives = Vec::new();
    for event in &events {
        if let Event::CraftRestarted {
            name,
            incarnation,
            ready_ns,
            peers_noticed_ns,
            caught_up_ns,
            ..
        } = event
        {
            assert_eq!(name, "craft-1");
            assert!(peers_noticed_ns.is_some(), "{event:?}");
            assert!(caught_up_ns.is_some_and(|caught_up_ns| caught_up_ns > *ready_ns), "{event:?}");
            lives.push(*incarnation);
        }
    }
    assert!((1..).take(recovered.len()).eq(lives), "{events:?}");
}

#[test]
fn half_the_fleet_that_is_stopped_catches_up_and_nobody_is_restarted() {
    let (events, recovered) = run(
        EVERY,
        "[[faults.process]]\ncraft = \"craft-0\"\nat-s = 0.2\n\
         do = \"stop\"\nfor-s = 0.5\n\
         [[faults.process]]\ncraft = \"craft-2\"\nat-s = 0.3\ndo = \"stop\"\nfor-s = 1.0\n",
    );
    assert!(recovered.iter().all(|recovery| recovery.deaths == 0 && recovery.records_missed == 0));
    assert!(!events.iter().any(|event| matches!(event, Event::CraftLost { .. })), "{events:?}");
}

#[test]
fn half_of_everything_is_lost_on_links_and_made_up_for() {
    // One strategy: after every loss at an end somebody waits for a patience and more.
    let (_, recovered) = run("hierarchy", "[link]\nloss = 0.5\n");
    for recovery in recovered {
        assert!(recovery.links.lost > 100 && recovery.repeats > 100, "{recovery:?}");
    }
}

#[test]
fn doubling_delay_reordering_and_outages_on_links_are_made_up_for() {
    let (_, recovered) = run(
        EVERY,
        "[link]\nduplication = 0.2\ndelay-ms = 1.0\njitter-ms = 2.0\n\
         bandwidth-bits-per-s = 20e6\n\
         [[link.outages]]\ncraft = \"craft-1\"\nfrom-ms = 300.0\nuntil-ms = 600.0\n\
         [[link.outages]]\nbetween = [\"craft-0\", \"craft-2\"]\nfrom-ms = 700.0\nuntil-ms = 800.0\n",
    );
    for recovery in recovered {
        let LinkCounts { lost, cut_off, doubled, delayed, overtaken } = recovery.links;
        assert_eq!(lost, 0, "{recovery:?}");
        for count in [cut_off, doubled, delayed, overtaken, recovery.repeats] {
            assert!(count > 0, "{recovery:?}");
        }
    }
}

#[test]
fn stated_death_takes_its_trial_and_no_other() {
    let place = Place::for_fleets();
    let fault = "faults.process=[{ craft = \"aerial\", at-turn = 0 }]";
    let restart = "faults.restart=\"on-failure\"";
    let words = ["run", "two-craft", "--trials", "2", "--strategies", "boundary"];
    let words = [&words[..], &["--set", fault, "--set", restart]].concat();
    let finished = place.run(&words).expect_code(3);
    place.assert_nothing_left(&[]);
    let events = place.results().unwrap().events;
    let is_lost = |event: &Event| matches!(event, Event::EpochDone { end: TrialEnd::Partial, .. });
    let lost = events.iter().filter(|line| is_lost(&line.event)).count();
    assert_eq!(lost, 2, "{finished}");
    assert!(finished.stdout.contains("lived again"), "{finished}");
}
