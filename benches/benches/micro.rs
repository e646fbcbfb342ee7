//! Micro-benches of the parts that every change and every trial passes through.
//!
//! Measurements are short: they show which part a regression sits in, not what a fleet does (that is
//! `slateswarm compare`) and not what a way between processes costs (that is `delta-one-way`).
//! Sender and receiver of the endpoint benches live in one process, so no cache line travels.

use agent::blackboard::Blackboard;
use agent::oracle::Replay;
use agent::replication::{Context, Plans, strategy};
use agent::simulation::Simulation;
use criterion::{Criterion, criterion_group, criterion_main};
use orchestrator::launch::run_root::RunRoot;
use orchestrator::scenario::generate::generate;
use shared_types::ids::{CraftId, FactId, Firing, Incarnation, RuleId};
use shared_types::knowledge::{Change, FleetNetwork, Topology, Value, Version};
use shared_types::scenario::GeneratedNetwork;
use shared_types::transport::iceoryx::{
    EndpointOptions, HostOptions, IceoryxEndpoint, IceoryxHost,
};
use shared_types::transport::memory::{MemoryNetwork, MemoryOptions};
use shared_types::transport::{Destination, Endpoint, Peers, WakeMode, clock};
use shared_types::wire::{Class, DELTA_BYTES, EpochSpec, Header, Kind, StrategyKind};
use std::hint::black_box;
use std::time::Duration;

const CRAFTS: u32 = 10;
const PAYLOAD_BYTES: usize = 128;

/// The networks of one published trial, with the groups that `hybrid` needs.
fn network() -> FleetNetwork {
    let mut network = FleetNetwork::default();
    generate(&GeneratedNetwork::default(), CRAFTS, 1, 0, &mut network);
    let parent = network.topology.parent.clone();
    let group = (0..CRAFTS).map(|craft| craft / 5).collect();
    network.topology = Topology::new(parent, group).expect("invariant: the bench's input is valid");
    network
}

fn epoch(strategy: StrategyKind) -> EpochSpec {
    EpochSpec {
        epoch: 0,
        network: 0,
        seed: 1,
        trial: 0,
        strategy,
        own_firing_only: true,
        ignores_finals: false,
        sends_altered_only: false,
        record_bytes: u32::try_from(DELTA_BYTES).expect("invariant: the bench's input is valid"),
        turns_max: 10_000,
        reasoning: shared_types::reasoning::Reasoning::default(),
        recovery: None,
        link: None,
        open: None,
    }
}

fn measuring(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("measuring");
    group.bench_function("two stamps", |bencher| {
        bencher.iter(|| (black_box(clock::now()), black_box(clock::now())));
    });
    let mut times = benches::raw::empty_histogram();
    let mut time_ns = 0;
    group.bench_function("record in a histogram", |bencher| {
        bencher.iter(|| {
            time_ns = (time_ns + 977) % 1_000_000;
            times.saturating_record(black_box(time_ns));
        });
    });
}

fn header(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("header");
    for bytes in [DELTA_BYTES, PAYLOAD_BYTES] {
        let payload = vec![7; bytes];
        let mut sealed = Header::new(Class::Replication, Kind::Delta);
        sealed.seal(&payload);
        group.bench_function(format!("seal {bytes} B"), |bencher| {
            let mut header = sealed;
            bencher.iter(|| black_box(&mut header).seal(black_box(&payload)));
        });
        group.bench_function(format!("verify {bytes} B"), |bencher| {
            bencher.iter(|| {
                black_box(&sealed)
                    .verify(black_box(&payload), 0)
                    .expect("invariant: the bench's input is valid")
            });
        });
    }
}

fn blackboard(criterion: &mut Criterion) {
    let network = network();
    let fleet = network.view();
    let board = fleet.board(CraftId(0));
    let mut group = criterion.benchmark_group("blackboard");
    let mut blackboard = Blackboard::default();
    group.bench_function("reset", |bencher| bencher.iter(|| blackboard.reset(board)));
    let mut changes = Vec::new();
    let toggling = benches::delta::exchange::network();
    let (toggling, mut toggled) = (toggling.view(), Blackboard::default());
    let (board_of_two, mut turn) = (toggling.board(CraftId(0)), 0);
    toggled.reset(board_of_two);
    // Two rules that enable each other: every firing alters a fact that both read.
    group.bench_function("fire, altering what two rules read", |bencher| {
        bencher.iter(|| {
            let firing = Firing::of_rule(RuleId(turn % 2));
            turn += 1;
            toggled.fire(board_of_two, CraftId(0), firing, &mut changes)
        });
    });
    // After the first pass every fact that a rule asserts is asserted already.
    let mut rule = 0;
    blackboard.reset(board);
    group.bench_function("fire, altering nothing", |bencher| {
        bencher.iter(|| {
            rule = (rule + 1) % board.rule_count();
            blackboard.fire(board, CraftId(0), Firing::of_rule(RuleId(rule)), &mut changes)
        });
    });
    let mut version = Version { count: 1 << 20, writer: CraftId(1) };
    for (name, values) in [
        ("merge what alters the value", [Value::Asserted, Value::Absent]),
        ("merge what is held already", [Value::Asserted, Value::Asserted]),
    ] {
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                version.count += 1;
                let value = values[(version.count / board.fact_count) as usize % 2];
                let fact = FactId(version.count % board.fact_count);
                blackboard.merge(board, fact, value, version)
            });
        });
    }
}

