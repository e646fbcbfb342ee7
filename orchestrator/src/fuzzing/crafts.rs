//! What a craft hears from others once the header is verified, and what the referee hears of crafts.

use crate::scenario::{ResolvedScenario, compile, load_text};
use agent::craft::{Craft, Outbox};
use agent::lockstep::Referee;
use shared_types::ids::{CraftId, FactId};
use shared_types::knowledge::{Change, FleetNetwork, FleetView, Value, Version};
use shared_types::reasoning::Reasoning;
use shared_types::time::Nanos;
use shared_types::wire::{
    Class, EpochSpec, Header, INTENDED_BYTES, Kind, OpenSpec, RecoverySpec, StrategyKind,
    TurnCommand, TurnReport, write_deltas, write_intended,
};
use std::sync::LazyLock;
use zerocopy::{FromBytes, IntoBytes};

/// Crafts of the fleet.
pub(super) const CRAFTS: u32 = 5;
/// Bytes of a record.
const STRIDE: usize = 16 + INTENDED_BYTES;

/// Five crafts in a tree, in groups of two.
pub(super) static SCENARIO: LazyLock<ResolvedScenario> = LazyLock::new(|| {
    let text = "fleet.crafts = 5\n[topology]\ntree = \"binary\"\n\
                group-size = 2\n\
                [network]\nfacts = 12\nrules = 8\nactions = 6\ninitial = 4\nfinals = 2\n\
                linking = \"shared\"\nboundary-fraction = 0.5\nsharers = 3\n";
    load_text("five", text, &[]).unwrap_or_else(|error| panic!("{error}"))
});

/// Their networks.
pub(super) static FLEET: LazyLock<FleetNetwork> = LazyLock::new(|| {
    let mut network = FleetNetwork::default();
    compile(&SCENARIO, 7, 0, &mut network);
    network
});

pub(super) fn spec(strategy: StrategyKind, is_open: bool, recovers: bool) -> EpochSpec {
    let open = OpenSpec {
        duration_ns: 1_000_000,
        slice_ns: 100_000,
        asks_every_ns: 1_000,
        stamps_stages: true,
    };
    EpochSpec {
        epoch: 3,
        network: 3,
        seed: 7,
        trial: 0,
        strategy,
        own_firing_only: false,
        ignores_finals: false,
        sends_altered_only: false,
        record_bytes: 16,
        turns_max: 50,
        reasoning: Reasoning::default(),
        open: is_open.then_some(open),
        recovery: recovers.then_some(RecoverySpec::patient(1_000)),
        link: None,
    }
}

/// Strategy, mode and craft in a byte each, then samples: header, length of the payload in two bytes,
/// payload. What a craft refuses changes no board and sends nothing.
pub(super) fn receive(bytes: &[u8]) {
    let [strategy, mode, own, samples @ ..] = bytes else { return };
    let fleet = FLEET.view();
    let strategy = StrategyKind::ALL[usize::from(*strategy) % StrategyKind::ALL.len()];
    let is_open = mode % 2 == 1 && strategy.plays_traces();
    let processes = CRAFTS + u32::from(strategy.has_centre());
    let mut craft = Craft::new(CraftId(u32::from(*own) % processes));
    craft.begin_epoch(&spec(strategy, is_open, mode & 2 == 2), &fleet);
    let mut out = Outbox::default();
    if is_open {
        craft.go(Nanos(1_000), &[]);
    } else {
        let opens =
            TurnCommand { closed: TurnCommand::NO_TURN, opened: 0, wants_merged: 0, is_last: 0 };
        craft.command(Nanos(1), &opens, &fleet, &mut out);
    }
    let mut rest = samples;
    while let Ok((header, after)) = Header::read_from_prefix(rest) {
        let Some((length, after)) = after.split_first_chunk() else { break };
        let (payload, after) = after.split_at(after.len().min(u16::from_le_bytes(*length).into()));
        rest = after;
        out.clear();
        take(&mut craft, &header, payload, &fleet, &mut out);
    }
    let _report = craft.report();
}

fn take(
    craft: &mut Craft,
    header: &Header,
    payload: &[u8],
    fleet: &FleetView<'_>,
    out: &mut Outbox,
) {
    let (Some(class), Some(kind)) = (header.class(), header.kind()) else { return };
    if kind == Kind::TurnCommand {
        if let Ok(command) = TurnCommand::read_from_bytes(payload) {
            craft.command(Nanos(header.published_ns), &command, fleet, out);
            craft.settle(out);
        }
        return;
    }
    let before = craft.report().board_digests;
    craft.arrive(Nanos(header.published_ns));
    // The centre runs a firing itself before it sees that the craft reports another one.
    let is_known = kind != Kind::Result;
    if craft.receive(class, kind, header, payload, fleet, out).is_err() && is_known {
        assert_eq!(craft.report().board_digests, before, "{kind:?} was refused");
        assert_eq!((out.samples.len(), out.reports.len()), (0, 0), "{kind:?} was refused");
    }
    craft.settle(out);
}

