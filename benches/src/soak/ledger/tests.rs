//! Soaks made up for tests: one in which all adds up, and everything that may be wrong with it.

use super::{KILLS, LOSS, lacks};
use crate::soak::Soak;
use orchestrator::outcome::Outcome;
use orchestrator::results::event::{Event, EventLine, ProcessEnd};
use orchestrator::results::load::{LoadRecord, LoadRecovery};
use orchestrator::results::read::{LoadCell, RunData};
use orchestrator::results::record::{Cell, Counts, Overhead};
use orchestrator::results::statistics::Distribution;
use shared_types::wire::{LinkCounts, Losses, Stage, StrategyKind, Traffic};
use std::collections::BTreeMap;

const SAMPLES: u64 = 1_000_000;

const LOST: LinkCounts =
    LinkCounts { lost: 10_101, cut_off: 0, doubled: 0, delayed: 0, overtaken: 0 };

fn soak(has_faults: bool) -> Soak {
    Soak {
        slateswarm: "slateswarm".into(),
        crafts: 10,
        seconds: 60,
        rate_per_s: 2000,
        strategy: "boundary".to_owned(),
        has_faults,
        set: Vec::new(),
        out: "runs".into(),
    }
}

fn record(part: u32, has_faults: bool) -> LoadRecord {
    let traffic = Traffic { transmissions: SAMPLES, deliveries: SAMPLES, ..Traffic::default() };
    let counts = Counts { replication: traffic, ..Counts::default() };
    let recovery =
        LoadRecovery { deaths: KILLS, repeats: 9, links: LOST, ..LoadRecovery::default() };
    let lateness = Distribution { max_ns: 900_000_000, ..Distribution::default() };
    LoadRecord {
        cell: Cell { block: 0, size: 10, strategy: StrategyKind::Boundary },
        again: 0,
        place: 0,
        load: part.to_string(),
        offered_per_s: 2000.0,
        duration_ns: 10_000_000_000,
        asks_every_ns: None,
        warm_up_ns: 200_000_000,
        writes: 20_000,
        unplayed: 0,
        needed: SAMPLES,
        applied_by_end: SAMPLES,
        applied_after_end: 0,
        censored: 0,
        saturated: None,
        counts,
        expected: (!has_faults).then_some(counts),
        overhead: Overhead::default(),
        losses: Losses::default(),
        recovery: has_faults.then_some(recovery),
        stages: BTreeMap::from([(Stage::Schedule, lateness)]),
        shares: BTreeMap::new(),
        second_half_ratio: None,
        reads: 0,
        stale_reads: 0,
        staleness: None,
        fleet_cpu_ns: 0,
        orchestrator_cpu_ns: 0,
        orchestrator_sleeps: 1,
        run_delay_ns: 0,
        sleeps: 0,
        proportional_bytes: 0,
        processes: 10,
        sharers: 1.0,
        boundary_fraction: 0.5,
        simulated: None,
    }
}

fn died(incarnation: u32) -> [Event; 2] {
    let (size, name) = (10, "craft-1".to_owned());
    [
        Event::CraftLost {
            size,
            name: name.clone(),
            end: ProcessEnd::Signal(9),
            phase: String::new(),
        },
        Event::CraftRestarted {
            size,
            name,
            incarnation,
            reclaimed_ns: 1,
            known_ns: 2,
            peers_noticed_ns: Some(3),
            ready_ns: 4,
            rejoined_ns: 5,
            caught_up_ns: Some(6),
        },
    ]
}

/// A soak of which nothing can be said.
fn run(has_faults: bool) -> RunData {
    let cell = |part| LoadCell {
        record: record(part, has_faults),
        knowledge: None,
        slices: Vec::new(),
        stages: BTreeMap::new(),
        staleness: None,
    };
    let deaths = if has_faults { 6 * u32::try_from(KILLS).unwrap() } else { 0 };
    let ended = Event::Ended { code: Outcome::Success.code() };
    let events = (1..=deaths).flat_map(died).chain([ended]);
    RunData {
        loads: (1..=6).map(cell).collect(),
        events: events.map(|event| EventLine { at_ns: 0, event }).collect(),
        ..RunData::default()
    }
}

