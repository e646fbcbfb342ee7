//! What a step wants sent, and what the process counts.

use shared_types::ids::{CraftId, FactId, Turn};
use shared_types::knowledge::{BoardView, Change};
use shared_types::time::Nanos;
use shared_types::transport::Destination;
use shared_types::wire::{
    Class, Counters, EpochSpec, HEADER_BYTES, Header, Kind, Refusal, TurnReport,
};
use std::ops::Range;

/// A delivered change that waits for its turn to close.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Held {
    /// The turn in which it was made.
    pub turn: Turn,
    /// The craft whose firing made it.
    pub origin: CraftId,
    /// That craft's firing number.
    pub firing_number: u32,
    /// The change, in the origin's ids.
    pub change: Change,
}

impl Held {
    /// The order in which a closed turn is merged.
    #[must_use]
    pub const fn merge_order(&self) -> (CraftId, u32, FactId) {
        (self.origin, self.firing_number, self.change.fact)
    }
}

/// The header of a sample that `origin` sends in `turn` of `epoch`.
pub(crate) fn header(class: Class, kind: Kind, origin: CraftId, epoch: u32, turn: Turn) -> Header {
    let mut header = Header::new(class, kind);
    header.origin = origin.0;
    header.epoch = epoch;
    header.turn = turn.0;
    header
}

/// One sample to send.
#[derive(Clone, Debug)]
pub struct Outgoing {
    /// Where it goes.
    pub to: Destination,
    /// Its header; the endpoint fills in what it knows better.
    pub header: Header,
    /// Its records, as a range of [`Outbox::changes`].
    pub changes: Range<usize>,
}

/// What one step wants sent. The shell empties it; the buffers stay.
#[derive(Debug, Default)]
pub struct Outbox {
    /// Samples of the classes replication and reply, in sending order.
    pub samples: Vec<Outgoing>,
    /// The changes that the samples carry.
    pub changes: Vec<Change>,
    /// When each of them was meant to be made, ns, where samples carry that change by change; else
    /// empty.
    pub intended: Vec<u64>,
    /// When the changes of these samples were made, in open mode; `None` for what is passed on.
    pub made: Option<Nanos>,
    /// Lines of the turn's ledger for the orchestrator, to be sent after the samples.
    pub reports: Vec<TurnReport>,
    /// Whether the process has done its part of the epoch and owes its trial report.
    pub is_finished: bool,
}

impl Outbox {
    /// Forgets everything that was to be sent.
    pub fn clear(&mut self) {
        self.samples.clear();
        self.changes.clear();
        self.intended.clear();
        self.made = None;
        self.reports.clear();
        self.is_finished = false;
    }

    /// Keeps changes for samples to refer to.
    pub(crate) fn put_changes(&mut self, changes: &[Change]) -> Range<usize> {
        let start = self.changes.len();
        self.changes.extend_from_slice(changes);
        start..self.changes.len()
    }

    /// Keeps changes with when they were meant to be made. All changes of a step are kept like this, or
    /// none is.
    pub(crate) fn put_timed(
        &mut self,
        changes: impl Iterator<Item = (Change, u64)>,
    ) -> Range<usize> {
        let start = self.changes.len();
        for (change, intended_ns) in changes {
            self.changes.push(change);
            self.intended.push(intended_ns);
        }
        start..self.changes.len()
    }

    /// Plans one sample and counts its request.
    pub(crate) fn send(
        &mut self,
        to: Destination,
        header: Header,
        changes: Range<usize>,
        counting: &mut Counting,
    ) {
        counting.counters.traffic[header.class as usize].requests += 1;
        self.put_sample(to, header, changes);
    }

    /// Plans one sample in which every change is a request of its own.
    pub(crate) fn send_batch(
        &mut self,
        to: Destination,
        header: Header,
        changes: Range<usize>,
        counting: &mut Counting,
    ) {
        counting.counters.traffic[header.class as usize].requests += changes.len() as u64;
        self.put_sample(to, header, changes);
    }

    /// Plans one sample without counting a request.
    pub(crate) fn put_sample(
        &mut self,
        to: Destination,
        mut header: Header,
        changes: Range<usize>,
    ) {
        header.record_count =
            u16::try_from(changes.len()).expect("invariant: a sample holds few changes");
        self.samples.push(Outgoing { to, header, changes });
    }
}

/// A process's counters of an epoch.
#[derive(Clone, Debug, Default)]
pub struct Counting {
    /// The counters.
    pub counters: Counters,
    /// Bytes of one record on the wire.
    pub record_bytes: usize,
}

impl Counting {
    /// Sets every counter to zero, for a fleet of `processes` processes.
    pub(crate) fn begin_epoch(&mut self, spec: &EpochSpec, processes: usize) {
        let mut deliveries_from = std::mem::take(&mut self.counters.deliveries_from);
        deliveries_from.clear();
        deliveries_from.resize(processes, 0);
        self.counters = Counters { deliveries_from, ..Counters::default() };
        self.record_bytes = spec.record_bytes as usize;
    }

    /// Counts a firing and whether it changed a boundary fact.
    pub(crate) fn fired(&mut self, board: &BoardView<'_>, changes: &[Change]) {
        self.counters.firings += 1;
        let is_boundary = changes.iter().any(|change| board.is_boundary(change.fact));
        self.counters.boundary_firings += u64::from(is_boundary);
    }

    /// Counts a sample as sent.
    pub fn sent(&mut self, class: Class, payload_bytes: usize) {
        let traffic = &mut self.counters.traffic[class as usize];
        traffic.transmissions += 1;
        traffic.bytes_sent += (HEADER_BYTES + payload_bytes) as u64;
    }

    /// Counts a sample as received.
    ///
    /// # Errors
    /// If its source is no process of the fleet.
    pub(crate) fn received(
        &mut self,
        class: Class,
        header: &Header,
        payload_bytes: usize,
    ) -> Result<(), Refusal> {
        let from = self.counters.deliveries_from.get_mut(header.source as usize);
        let is_first = matches!(class, Class::Replication | Class::Reply);
        *from.ok_or(Refusal::Record)? += u64::from(is_first);
        let traffic = &mut self.counters.traffic[class as usize];
        traffic.deliveries += 1;
        traffic.bytes_received += (HEADER_BYTES + payload_bytes) as u64;
        Ok(())
    }
}
