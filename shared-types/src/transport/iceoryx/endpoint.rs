//! The port of one process: a craft's, or the orchestrator's.

use super::broadcast::Broadcast;
use super::peers::{PeerTable, publish_sample, transport_error};
use super::services::{OpenError, node_of, open, open_bell, publish, subscribe};
use super::wake::{self, Wake};
use super::world::{HeldSample, World};
use super::{BellFactory, Factory, Listener, Node, Subscriber};
use crate::ids::{CraftId, Incarnation};
use crate::limits::{DRAIN_BURST, DRAIN_SAMPLES_MAX, INBOX_PAYLOAD_BYTES};
use crate::time::Nanos;
use crate::transport::held::Copied;
use crate::transport::incoming::Incoming;
use crate::transport::intake::{Intake, Through};
use crate::transport::link::StatedLink;
use crate::transport::outbox::Outbox;
use crate::transport::paths::RunPaths;
use crate::transport::sequence::Sequences;
use crate::transport::topic::Service;
use crate::transport::{
    Destination, Endpoint, Numbered, Peers, SendError, WakeMode, WorldSample, clock,
};
use crate::wire::{Header, Losses};
use iceoryx2::port::update_connections::UpdateConnections;
use std::os::fd::BorrowedFd;

/// What an endpoint must know of its run; the same for all processes of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EndpointOptions {
    /// As [`super::HostOptions::craft_count`].
    pub craft_count: u32,
    /// As [`super::HostOptions::payload_bytes_max`].
    pub payload_bytes_max: usize,
    /// As [`super::HostOptions::world_bytes`]; only the orchestrator needs it.
    pub world_bytes: usize,
    /// How processes of this run wait; without sleepers nobody rings.
    pub wake: WakeMode,
    /// Whether a craft listens to the orchestrator's turns. The centre does not: it sleeps through
    /// the epochs that have none, and hears of its own by unicast.
    pub hears_turns: bool,
}

impl EndpointOptions {
    /// Options for a run of `craft_count` crafts (the centre included) with the usual bounds.
    #[must_use]
    pub const fn new(craft_count: u32, wake: WakeMode) -> Self {
        Self {
            craft_count,
            payload_bytes_max: INBOX_PAYLOAD_BYTES,
            world_bytes: 0,
            wake,
            hears_turns: true,
        }
    }
}

/// The port of one process on the services that an [`super::IceoryxHost`] holds.
#[derive(Debug)]
pub struct IceoryxEndpoint {
    pub(super) run: u64,
    pub(super) own: CraftId,
    pub(super) incarnation: Incarnation,
    pub(super) options: EndpointOptions,
    pub(super) intake: Intake,
    pub(super) outbox: Outbox,
    pub(super) losses: Losses,
    pub(super) peers: PeerTable,
    /// Sending side: multicasts of a craft, turns of the orchestrator.
    pub(super) broadcast: Option<Broadcast>,
    pub(super) broadcast_sequence: u64,
    pub(super) world: World,
    pub(super) inbox: Subscriber,
    pub(super) turn: Option<Subscriber>,
    pub(super) multicast: Option<Subscriber>,
    pub(super) multicast_service: Option<Factory>,
    pub(super) bell: Listener,
    pub(super) scratch: Vec<u8>,
    pub(super) missed: Vec<CraftId>,
    /// The links to here, while they do something.
    incoming: Option<Incoming>,
    // Services and node last: ports go before what they belong to.
    _bell_service: BellFactory,
    pub(super) node: Node,
}

impl IceoryxEndpoint {
    /// Opens the endpoint of `own` ([`CraftId::ORCHESTRATOR`] for the orchestrator; see also
    /// [`super::IceoryxHost::endpoint`]) in its life `incarnation`. The services must exist.
    ///
    /// # Errors
    /// If the paths are not usable, or the run is not there.
    pub fn open(
        paths: &RunPaths,
        own: CraftId,
        incarnation: Incarnation,
        options: EndpointOptions,
    ) -> Result<Self, OpenError> {
        let node = node_of(paths, options.craft_count)?;
        let is_orchestrator = own == CraftId::ORCHESTRATOR;
        let (inbox, bell) = if is_orchestrator {
            (Service::OrchestratorInbox, Service::OrchestratorBell)
        } else {
            (Service::Inbox(own), Service::Bell(own))
        };
        let bell_service = open_bell(&node, bell)?;
        let world_service = open(&node, Service::World)?;
        let limit = options.payload_bytes_max;
        let mut endpoint = Self {
            run: paths.run(),
            own,
            incarnation,
            options,
            intake: Intake::new(paths.run(), own, options.craft_count, incarnation.0 > 0),
            outbox: Outbox::default(),
            losses: Losses::default(),
            peers: PeerTable::new(options.craft_count),
            broadcast: is_orchestrator
                .then(|| Broadcast::open(&node, Service::Turn, own, limit))
                .transpose()?,
            broadcast_sequence: 0,
            world: if is_orchestrator {
                let bytes = options.world_bytes.max(1);
                let publisher = publish(&world_service, Service::World, bytes, None)?;
                World::Publisher { publisher, sequence: 0 }
            } else {
                World::Subscriber(subscribe(&world_service, Service::World, own)?)
            },
            inbox: subscribe(&open(&node, inbox)?, inbox, own)?,
            turn: (!is_orchestrator && options.hears_turns)
                .then(|| subscribe(&open(&node, Service::Turn)?, Service::Turn, own))
                .transpose()?,
            multicast: None,
            multicast_service: None,
            bell: bell_service
                .listener_builder()
                .create()
                .map_err(|error| OpenError::new("listening to", bell.name(), error))?,
            scratch: Vec::new(),
            missed: Vec::new(),
            incoming: None,
            _bell_service: bell_service,
            node,
        };
        endpoint.open_standing_ports()?;
        Ok(endpoint)
    }

