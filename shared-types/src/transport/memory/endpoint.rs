//! One participant's endpoint on a memory network.

use super::network::{Network, Node, WayId};
use crate::ids::CraftId;
use crate::limits::DRAIN_SAMPLES_MAX;
use crate::transport::intake::{Intake, Through};
use crate::transport::outbox::Outbox;
use crate::transport::sequence::Sequences;
use crate::transport::topic::Service;
use crate::transport::{Destination, Endpoint, Numbered, Peers, SendError, WorldSample};
use crate::wire::{Header, Losses};
use std::cell::RefCell;
use std::rc::Rc;

/// The port of one craft, or of the orchestrator, on a [`super::MemoryNetwork`].
pub struct MemoryEndpoint {
    pub(super) network: Rc<RefCell<Network>>,
    own: CraftId,
    node: Node,
    generation: u32,
    incarnation: u32,
    intake: Intake,
    pub(super) outbox: Outbox,
    pub(super) losses: Losses,
    /// Unicast receivers ever sent to, ascending: ways and numbers outlive an epoch's ports.
    peers: Vec<Peer>,
    sends_multicast: bool,
    /// Ways of this endpoint's broadcasts, ascending by receiver, and the state of the network that
    /// they were looked up in.
    pub(super) listeners: Vec<(CraftId, WayId)>,
    listeners_seen: u64,
    broadcast_sequence: u64,
    world_sequence: u64,
    world_taken: u64,
    scratch: Vec<u8>,
}

#[derive(Debug)]
pub(super) struct Peer {
    craft: CraftId,
    pub(super) way: WayId,
    sequence: u64,
    is_open: bool,
}

impl std::fmt::Debug for MemoryEndpoint {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("MemoryEndpoint")
            .field("own", &self.own)
            .field("incarnation", &self.incarnation)
            .finish_non_exhaustive()
    }
}

impl MemoryEndpoint {
    pub(super) fn open(
        network: Rc<RefCell<Network>>,
        own: CraftId,
        node: Node,
        incarnation: u32,
    ) -> Self {
        let (generation, intake) = {
            let mut network = network.borrow_mut();
            assert!(network.node(own) == Some(node), "invariant: the network has this craft");
            (
                network.attach(node),
                Intake::new(network.options().run, own, network.craft_count(), false),
            )
        };
        let mut endpoint = Self {
            network,
            own,
            node,
            generation,
            incarnation,
            intake,
            outbox: Outbox::default(),
            losses: Losses::default(),
            peers: Vec::new(),
            sends_multicast: false,
            listeners: Vec::new(),
            listeners_seen: 0,
            broadcast_sequence: 0,
            world_sequence: 0,
            world_taken: 0,
            scratch: Vec::new(),
        };
        if !endpoint.is_orchestrator() {
            endpoint.peer(CraftId::ORCHESTRATOR);
        }
        endpoint
    }

    fn is_orchestrator(&self) -> bool {
        self.own == CraftId::ORCHESTRATOR
    }

    /// The unicast receiver `craft`, made known if it was not; `None` if there is no such craft.
    pub(super) fn peer(&mut self, craft: CraftId) -> Option<&mut Peer> {
        let index = match self.peers.binary_search_by_key(&craft, |peer| peer.craft) {
            Ok(index) => index,
            Err(index) => {
                let mut network = self.network.borrow_mut();
                let node = network.node(craft)?;
                let service = if craft == CraftId::ORCHESTRATOR {
                    Service::OrchestratorInbox
                } else {
                    Service::Inbox(craft)
                };
                let way = network.add_way(node, Through::Inbox, service.capacity());
                let is_open = craft == CraftId::ORCHESTRATOR;
                self.peers.insert(index, Peer { craft, way, sequence: 0, is_open });
                index
            }
        };
        Some(&mut self.peers[index])
    }

