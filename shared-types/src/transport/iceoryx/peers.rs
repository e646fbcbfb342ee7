//! One slot per process that this one may send to: its inbox's publisher, its bell's notifier, and
//! the number of the next sample, which outlives both.
//!
//! Opened services are kept across epochs; publishers and notifiers are kept as long as epochs need
//! them, because an idle publisher makes every receive of its subscriber dearer.

use super::services::{OpenError, open, open_bell, publish};
use super::{BellFactory, Factory, Node, Notifier, Publisher};
use crate::ids::CraftId;
use crate::transport::topic::Service;
use crate::transport::{Destination, SendError};
use crate::wire::Header;
use iceoryx2::port::LoanError;
use iceoryx2::port::update_connections::UpdateConnections;

/// Slots of all crafts by id, the orchestrator's after them.
#[derive(Debug)]
pub(super) struct PeerTable {
    slots: Vec<Slot>,
    /// Slots with `must_ring`, in the order of sending.
    to_ring: Vec<usize>,
}

/// A process that samples are sent to.
#[derive(Debug, Default)]
pub(super) struct Slot {
    inbox: Option<Factory>,
    publisher: Option<Publisher>,
    bell: Option<BellFactory>,
    notifier: Option<Notifier>,
    /// Number of the next sample to this inbox.
    pub(super) sequence: u64,
    /// Whether the epoch's strategy may send here; repairs always may.
    pub(super) is_open: bool,
    must_ring: bool,
}

impl PeerTable {
    pub(super) fn new(craft_count: u32) -> Self {
        let slots = craft_count as usize + 1;
        Self {
            slots: std::iter::repeat_with(Slot::default).take(slots).collect(),
            to_ring: Vec::with_capacity(slots),
        }
    }

    /// The slot of `craft`, `None` if there is no such process.
    pub(super) fn index_of(&self, craft: CraftId) -> Option<usize> {
        let orchestrator = self.slots.len() - 1;
        match craft {
            CraftId::ORCHESTRATOR => Some(orchestrator),
            craft => (craft.index() < orchestrator).then_some(craft.index()),
        }
    }

    /// Number of the next sample to the inbox of `index`.
    pub(super) fn number(&self, index: usize) -> u64 {
        self.slots[index].sequence
    }

    pub(super) fn slot(&mut self, index: usize) -> &mut Slot {
        &mut self.slots[index]
    }

    /// Crafts by index, without the orchestrator.
    pub(super) fn craft_indices(&self) -> std::ops::Range<usize> {
        0..self.slots.len() - 1
    }

    /// The publisher to the inbox of slot `index`, opened if it is not.
    pub(super) fn publisher(
        &mut self,
        index: usize,
        node: &Node,
        payload_bytes_max: usize,
    ) -> Result<&Publisher, OpenError> {
        let service = self.inbox_of(index);
        let slot = &mut self.slots[index];
        if slot.publisher.is_none() {
            if slot.inbox.is_none() {
                slot.inbox = Some(open(node, service)?);
            }
            let factory = slot.inbox.as_ref().expect("invariant: opened above");
            slot.publisher = Some(publish(factory, service, payload_bytes_max, None)?);
        }
        Ok(slot.publisher.as_ref().expect("invariant: opened above"))
    }

    /// Closes the publisher to slot `index`; its service stays open, its numbers run on.
    pub(super) fn close(&mut self, index: usize) {
        self.slots[index].publisher = None;
    }

    /// Opens the notifier of slot `index`'s bell if it is not.
    pub(super) fn open_notifier(&mut self, index: usize, node: &Node) -> Result<(), OpenError> {
        let service = self.bell_of(index);
        let slot = &mut self.slots[index];
        if slot.notifier.is_none() {
            if slot.bell.is_none() {
                slot.bell = Some(open_bell(node, service)?);
            }
            let factory = slot.bell.as_ref().expect("invariant: opened above");
            let created = factory.notifier_builder().create();
            let opened = created
                .map_err(|error| OpenError::new("opening a notifier of", service.name(), error))?;
            slot.notifier = Some(opened);
        }
        Ok(())
    }

    /// Closes the notifier of slot `index`'s bell.
    pub(super) fn close_notifier(&mut self, index: usize) {
        self.slots[index].notifier = None;
    }

    /// Notes that slot `index` was sent to.
    #[inline]
    pub(super) fn mark(&mut self, index: usize) {
        let slot = &mut self.slots[index];
        if !slot.must_ring {
            slot.must_ring = true;
            self.to_ring.push(index);
        }
    }

    /// Rings the bells of all slots sent to since the last call. A bell that cannot be rung belongs to
    /// a process that is gone or has not come up, and neither sleeps on it.
    pub(super) fn ring(&mut self, node: &Node) {
        while let Some(index) = self.to_ring.pop() {
            self.slots[index].must_ring = false;
            if self.open_notifier(index, node).is_ok()
                && let Some(notifier) = &self.slots[index].notifier
            {
                let _not_there = notifier.notify();
            }
        }
    }

    /// Forgets who was sent to: nobody sleeps.
    pub(super) fn clear_marks(&mut self) {
        while let Some(index) = self.to_ring.pop() {
            self.slots[index].must_ring = false;
        }
    }

    /// Brings up the connections of all open publishers.
    pub(super) fn update_connections(&self) -> Result<(), SendError> {
        self.slots.iter().filter_map(|slot| slot.publisher.as_ref()).try_for_each(|publisher| {
            publisher
                .update_connections()
                .map_err(|error| transport_error("connecting to an inbox", error))
        })
    }

    fn inbox_of(&self, index: usize) -> Service {
        if index + 1 == self.slots.len() {
            Service::OrchestratorInbox
        } else {
            Service::Inbox(CraftId::from_index(index))
        }
    }

    fn bell_of(&self, index: usize) -> Service {
        if index + 1 == self.slots.len() {
            Service::OrchestratorBell
        } else {
            Service::Bell(CraftId::from_index(index))
        }
    }

    /// Where the samples of slot `index`'s inbox go.
    pub(super) fn destination_of(&self, index: usize) -> Destination {
        if index + 1 == self.slots.len() {
            Destination::Orchestrator
        } else {
            Destination::Craft(CraftId::from_index(index))
        }
    }
}

/// Writes a sample into a loan, seals `header` over it and sends it. Returns how many receivers took
/// it: 0 as well if all of the publisher's memory is in use.
pub(super) fn publish_sample(
    publisher: &Publisher,
    header: &mut Header,
    length: usize,
    write: &mut dyn FnMut(&mut [u8]),
) -> Result<usize, SendError> {
    let mut sample = match publisher.loan_slice(length) {
        Ok(sample) => sample,
        Err(LoanError::OutOfMemory | LoanError::ExceedsMaxLoans) => return Ok(0),
        Err(error) => return Err(transport_error("loaning a sample", error)),
    };
    write(sample.payload_mut());
    header.seal(sample.payload());
    *sample.user_header_mut() = *header;
    sample.send().map_err(|error| transport_error("sending", error))
}

/// What iceoryx2 said, as an error of the port.
pub(super) fn transport_error(operation: &'static str, detail: impl std::fmt::Debug) -> SendError {
    SendError::Transport { operation, detail: format!("{detail:?}") }
}

impl From<OpenError> for SendError {
    fn from(error: OpenError) -> Self {
        Self::Transport { operation: "opening a port", detail: error.to_string() }
    }
}
