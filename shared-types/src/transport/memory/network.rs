//! The state that all endpoints of a memory network share: samples, ways, the queue of arrivals.

use super::MemoryOptions;
use crate::ids::CraftId;
use crate::rng::{Purpose, Stream};
use crate::time::Nanos;
use crate::transport::intake::Through;
use crate::transport::link::{Link, LinkCounts, Verdict};
use crate::wire::Header;
use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};
use std::rc::Rc;

/// A participant: crafts by their id, the orchestrator after them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Node(u32);

impl Node {
    pub(super) const fn of_craft(craft: CraftId) -> Self {
        Self(craft.0)
    }

    const fn index(self) -> usize {
        self.0 as usize
    }
}

/// From one sender to one service of one receiver; an index into [`Network::ways`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct WayId(u32);

/// A sample, shared by all that have not read it yet; an index into [`Network::samples`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct SampleId(u32);

#[derive(Debug)]
struct Way {
    receiver: Node,
    through: Through,
    /// Samples in flight or unread.
    outstanding: usize,
    capacity: usize,
    /// When the latest of them arrives: nothing behind it may arrive earlier.
    latest_due: Nanos,
    /// The latest sent of those that have arrived.
    latest_arrived: u64,
}

struct Sample {
    header: Header,
    payload: Vec<u8>,
    readers: u32,
}

/// On its way; ordered by arrival, then by the order of sending.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Flight {
    due: Nanos,
    number: u64,
    sample: SampleId,
    way: u32,
}

#[derive(Debug, Default)]
struct Inbox {
    unread: VecDeque<(SampleId, Option<WayId>)>,
    /// How many endpoints this node has had; the latest is the one that is served.
    generation: u32,
    is_open: bool,
    receives_multicast: bool,
}

/// The newest sample of the `World` service.
#[derive(Clone)]
pub(super) struct World {
    pub(super) header: Header,
    pub(super) bytes: Rc<rkyv::util::AlignedVec>,
    pub(super) number: u64,
}

pub(super) struct Network {
    options: MemoryOptions,
    inboxes: Vec<Inbox>,
    ways: Vec<Way>,
    samples: Vec<Sample>,
    free: Vec<SampleId>,
    flights: BinaryHeap<Reverse<Flight>>,
    order: Stream,
    link: Option<Box<dyn Link>>,
    link_counts: LinkCounts,
    now: Nanos,
    sent: u64,
    unread: usize,
    /// Samples in the outboxes of all endpoints.
    pub(super) kept: usize,
    /// Grows whenever somebody starts or stops listening to multicasts or turns.
    pub(super) listeners_changed: u64,
    pub(super) world: Option<World>,
}

impl Network {
    pub(super) fn new(craft_count: u32, options: MemoryOptions) -> Self {
        let nodes = craft_count as usize + 1;
        Self {
            options,
            inboxes: std::iter::repeat_with(Inbox::default).take(nodes).collect(),
            ways: Vec::new(),
            samples: Vec::new(),
            free: Vec::new(),
            flights: BinaryHeap::new(),
            order: Stream::new(options.seed, 0, Purpose::Delivery, 0),
            link: None,
            link_counts: LinkCounts::default(),
            now: Nanos::default(),
            sent: 0,
            unread: 0,
            kept: 0,
            listeners_changed: 0,
            world: None,
        }
    }

    pub(super) const fn options(&self) -> &MemoryOptions {
        &self.options
    }

    pub(super) fn craft_count(&self) -> u32 {
        self.orchestrator().0
    }

    pub(super) fn orchestrator(&self) -> Node {
        Node(CraftId::from_index(self.inboxes.len() - 1).0)
    }

    pub(super) fn node(&self, craft: CraftId) -> Option<Node> {
        if craft == CraftId::ORCHESTRATOR {
            Some(self.orchestrator())
        } else {
            (craft.0 < self.craft_count()).then_some(Node(craft.0))
        }
    }

    pub(super) fn craft(&self, node: Node) -> CraftId {
        if node == self.orchestrator() { CraftId::ORCHESTRATOR } else { CraftId(node.0) }
    }

