//! Sending on a memory network: to one inbox, to everybody who listens, and the outbox behind both.

use super::endpoint::MemoryEndpoint;
use super::network::{SampleId, World};
use crate::ids::CraftId;
use crate::transport::{Destination, SendError};
use crate::wire::Header;
use std::rc::Rc;

impl MemoryEndpoint {
    pub(super) fn send_world(
        &mut self,
        mut header: Header,
        length: usize,
        write: &mut dyn FnMut(&mut [u8]),
    ) -> Result<(), SendError> {
        let sequence = self.next_sequence(Destination::World)?;
        header = self.address(Destination::World, header, sequence);
        let mut bytes = rkyv::util::AlignedVec::with_capacity(length);
        bytes.resize(length, 0);
        write(&mut bytes);
        header.seal(&bytes);
        let mut network = self.network.borrow_mut();
        network.world = Some(World { header, bytes: Rc::new(bytes), number: sequence + 1 });
        Ok(())
    }

    /// A sealed sample of `length` bytes that `write` fills.
    pub(super) fn loan(
        &mut self,
        header: Header,
        length: usize,
        write: &mut dyn FnMut(&mut [u8]),
    ) -> SampleId {
        let mut network = self.network.borrow_mut();
        let sample = network.loan(length);
        let (slot, payload) = network.sample_mut(sample);
        write(payload);
        *slot = header;
        slot.seal(payload);
        sample
    }

    /// Sends a sealed sample to one receiver's inbox, or keeps it.
    pub(super) fn deliver_unicast(
        &mut self,
        craft: CraftId,
        sample: SampleId,
    ) -> Result<(), SendError> {
        let to = inbox_of(craft);
        let Some(way) = self.peer(craft).map(|peer| peer.way) else {
            return Err(SendError::NotOpen(to));
        };
        let mut network = self.network.borrow_mut();
        if !self.outbox.holds_back(to) && network.offer(way, sample) {
            return Ok(());
        }
        let (header, payload) = network.sample(sample);
        let kept = self.outbox.keep(to, header, payload);
        if kept.is_ok() {
            network.kept += 1;
            self.losses.full_inboxes += 1;
        } else {
            self.losses.full_outboxes += 1;
        }
        kept
    }

    /// Sends a sealed sample to everybody who listens; whoever missed it gets it by unicast.
    pub(super) fn deliver_broadcast(&mut self, sample: SampleId) -> Result<(), SendError> {
        self.refresh_listeners();
        let mut result = Ok(());
        for index in 0..self.listeners.len() {
            let (craft, way) = self.listeners[index];
            if self.network.borrow_mut().offer(way, sample) {
                continue;
            }
            self.losses.missed_multicasts += 1;
            result = result.and(self.deliver_unicast(craft, sample));
        }
        result
    }
}

const fn inbox_of(craft: CraftId) -> Destination {
    match craft {
        CraftId::ORCHESTRATOR => Destination::Orchestrator,
        craft => Destination::Craft(craft),
    }
}
