//! A craft's process from its first act to its last, whatever it is told, by whomever: networks, epochs,
//! orders, samples of others. Its network and its clock are those of simulations.

use super::crafts::{CRAFTS, FLEET, sample, spec, with_payload};
use agent::craft::Craft;
use agent::process::session::{Rest, Session, SessionError, Surroundings, Usage};
use rkyv::rancor::Error;
use shared_types::ids::CraftId;
use shared_types::time::Nanos;
use shared_types::transport::memory::{MemoryEndpoint, MemoryNetwork, MemoryOptions};
use shared_types::transport::{Destination, Endpoint, SendError};
use shared_types::wire::{
    Class, EpochSpec, FORMAT_VERSION, Header, Kind, MembershipChange, StrategyKind, TurnCommand,
    TurnReport,
};
use std::sync::LazyLock;
use zerocopy::{FromBytes, IntoBytes};

/// Rounds that a process goes after the last sample that it hears.
const ROUNDS_AFTER: u32 = 8;

/// The most that passes between two samples, ns.
const PAUSE_NS_MAX: u64 = 1 << 30;

/// The networks, as the orchestrator publishes them.
static WORLD: LazyLock<Vec<u8>> = LazyLock::new(|| FLEET.to_archive().to_vec());

/// What surrounds the process: it hears the next sample whenever it rests.
struct Script<'a> {
    network: MemoryNetwork,
    orchestrator: MemoryEndpoint,
    own: CraftId,
    rest: &'a [u8],
    heard: u64,
    now: Nanos,
    rounds_left: u32,
}

impl Script<'_> {
    /// Lets the process hear the next sample; says whether there was one.
    fn tell(&mut self) -> bool {
        let Ok((mut header, after)) = Header::read_from_prefix(self.rest) else { return false };
        let Some((length, after)) = after.split_first_chunk() else { return false };
        let (payload, after) = after.split_at(after.len().min(u16::from_le_bytes(*length).into()));
        self.rest = after;
        self.now = self.now.plus(header.published_ns % PAUSE_NS_MAX);
        if header.kind() == Some(Kind::World) {
            // Without a payload it is the sound one: mutations of long archives are seldom of use.
            let archive = if payload.is_empty() { &WORLD } else { payload };
            let write = &mut |slot: &mut [u8]| slot.copy_from_slice(archive);
            let sent = self.orchestrator.send(Destination::World, header, archive.len(), write);
            sent.expect("the orchestrator may publish");
            return true;
        }
        (header.format_version, header.run) = (FORMAT_VERSION, MemoryOptions::default().run);
        header.sequence = self.heard;
        if header.destination != CraftId::NONE.0 {
            header.destination = self.own.0;
        }
        header.seal(payload);
        self.network.inject(self.own, header, payload);
        self.heard += 1;
        true
    }

    /// What the process says is of its kind.
    fn hear(&mut self) {
        self.network.deliver_all();
        let own = self.own.0;
        let heard = self.orchestrator.drain(&mut |_, header, payload| {
            assert_eq!(header.source, own);
            match header.kind() {
                Some(Kind::TurnReport) => {
                    let report = TurnReport::read_from_bytes(payload).expect("a turn report");
                    assert!(report.phase().is_some(), "{report:?}");
                }
                Some(Kind::TrialReport) => assert!(header.argument < header.firing_number),
                Some(Kind::Ready | Kind::EpochReady | Kind::Connected | Kind::TallyReport) => {}
                kind => panic!("a process says {kind:?}"),
            }
        });
        heard.expect("the orchestrator hears everybody");
    }
}

impl Surroundings<MemoryEndpoint> for Script<'_> {
    fn now(&self) -> Nanos {
        self.now
    }

    fn cpu_ns(&self) -> u64 {
        self.now.0
    }

    fn resident_bytes(&self) -> u64 {
        0
    }

    fn proportional_bytes(&self) -> u64 {
        0
    }

    fn usage(&self) -> Usage {
        Usage::default()
    }

    fn must_end(&self) -> bool {
        self.rounds_left == 0
    }

    fn stay_awake(&mut self) {}

    fn rest(&mut self, _: &mut MemoryEndpoint, _: Rest) -> Result<(), SendError> {
        self.hear();
        if !self.tell() {
            self.rounds_left = self.rounds_left.saturating_sub(1);
        }
        Ok(())
    }
}

