//! Laws that hold under every strategy, on random missions and random delivery.
//!
//! Missions here have several outputs a rule, repeats, de-assertions and facts shared by up to five
//! crafts, so that they reach what the published experiment does not.

use super::{SimulatedTrial, Simulation, SimulationError};
use crate::craft::{Craft, Outbox};
use crate::lockstep::Outcome;
use crate::replication::{Context, Plans, Strategy, strategy};
use shared_types::ids::CraftId;
use shared_types::knowledge::{BoardNetwork, Change, Csr, FleetNetwork, Topology};
use shared_types::rng::{Purpose, Stream};
use shared_types::transport::Peers;
use shared_types::transport::link::Lossy;
use shared_types::transport::memory::MemoryOptions;
use shared_types::wire::{Class, EpochSpec, Header, Kind, RecoverySpec, StrategyKind, TrialReport};

/// Strategies that replicate; `null` does not agree with anybody.
const REPLICATING: [StrategyKind; 8] = [
    StrategyKind::Full,
    StrategyKind::Boundary,
    StrategyKind::Limited,
    StrategyKind::Hierarchy,
    StrategyKind::Hybrid,
    StrategyKind::Central,
    StrategyKind::CentralBatched,
    StrategyKind::Pipelined,
];

const FACTS: u32 = 24;

fn random_row(stream: &mut Stream, least: u32, most: u32, bound: u32) -> Vec<u32> {
    let length = stream.between(least, most);
    (0..length).map(|_| stream.below(bound)).collect()
}

/// A random mission of `crafts` crafts in groups of three.
fn mission(crafts: u32, seed: u64) -> FleetNetwork {
    let mut stream = Stream::new(seed, 0, Purpose::Test, 0);
    let mut links = vec![Vec::<(u32, u32)>::new(); crafts as usize];
    for fact in 0..8 {
        let mut sharers: Vec<u32> = (0..crafts).collect();
        stream.shuffle(&mut sharers);
        sharers.truncate(stream.between(2, 5.min(crafts)) as usize);
        sharers.sort_unstable();
        for &from in &sharers {
            for &to in sharers.iter().filter(|&&to| to != from) {
                links[from as usize].extend([(fact, to), (fact, fact)]);
            }
        }
    }
    let boards = links.iter().map(|links| board(&mut stream, links)).collect();
    let parent = (0..crafts).map(|craft| craft.checked_sub(1).map_or(u32::MAX, |below| below / 2));
    let group = (0..crafts).map(|craft| craft / 3).collect();
    let topology = Topology::new(parent.collect(), group).expect("halving makes a tree");
    let network = FleetNetwork { boards, topology, script: Vec::new(), trace: Vec::new() };
    network.view().validate().expect("the mission names only what exists");
    network
}

fn board(stream: &mut Stream, links: &[(u32, u32)]) -> BoardNetwork {
    let mut network = BoardNetwork { fact_count: FACTS, ..BoardNetwork::default() };
    for rule in 0..20 {
        network.premises.push_row(random_row(stream, 1, 2, FACTS * 2));
        network.outputs.push_row(random_row(stream, 1, 3, FACTS * 2));
        network.queues.push_row(random_row(stream, 0, 2, 6));
        if stream.below(8) == 0 {
            network.repeating_rules.push(rule);
        }
    }
    for _ in 0..6 {
        network.action_outputs.push_row(random_row(stream, 1, 2, FACTS * 2));
    }
    network.repeating_actions = vec![2];
    network.initial = (8..20).collect();
    network.finals = vec![FACTS - 1];
    network.links = Csr::from_pairs(FACTS as usize, links);
    network.index_readers();
    network
}

fn spec(strategy: StrategyKind, seed: u64) -> EpochSpec {
    EpochSpec {
        epoch: 0,
        network: 0,
        seed,
        trial: 3,
        strategy,
        own_firing_only: true,
        ignores_finals: true,
        sends_altered_only: false,
        record_bytes: 16,
        turns_max: 12,
        reasoning: shared_types::reasoning::Reasoning::default(),
        recovery: None,
        link: None,
        open: None,
    }
}

fn play(network: &FleetNetwork, spec: &EpochSpec, jitter_ns: u32) -> SimulatedTrial {
    let options = MemoryOptions { jitter_ns, ..MemoryOptions::default() };
    let crafts = network.view().craft_count();
    Simulation::new(crafts, options).play(spec, &network.view()).expect("the trial ends")
}

fn board_digests(trial: &SimulatedTrial) -> Vec<u64> {
    let mut digests: Vec<(u32, u64)> =
        trial.reports.iter().flat_map(|report| report.board_digests.clone()).collect();
    digests.sort_unstable();
    digests.into_iter().map(|(_, digest)| digest).collect()
}

fn conflicts(trial: &SimulatedTrial) -> u64 {
    trial.reports.iter().map(|report| report.counters.conflicts).sum()
}

