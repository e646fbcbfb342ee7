//! A strategy that sends one unicast too few, one that sends one too many and one that echoes are
//! each caught, by the independent replay or by the ledger.

use agent::oracle::{Discrepancy, Metric, Observed, Replay, compare};
use agent::replication::{Context, Plans, Recipient, Request, Strategy, strategy};
use agent::simulation::{Simulation, SimulationError};
use shared_types::ids::CraftId;
use shared_types::knowledge::{BoardNetwork, Change, Csr, FleetNetwork, Literal, Topology};
use shared_types::transport::Peers;
use shared_types::transport::memory::MemoryOptions;
use shared_types::wire::{EpochSpec, StrategyKind};

const CRAFTS: u32 = 4;

/// Craft 0 shares one fact with crafts 1 and 2 and writes it in every turn; craft 3 shares nothing.
fn network() -> FleetNetwork {
    let sharers = [0_u32, 1, 2];
    let boards = (0..CRAFTS).map(|craft| {
        let mut board = BoardNetwork { fact_count: 2, initial: vec![0], ..BoardNetwork::default() };
        if craft == 0 {
            board.premises.push_row([Literal::holds(shared_types::ids::FactId(0)).0]);
            board.outputs.push_row([1 << 1]);
            board.queues.push_row([]);
            board.repeating_rules = vec![0];
        }
        let others = sharers.iter().filter(|&&other| sharers.contains(&craft) && other != craft);
        let links: Vec<(u32, u32)> = others.flat_map(|&to| [(1, to), (1, 1)]).collect();
        board.links = Csr::from_pairs(2, &links);
        board.index_readers();
        board
    });
    FleetNetwork {
        boards: boards.collect(),
        topology: Topology::binary(CRAFTS),
        script: Vec::new(),
        trace: Vec::new(),
    }
}

fn spec() -> EpochSpec {
    EpochSpec {
        epoch: 0,
        network: 0,
        seed: 1,
        trial: 0,
        strategy: StrategyKind::Boundary,
        own_firing_only: true,
        ignores_finals: true,
        sends_altered_only: false,
        record_bytes: 16,
        turns_max: 5,
        reasoning: shared_types::reasoning::Reasoning::default(),
        recovery: None,
        link: None,
        open: None,
    }
}

/// Plays the trial with a mutant at `place` and returns what is wrong with it.
fn findings(
    place: u32,
    mutant: impl Fn() -> Box<dyn Strategy>,
) -> Result<Vec<Discrepancy>, SimulationError> {
    let network = network();
    let (view, spec) = (network.view(), spec());
    let mut simulation = Simulation::new(CRAFTS, MemoryOptions::default());
    let played = simulation.play_with(&spec, &view, |craft| (craft.0 == place).then(&mutant))?;
    let replay = Replay::of(&view, &spec);
    let expected = replay.expected(&view, &spec, spec.strategy);
    let observed = Observed {
        trial: spec.trial,
        turns: played.turns,
        outcome: played.outcome,
        path_digest: played.path_digest,
        reports: &played.reports,
    };
    Ok(compare(&replay, &expected, &observed))
}

/// Boundary replication that does something else with what it planned.
#[derive(Debug)]
struct Mutant {
    sound: Box<dyn Strategy>,
    change: fn(&mut Plans),
    echoes: bool,
}

impl Mutant {
    fn boxed(change: fn(&mut Plans), echoes: bool) -> Box<dyn Strategy> {
        Box::new(Self { sound: strategy(StrategyKind::Boundary), change, echoes })
    }
}

impl Strategy for Mutant {
    fn plan(&mut self, context: &Context<'_>, changes: &[Change], plans: &mut Plans) {
        self.sound.plan(context, changes, plans);
        (self.change)(plans);
    }

    fn plan_relay(
        &mut self,
        _: &Context<'_>,
        origin: CraftId,
        _: CraftId,
        changes: &[Change],
        plans: &mut Plans,
    ) {
        if self.echoes {
            plans.changes.extend_from_slice(changes);
            let changes = 0..plans.changes.len();
            plans.requests.push(Request { to: Recipient::One(origin), changes });
        }
    }

    fn peers(&self, _: &Context<'_>) -> Peers {
        let unicast = (0..CRAFTS).map(CraftId).collect();
        Peers { unicast, ..Peers::default() }
    }
}

fn one_too_few(plans: &mut Plans) {
    if plans.requests.pop().is_some() {
        plans.owed -= 1;
    }
}

fn one_too_many(plans: &mut Plans) {
    if let Some(last) = plans.requests.last().cloned() {
        plans.requests.push(Request { to: Recipient::One(CraftId(3)), ..last });
    }
}

fn as_planned(_: &mut Plans) {}

#[test]
fn sound_strategy_breaks_no_identity() {
    let broken = findings(0, || Mutant::boxed(as_planned, false)).expect("the trial ends");
    assert_eq!(broken, []);
}

#[test]
fn unicast_too_few_is_named_with_its_sender() {
    let broken = findings(0, || Mutant::boxed(one_too_few, false)).expect("the trial ends");
    let requests = broken.iter().find(|found| found.craft == Some(CraftId(0)));
    let requests = requests.expect("the sending craft is named");
    assert_eq!((requests.expected, requests.found), (10, 5), "{requests}");
}

#[test]
fn unicast_too_few_that_is_still_owed_leaves_the_ledger_open() {
    let forget = |plans: &mut Plans| plans.requests.truncate(1);
    let result = findings(0, || Mutant::boxed(forget, false));
    assert!(matches!(result, Err(SimulationError::Unbalanced { .. })), "{result:?}");
}

#[test]
fn unicast_too_many_is_named_with_sender_and_receiver() {
    let broken = findings(0, || Mutant::boxed(one_too_many, false)).expect("the trial ends");
    let pair = broken.iter().find(|found| found.sender == Some(CraftId(0)));
    let pair = pair.expect("the pair is named");
    assert_eq!((pair.craft, pair.expected, pair.found), (Some(CraftId(3)), 0, 5), "{pair}");
}

#[test]
fn echo_is_caught() {
    match findings(1, || Mutant::boxed(as_planned, true)) {
        Ok(broken) => {
            let is_named = broken
                .iter()
                .any(|found| found.craft == Some(CraftId(1)) && found.metric == Metric::Requests);
            assert!(is_named, "{broken:?}");
        }
        Err(error) => assert!(matches!(error, SimulationError::Unbalanced { .. }), "{error}"),
    }
}
