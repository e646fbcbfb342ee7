//! One craft of two that write to each other in turn, over any endpoint.
//!
//! Each board has a fact of its own that its craft asserts and de-asserts in turn, so that every
//! write alters the value, and a fact that the peer's writes reach. The latter is read by a rule
//! whose other premise never holds: a merge updates the rule, and there is always one candidate.

use agent::craft::dispatch::dispatch;
use agent::craft::{Craft, Outbox};
use agent::oracle::board_digest;
use shared_types::ids::{CraftId, FactId};
use shared_types::knowledge::{
    BoardNetwork, FactState, FleetNetwork, FleetView, Literal, Topology, Value, Version,
};
use shared_types::time::Nanos;
use shared_types::transport::{Endpoint, SendError};
use shared_types::wire::{Class, EpochSpec, Losses, StrategyKind, TurnCommand};

/// Bytes of one delta's payload: one record, padded to what the raw programs send.
pub const RECORD_BYTES: usize = crate::raw::port::PAYLOAD_BYTES;

/// The fact that a craft writes.
const OWN: FactId = FactId(0);
/// The fact that the peer's writes reach.
const PEERS: FactId = FactId(1);
/// A fact that never holds.
const NEVER: FactId = FactId(2);

/// Why an exchange failed.
#[derive(Debug, thiserror::Error)]
pub enum ExchangeError {
    /// The transport failed.
    #[error(transparent)]
    Transport(#[from] SendError),
    /// At the end something is not as it must be.
    #[error("craft {craft}: {what}")]
    Wrong {
        /// Where.
        craft: CraftId,
        /// What is wrong.
        what: String,
    },
}

/// The networks of the two crafts.
#[must_use]
pub fn network() -> FleetNetwork {
    FleetNetwork {
        boards: [1, 0].map(board).into(),
        topology: Topology::binary(2),
        script: Vec::new(),
        trace: Vec::new(),
    }
}

/// The board whose own fact is linked to `peer`.
fn board(peer: u32) -> BoardNetwork {
    let mut board = BoardNetwork { fact_count: 3, ..BoardNetwork::default() };
    let rules: [(&[Literal], Literal); 3] = [
        (&[Literal::holds(OWN)], Literal::is_absent(OWN)),
        (&[Literal::is_absent(OWN)], Literal::holds(OWN)),
        (&[Literal::holds(PEERS), Literal::holds(NEVER)], Literal::holds(OWN)),
    ];
    for (premises, output) in rules {
        board.premises.push_row(premises.iter().map(|premise| premise.0));
        board.outputs.push_row([output.0]);
        board.queues.push_row([]);
    }
    board.links.push_row([peer, PEERS.0]);
    board.links.push_row([]);
    board.links.push_row([]);
    board.repeating_rules = vec![0, 1];
    board.initial = vec![OWN.0];
    board.index_readers();
    board
}

/// One of the two crafts.
#[derive(Debug)]
pub struct Side<'a, E> {
    own: CraftId,
    fleet: &'a FleetView<'a>,
    endpoint: E,
    craft: Craft,
    out: Outbox,
}

impl<'a, E: Endpoint> Side<'a, E> {
    /// Craft `own` (0 or 1) on the networks of [`network`], with its ports open.
    ///
    /// # Errors
    /// If the transport fails.
    pub fn new(
        own: CraftId,
        fleet: &'a FleetView<'a>,
        mut endpoint: E,
    ) -> Result<Self, ExchangeError> {
        let mut craft = Craft::new(own);
        craft.begin_epoch(&epoch(), fleet);
        endpoint.open_ports(&craft.peers(fleet))?;
        Ok(Self { own, fleet, endpoint, craft, out: Outbox::default() })
    }

    /// Brings up the connections to the peer, whose ports must be open.
    ///
    /// # Errors
    /// If the transport fails.
    pub fn connect(&mut self) -> Result<(), ExchangeError> {
        Ok(self.endpoint.update_connections()?)
    }

    /// Writes the own fact in `turn` and sends the change; `made` is when, `now` is asked when the
    /// sample is published.
    ///
    /// # Errors
    /// If the transport fails.
    #[inline]
    pub fn write(
        &mut self,
        made: Nanos,
        turn: u32,
        now: impl FnOnce() -> Nanos,
    ) -> Result<(), ExchangeError> {
        let opening = TurnCommand { closed: TurnCommand::NO_TURN, opened: turn, ..quiet() };
        self.craft.command(made, &opening, self.fleet, &mut self.out);
        dispatch(&mut self.endpoint, now(), &mut self.out, &mut self.craft)?;
        // The ledger's lines are the orchestrator's; there is none.
        self.out.reports.clear();
        Ok(())
    }

    /// Takes what has arrived; returns how many samples there were.
    ///
    /// # Errors
    /// If the transport fails.
    #[inline]
    pub fn take(&mut self) -> Result<usize, ExchangeError> {
        let Self { endpoint, craft, out, fleet, .. } = self;
        let arrived = endpoint.drain(&mut |_, header, payload| {
            if let (Some(class @ Class::Replication), Some(kind)) = (header.class(), header.kind())
            {
                // A refusal is counted and makes the check at the end fail.
                let _refusal = craft.receive(class, kind, header, payload, fleet, out);
            }
        })?;
        Ok(arrived)
    }