    pub(super) fn now(&self) -> Nanos {
        self.now
    }

    pub(super) fn next_due(&self) -> Option<Nanos> {
        self.flights.peek().map(|Reverse(flight)| flight.due)
    }

    pub(super) fn advance_to(&mut self, now: Nanos) {
        self.now = self.now.max(now);
    }

    pub(super) fn in_flight(&self) -> usize {
        self.flights.len()
    }

    pub(super) fn samples_held(&self) -> usize {
        self.samples.len()
    }

    pub(super) fn is_quiet(&self) -> bool {
        self.flights.is_empty() && self.unread == 0 && self.kept == 0
    }

    pub(super) fn set_link(&mut self, link: Option<Box<dyn Link>>) {
        self.link = link;
    }

    pub(super) fn reseed(&mut self, seed: u64, trial: u32) {
        self.order = Stream::new(seed, trial, Purpose::Delivery, 0);
        self.link_counts = LinkCounts::default();
        if let Some(link) = &mut self.link {
            link.begin(self.now, trial);
        }
    }

    pub(super) const fn link_counts(&self) -> LinkCounts {
        self.link_counts
    }

    /// Opens the inbox of `node` for a new endpoint and returns that endpoint's generation.
    pub(super) fn attach(&mut self, node: Node) -> u32 {
        while self.take_unread(node).is_some() {}
        let inbox = &mut self.inboxes[node.index()];
        inbox.generation += 1;
        inbox.is_open = true;
        inbox.receives_multicast = false;
        self.listeners_changed += 1;
        inbox.generation
    }

    /// Closes the inbox of `node`, unless a newer endpoint has taken over.
    pub(super) fn detach(&mut self, node: Node, generation: u32) {
        if self.is_served(node, generation) {
            while self.take_unread(node).is_some() {}
            let inbox = &mut self.inboxes[node.index()];
            inbox.is_open = false;
            inbox.receives_multicast = false;
            self.listeners_changed += 1;
        }
    }

    /// Whether the endpoint of `generation` is the one that `node`'s inbox belongs to.
    pub(super) fn is_served(&self, node: Node, generation: u32) -> bool {
        self.inboxes[node.index()].generation == generation
    }

    pub(super) fn listen_to_multicasts(&mut self, node: Node, listens: bool) {
        let inbox = &mut self.inboxes[node.index()];
        if inbox.receives_multicast != listens {
            inbox.receives_multicast = listens;
            self.listeners_changed += 1;
        }
    }

