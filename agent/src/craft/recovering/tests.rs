//! A centre that learns something after it has told its clients that all is said.

use super::super::open_client::{ALL_IS_SAID, WRITES_NO_MORE};
use super::{CALLS, Craft, Outbox};
use shared_types::ids::{CraftId, FactId};
use shared_types::knowledge::{
    BoardNetwork, Change, Csr, FleetNetwork, FleetView, Topology, Value, Version,
};
use shared_types::time::Nanos;
use shared_types::transport::Destination;
use shared_types::wire::{
    Class, DELTA_BYTES, EpochSpec, Header, Kind, OpenSpec, RecoverySpec, StrategyKind, write_deltas,
};

const CENTRE: CraftId = CraftId(2);
const PATIENCE_NS: u64 = 1_000;

/// Two boards that share their only fact.
fn network() -> FleetNetwork {
    let board = |other: u32| {
        let links = Csr::from_pairs(1, &[vec![(0, other), (0, 0)]].concat());
        let mut board = BoardNetwork { fact_count: 1, links, ..BoardNetwork::default() };
        board.index_readers();
        board
    };
    let topology = Topology::new(vec![u32::MAX, 0], vec![0, 0]).expect("a tree of two");
    let boards = vec![board(1), board(0)];
    FleetNetwork { boards, topology, script: Vec::new(), trace: Vec::new() }
}

/// Process `craft` of an interval that has begun at 0.
fn process(craft: CraftId, fleet: &FleetView<'_>) -> Craft {
    let spec = EpochSpec {
        epoch: 0,
        network: 0,
        seed: 1,
        trial: 0,
        strategy: StrategyKind::CentralBatched,
        own_firing_only: true,
        ignores_finals: true,
        sends_altered_only: false,
        record_bytes: u32::try_from(DELTA_BYTES).unwrap(),
        turns_max: 0,
        reasoning: shared_types::reasoning::Reasoning::default(),
        open: Some(OpenSpec {
            duration_ns: 1,
            slice_ns: 1,
            asks_every_ns: 10,
            stamps_stages: false,
        }),
        recovery: Some(RecoverySpec::patient(PATIENCE_NS)),
        link: None,
    };
    let mut process = Craft::new(craft);
    process.begin_epoch(&spec, fleet);
    process.go(Nanos(0), &[]);
    process
}

/// Hands `process` a sample at `now`; returns the headers and receivers of what it plans to send.
fn hand(
    process: &mut Craft,
    now: u64,
    header: Header,
    changes: &[Change],
    fleet: &FleetView<'_>,
) -> Vec<(Destination, Header)> {
    let mut payload = vec![0; changes.len() * DELTA_BYTES];
    if !changes.is_empty() {
        write_deltas(changes, DELTA_BYTES, &mut payload);
    }
    let header = Header { record_count: u16::try_from(changes.len()).unwrap(), ..header };
    let (class, kind) = (header.class().unwrap(), header.kind().unwrap());
    let mut out = Outbox::default();
    process.arrive(Nanos(now));
    process.receive(class, kind, &header, &payload, fleet, &mut out).expect("it is taken");
    process.play_due(Nanos(now), &[], fleet, &mut out);
    out.samples.iter().map(|sample| (sample.to, sample.header)).collect()
}

fn header(class: Class, kind: Kind, source: CraftId) -> Header {
    Header { source: source.0, origin: source.0, epoch: 0, ..Header::new(class, kind) }
}

/// A client's request that is its last.
fn last_request(client: u32, number: u32) -> Header {
    let argument = WRITES_NO_MORE;
    let plain = header(Class::Replication, Kind::Instruction, CraftId(client));
    Header { argument, firing_number: number, ..plain }
}

#[test]
fn whom_a_centre_dismissed_too_early_it_calls_back() {
    let network = network();
    let fleet = network.view();
    let mut centre = process(CENTRE, &fleet);
    let said = |sent: &[(Destination, Header)]| sent[0].1.argument;
    assert_eq!(said(&hand(&mut centre, 1, last_request(0, 1), &[], &fleet)), 0);
    assert_eq!(said(&hand(&mut centre, 2, last_request(1, 1), &[], &fleet)), ALL_IS_SAID);
    // What client 0 had lost on the way comes as its state.
    let version = Version { count: 1, writer: CraftId(0) };
    let lost = Change { fact: FactId(0), value: Value::Asserted, version, altered: true };
    let state = header(Class::Repair, Kind::State, CraftId(0));
    let sent = hand(&mut centre, 3, state, &[lost], &fleet);
    let calls: Vec<_> = sent.iter().filter(|(_, header)| header.hop_count == CALLS).collect();
    let [(to, call)] = calls[..] else { panic!("one call: {sent:?}") };
    assert_eq!((*to, call.kind()), (Destination::Craft(CraftId(1)), Some(Kind::Digest)));
    // With its next request the client has it, and is dismissed again.
    let sent = hand(&mut centre, 4, last_request(1, 2), &[], &fleet);
    assert_eq!((sent[0].1.record_count, said(&sent)), (1, ALL_IS_SAID));
}

#[test]
fn a_client_that_is_called_asks_again_and_one_that_is_only_asked_does_not() {
    let network = network();
    let fleet = network.view();
    for hop_count in [CALLS, 0] {
        let mut client = process(CraftId(1), &fleet);
        let mut out = Outbox::default();
        client.play_due(Nanos(20), &[], &fleet, &mut out);
        let asked = out.samples[0].header;
        assert_eq!(asked.kind(), Some(Kind::Instruction));
        let reply = header(Class::Reply, Kind::Reply, CENTRE);
        let (argument, firing_number) = (ALL_IS_SAID, asked.firing_number);
        let reply = Header { argument, firing_number, ..reply };
        assert!(hand(&mut client, 21, reply, &[], &fleet).is_empty(), "all is said");
        let digest = header(Class::Ack, Kind::Digest, CENTRE);
        let sent = hand(&mut client, 22, Header { hop_count, turn: 1, ..digest }, &[], &fleet);
        let asks = sent.iter().any(|(_, header)| header.kind() == Some(Kind::Instruction));
        assert_eq!(asks, hop_count == CALLS, "{sent:?}");
    }
}

#[test]
fn a_client_that_is_idle_waits_for_its_answer_no_longer() {
    let network = network();
    let fleet = network.view();
    let mut client = process(CraftId(1), &fleet);
    let requests = |client: &mut Craft, now: u64| {
        let mut out = Outbox::default();
        client.play_due(Nanos(now), &[], &fleet, &mut out);
        let sent = out.samples.iter().filter_map(|sample| sample.header.kind());
        sent.filter(|kind| *kind == Kind::Instruction).count()
    };
    assert_eq!(requests(&mut client, 20), 1);
    // An answer to another request is the last that is heard.
    let stale = Header { firing_number: 99, ..header(Class::Reply, Kind::Reply, CENTRE) };
    assert!(hand(&mut client, 30, stale, &[], &fleet).is_empty());
    assert_eq!(requests(&mut client, 30 + 15 * PATIENCE_NS), 0);
    assert_eq!(requests(&mut client, 30 + 17 * PATIENCE_NS), 1);
}