/// The process in a byte, then samples: header, length of the payload in two bytes, payload. The process
/// ends in order, or says which networks it cannot use.
pub(super) fn live(bytes: &[u8]) {
    let Some((&own, rest)) = bytes.split_first() else { return };
    let own = CraftId(u32::from(own) % (CRAFTS + 1));
    let network = MemoryNetwork::new(CRAFTS + 1, MemoryOptions::default());
    let script = Script {
        orchestrator: network.orchestrator(),
        own,
        rest,
        heard: 0,
        now: Nanos(1_000),
        rounds_left: ROUNDS_AFTER,
        network: network.clone(),
    };
    let session = Session::new(Craft::new(own), network.endpoint(own, 0), script);
    match session.run() {
        Ok(()) | Err(SessionError::Network(_) | SessionError::OtherFleet(..)) => {}
        // Networks of a larger fleet name processes that this one does not reach.
        Err(SessionError::Transport(SendError::NotOpen(_))) => {}
        Err(error) => panic!("{error}"),
    }
}

fn word(class: Class, kind: Kind) -> Header {
    let mut header = Header::new(class, kind);
    (header.source, header.epoch) = (CraftId::ORCHESTRATOR.0, 3);
    header.published_ns = 20_000;
    header
}

fn told(kind: Kind, payload: &[u8]) -> Vec<u8> {
    with_payload(&word(Class::Control, kind), payload)
}

/// How an epoch of `spec` begins.
fn beginning(spec: &EpochSpec) -> Vec<u8> {
    let archive = rkyv::to_bytes::<Error>(spec).expect("memory takes every archive");
    [told(Kind::World, &[]), told(Kind::EpochBegin, &archive), told(Kind::Connect, &[])].concat()
}

/// A trial and an interval under every strategy, as each kind of process lives them, and networks that are
/// published whole.
pub(super) fn seeds() -> Vec<Vec<u8>> {
    let mut seeds = Vec::new();
    for (strategy, own) in StrategyKind::ALL.into_iter().flat_map(|s| [(s, 1), (s, CRAFTS)]) {
        let own_byte = u8::try_from(own).expect("a few crafts");
        let deltas: Vec<u8> = [0, 3]
            .into_iter()
            .flat_map(|source| [Kind::Register, Kind::Delta].map(|kind| sample(source, own, kind)))
            .flatten()
            .collect();
        let turn = |closed, opened, is_last| {
            let command = TurnCommand { closed, opened, wants_merged: 0, is_last };
            told(Kind::TurnCommand, command.as_bytes())
        };
        let none = TurnCommand::NO_TURN;
        let trial = [turn(none, 0, 0), deltas.clone(), turn(0, 1, 0), turn(1, none, 1)].concat();
        let end = [told(Kind::EpochEnd, &[]), told(Kind::Stop, &[])].concat();
        let begun = beginning(&spec(strategy, false, false));
        seeds.push([&[own_byte][..], &begun, &trial, &end].concat());
        if strategy.plays_traces() {
            let change =
                |is_up| MembershipChange { craft: 2, incarnation: is_up, is_up, reserved: 0 };
            let gone = told(Kind::Membership, change(0).as_bytes());
            let back = told(Kind::Membership, change(1).as_bytes());
            let mut go = word(Class::Control, Kind::Go);
            go.intended_ns = 100_000;
            let go = with_payload(&go, &[]);
            let interval = [go, deltas, gone, back, told(Kind::Tally, &[])].concat();
            let begun = beginning(&spec(strategy, true, true));
            seeds.push([&[own_byte][..], &begun, &interval, &end].concat());
        }
    }
    let whole = [told(Kind::World, &WORLD), beginning(&spec(StrategyKind::Full, false, false))];
    seeds.push([&[1][..], &whole.concat(), &told(Kind::Stop, &[])].concat());
    seeds
}