    /// Samples that wait in the outbox.
    #[must_use]
    pub const fn waiting(&self) -> usize {
        self.outbox.waiting()
    }

    /// Sleeps until somebody rings, one of `others` is readable, a sample is due that links hold up, or
    /// `until`; at most half a second.
    /// See [`super::IdleWait`] for what a loop should call.
    ///
    /// # Errors
    /// If the bell is broken.
    pub fn wait(
        &mut self,
        until: Option<Nanos>,
        others: &[BorrowedFd<'_>],
    ) -> Result<Wake, SendError> {
        let held = self.incoming.as_ref().and_then(Incoming::next_due);
        wake::sleep(&self.bell, until.into_iter().chain(held).min(), others)
    }

    /// Rings every craft's bell, so that all of them look up; for endings.
    pub fn ring_everybody(&mut self) {
        for index in self.peers.craft_indices() {
            self.peers.mark(index);
        }
        self.peers.ring(&self.node);
    }

    const fn is_orchestrator(&self) -> bool {
        self.own.0 == CraftId::ORCHESTRATOR.0
    }

    /// What is open in every epoch: a craft's way to the orchestrator, the orchestrator's bells.
    fn open_standing_ports(&mut self) -> Result<(), OpenError> {
        if !self.is_orchestrator() {
            let index = self.peers.craft_indices().end;
            self.peers.publisher(index, &self.node, self.options.payload_bytes_max)?;
            self.peers.slot(index).is_open = true;
            self.open_notifier(index)?;
        }
        Ok(())
    }

    fn open_notifier(&mut self, index: usize) -> Result<(), OpenError> {
        if self.options.wake == WakeMode::Poll {
            return Ok(());
        }
        self.peers.open_notifier(index, &self.node)
    }
}

impl Endpoint for IceoryxEndpoint {
    fn open_ports(&mut self, peers: &Peers) -> Result<(), SendError> {
        let limit = self.options.payload_bytes_max;
        for index in self.peers.craft_indices() {
            let to = self.peers.destination_of(index);
            let is_wanted = peers.unicast.binary_search(&to.address()).is_ok();
            self.peers.slot(index).is_open = is_wanted;
            if is_wanted {
                self.peers.publisher(index, &self.node, limit)?;
            } else if !self.outbox.holds_back(to) {
                self.peers.close(index);
            }
            let is_self = to.address() == self.own;
            if !is_self && (is_wanted || peers.sends_multicast || self.is_orchestrator()) {
                self.open_notifier(index)?;
            } else {
                self.peers.close_notifier(index);
            }
        }
        let strangers = peers.unicast.iter().find(|&&craft| self.peers.index_of(craft).is_none());
        if let Some(&craft) = strangers {
            return Err(SendError::NotOpen(Destination::Craft(craft)));
        }
        if !self.is_orchestrator() {
            self.open_multicast(peers)?;
        }
        Ok(())
    }

    fn update_connections(&mut self) -> Result<(), SendError> {
        self.peers.update_connections()?;
        if let Some(broadcast) = &mut self.broadcast {
            broadcast.update_connections()?;
        }
        let subscribers = [Some(&self.inbox), self.turn.as_ref(), self.multicast.as_ref()];
        for subscriber in subscribers.into_iter().flatten() {
            subscriber
                .update_connections()
                .map_err(|error| transport_error("connecting to senders", error))?;
        }
        match &self.world {
            World::Publisher { publisher, .. } => publisher.update_connections(),
            World::Subscriber(subscriber) => subscriber.update_connections(),
        }
        .map_err(|error| transport_error("connecting for worlds", error))
    }