fn plans(criterion: &mut Criterion) {
    let network = network();
    let fleet = network.view();
    let board = fleet.board(CraftId(0));
    let mut group = criterion.benchmark_group("plan");
    let fact = (0..board.fact_count)
        .map(FactId)
        .find(|&fact| board.is_boundary(fact))
        .expect("invariant: the bench's input is valid");
    let version = Version { count: 1, writer: CraftId(0) };
    let changes = [Change { fact, value: Value::Asserted, version, altered: true }];
    let context = Context { craft: CraftId(0), fleet: &fleet };
    for kind in StrategyKind::ALL.into_iter().filter(|kind| !kind.has_centre()) {
        let (mut strategy, mut plans) = (strategy(kind), Plans::default());
        group.bench_function(kind.name(), |bencher| {
            bencher.iter(|| {
                plans.clear();
                strategy.plan(&context, black_box(&changes), &mut plans);
                plans.owed
            });
        });
    }
}

/// One sample from `sender` to craft 1, received there once `deliver` was called.
fn send_and_receive(
    sender: &mut impl Endpoint,
    receiver: &mut impl Endpoint,
    deliver: impl FnOnce(),
) {
    let header = Header::new(Class::Replication, Kind::Delta);
    let to = Destination::Craft(CraftId(1));
    sender
        .send(to, header, PAYLOAD_BYTES, &mut |slot| slot.fill(7))
        .expect("invariant: the host lets the bench run");
    deliver();
    let arrived = receiver.drain(&mut |_, header, payload| {
        black_box((header, payload));
    });
    assert_eq!(arrived.expect("invariant: the host lets the bench run"), 1);
}

fn open(endpoint: &mut impl Endpoint, to: u32) {
    let unicast = vec![CraftId(to)];
    endpoint
        .open_ports(&Peers { unicast, ..Peers::default() })
        .expect("invariant: the host lets the bench run");
}

fn endpoints(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("publish and receive");
    let network = MemoryNetwork::new(2, MemoryOptions::default());
    let [mut sender, mut receiver] = [0, 1].map(|craft| network.endpoint(CraftId(craft), 0));
    open(&mut sender, 1);
    open(&mut receiver, 0);
    group.bench_function("memory", |bencher| {
        bencher.iter(|| {
            send_and_receive(&mut sender, &mut receiver, || {
                network.deliver_all();
            });
        });
    });

    let root = RunRoot::create().expect("invariant: the host lets the bench run");
    let _host = IceoryxHost::create(root.paths(), HostOptions::new(3))
        .expect("invariant: the host lets the bench run");
    let [mut sender, mut receiver] = [0, 1].map(|craft| {
        let options = EndpointOptions::new(3, WakeMode::Poll);
        IceoryxEndpoint::open(root.paths(), CraftId(craft), Incarnation(0), options)
            .expect("invariant: the host lets the bench run")
    });
    open(&mut sender, 1);
    open(&mut receiver, 0);
    sender.update_connections().expect("invariant: the host lets the bench run");
    receiver.update_connections().expect("invariant: the host lets the bench run");
    group.bench_function("iceoryx2", |bencher| {
        bencher.iter(|| send_and_receive(&mut sender, &mut receiver, || ()));
    });
}

fn trials(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("trial");
    let mut generated = FleetNetwork::default();
    let mut trial = 0;
    group.bench_function("generate", |bencher| {
        bencher.iter(|| {
            trial += 1;
            generate(&GeneratedNetwork::default(), CRAFTS, 1, trial, &mut generated);
        });
    });
    let network = network();
    let fleet = network.view();
    group.bench_function("replay", |bencher| {
        bencher.iter(|| Replay::of(&fleet, &epoch(StrategyKind::Boundary)));
    });
    let mut simulation = Simulation::new(CRAFTS, MemoryOptions::default());
    for kind in [StrategyKind::Boundary, StrategyKind::Full, StrategyKind::Central] {
        group.bench_function(format!("simulate {kind}"), |bencher| {
            bencher.iter(|| {
                simulation
                    .play(&epoch(kind), &fleet)
                    .expect("invariant: the host lets the bench run")
            });
        });
    }
}

criterion_group! {
    name = micro;
    config = Criterion::default()
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_millis(800))
        .without_plots();
    targets = measuring, header, blackboard, plans, endpoints, trials
}
criterion_main!(micro);
