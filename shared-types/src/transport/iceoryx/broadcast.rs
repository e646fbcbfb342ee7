//! One publisher to many subscribers, and who of them missed a sample.
//!
//! iceoryx2 names those whose buffer was full by the id of their port; every subscriber carries its
//! craft's number as its name, so the list of subscribers translates.

use super::endpoint::IceoryxEndpoint;
use super::peers::{publish_sample, transport_error};
use super::services::{OpenError, open, publish, subscribe};
use super::{Factory, Node, Publisher};
use crate::ids::CraftId;
use crate::transport::topic::Service;
use crate::transport::{Peers, SendError};
use crate::wire::Header;
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::prelude::{CallbackProgression, PortFactory};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// Subscribers that did not take the latest sample, noted by the back-pressure handler.
#[derive(Debug, Default)]
pub(super) struct Missed {
    is_any: AtomicBool,
    ports: Mutex<Vec<u128>>,
}

impl Missed {
    /// Notes that the subscriber with id `port` missed a sample.
    pub(super) fn note(&self, port: u128) {
        self.is_any.store(true, Ordering::Relaxed);
        self.ports.lock().unwrap_or_else(PoisonError::into_inner).push(port);
    }
}

/// The sending side of `multicast`, or of `turn`.
#[derive(Debug)]
pub(super) struct Broadcast {
    factory: Factory,
    publisher: Publisher,
    missed: Arc<Missed>,
    own: CraftId,
    /// Port id and craft of every other subscriber, as last listed.
    listeners: Vec<(u128, CraftId)>,
    /// How many subscribers there were then, this craft's own among them.
    subscriber_count: usize,
}

impl Broadcast {
    pub(super) fn open(
        node: &Node,
        service: Service,
        own: CraftId,
        payload_bytes_max: usize,
    ) -> Result<Self, OpenError> {
        let factory = open(node, service)?;
        let missed = Arc::new(Missed::default());
        let publisher = publish(&factory, service, payload_bytes_max, Some(Arc::clone(&missed)))?;
        let (listeners, subscriber_count) = (Vec::new(), 0);
        let mut broadcast = Self { factory, publisher, missed, own, listeners, subscriber_count };
        broadcast.list();
        Ok(broadcast)
    }

    /// Connects to everybody who listens by now.
    pub(super) fn update_connections(&mut self) -> Result<(), SendError> {
        self.publisher
            .update_connections()
            .map_err(|error| transport_error("connecting to listeners", error))?;
        self.list();
        Ok(())
    }

    /// Crafts that listen, this one not counted.
    pub(super) fn listeners(&self) -> impl Iterator<Item = CraftId> + use<'_> {
        self.listeners.iter().map(|&(_, craft)| craft)
    }

    /// Sends to everybody and adds those who did not get the sample to `missed`.
    pub(super) fn send(
        &mut self,
        header: &mut Header,
        length: usize,
        write: &mut dyn FnMut(&mut [u8]),
        missed: &mut Vec<CraftId>,
    ) -> Result<(), SendError> {
        if self.factory.dynamic_config().number_of_subscribers() != self.subscriber_count {
            self.list();
        }
        let taken = publish_sample(&self.publisher, header, length, write)?;
        let is_noted = self.missed.is_any.load(Ordering::Relaxed);
        if taken == 0 && !is_noted {
            // Nobody listens, or no memory was left to write into.
            self.list();
            missed.extend(self.listeners());
        } else if is_noted {
            self.name_missed(missed);
        }
        Ok(())
    }

    /// Translates the noted ports to crafts and clears the notes.
    #[cold]
    fn name_missed(&mut self, missed: &mut Vec<CraftId>) {
        self.list();
        self.missed.is_any.store(false, Ordering::Relaxed);
        let mut ports = self.missed.ports.lock().unwrap_or_else(PoisonError::into_inner);
        for port in ports.drain(..) {
            // A port that is not listed is this craft's own, or has just gone.
            missed.extend(
                self.listeners.iter().find(|&&(id, _)| id == port).map(|&(_, craft)| craft),
            );
        }
    }

    fn list(&mut self) {
        let Self { factory, listeners, own, subscriber_count, .. } = self;
        listeners.clear();
        // Counted first: who comes while the list is read makes it be read again.
        *subscriber_count = factory.dynamic_config().number_of_subscribers();
        factory.dynamic_config().list_subscribers(|details| {
            if let Ok(number) = details.subscriber_name.as_str().parse()
                && CraftId(number) != *own
            {
                listeners.push((details.subscriber_id.value(), CraftId(number)));
            }
            CallbackProgression::Continue
        });
    }
}

impl IceoryxEndpoint {
    /// Opens or closes what multicasts need.
    pub(super) fn open_multicast(&mut self, peers: &Peers) -> Result<(), OpenError> {
        let wants_service = peers.sends_multicast || peers.receives_multicast;
        if wants_service && self.multicast_service.is_none() {
            self.multicast_service = Some(open(&self.node, Service::Multicast)?);
        }
        if !peers.receives_multicast {
            self.multicast = None;
        } else if self.multicast.is_none()
            && let Some(service) = &self.multicast_service
        {
            self.multicast = Some(subscribe(service, Service::Multicast, self.own)?);
        }
        if !peers.sends_multicast {
            self.broadcast = None;
        } else if self.broadcast.is_none() {
            let limit = self.options.payload_bytes_max;
            let opened = Broadcast::open(&self.node, Service::Multicast, self.own, limit)?;
            self.broadcast = Some(opened);
        }
        Ok(())
    }
}
