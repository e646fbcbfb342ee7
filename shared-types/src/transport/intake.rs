//! The receiver's side of both adapters: what is believed, and what each sample was addressed to.
//!
//! A sample is verified (version, run, length, checksum, kind), must be addressed to whoever it
//! reached, and must be new in its sequence; else it is counted and goes no further. A sample without
//! an address that comes through an inbox is the repair of a multicast (of the orchestrator: of a
//! turn message) and belongs to that service's sequence.

use super::sequence::{Arrival, Sequences};
use super::{Destination, Numbered};
use crate::ids::CraftId;
use crate::wire::{Header, Losses, Refusal};

/// Through which service a sample came.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Through {
    /// The receiver's own inbox.
    Inbox,
    /// What all crafts or the orchestrator send to everybody.
    Broadcast,
    /// The orchestrator's networks.
    World,
}

/// Admission of one receiver.
#[derive(Debug)]
pub(super) struct Intake {
    run: u64,
    own: CraftId,
    /// Crafts of the run, the centre included; who else claims to send is refused.
    craft_count: u32,
    inbox: Sequences,
    broadcast: Sequences,
    world: Sequences,
    losses: Losses,
}

impl Intake {
    /// That of the process `own`, which has an earlier life if it is a successor.
    pub(super) fn new(run: u64, own: CraftId, craft_count: u32, is_successor: bool) -> Self {
        let table = || if is_successor { Sequences::joining_late() } else { Sequences::default() };
        Self {
            run,
            own,
            craft_count,
            inbox: table(),
            broadcast: table(),
            world: table(),
            losses: Losses::default(),
        }
    }

    /// What the sample was addressed to, `None` if it is not to be handed over. A craft's own
    /// multicast comes back to it and is nothing that anybody sent to it: dropped, not counted.
    #[inline]
    pub(super) fn admit(
        &mut self,
        through: Through,
        header: &Header,
        payload: &[u8],
    ) -> Option<Destination> {
        if through == Through::Broadcast && header.source == self.own.0 {
            return None;
        }
        match self.check(through, header, payload) {
            Ok(destination) => destination,
            Err(refusal) => {
                if refusal == Refusal::Incarnation {
                    self.losses.old_incarnation += 1;
                } else {
                    self.losses.refused += 1;
                }
                None
            }
        }
    }

    /// What is known of the numbers of one service.
    pub(super) fn numbers(&mut self, service: Numbered) -> &mut Sequences {
        match service {
            Numbered::Unicast => &mut self.inbox,
            Numbered::Multicast => &mut self.broadcast,
        }
    }

    /// Losses on the receiving side since the last call. A world that was never taken is none: the
    /// next one stands in its place.
    pub(super) fn take_losses(&mut self) -> Losses {
        let gaps = self.inbox.take_gaps().saturating_add(self.broadcast.take_gaps());
        Losses { gaps, ..std::mem::take(&mut self.losses) }
    }

    /// What the sample was addressed to, `Ok(None)` for a repeat.
    #[inline]
    fn check(
        &mut self,
        through: Through,
        header: &Header,
        payload: &[u8],
    ) -> Result<Option<Destination>, Refusal> {
        let (class, kind) = header.verify(payload, self.run)?;
        let is_from_orchestrator = header.source == CraftId::ORCHESTRATOR.0;
        if header.source >= self.craft_count && !is_from_orchestrator {
            return Err(Refusal::Record);
        }
        if !class.is_between_crafts() && !is_from_orchestrator && self.own != CraftId::ORCHESTRATOR
        {
            // No craft commands another.
            return Err(Refusal::Record);
        }
        let is_unaddressed = header.destination == CraftId::NONE.0;
        if !kind.is_numbered() {
            if through != Through::Inbox || header.destination != self.own.0 || is_from_orchestrator
            {
                return Err(Refusal::Record);
            }
            // Who speaks unnumbered first speaks in its present life all the same.
            self.broadcast.meet(header.source, header.incarnation);
            return if self.inbox.meet(header.source, header.incarnation) {
                Ok(Some(Destination::Craft(self.own)))
            } else {
                Err(Refusal::Incarnation)
            };
        }
        let (destination, table) = match through {
            Through::Inbox if header.destination == self.own.0 => {
                let destination = match self.own {
                    CraftId::ORCHESTRATOR => Destination::Orchestrator,
                    craft => Destination::Craft(craft),
                };
                (destination, &mut self.inbox)
            }
            Through::Inbox | Through::Broadcast if is_unaddressed => {
                let destination =
                    if is_from_orchestrator { Destination::Turn } else { Destination::Multicast };
                (destination, &mut self.broadcast)
            }
            Through::World if is_unaddressed && is_from_orchestrator => {
                (Destination::World, &mut self.world)
            }
            _ => return Err(Refusal::Record),
        };
        match table.arrive(header.source, header.incarnation, header.sequence) {
            Arrival::New => Ok(Some(destination)),
            Arrival::Repeat => {
                self.losses.repeats += 1;
                Ok(None)
            }
            Arrival::OldIncarnation => Err(Refusal::Incarnation),
        }
    }
}
