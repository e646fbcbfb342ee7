//! Replication strategies: which changes of a firing go where.
//!
//! A strategy decides and never sends. It is given the changes of a firing (or a sample to pass on)
//! and puts requests into [`Plans`]; the craft turns them into samples and the shell writes the bytes
//! once, into the loaned memory. One strategy a file. The central strategies are conversations with a
//! centre rather than plans for changes: [`central`] is the craft's side, [`centre`] the other.

pub mod boundary;
pub mod central;
pub mod centre;
pub mod full;
pub mod hierarchy;
pub mod hybrid;
pub mod limited;
pub mod null;

use shared_types::ids::{CraftId, FactId};
use shared_types::knowledge::{BoardView, Change, FleetView, Topology};
use shared_types::transport::Peers;
use shared_types::wire::StrategyKind;
use std::ops::Range;

/// Who a strategy plans for.
#[derive(Clone, Copy, Debug)]
pub struct Context<'a> {
    /// The craft that plans.
    pub craft: CraftId,
    /// All networks and the topology.
    pub fleet: &'a FleetView<'a>,
}

impl<'a> Context<'a> {
    /// The crafts other than this one that share a fact which `origin` changed.
    pub(crate) fn sharers(
        &self,
        origin: CraftId,
        change: &Change,
    ) -> impl Iterator<Item = CraftId> + use<'a> {
        let craft = self.craft;
        self.fleet
            .board(origin)
            .targets(change.fact)
            .map(|target| target.craft)
            .filter(move |&sharer| sharer != craft && sharer != origin)
    }

    /// Every other craft, starting after this one.
    pub(crate) fn others(&self) -> impl Iterator<Item = CraftId> + use<'a> {
        let (craft, count) = (self.craft.0, self.fleet.craft_count());
        (1..count).map(move |step| CraftId((craft + step) % count))
    }
}

/// Who a request goes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Recipient {
    /// One craft.
    One(CraftId),
    /// Every other craft, as one multicast.
    Everybody,
}

/// One request: changes that go over one hop.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Request {
    /// The hop.
    pub to: Recipient,
    /// Its changes, as a range of [`Plans::changes`].
    pub changes: Range<usize>,
}

/// What a strategy decided. Cleared and filled again for every firing, so that planning allocates
/// nothing once the buffers have grown.
#[derive(Clone, Debug, Default)]
pub struct Plans {
    /// The requests, in sending order.
    pub requests: Vec<Request>,
    /// The changes that the requests refer to.
    pub changes: Vec<Change>,
    /// How many crafts are final receivers of the firing.
    pub owed: u32,
    /// (hop, index of change) pairs while a plan is made.
    hops: Vec<(CraftId, usize)>,
}

impl Plans {
    /// Forgets everything planned.
    pub fn clear(&mut self) {
        self.requests.clear();
        self.changes.clear();
        self.owed = 0;
    }

    /// Plans one request with `changes` to each of `recipients`.
    pub(crate) fn send_all(
        &mut self,
        recipients: impl IntoIterator<Item = Recipient>,
        changes: impl IntoIterator<Item = Change>,
    ) {
        let start = self.changes.len();
        self.changes.extend(changes);
        let range = start..self.changes.len();
        if range.is_empty() {
            return;
        }
        for to in recipients {
            self.requests.push(Request { to, changes: range.clone() });
        }
    }

    /// Plans one request per distinct hop towards the crafts that share what `origin` changed,
    /// carrying the changes that some sharer behind that hop needs. `hop` says which way a sharer
    /// lies, `None` for one that others serve.
    pub(crate) fn send_towards_sharers(
        &mut self,
        context: &Context<'_>,
        origin: CraftId,
        changes: &[Change],
        hop: impl Fn(CraftId) -> Option<CraftId>,
    ) {
        let mut pairs = std::mem::take(&mut self.hops);
        pairs.clear();
        for (index, change) in changes.iter().enumerate() {
            let sharers = context.sharers(origin, change);
            pairs.extend(sharers.filter_map(&hop).map(|hop| (hop, index)));
        }
        pairs.sort_unstable();
        pairs.dedup();
        for hop in pairs.chunk_by(|left, right| left.0 == right.0) {
            let start = self.changes.len();
            self.changes.extend(hop.iter().map(|&(_, index)| changes[index]));
            let range = start..self.changes.len();
            self.requests.push(Request { to: Recipient::One(hop[0].0), changes: range });
        }
        self.hops = pairs;
    }

    /// Sets `owed` to the number of distinct crafts that share what the planning craft changed.
    pub(crate) fn owe_sharers(&mut self, context: &Context<'_>, changes: &[Change]) {
        let mut pairs = std::mem::take(&mut self.hops);
        pairs.clear();
        for change in changes {
            pairs.extend(context.sharers(context.craft, change).map(|sharer| (sharer, 0)));
        }
        pairs.sort_unstable();
        pairs.dedup();
        self.owed = CraftId::from_index(pairs.len()).0;
        self.hops = pairs;
    }
}

/// Decides which changes go where.
pub trait Strategy: std::fmt::Debug + Send {
    /// Plans the requests for the changes of this craft's own firing, and who is owed.
    fn plan(&mut self, context: &Context<'_>, changes: &[Change], plans: &mut Plans);

    /// Plans the copies that this craft passes on of changes of `origin` that came from `source`.
    fn plan_relay(
        &mut self,
        context: &Context<'_>,
        origin: CraftId,
        source: CraftId,
        changes: &[Change],
        plans: &mut Plans,
    ) {
        let _ = (context, origin, source, changes, plans);
    }

    /// Whether a craft may be owed deliveries, so that it pays to report a firing together with what
    /// has arrived meanwhile.
    fn expects_deliveries(&self) -> bool {
        true
    }

    /// Plans over `topology` from now on, or over the scenario's own again. Strategies that do not
    /// relay have no use for it.
    fn reroute(&mut self, topology: Option<Topology>) {
        let _ = topology;
    }

    /// Whether others keep a replica of `fact` of this craft's `board`.
    fn replicates(&self, board: &BoardView<'_>, fact: FactId) -> bool {
        let _ = (board, fact);
        false
    }

    /// Whether copies are passed on by others, so that a craft that is gone may be in the way.
    fn relays(&self) -> bool {
        false
    }

    /// Which ports the strategy needs on this craft.
    fn peers(&self, context: &Context<'_>) -> Peers;
}

/// The strategy of `kind`; the central ones plan no changes by themselves.
#[must_use]
pub fn strategy(kind: StrategyKind) -> Box<dyn Strategy> {
    match kind {
        StrategyKind::Null
        | StrategyKind::Central
        | StrategyKind::CentralBatched
        | StrategyKind::Pipelined => Box::new(null::Null),
        StrategyKind::Full => Box::new(full::Full),
        StrategyKind::Boundary => Box::new(boundary::Boundary),
        StrategyKind::Limited => Box::new(limited::Limited),
        StrategyKind::Hierarchy => Box::<hierarchy::Hierarchy>::default(),
        StrategyKind::Hybrid => Box::<hybrid::Hybrid>::default(),
    }
}
