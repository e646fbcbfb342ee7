//! A simulated fleet under load, and one that counts wrongly.

use crate::launch::placement::{Placement, Processors};
use crate::outcome::Outcome;
use crate::results::event::Event;
use crate::results::provenance::{Provenance, RunIdentity};
use crate::results::read::{RunData, read_run};
use crate::results::record::Label;
use crate::results::store::{Place, Store};
use crate::run::backend::{Backend, PlayError, Played, PlayedOpen};
use crate::run::plan::{FleetPlan, LoadLabel, LoadPlan, Offered, OpenPlan, RunPlan};
use crate::run::{Ended, Progress, Runner};
use crate::scenario::{Base, Override, load};
use agent::simulation::Simulation;
use shared_types::knowledge::FleetNetwork;
use shared_types::rng::{Purpose, Stream};
use shared_types::scenario::Pinning;
use shared_types::trace::TraceRecord;
use shared_types::transport::WakeMode;
use shared_types::transport::memory::MemoryOptions;
use shared_types::wire::{Class, EpochSpec, Stage, StrategyKind};
use std::collections::BTreeMap;

struct Silent;

impl Progress for Silent {
    fn at(&mut self, _: u64, _: u64, _: &str) {}

    fn say(&mut self, _: &str) {}
}

/// A simulated fleet that changes its reports before it hands them over.
struct Simulated {
    simulation: Simulation,
    change: fn(&mut PlayedOpen),
    played: Vec<EpochSpec>,
}

impl Backend for Simulated {
    fn play(&mut self, _: &EpochSpec, _: &FleetNetwork) -> Result<Played, PlayError> {
        unreachable!("these tests play no turns")
    }

    fn play_open(
        &mut self,
        spec: &EpochSpec,
        network: &FleetNetwork,
    ) -> Result<PlayedOpen, PlayError> {
        let fleet = network.view();
        let trace: Vec<Vec<TraceRecord>> = fleet.trace.iter().map(|part| part.to_vec()).collect();
        let played = self.simulation.play_open(spec, &fleet, &trace)?;
        let mut played =
            PlayedOpen { reports: played.reports, is_quiet: true, ..PlayedOpen::default() };
        (self.change)(&mut played);
        self.played.push(spec.clone());
        Ok(played)
    }

    fn ready_ns(&self) -> Option<u64> {
        None
    }
}

const STRATEGIES: [StrategyKind; 5] = [
    StrategyKind::Null,
    StrategyKind::Full,
    StrategyKind::Boundary,
    StrategyKind::Limited,
    StrategyKind::Hierarchy,
];

const MS: u64 = 1_000_000;

/// Offers two loads to a simulated fleet of five; returns how the run ends, what was kept, and what was
/// played.
fn offer_loads(change: fn(&mut PlayedOpen)) -> (Outcome, RunData, Vec<EpochSpec>) {
    offer_loads_with(&[], change)
}

/// The same where `more` is set in the scenario.
fn offer_loads_with(
    more: &[&str],
    change: fn(&mut PlayedOpen),
) -> (Outcome, RunData, Vec<EpochSpec>) {
    let settings = [&["fleet.crafts=5", "trace.reads-per-s=500"][..], more].concat();
    let settings: Vec<Override> =
        settings.into_iter().map(|setting| Override::set(setting).expect("a setting")).collect();
    let scenario = load(&Base::Preset("generated".to_owned()), [], &settings).expect("a preset");
    let mut draws = Stream::new(1, 0, Purpose::Order, 0);
    let processors = Processors::of_cores(vec![vec![0]]);
    let label = |strategy| LoadLabel { label: Label::first(strategy), asks_every_ns: None };
    let load = |name: &str, rate_per_s| LoadPlan {
        name: name.to_owned(),
        offered: Offered::Drawn { rate_per_s },
        records: 0,
        order: STRATEGIES.map(label).to_vec(),
    };
    let fleet = FleetPlan {
        scenario,
        strategies: STRATEGIES.to_vec(),
        order: Vec::new(),
        loads: vec![load("common", 2_000.0), load("high", 8_000.0)],
        searched: Vec::new(),
        placement: Placement::draw(&processors, Pinning::Unpinned, 5, &mut draws),
    };
    let open = OpenPlan { duration_ns: 500 * MS, slice_ns: 100 * MS, warm_up_ns: 200 * MS };
    let plan = RunPlan {
        fleets: vec![fleet.clone()],
        seed: 1,
        trials: 0,
        is_simulated: true,
        timing: None,
        open: Some(open),
        capacity: None,
        wake: WakeMode::Adaptive,
        turn_limit_ns: 1_000 * MS,
        time_limit_s: None,
        restart: None,
    };
    let folder = tempfile::tempdir().expect("a folder");
    let provenance = Provenance::gather(&RunIdentity {
        scenario: "generated".to_owned(),
        command: vec!["run".to_owned()],
        seed: 1,
        is_simulated: true,
        processes_max: 5,
        cores_used: 1,
        wake: WakeMode::Adaptive,
        plan: BTreeMap::new(),
    });
    let mut store = Store::create(Place::Below(folder.path()), &provenance, "").expect("writable");
    let mut silent = Silent;
    let mut runner = Runner::new(&plan, &mut store, &mut silent);
    let simulation = Simulation::new(5, MemoryOptions::default());
    let mut backend = Simulated { simulation, change, played: Vec::new() };
    let ended = runner.offer_loads(&mut backend, 2, &fleet, &open).expect("kept");
    let outcome = match ended {
        Ended::Complete | Ended::Epoch => runner.outcome,
        Ended::Early(outcome) => runner.outcome.worse(outcome),
    };
    let run = read_run(store.directory()).expect("readable");
    (outcome, run, backend.played)
}