#[test]
fn every_strategy_takes_the_same_path_to_the_same_boards() {
    for seed in 0..40 {
        let crafts = 2 + u32::try_from(seed % 9).expect("small");
        let network = mission(crafts, seed);
        for own_firing_only in [true, false] {
            let rules = |kind| EpochSpec {
                own_firing_only,
                ignores_finals: seed % 2 == 0,
                sends_altered_only: seed % 3 == 0,
                ..spec(kind, seed)
            };
            let first = play(&network, &rules(StrategyKind::Boundary), 0);
            for kind in REPLICATING {
                let trial = play(&network, &rules(kind), 1000);
                assert_eq!(trial.path, first.path, "{kind}, seed {seed}");
                assert_eq!(trial.outcome, first.outcome, "{kind}, seed {seed}");
                assert_eq!(board_digests(&trial), board_digests(&first), "{kind}, seed {seed}");
                assert_eq!(conflicts(&trial), conflicts(&first), "{kind}, seed {seed}");
            }
        }
    }
}

#[test]
fn counts_do_not_depend_on_the_order_of_delivery() {
    for seed in 0..20 {
        let network = mission(7, seed);
        for kind in REPLICATING {
            let first = play(&network, &spec(kind, seed), 0);
            let second = play(&network, &spec(kind, seed), 5000);
            assert_eq!(first.reports, second.reports, "{kind}, seed {seed}");
        }
    }
}

#[test]
fn boards_that_share_every_fact_are_equal_when_quiet() {
    for seed in 0..20 {
        let mut network = mission(6, seed);
        for (craft, board) in (0_u32..).zip(&mut network.boards) {
            let others = || (0..6_u32).filter(move |&other| other != craft);
            let links: Vec<(u32, u32)> = (0..FACTS)
                .flat_map(|fact| others().flat_map(move |to| [(fact, to), (fact, fact)]))
                .collect();
            board.links = Csr::from_pairs(FACTS as usize, &links);
        }
        for kind in REPLICATING {
            let trial = play(&network, &spec(kind, seed), 700);
            let digests = board_digests(&trial);
            assert!(digests.iter().all(|digest| *digest == digests[0]), "{kind}, seed {seed}");
            assert!(conflicts(&trial) > 0, "{kind}, seed {seed}: nobody wrote the same fact");
        }
    }
}