    /// Looks up who listens, if that changed.
    pub(super) fn refresh_listeners(&mut self) {
        let mut network = self.network.borrow_mut();
        if self.listeners_seen == network.listeners_changed {
            return;
        }
        self.listeners_seen = network.listeners_changed;
        let mut listeners = Vec::with_capacity(self.listeners.len());
        let nodes: Vec<Node> = network.listeners(self.node).collect();
        for node in nodes {
            let craft = network.craft(node);
            let known = self.listeners.binary_search_by_key(&craft, |&(known, _)| known);
            let way = known.map_or_else(
                |_| network.add_way(node, Through::Broadcast, Service::Multicast.capacity()),
                |index| self.listeners[index].1,
            );
            listeners.push((craft, way));
        }
        self.listeners = listeners;
    }

    /// Whether the port to `to` is open, and the number that its next sample gets.
    pub(super) fn next_sequence(&mut self, to: Destination) -> Result<u64, SendError> {
        let unicast = match to {
            Destination::Craft(craft) => Some(craft),
            Destination::Orchestrator => Some(CraftId::ORCHESTRATOR),
            Destination::Multicast | Destination::Turn | Destination::World => None,
        };
        if let Some(craft) = unicast {
            let index = self
                .peers
                .binary_search_by_key(&craft, |peer| peer.craft)
                .map_err(|_| SendError::NotOpen(to))?;
            let peer = &mut self.peers[index];
            if !peer.is_open {
                return Err(SendError::NotOpen(to));
            }
            peer.sequence += 1;
            return Ok(peer.sequence - 1);
        }
        let (is_open, sequence) = match to {
            Destination::World => (self.is_orchestrator(), &mut self.world_sequence),
            Destination::Turn => (self.is_orchestrator(), &mut self.broadcast_sequence),
            _ => (self.sends_multicast, &mut self.broadcast_sequence),
        };
        if !is_open {
            return Err(SendError::NotOpen(to));
        }
        *sequence += 1;
        Ok(*sequence - 1)
    }

    /// Fills the fields of the header that the transport owns, except length and checksum.
    pub(super) fn address(&self, to: Destination, header: Header, sequence: u64) -> Header {
        Header { destination: to.address().0, sequence, ..self.sign(header) }
    }

    /// Fills those that say who sends.
    fn sign(&self, mut header: Header) -> Header {
        header.run = self.network.borrow().options().run;
        header.source = self.own.0;
        header.incarnation = self.incarnation;
        header
    }
}

impl Endpoint for MemoryEndpoint {
    fn open_ports(&mut self, peers: &Peers) -> Result<(), SendError> {
        for peer in &mut self.peers {
            peer.is_open = peer.craft == CraftId::ORCHESTRATOR;
        }
        for &craft in &peers.unicast {
            let Some(peer) = self.peer(craft) else {
                return Err(SendError::NotOpen(Destination::Craft(craft)));
            };
            peer.is_open = true;
        }
        self.sends_multicast = peers.sends_multicast && !self.is_orchestrator();
        let listens = peers.receives_multicast && !self.is_orchestrator();
        self.network.borrow_mut().listen_to_multicasts(self.node, listens);
        Ok(())
    }

    fn update_connections(&mut self) -> Result<(), SendError> {
        // Ways are made for those who broadcast only: a fleet has far fewer than pairs of crafts.
        if self.sends_multicast || self.is_orchestrator() {
            self.refresh_listeners();
        }
        Ok(())
    }

    fn send(
        &mut self,
        to: Destination,
        header: Header,
        length: usize,
        write: &mut dyn FnMut(&mut [u8]),
    ) -> Result<(), SendError> {
        if to == Destination::World {
            return self.send_world(header, length, write);
        }
        let limit = self.network.borrow().options().payload_bytes_max;
        if length > limit {
            return Err(SendError::TooLong { needed: length, limit });
        }
        let sequence = self.next_sequence(to)?;
        let header = self.address(to, header, sequence);
        let sample = self.loan(header, length, write);
        let result = match to {
            Destination::Craft(craft) => self.deliver_unicast(craft, sample),
            Destination::Orchestrator => self.deliver_unicast(CraftId::ORCHESTRATOR, sample),
            _ => self.deliver_broadcast(sample),
        };
        self.network.borrow_mut().release(sample);
        result
    }