    /// What a craft does when nothing has arrived, as in its session: rings, tries again what waits.
    ///
    /// # Errors
    /// If the transport fails.
    #[inline]
    pub fn idle(&mut self) -> Result<(), ExchangeError> {
        self.endpoint.ring();
        self.endpoint.flush()?;
        Ok(())
    }

    /// Merges what arrived for `turn`.
    #[inline]
    pub fn apply(&mut self, turn: u32) {
        let closing = TurnCommand { closed: turn, opened: TurnCommand::NO_TURN, ..quiet() };
        self.craft.command(Nanos(0), &closing, self.fleet, &mut self.out);
    }

    /// Checks that each craft wrote `writes` times, that all arrived, and what the board holds.
    ///
    /// # Errors
    /// Says what is not so.
    pub fn check(&mut self, writes: u32) -> Result<(), ExchangeError> {
        let wrong = |what: String| Err(ExchangeError::Wrong { craft: self.own, what });
        let counters = &self.craft.counting_mut().counters;
        let mut losses = counters.losses;
        let traffic = &counters.traffic[Class::Replication as usize];
        let (sent, received) = (traffic.transmissions, traffic.deliveries);
        if [sent, received] != [u64::from(writes); 2] {
            return wrong(format!("sent {sent} and received {received} of {writes} deltas"));
        }
        losses += self.endpoint.take_losses();
        if losses != Losses::default() {
            return wrong(format!("{losses:?}"));
        }
        let peer = CraftId(1 - self.own.0);
        let mut expected = [written(self.own, writes), written(peer, writes), FactState::default()];
        if writes == 0 {
            expected[PEERS.index()] = FactState::default();
        }
        let digests = self.craft.report().board_digests;
        if digests != [(self.own.0, board_digest(&expected))] {
            return wrong("the board does not hold what was written".to_owned());
        }
        Ok(())
    }
}

/// What a fact holds that `writer` has written `writes` times, beginning with the value absent.
fn written(writer: CraftId, writes: u32) -> FactState {
    match writes {
        0 => FactState { value: Value::Asserted, version: Version::default() },
        _ => FactState {
            value: if writes.is_multiple_of(2) { Value::Asserted } else { Value::Absent },
            version: Version { count: writes, writer },
        },
    }
}

/// A command that neither closes nor opens a turn.
const fn quiet() -> TurnCommand {
    let none = TurnCommand::NO_TURN;
    TurnCommand { closed: none, opened: none, wants_merged: 0, is_last: 0 }
}

fn epoch() -> EpochSpec {
    EpochSpec {
        epoch: 0,
        network: 0,
        seed: 1,
        trial: 0,
        strategy: StrategyKind::Boundary,
        own_firing_only: true,
        ignores_finals: true,
        sends_altered_only: true,
        record_bytes: u32::try_from(RECORD_BYTES).expect("invariant: a record is short"),
        turns_max: u32::MAX,
        reasoning: shared_types::reasoning::Reasoning::default(),
        recovery: None,
        link: None,
        open: None,
    }
}

#[cfg(test)]
mod tests {
    use super::{Side, network};
    use shared_types::ids::CraftId;
    use shared_types::time::Nanos;
    use shared_types::transport::memory::{MemoryNetwork, MemoryOptions};

    #[test]
    fn every_write_is_on_the_other_board_when_the_echo_is_written() {
        let (memory, networks) = (MemoryNetwork::new(2, MemoryOptions::default()), network());
        let fleet = networks.view();
        fleet.validate().unwrap();
        let mut sides = [0, 1].map(|index| {
            let craft = CraftId(index);
            Side::new(craft, &fleet, memory.endpoint(craft, 0)).unwrap()
        });
        sides.iter_mut().for_each(|side| side.connect().unwrap());
        sides.iter_mut().for_each(|side| side.check(0).unwrap());
        for turn in 0..20 {
            let (writer, reader) = (turn as usize % 2, 1 - turn as usize % 2);
            sides[writer].write(Nanos(1), turn, || Nanos(2)).unwrap();
            memory.deliver_all();
            assert_eq!(sides[reader].take().unwrap(), 1, "turn {turn}");
            sides[reader].apply(turn);
        }
        sides.iter_mut().for_each(|side| side.check(10).unwrap());
    }

    #[test]
    fn a_write_that_was_not_applied_is_found() {
        let (memory, networks) = (MemoryNetwork::new(2, MemoryOptions::default()), network());
        let fleet = networks.view();
        let mut sides = [0, 1].map(|index| {
            let craft = CraftId(index);
            Side::new(craft, &fleet, memory.endpoint(craft, 0)).unwrap()
        });
        sides.iter_mut().for_each(|side| side.connect().unwrap());
        for (turn, writer) in [(0, 0), (1, 1)] {
            sides[writer].write(Nanos(1), turn, || Nanos(2)).unwrap();
            memory.deliver_all();
            sides[1 - writer].take().unwrap();
        }
        let found = sides[0].check(1).unwrap_err();
        assert!(found.to_string().contains("board"), "{found}");
    }
}