#[test]
fn strategies_plan_and_senders_count_what_receivers_count() {
    for seed in 0..20 {
        let network = mission(8, seed);
        for kind in REPLICATING {
            let trial = play(&network, &spec(kind, seed), 300);
            for class in [Class::Replication, Class::Reply] {
                let traffic = trial.reports.iter().map(|report| {
                    let traffic = report.counters.traffic[class as usize];
                    (traffic.transmissions, traffic.deliveries)
                });
                let (sent, received) =
                    traffic.fold((0, 0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
                let copies = if kind == StrategyKind::Full { 7 } else { 1 };
                assert_eq!(sent * copies, received, "{kind}, {class:?}, seed {seed}");
            }
        }
    }
}

#[test]
fn stalled_mission_ends_as_stalled_under_every_strategy() {
    let mut network = mission(4, 1);
    for board in &mut network.boards {
        board.initial.clear();
    }
    for kind in REPLICATING {
        let rules = EpochSpec { ignores_finals: false, ..spec(kind, 1) };
        let trial = play(&network, &rules, 0);
        assert_eq!((trial.outcome, trial.turns), (Outcome::Stalled, 1), "{kind}");
    }
}

/// Owes one delivery that it never sends.
#[derive(Debug)]
struct Forgetful(Box<dyn Strategy>);

impl Strategy for Forgetful {
    fn plan(&mut self, context: &Context<'_>, changes: &[Change], plans: &mut Plans) {
        self.0.plan(context, changes, plans);
        plans.requests.pop();
    }

    fn peers(&self, context: &Context<'_>) -> Peers {
        self.0.peers(context)
    }
}

#[test]
fn delivery_that_is_owed_and_never_sent_leaves_the_ledger_unbalanced() {
    let network = mission(5, 2);
    let mut simulation = Simulation::new(5, MemoryOptions::default());
    let mutant = |craft: CraftId| -> Option<Box<dyn Strategy>> {
        (craft.0 == 1).then(|| Box::new(Forgetful(strategy(StrategyKind::Boundary))) as Box<_>)
    };
    let result = simulation.play_with(&spec(StrategyKind::Boundary, 2), &network.view(), mutant);
    match result {
        Err(SimulationError::Unbalanced { standing, reports, .. }) => {
            assert!(standing.contains("owed"), "{standing}");
            assert_eq!(reports.len(), 5);
        }
        other => panic!("a forgotten delivery went unnoticed: {other:?}"),
    }
}

#[test]
fn fleet_of_ten_thousand_plays_a_sparse_mission() {
    // A ring of small boards, each sharing one fact with the next.
    let crafts = 10_000_u32;
    let boards = (0..crafts).map(|craft| {
        let mut board = BoardNetwork { fact_count: 3, initial: vec![0], ..BoardNetwork::default() };
        board.premises.push_row([0]);
        board.outputs.push_row([2]);
        board.queues.push_row([]);
        let links = [(1, (craft + 1) % crafts), (1, 2)];
        board.links = Csr::from_pairs(3, &links);
        board.index_readers();
        board
    });
    let network = FleetNetwork {
        boards: boards.collect(),
        topology: Topology::binary(crafts),
        script: Vec::new(),
        trace: Vec::new(),
    };
    for kind in [StrategyKind::Boundary, StrategyKind::Hierarchy] {
        let rules = EpochSpec { turns_max: 1, ..spec(kind, 5) };
        let trial = play(&network, &rules, 0);
        let held: u64 = trial
            .reports
            .iter()
            .map(|report| report.counters.traffic[Class::Replication as usize].deliveries)
            .sum();
        assert_eq!(trial.path.len(), 10_000);
        assert!(held >= 10_000, "{kind}: {held}");
    }
}

#[test]
fn what_a_turn_loses_is_repeated_and_changes_no_path_no_board_and_no_count() {
    let recovery = Some(RecoverySpec::patient(100_000));
    for seed in 0..12 {
        let network = mission(2 + u32::try_from(seed % 6).expect("small"), seed);
        let view = network.view();
        for kind in REPLICATING {
            let lossless = play(&network, &spec(kind, seed), 1000);
            let rules = EpochSpec { recovery, ..spec(kind, seed) };
            let mut simulation = Simulation::new(view.craft_count(), MemoryOptions::default());
            simulation.network().set_link(Lossy::new(seed, 0.25, 0.1));
            let lossy = simulation.play(&rules, &view).expect("the trial ends");
            assert_eq!(lossy.path, lossless.path, "{kind}, seed {seed}");
            assert_eq!(board_digests(&lossy), board_digests(&lossless), "{kind}, seed {seed}");
            let mut repeats = 0;
            for (one, other) in lossy.reports.iter().zip(&lossless.reports) {
                for class in [Class::Replication, Class::Reply] {
                    let traffic = |report: &TrialReport| report.counters.traffic[class as usize];
                    assert_eq!(traffic(one), traffic(other), "{kind}, seed {seed}, {class:?}");
                }
                assert_eq!(one.counters.losses.gaps, 0, "{kind}, seed {seed}");
                repeats += one.counters.recovered.repeats;
            }
            let samples: u64 = lossy
                .reports
                .iter()
                .map(|report| report.counters.traffic[Class::Replication as usize].transmissions)
                .sum();
            assert!(repeats > 0 || samples < 40, "{kind}, seed {seed}: {samples} samples");
        }
    }
}

#[test]
fn recovery_changes_no_count_where_nothing_is_lost() {
    let recovery = Some(RecoverySpec::patient(1_000_000));
    for kind in REPLICATING {
        let network = mission(5, 4);
        let without = play(&network, &spec(kind, 4), 1000);
        let with = play(&network, &EpochSpec { recovery, ..spec(kind, 4) }, 1000);
        for (one, other) in with.reports.iter().zip(&without.reports) {
            for class in [Class::Replication, Class::Reply, Class::Repair] {
                let traffic = |report: &TrialReport| report.counters.traffic[class as usize];
                assert_eq!(traffic(one), traffic(other), "{kind}, {class:?}");
            }
            assert_eq!(one.counters.losses, other.counters.losses, "{kind}");
        }
    }
}

#[test]
fn what_comes_late_is_a_loss_unless_its_epoch_was_given_up_or_is_of_an_earlier_life() {
    let network = mission(3, 1);
    let at = |epoch| EpochSpec { epoch, ..spec(StrategyKind::Full, 1) };
    let late_and_stale = |is_given_up: bool, life: u32| {
        let mut craft = Craft::new(CraftId(0)).with_life(life);
        if life == 0 {
            craft.begin_epoch(&at(4), &network.view());
            if is_given_up {
                craft.abandon_epoch();
            }
        }
        craft.begin_epoch(&at(5), &network.view());
        let mut header = Header::new(Class::Replication, Kind::Delta);
        (header.source, header.epoch) = (1, 4);
        let out = &mut Outbox::default();
        let taken =
            craft.receive(Class::Replication, Kind::Delta, &header, &[], &network.view(), out);
        taken.expect("counted and otherwise ignored");
        let counters = craft.report().counters;
        (counters.losses.late, counters.recovered.stale)
    };
    assert_eq!(late_and_stale(false, 0), (1, 0));
    assert_eq!(late_and_stale(true, 0), (0, 1));
    assert_eq!(late_and_stale(false, 2), (0, 1));
}