    /// Crafts that a broadcast of `sender` reaches, ascending: all that are up for the orchestrator's
    /// turns, those that listen for a craft's multicasts.
    pub(super) fn listeners(&self, sender: Node) -> impl Iterator<Item = Node> + use<'_> {
        let is_turn = sender == self.orchestrator();
        (0..self.craft_count()).map(Node).filter(move |&node| {
            let inbox = &self.inboxes[node.index()];
            node != sender && inbox.is_open && (is_turn || inbox.receives_multicast)
        })
    }

    pub(super) fn add_way(&mut self, receiver: Node, through: Through, capacity: usize) -> WayId {
        let way = WayId(CraftId::from_index(self.ways.len()).0);
        let latest_due = self.now;
        let (outstanding, latest_arrived) = (0, 0);
        self.ways.push(Way {
            receiver,
            through,
            outstanding,
            capacity,
            latest_due,
            latest_arrived,
        });
        way
    }

    /// A sample with room for `length` bytes; the caller writes and seals it, then sends it to any
    /// number of ways and [`Self::release`]s it.
    pub(super) fn loan(&mut self, length: usize) -> SampleId {
        let id = self.free.pop().unwrap_or_else(|| {
            let id = SampleId(CraftId::from_index(self.samples.len()).0);
            let header = Header::default();
            self.samples.push(Sample { header, payload: Vec::new(), readers: 0 });
            id
        });
        let sample = &mut self.samples[id.0 as usize];
        sample.readers = 1;
        sample.payload.clear();
        sample.payload.resize(length, 0);
        id
    }

    pub(super) fn sample_mut(&mut self, id: SampleId) -> (&mut Header, &mut Vec<u8>) {
        let sample = &mut self.samples[id.0 as usize];
        (&mut sample.header, &mut sample.payload)
    }

    pub(super) fn sample(&self, id: SampleId) -> (&Header, &[u8]) {
        let sample = &self.samples[id.0 as usize];
        (&sample.header, &sample.payload)
    }

    pub(super) fn release(&mut self, id: SampleId) {
        let sample = &mut self.samples[id.0 as usize];
        sample.readers -= 1;
        if sample.readers == 0 {
            self.free.push(id);
        }
    }

    /// Sends a sealed sample one way; `false` if the receiver is away or its inbox is full.
    pub(super) fn offer(&mut self, way: WayId, id: SampleId) -> bool {
        let Way { receiver, outstanding, capacity, .. } = self.ways[way.0 as usize];
        if outstanding >= capacity || !self.inboxes[receiver.index()].is_open {
            return false;
        }
        let receiver = self.craft(receiver);
        let header = &self.samples[id.0 as usize].header;
        let verdict =
            self.link.as_mut().map_or(Verdict::Pass, |link| link.judge(self.now, receiver, header));
        self.link_counts.count(verdict);
        match verdict {
            Verdict::Pass => self.depart(way, id, 0, true),
            Verdict::Delay(delay_ns) => self.depart(way, id, delay_ns, true),
            Verdict::Overtaken(delay_ns) => self.depart(way, id, delay_ns, false),
            Verdict::Duplicate => {
                self.depart(way, id, 0, true);
                self.depart(way, id, 0, true);
            }
            Verdict::Doubled { delay_ns, keeps_order } => {
                self.depart(way, id, delay_ns, keeps_order);
                self.depart(way, id, delay_ns, keeps_order);
            }
            Verdict::Drop | Verdict::CutOff => {}
        }
        true
    }

    pub(super) fn deliver_next(&mut self) -> Option<CraftId> {
        let Reverse(Flight { due, number, sample, way }) = self.flights.pop()?;
        self.now = self.now.max(due);
        let Way { receiver, latest_arrived, .. } = &mut self.ways[way as usize];
        let receiver = *receiver;
        self.link_counts.overtaken += u64::from(number < *latest_arrived);
        *latest_arrived = number.max(*latest_arrived);
        self.inboxes[receiver.index()].unread.push_back((sample, Some(WayId(way))));
        self.unread += 1;
        Some(self.craft(receiver))
    }

    /// The next unread sample of `node`, and through which service it came. The caller releases it.
    pub(super) fn take_unread(&mut self, node: Node) -> Option<(SampleId, Through)> {
        let (sample, way) = self.inboxes[node.index()].unread.pop_front()?;
        self.unread -= 1;
        let through = way.map_or(Through::Inbox, |way| {
            let way = &mut self.ways[way.0 as usize];
            way.outstanding -= 1;
            way.through
        });
        Some((sample, through))
    }

    pub(super) fn inject(&mut self, receiver: CraftId, header: Header, payload: &[u8]) {
        let Some(node) = self.node(receiver) else { return };
        let id = self.loan(payload.len());
        let (slot, bytes) = self.sample_mut(id);
        *slot = header;
        bytes.copy_from_slice(payload);
        self.inboxes[node.index()].unread.push_back((id, None));
        self.unread += 1;
    }

    fn depart(&mut self, way: WayId, id: SampleId, delay_ns: u64, keeps_order: bool) {
        let jitter_ns = match self.options.jitter_ns {
            0 => 0,
            bound => u64::from(self.order.below(bound)),
        };
        let Way { latest_due, outstanding, .. } = &mut self.ways[way.0 as usize];
        let mut due = self.now.plus(delay_ns + jitter_ns);
        if keeps_order {
            due = due.max(*latest_due);
            *latest_due = due;
        }
        *outstanding += 1;
        self.samples[id.0 as usize].readers += 1;
        self.sent += 1;
        let number = self.sent;
        self.flights.push(Reverse(Flight { due, number, sample: id, way: way.0 }));
    }
}