#[test]
fn every_strategy_bears_every_load_on_the_same_trace_after_an_unmeasured_part_of_it() {
    let (outcome, run, played) = offer_loads(|_| {});
    assert_eq!(outcome, Outcome::Success);
    assert_eq!((run.loads.len(), played.len()), (10, 20));
    for pair in played.chunks(2) {
        let [warm_up, interval] = pair else { panic!("each cell is played twice") };
        assert_eq!(warm_up.open.unwrap().duration_ns, 200 * MS);
        assert_eq!(interval.open.unwrap().duration_ns, 500 * MS);
        assert_eq!((warm_up.trial, warm_up.network), (interval.trial, interval.network));
    }
    let networks: Vec<u32> = played.iter().map(|spec| spec.network).collect();
    assert_eq!(networks, [[0; 10], [10; 10]].concat(), "published once a load");
    for cells in run.loads.chunks(5) {
        let first = &cells[0].record;
        assert!(first.needed > 100 && first.writes > first.needed, "{first:?}");
        for cell in cells {
            let record = &cell.record;
            assert_eq!((record.writes, record.needed), (first.writes, first.needed));
            assert_eq!(record.expected, Some(record.counts), "{:?}", record.cell);
            let is_null = record.cell.strategy == StrategyKind::Null;
            let known = record.applied_by_end + record.applied_after_end;
            assert_eq!(known, if is_null { 0 } else { record.needed });
            assert_eq!((record.censored, record.saturated, record.unplayed), (0, None, 0));
            assert_eq!(cell.knowledge.as_ref().unwrap().len(), known);
            assert_eq!(record.stages[&Stage::Schedule].n, record.writes);
            assert!(record.reads > 100 && (record.stale_reads > 0) == is_null, "{record:?}");
            assert_eq!((record.place as usize), record.cell.strategy as usize);
        }
    }
    assert!(run.loads[5].record.writes > 3 * run.loads[0].record.writes);
}

#[test]
fn a_count_that_is_not_the_replays_breaks_the_run() {
    let (outcome, run, _) = offer_loads(|played| {
        played.reports[3].counters.traffic[Class::Replication as usize].requests += 1;
    });
    assert_eq!(outcome, Outcome::Broken);
    let told = run.events.iter().filter(|line| matches!(line.event, Event::Discrepancy { .. }));
    assert!(told.count() > 0);
    assert_eq!(run.loads.len(), 10, "what was measured is kept");
}

#[test]
fn a_board_that_is_not_what_the_trace_demands_breaks_a_run_that_recovers() {
    let lossy = ["link.loss=0.1"];
    let (outcome, run, _) = offer_loads_with(&lossy, |_| {});
    assert_eq!(outcome, Outcome::Success);
    assert!(run.loads.iter().all(|cell| cell.record.recovery.is_some()));
    let (outcome, run, _) = offer_loads_with(&lossy, |played| {
        let open = played.reports[2].open.as_mut().expect("an interval of open mode");
        open.held.remove(0);
    });
    assert_eq!(outcome, Outcome::Broken);
    assert!(run.events.iter().any(|line| matches!(line.event, Event::Discrepancy { .. })));
    let (outcome, _, _) = offer_loads_with(&lossy, |played| played.is_quiet = false);
    assert_eq!(outcome, Outcome::Partial, "a fleet that finds no rest has lost something");
}

#[test]
fn a_loss_makes_the_run_partial_and_a_full_outbox_only_the_cell_saturated() {
    let (outcome, run, _) = offer_loads(|played| played.reports[0].counters.losses.gaps = 1);
    assert_eq!(outcome, Outcome::Partial);
    assert!(run.loads.iter().all(|cell| cell.record.expected.is_none()));
    let (outcome, run, _) = offer_loads(|played| {
        played.reports[0].counters.losses.full_outboxes = 1;
        played.reports[1].counters.losses.gaps = 1;
    });
    assert_eq!(outcome, Outcome::Success);
    assert!(run.loads.iter().all(|cell| cell.record.saturated.is_some()));
}