/// For every strategy and mode each kind of sample, then the end of the turn.
pub(super) fn seeds() -> Vec<Vec<u8>> {
    let mut seeds = Vec::new();
    for (strategy, mode, own) in (0..9).flat_map(|s| [(s, 0, 1), (s, 1, 2), (s, 0, 5), (s, 1, 5)]) {
        let mut seed = vec![strategy, mode, own];
        let kinds = [
            Kind::Register,
            Kind::Delta,
            Kind::Instruction,
            Kind::Result,
            Kind::Check,
            Kind::Reply,
        ];
        for (source, kind) in [0, 3].into_iter().flat_map(|craft| kinds.map(|kind| (craft, kind))) {
            seed.extend(sample(source, own.into(), kind));
        }
        let mut header = Header::new(Class::Control, Kind::TurnCommand);
        header.epoch = 3;
        let next = TurnCommand { closed: 0, opened: 1, wants_merged: 1, is_last: 0 };
        seed.extend(with_payload(&header, next.as_bytes()));
        seed.extend(sample(0, own.into(), Kind::SignOff));
        seeds.push(seed);
    }
    seeds
}

/// A sample of `source` with two records, if the kind has any.
pub(super) fn sample(source: u32, destination: u32, kind: Kind) -> Vec<u8> {
    let class = if kind == Kind::Reply { Class::Reply } else { Class::Replication };
    let mut header = Header::new(class, kind);
    (header.source, header.origin, header.destination) = (source, source, destination);
    header.epoch = 3;
    let has_records = matches!(kind, Kind::Delta | Kind::Result | Kind::Reply);
    let change = |fact: u32| Change {
        fact: FactId(fact),
        value: Value::Asserted,
        version: Version { count: 2, writer: CraftId(source) },
        altered: true,
    };
    let changes = if has_records { vec![change(1), change(3)] } else { Vec::new() };
    header.record_count = if has_records { 2 } else { 0 };
    let mut payload = vec![0; changes.len() * STRIDE];
    write_deltas(&changes, STRIDE, &mut payload);
    write_intended(&[500, 600], STRIDE, &mut payload);
    with_payload(&header, &payload)
}

pub(super) fn with_payload(header: &Header, payload: &[u8]) -> Vec<u8> {
    let length = u16::try_from(payload.len()).unwrap_or(u16::MAX).to_le_bytes();
    [header.as_bytes(), &length, payload].concat()
}

/// One byte of options, then lines of the ledger: the craft in a byte, its report. A line that does not
/// fit leaves the ledger as it was, and a trial that is over stays so.
pub(super) fn record(bytes: &[u8]) {
    let Some((options, lines)) = bytes.split_first() else { return };
    let strategy = StrategyKind::ALL[usize::from(*options) % StrategyKind::ALL.len()];
    let mut referee = Referee::new(&spec(strategy, false, false), CRAFTS);
    for line in lines.chunks_exact(1 + size_of::<TurnReport>()) {
        let Ok(report) = TurnReport::read_from_bytes(&line[1..]) else { break };
        let before = format!("{referee:?}");
        if referee.record(CraftId(line[0].into()), &report).is_err() {
            assert_eq!(format!("{referee:?}"), before);
        }
        let ended = referee.outcome();
        let command = referee.advance();
        assert!(ended.is_none() || (command.is_none() && referee.outcome() == ended));
    }
    let _words = (referee.standing(), referee.path_digest(), referee.turns());
}

/// Two turns of five crafts, in order.
pub(super) fn ledgers_seeds() -> Vec<Vec<u8>> {
    let mut turns = vec![1];
    for turn in 0..2 {
        for (craft, held) in [(0_u8, 1), (1, 1), (2, 0), (3, 0), (4, 0)] {
            let report = TurnReport {
                turn,
                phase: 0,
                firing: 3,
                owed: u32::from(craft == 3) * 2,
                held,
                is_final: 0,
            };
            turns.push(craft);
            turns.extend(report.as_bytes());
        }
        for craft in 0..5 {
            let report =
                TurnReport { turn, phase: 2, firing: u32::MAX, owed: 0, held: 0, is_final: 0 };
            turns.push(craft);
            turns.extend(report.as_bytes());
        }
    }
    let mut with_centre = turns.clone();
    with_centre[0] = 6;
    vec![turns, with_centre]
}