    fn take_world(&mut self) -> Result<Option<WorldSample>, SendError> {
        let Some(world) = self.network.borrow().world.clone() else { return Ok(None) };
        if world.number == self.world_taken {
            return Ok(None);
        }
        self.world_taken = world.number;
        let admitted = self.intake.admit(Through::World, &world.header, &world.bytes);
        Ok(admitted.map(|_| WorldSample::new(world.header, SharedArchive(world.bytes))))
    }

    fn flush(&mut self) -> Result<usize, SendError> {
        let Self { network, outbox, peers, .. } = self;
        if outbox.waiting() == 0 {
            return Ok(0);
        }
        let mut network = network.borrow_mut();
        let before = outbox.waiting();
        let waiting = outbox.retry(|to, header, payload| {
            let Ok(index) = peers.binary_search_by_key(&to.address(), |peer| peer.craft) else {
                return Ok(false);
            };
            let sample = network.loan(payload.len());
            let (slot, bytes) = network.sample_mut(sample);
            *slot = *header;
            bytes.copy_from_slice(payload);
            let is_taken = network.offer(peers[index].way, sample);
            network.release(sample);
            Ok(is_taken)
        })?;
        network.kept -= before - waiting;
        Ok(waiting)
    }

    fn holds_back(&self, to: Destination) -> bool {
        self.outbox.holds_back(to)
    }

    fn drain(
        &mut self,
        visit: &mut dyn FnMut(Destination, &Header, &[u8]),
    ) -> Result<usize, SendError> {
        let mut visited = 0;
        for _ in 0..DRAIN_SAMPLES_MAX {
            // The payload is copied out, so that the visitor may use any endpoint of the network.
            let (header, through) = {
                let mut network = self.network.borrow_mut();
                if !network.is_served(self.node, self.generation) {
                    break;
                }
                let Some((sample, through)) = network.take_unread(self.node) else { break };
                let (header, payload) = network.sample(sample);
                let header = *header;
                self.scratch.clear();
                self.scratch.extend_from_slice(payload);
                network.release(sample);
                (header, through)
            };
            if let Some(destination) = self.intake.admit(through, &header, &self.scratch) {
                visit(destination, &header, &self.scratch);
                visited += 1;
            }
        }
        Ok(visited)
    }

    fn next_number(&self, to: Destination) -> u64 {
        match to {
            Destination::World => self.world_sequence,
            Destination::Multicast | Destination::Turn => self.broadcast_sequence,
            Destination::Craft(_) | Destination::Orchestrator => {
                let known = self.peers.binary_search_by_key(&to.address(), |peer| peer.craft);
                known.map_or(0, |index| self.peers[index].sequence)
            }
        }
    }

    fn send_past_numbering(
        &mut self,
        receiver: CraftId,
        header: Header,
        length: usize,
        write: &mut dyn FnMut(&mut [u8]),
    ) -> Result<(), SendError> {
        let sample = self.loan(self.sign(header), length, write);
        let result = self.deliver_unicast(receiver, sample);
        self.network.borrow_mut().release(sample);
        result
    }

    fn numbers(&mut self, service: Numbered) -> &mut Sequences {
        self.intake.numbers(service)
    }

    fn discard(&mut self, craft: CraftId) -> usize {
        let discarded = self.outbox.discard(Destination::Craft(craft));
        self.network.borrow_mut().kept -= discarded;
        discarded
    }

    fn ring(&mut self) {}

    fn take_losses(&mut self) -> Losses {
        let mut losses = std::mem::take(&mut self.losses);
        losses += self.intake.take_losses();
        losses
    }
}

impl Drop for MemoryEndpoint {
    fn drop(&mut self) {
        // A panic may unwind through a borrow of the network; there is nothing left to tidy then.
        if let Ok(mut network) = self.network.try_borrow_mut() {
            network.kept -= self.outbox.waiting();
            network.detach(self.node, self.generation);
        }
    }
}

/// Lends the bytes of a shared archive.
struct SharedArchive(Rc<rkyv::util::AlignedVec>);

impl AsRef<[u8]> for SharedArchive {
    fn as_ref(&self) -> &[u8] {
        &self.0
    }
}