    fn send(
        &mut self,
        to: Destination,
        header: Header,
        length: usize,
        write: &mut dyn FnMut(&mut [u8]),
    ) -> Result<(), SendError> {
        let limit = self.options.payload_bytes_max;
        if length > limit && to != Destination::World {
            return Err(SendError::TooLong { needed: length, limit });
        }
        match to {
            Destination::Craft(_) | Destination::Orchestrator => {
                self.send_unicast(to, header, length, write)
            }
            Destination::Multicast if !self.is_orchestrator() => {
                self.send_broadcast(to, header, length, write)
            }
            Destination::Turn if self.is_orchestrator() => {
                self.send_broadcast(to, header, length, write)
            }
            Destination::World => self.send_world(header, length, write),
            Destination::Multicast | Destination::Turn => Err(SendError::NotOpen(to)),
        }
    }

    fn take_world(&mut self) -> Result<Option<WorldSample>, SendError> {
        let World::Subscriber(subscriber) = &self.world else { return Ok(None) };
        let received =
            subscriber.receive().map_err(|error| transport_error("taking a world", error))?;
        let Some(sample) = received else { return Ok(None) };
        let header = *sample.user_header();
        let admitted = self.intake.admit(Through::World, &header, sample.payload());
        Ok(admitted.map(|_| WorldSample::new(header, HeldSample(sample))))
    }

    fn flush(&mut self) -> Result<usize, SendError> {
        let Self { outbox, peers, node, options, .. } = self;
        outbox.retry(|to, header, payload| {
            let Some(index) = peers.index_of(to.address()) else { return Ok(false) };
            let publisher = peers.publisher(index, node, options.payload_bytes_max)?;
            let mut header = *header;
            let mut copy = |slot: &mut [u8]| slot.copy_from_slice(payload);
            let is_taken = publish_sample(publisher, &mut header, payload.len(), &mut copy)? > 0;
            if is_taken {
                peers.mark(index);
            }
            Ok(is_taken)
        })
    }

    fn holds_back(&self, to: Destination) -> bool {
        self.outbox.holds_back(to)
    }

    fn drain(
        &mut self,
        visit: &mut dyn FnMut(Destination, &Header, &[u8]),
    ) -> Result<usize, SendError> {
        let Self { inbox, turn, multicast, intake, incoming, .. } = self;
        let subscribers = [
            (Some(&*inbox), Through::Inbox),
            (turn.as_ref(), Through::Broadcast),
            (multicast.as_ref(), Through::Broadcast),
        ];
        let mut visited = 0;
        let mut admit = |through, header: &Header, payload: &[u8]| {
            if let Some(destination) = intake.admit(through, header, payload) {
                visit(destination, header, payload);
                visited += 1;
            }
        };
        let mut received = 0;
        let now = incoming.as_ref().map_or(Nanos(0), |_| clock::now());
        loop {
            let mut is_any_left = false;
            for (subscriber, through) in subscribers {
                let Some(subscriber) = subscriber else { continue };
                let mut burst = 0;
                while burst < DRAIN_BURST {
                    let Some(sample) = subscriber
                        .receive()
                        .map_err(|error| transport_error("receiving", error))?
                    else {
                        break;
                    };
                    burst += 1;
                    let (header, payload) = (sample.user_header(), sample.payload());
                    let times = incoming
                        .as_mut()
                        .map_or(1, |incoming| incoming.take(now, through, header, payload));
                    for _ in 0..times {
                        admit(through, header, payload);
                    }
                }
                is_any_left |= burst == DRAIN_BURST;
                received += burst;
            }
            if !is_any_left || received >= DRAIN_SAMPLES_MAX {
                break;
            }
        }
        if let Some(incoming) = incoming {
            while let Some(Copied { through, header, payload }) = incoming.release(now) {
                admit(*through, header, payload);
            }
        }
        Ok(visited)
    }

    fn next_number(&self, to: Destination) -> u64 {
        self.number_of_next(to)
    }

    fn send_past_numbering(
        &mut self,
        receiver: CraftId,
        header: Header,
        length: usize,
        write: &mut dyn FnMut(&mut [u8]),
    ) -> Result<(), SendError> {
        self.send_as_numbered(receiver, header, length, write)
    }

    fn numbers(&mut self, service: Numbered) -> &mut Sequences {
        self.intake.numbers(service)
    }

    fn expose(&mut self, link: Option<StatedLink>) {
        self.incoming = link.map(|link| Incoming::new(link, self.own, self.options.craft_count));
    }

    fn discard(&mut self, craft: CraftId) -> usize {
        self.outbox.discard(Destination::Craft(craft))
    }

    fn ring(&mut self) {
        if self.options.wake == WakeMode::Poll {
            self.peers.clear_marks();
        } else {
            self.peers.ring(&self.node);
        }
    }

    fn take_losses(&mut self) -> Losses {
        let mut losses = std::mem::take(&mut self.losses);
        losses += self.intake.take_losses();
        losses.links += self.incoming.as_mut().map(Incoming::take_counts).unwrap_or_default();
        losses
    }
}