/// What is told of a soak of which `spoil` made something else.
fn told(has_faults: bool, spoil: impl FnOnce(&mut RunData)) -> String {
    let mut run = run(has_faults);
    spoil(&mut run);
    let lacks: Vec<String> =
        lacks(&soak(has_faults), &run).iter().map(ToString::to_string).collect();
    lacks.join("; ")
}

#[test]
fn nothing_is_told_where_all_adds_up() {
    assert_eq!(told(false, |_| {}), "");
    assert_eq!(told(true, |_| {}), "");
}

#[test]
fn without_faults_counts_are_held_against_the_trace() {
    let spoilt = |spoil: fn(&mut LoadRecord)| told(false, |run| spoil(&mut run.loads[2].record));
    let sent = spoilt(|record| record.counts.replication.transmissions += 1);
    assert_eq!(sent, "part 3: the counts are not those that the trace demands");
    assert!(spoilt(|record| record.censored = 1).contains("1 changes never arrived"));
    assert!(spoilt(|record| record.unplayed = 1).contains("1 writes were not made"));
    assert!(spoilt(|record| record.losses.gaps = 1).contains("something was lost"));
    let died = told(false, |run| {
        let event = died(1)[0].clone();
        run.events.insert(0, EventLine { at_ns: 0, event });
    });
    assert_eq!(died, "1 crafts were lost, 0 deaths stated; 0 successors of 1 caught up");
}

#[test]
fn with_faults_each_must_have_struck_and_be_made_up_for() {
    let spoilt = |spoil: fn(&mut LoadRecovery)| {
        told(true, |run| spoil(run.loads[2].record.recovery.as_mut().unwrap()))
    };
    assert_eq!(spoilt(|recovery| recovery.deaths -= 1), "part 3: 1 deaths where 2 were stated");
    assert!(spoilt(|recovery| recovery.links.lost = 0).contains("links lost 0, not 10000"));
    assert!(spoilt(|recovery| recovery.links.lost *= 3).contains("part 3: links lost 30303"));
    assert!(spoilt(|recovery| recovery.repeats = 0).contains("nothing was sent again"));
    assert!(spoilt(|recovery| recovery.states_missed = 1).contains("had no answer"));
    let never_stopped = told(true, |run| {
        run.loads[0].record.stages.insert(Stage::Schedule, Distribution::default());
    });
    assert_eq!(never_stopped, "part 1: nobody was stopped");
    let never_recovering = told(true, |run| run.loads[5].record.recovery = None);
    assert_eq!(never_recovering, "part 6: nothing was to recover");
}

#[test]
fn few_samples_say_nothing_of_a_share() {
    let few = told(true, |run| {
        let record = &mut run.loads[0].record;
        record.counts.replication.deliveries = 1000;
        record.recovery.as_mut().unwrap().links.lost = 60;
    });
    assert_eq!(few, "", "{LOSS} of 1060 are too few");
}

#[test]
fn every_death_has_a_successor_that_caught_up() {
    let never_caught_up = told(true, |run| {
        let last = run.events.iter_mut().rev().find_map(|line| match &mut line.event {
            Event::CraftRestarted { caught_up_ns, .. } => Some(caught_up_ns),
            _ => None,
        });
        *last.unwrap() = None;
    });
    assert_eq!(never_caught_up, "11 successors of 12 caught up");
    let one_more =
        told(true, |run| run.events.extend(died(99).map(|event| EventLine { at_ns: 0, event })));
    assert_eq!(one_more, "13 crafts were lost, 12 deaths stated");
}

#[test]
fn the_end_of_the_run_is_looked_at() {
    let cut_off = told(false, |run| run.events.clear());
    assert_eq!(cut_off, "the run ended with None");
    let at_odds = told(true, |run| {
        let cell = run.loads[0].record.cell;
        let event = Event::Discrepancy { cell, trial: 0, what: "the boards differ".to_owned() };
        run.events.insert(0, EventLine { at_ns: 0, event });
    });
    assert_eq!(at_odds, "the boards differ");
    let shorter = told(false, |run| run.loads.truncate(5));
    assert_eq!(shorter, "5 of 6 parts");
}
