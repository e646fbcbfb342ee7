//! What the loop makes of a fleet that misbehaves.

use super::backend::{Backend, PlayError, Played, PlayedOpen};
use super::plan::{FleetPlan, RunPlan};
use super::{Ended, Progress, Runner};
use crate::launch::placement::{Placement, Processors};
use crate::outcome::Outcome;
use crate::results::provenance::{Provenance, RunIdentity};
use crate::results::store::{EVENTS_FILE, Place, Store};
use crate::scenario::{Base, load};
use agent::replication::{Context, Plans, Request, Strategy, strategy};
use agent::simulation::Simulation;
use shared_types::ids::CraftId;
use shared_types::knowledge::{Change, FleetNetwork};
use shared_types::rng::{Purpose, Stream};
use shared_types::scenario::Pinning;
use shared_types::transport::memory::MemoryOptions;
use shared_types::transport::{Peers, WakeMode};
use shared_types::wire::{EpochSpec, StrategyKind};

/// Keeps what the user would have been told.
#[derive(Default)]
struct Told(Vec<String>);

impl Progress for Told {
    fn at(&mut self, _: u64, _: u64, _: &str) {}

    fn say(&mut self, line: &str) {
        self.0.push(line.to_owned());
    }
}

/// What the orbiter of the two-craft mission does instead of replicating.
#[derive(Clone, Copy, Debug)]
enum Misdeed {
    None,
    SendsTwice,
    OwesWithoutSending,
    LosesASample,
}

#[derive(Debug)]
struct Mutant(Box<dyn Strategy>, Misdeed);

impl Strategy for Mutant {
    fn plan(&mut self, context: &Context<'_>, changes: &[Change], plans: &mut Plans) {
        self.0.plan(context, changes, plans);
        match self.1 {
            Misdeed::SendsTwice => {
                let again: Vec<Request> = plans.requests.clone();
                plans.requests.extend(again);
            }
            Misdeed::OwesWithoutSending => plans.requests.clear(),
            Misdeed::None | Misdeed::LosesASample => {}
        }
    }

    fn peers(&self, _: &Context<'_>) -> Peers {
        Peers { unicast: vec![CraftId(0), CraftId(1)], ..Peers::default() }
    }
}

/// A simulated fleet whose first craft misbehaves.
struct Misbehaving(Misdeed);

impl Backend for Misbehaving {
    fn play(&mut self, spec: &EpochSpec, network: &FleetNetwork) -> Result<Played, PlayError> {
        let mut simulation = Simulation::new(2, MemoryOptions::default());
        let mutant = |craft: CraftId| -> Option<Box<dyn Strategy>> {
            (craft.0 == 0).then(|| Box::new(Mutant(strategy(spec.strategy), self.0)) as Box<_>)
        };
        let mut trial = simulation.play_with(spec, &network.view(), mutant)?;
        if matches!(self.0, Misdeed::LosesASample) {
            trial.reports[1].counters.losses.gaps = 1;
        }
        Ok(trial.into())
    }

    fn play_open(&mut self, _: &EpochSpec, _: &FleetNetwork) -> Result<PlayedOpen, PlayError> {
        unreachable!("these tests play turns")
    }

    fn ready_ns(&self) -> Option<u64> {
        None
    }
}

/// Plays one trial of the two-craft mission; returns how the loop judges it, what it told, and the
/// events that it kept.
fn judge(misdeed: Misdeed) -> (Outcome, Vec<String>, String) {
    let scenario = load(&Base::Preset("two-craft".to_owned()), [], &[]).expect("a preset");
    let mut draws = Stream::new(1, 0, Purpose::Order, 0);
    let processors = Processors::of_cores(vec![vec![0]]);
    let fleet = FleetPlan {
        scenario,
        strategies: vec![StrategyKind::Boundary],
        order: Vec::new(),
        loads: Vec::new(),
        searched: Vec::new(),
        placement: Placement::draw(&processors, Pinning::Unpinned, 2, &mut draws),
    };
    let plan = RunPlan {
        fleets: vec![fleet.clone()],
        seed: 1,
        trials: 1,
        is_simulated: true,
        timing: None,
        open: None,
        capacity: None,
        wake: WakeMode::Adaptive,
        turn_limit_ns: 1_000_000_000,
        time_limit_s: None,
        restart: None,
    };
    let folder = tempfile::tempdir().expect("a folder");
    let provenance = Provenance::gather(&RunIdentity {
        scenario: "two-craft".to_owned(),
        command: vec!["run".to_owned()],
        seed: 1,
        is_simulated: true,
        processes_max: 2,
        cores_used: 1,
        wake: WakeMode::Adaptive,
        plan: std::collections::BTreeMap::new(),
    });
    let place = Place::Below(folder.path());
    let mut store = Store::create(place, &provenance, "").expect("writable");
    let mut told = Told::default();
    let mut runner = Runner::new(&plan, &mut store, &mut told);
    let ended = runner.play_trials(&mut Misbehaving(misdeed), 0, &fleet).expect("kept");
    let outcome = match ended {
        Ended::Complete | Ended::Epoch => runner.outcome,
        Ended::Early(outcome) => runner.outcome.worse(outcome),
    };
    let events = std::fs::read_to_string(store.directory().join(EVENTS_FILE)).expect("events");
    (outcome, told.0, events)
}

#[test]
fn sound_trial_is_a_success_and_nothing_is_told() {
    let (outcome, told, _) = judge(Misdeed::None);
    assert_eq!((outcome, told), (Outcome::Success, Vec::new()));
}

#[test]
fn unicast_too_many_breaks_the_run_and_names_origin_and_receiver() {
    let (outcome, told, events) = judge(Misdeed::SendsTwice);
    assert_eq!(outcome, Outcome::Broken);
    let told = told.join("\n");
    assert!(told.contains("from orbiter to aerial: 2 deliveries, expected 1"), "{told}");
    assert!(events.contains("\"event\":\"discrepancy\""), "{events}");
}

#[test]
fn delivery_that_is_owed_and_never_sent_breaks_the_run_and_says_what_is_missing() {
    let (outcome, told, events) = judge(Misdeed::OwesWithoutSending);
    assert_eq!(outcome, Outcome::Broken);
    let told = told.join("\n");
    assert!(told.contains("1 deliveries owed, 0 held"), "{told}");
    assert!(told.contains("from orbiter to aerial: 0 deliveries, expected 1"), "{told}");
    assert!(events.contains("\"event\":\"discrepancy\""), "{events}");
}

#[test]
fn counted_loss_makes_the_run_partial_and_breaks_nothing() {
    let (outcome, told, events) = judge(Misdeed::LosesASample);
    assert_eq!(outcome, Outcome::Partial);
    assert!(told.iter().any(|line| line.contains("lost")), "{told:?}");
    assert!(!events.contains("\"event\":\"discrepancy\""), "{events}");
}
