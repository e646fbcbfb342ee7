//! A deterministic network inside one process, with a virtual clock: the transport of the simulator
//! and of tests, held to the same laws as the real one.
//!
//! What is sent is in flight until the owner of the [`MemoryNetwork`] delivers it: one sample at a
//! time ([`MemoryNetwork::deliver_next`]) or all of them. Every sample takes a random time below
//! [`MemoryOptions::jitter_ns`] from one seeded stream, but never overtakes another of its sender on
//! its way to the same service, so the seed decides how senders interleave and nothing else does.
//! Inboxes are as bounded as the real ones: a sender may have as many samples in flight or unread at
//! a receiver as the service holds. Faults come from a [`Link`]. Memory is per pair that talks, not
//! per pair that could, and is reused: the steady state does not allocate. Not here: who steps the
//! crafts (agent, `simulation`).

mod endpoint;
mod network;
mod sending;

pub use endpoint::MemoryEndpoint;

use super::link::{Link, LinkCounts};
use crate::ids::CraftId;
use crate::time::Nanos;
use crate::wire::Header;
use network::{Network, Node};
use std::cell::RefCell;
use std::rc::Rc;

/// How a memory network is set up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryOptions {
    /// Run id that every sample carries.
    pub run: u64,
    /// Seed of the order of delivery.
    pub seed: u64,
    /// Samples take a random time below this, in ns; 0 delivers in the order of sending.
    pub jitter_ns: u32,
    /// Longest payload of an inbox or multicast sample, in bytes.
    pub payload_bytes_max: usize,
}

impl Default for MemoryOptions {
    fn default() -> Self {
        Self {
            run: 1,
            seed: 0,
            jitter_ns: 1_000,
            payload_bytes_max: crate::limits::INBOX_PAYLOAD_BYTES,
        }
    }
}

/// The network and its clock. Cloning gives another handle to the same network.
#[derive(Clone)]
pub struct MemoryNetwork {
    shared: Rc<RefCell<Network>>,
}

impl std::fmt::Debug for MemoryNetwork {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let network = self.shared.borrow();
        formatter
            .debug_struct("MemoryNetwork")
            .field("now", &network.now())
            .field("in_flight", &network.in_flight())
            .finish_non_exhaustive()
    }
}

impl MemoryNetwork {
    /// A network of `craft_count` crafts (count the centre, if there is one) and an orchestrator.
    #[must_use]
    pub fn new(craft_count: u32, options: MemoryOptions) -> Self {
        Self { shared: Rc::new(RefCell::new(Network::new(craft_count, options))) }
    }

    /// The endpoint of `craft` in its life `incarnation`. An earlier endpoint of the craft is cut
    /// off, and what it had not read is lost.
    ///
    /// # Panics
    /// If the network has no such craft.
    #[must_use]
    pub fn endpoint(&self, craft: CraftId, incarnation: u32) -> MemoryEndpoint {
        let node = Node::of_craft(craft);
        MemoryEndpoint::open(Rc::clone(&self.shared), craft, node, incarnation)
    }

    /// The endpoint of the orchestrator.
    #[must_use]
    pub fn orchestrator(&self) -> MemoryEndpoint {
        let node = self.shared.borrow().orchestrator();
        MemoryEndpoint::open(Rc::clone(&self.shared), CraftId::ORCHESTRATOR, node, 0)
    }

    /// Lets `link` judge every sample from now on.
    pub fn set_link(&self, link: impl Link + 'static) {
        self.shared.borrow_mut().set_link(Some(Box::new(link)));
    }

    /// Lets everything pass again.
    pub fn clear_link(&self) {
        self.shared.borrow_mut().set_link(None);
    }

    /// Starts the order of delivery of another trial, which the link hears of; the numbering of samples
    /// runs on.
    pub fn reseed(&self, seed: u64, trial: u32) {
        self.shared.borrow_mut().reseed(seed, trial);
    }

    /// What the link did since [`Self::reseed`].
    #[must_use]
    pub fn link_counts(&self) -> LinkCounts {
        self.shared.borrow().link_counts()
    }

    /// The virtual time.
    #[must_use]
    pub fn now(&self) -> Nanos {
        self.shared.borrow().now()
    }

    /// When the next sample arrives.
    #[must_use]
    pub fn next_due(&self) -> Option<Nanos> {
        self.shared.borrow().next_due()
    }

    /// Lets virtual time pass without delivering anything. Time never goes back.
    pub fn advance_to(&self, now: Nanos) {
        self.shared.borrow_mut().advance_to(now);
    }

    /// Moves the clock to the next arrival and puts that sample into its receiver's inbox. Returns
    /// the receiver ([`CraftId::ORCHESTRATOR`] for the orchestrator), `None` if nothing is in flight.
    #[must_use = "says who has something to read"]
    pub fn deliver_next(&self) -> Option<CraftId> {
        self.shared.borrow_mut().deliver_next()
    }

    /// Delivers everything that is in flight now; returns how many samples that were.
    pub fn deliver_all(&self) -> usize {
        let mut network = self.shared.borrow_mut();
        let mut delivered = 0;
        while network.deliver_next().is_some() {
            delivered += 1;
        }
        delivered
    }

    /// Samples sent and not yet delivered.
    #[must_use]
    pub fn in_flight(&self) -> usize {
        self.shared.borrow().in_flight()
    }

    /// Samples that memory is held for, in use or to be reused.
    #[must_use]
    pub fn samples_held(&self) -> usize {
        self.shared.borrow().samples_held()
    }

    /// Whether nothing is in flight, unread, or waiting in an outbox.
    #[must_use]
    pub fn is_quiet(&self) -> bool {
        self.shared.borrow().is_quiet()
    }

    /// Puts a sample into `receiver`'s inbox as it is, past sealing and numbering: what a foreign
    /// or broken sender might do.
    pub fn inject(&self, receiver: CraftId, header: Header, payload: &[u8]) {
        self.shared.borrow_mut().inject(receiver, header, payload);
    }
}
