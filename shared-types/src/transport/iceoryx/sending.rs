//! Sending: numbering, the outbox behind a full inbox, the repair of a missed broadcast.

use super::endpoint::IceoryxEndpoint;
use super::peers::{publish_sample, transport_error};
use super::world::World;
use crate::ids::CraftId;
use crate::transport::{Destination, SendError, WakeMode};
use crate::wire::Header;

impl IceoryxEndpoint {
    /// Fills the fields of the header that the transport owns, except length and checksum.
    fn address(&self, to: Destination, header: &mut Header, sequence: u64) {
        self.sign(header);
        header.destination = to.address().0;
        header.sequence = sequence;
    }

    /// Fills those that say who sends.
    fn sign(&self, header: &mut Header) {
        header.run = self.run;
        header.source = self.own.0;
        header.incarnation = self.incarnation.0;
    }

    /// Sends a sample to one inbox with the number and destination that its header has.
    pub(super) fn send_as_numbered(
        &mut self,
        receiver: CraftId,
        mut header: Header,
        length: usize,
        write: &mut dyn FnMut(&mut [u8]),
    ) -> Result<(), SendError> {
        let closed = SendError::NotOpen(Destination::Craft(receiver));
        let index = self.peers.index_of(receiver).ok_or(closed)?;
        self.sign(&mut header);
        self.deliver_unicast(index, &mut header, length, write)
    }

    /// The number that the next sample to `to` gets.
    pub(super) fn number_of_next(&self, to: Destination) -> u64 {
        match (to, &self.world) {
            (Destination::World, World::Publisher { sequence, .. }) => *sequence,
            (Destination::World, World::Subscriber(_)) => 0,
            (Destination::Multicast | Destination::Turn, _) => self.broadcast_sequence,
            _ => self.peers.index_of(to.address()).map_or(0, |index| self.peers.number(index)),
        }
    }

    pub(super) fn send_unicast(
        &mut self,
        to: Destination,
        mut header: Header,
        length: usize,
        write: &mut dyn FnMut(&mut [u8]),
    ) -> Result<(), SendError> {
        let index = self.peers.index_of(to.address()).ok_or(SendError::NotOpen(to))?;
        let slot = self.peers.slot(index);
        if !slot.is_open {
            return Err(SendError::NotOpen(to));
        }
        let sequence = slot.sequence;
        slot.sequence += 1;
        self.address(to, &mut header, sequence);
        self.deliver_unicast(index, &mut header, length, write)
    }

    /// Sends a numbered sample to one inbox, or keeps it.
    fn deliver_unicast(
        &mut self,
        index: usize,
        header: &mut Header,
        length: usize,
        write: &mut dyn FnMut(&mut [u8]),
    ) -> Result<(), SendError> {
        let to = self.peers.destination_of(index);
        self.peers.mark(index);
        if !self.outbox.holds_back(to) {
            let limit = self.options.payload_bytes_max;
            let publisher = self.peers.publisher(index, &self.node, limit)?;
            if publish_sample(publisher, header, length, write)? > 0 {
                return Ok(());
            }
        }
        self.scratch.clear();
        self.scratch.resize(length, 0);
        write(&mut self.scratch);
        header.seal(&self.scratch);
        let kept = self.outbox.keep(to, header, &self.scratch);
        match &kept {
            Ok(()) => self.losses.full_inboxes += 1,
            Err(_) => self.losses.full_outboxes += 1,
        }
        kept
    }

    pub(super) fn send_broadcast(
        &mut self,
        to: Destination,
        mut header: Header,
        length: usize,
        write: &mut dyn FnMut(&mut [u8]),
    ) -> Result<(), SendError> {
        let sequence = self.broadcast_sequence;
        self.address(to, &mut header, sequence);
        let Some(broadcast) = self.broadcast.as_mut() else { return Err(SendError::NotOpen(to)) };
        self.broadcast_sequence += 1;
        let mut missed = std::mem::take(&mut self.missed);
        broadcast.send(&mut header, length, write, &mut missed)?;
        if self.options.wake != WakeMode::Poll {
            for craft in broadcast.listeners() {
                if let Some(index) = self.peers.index_of(craft) {
                    self.peers.mark(index);
                }
            }
        }
        let mut result = Ok(());
        for craft in missed.drain(..) {
            if let Some(index) = self.peers.index_of(craft) {
                self.losses.missed_multicasts += 1;
                result = result.and(self.deliver_unicast(index, &mut header, length, write));
            }
        }
        self.missed = missed;
        result
    }

    pub(super) fn send_world(
        &mut self,
        mut header: Header,
        length: usize,
        write: &mut dyn FnMut(&mut [u8]),
    ) -> Result<(), SendError> {
        let World::Publisher { sequence, .. } = &mut self.world else {
            return Err(SendError::NotOpen(Destination::World));
        };
        let number = *sequence;
        *sequence += 1;
        self.address(Destination::World, &mut header, number);
        if let World::Publisher { publisher, .. } = &self.world {
            let mut sample = publisher
                .loan_slice(length)
                .map_err(|error| transport_error("loaning a world", error))?;
            write(sample.payload_mut());
            header.seal(sample.payload());
            *sample.user_header_mut() = header;
            sample.send().map_err(|error| transport_error("publishing a world", error))?;
        }
        Ok(())
    }
}
