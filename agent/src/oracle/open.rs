//! What open mode must send, from the trace alone, and what must hold when the fleet is quiet.
//!
//! Writes of one craft that are due together are looked at together: each is a request over every edge
//! of its way, and those that share an edge share samples.

use super::Deliveries;
use super::routes::route;
use shared_types::ids::{CraftId, FactId};
use shared_types::knowledge::{FactState, FleetView};
use shared_types::limits::INBOX_PAYLOAD_BYTES;
use shared_types::trace::TraceRecord;
use shared_types::wire::{EpochSpec, StrategyKind};
use std::collections::BTreeSet;

/// What a strategy must do with a trace, when every output is sent.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ExpectedOpen {
    /// Per craft the requests that it sends or passes on.
    pub requests: Vec<u64>,
    /// Per craft the samples that it publishes.
    pub transmissions: Vec<u64>,
    /// Samples by sender and receiver.
    pub deliveries: Deliveries,
    /// Per craft the changes of others that it applies to its board.
    pub applications: Vec<u64>,
    /// The same by origin and receiver.
    pub applied: Deliveries,
    /// Per craft the records that it receives.
    pub received_records: Vec<u64>,
    /// Per craft the writes of its trace.
    pub writes: Vec<u64>,
    /// Those of them that write a boundary fact.
    pub boundary_writes: Vec<u64>,
}

/// One write on its way: the edges that it travels.
type Edges = BTreeSet<(CraftId, CraftId)>;

impl ExpectedOpen {
    /// What `spec` must send for `trace` (per craft its records). Of a central strategy only what is
    /// written and applied: how it is asked for depends on the clock.
    #[must_use]
    pub fn of(spec: &EpochSpec, fleet: &FleetView<'_>, trace: &[&[TraceRecord]]) -> Self {
        let zeros = vec![0; fleet.boards.len()];
        let mut expected = Self {
            requests: zeros.clone(),
            transmissions: zeros.clone(),
            applications: zeros.clone(),
            received_records: zeros.clone(),
            writes: zeros.clone(),
            boundary_writes: zeros,
            ..Self::default()
        };
        let fitting = INBOX_PAYLOAD_BYTES / spec.record_bytes as usize;
        for (craft, &records) in (0..).map(CraftId).zip(trace) {
            for together in records.chunk_by(|left, right| left.at_ns == right.at_ns) {
                let writes = together.iter().filter(|record| record.holds().is_some());
                let facts: Vec<FactId> = writes.map(TraceRecord::fact).collect();
                expected.add(spec.strategy, fleet, craft, &facts, fitting);
            }
        }
        expected
    }

    fn add(
        &mut self,
        strategy: StrategyKind,
        fleet: &FleetView<'_>,
        craft: CraftId,
        facts: &[FactId],
        fitting: usize,
    ) {
        let board = fleet.board(craft);
        let crafts = || (0..fleet.craft_count()).map(CraftId);
        self.writes[craft.index()] += facts.len() as u64;
        let boundary = facts.iter().filter(|&&fact| board.is_boundary(fact));
        self.boundary_writes[craft.index()] += boundary.count() as u64;
        if strategy != StrategyKind::Null {
            let targets = facts.iter().flat_map(|&fact| board.targets(fact));
            for target in targets.filter(|target| target.craft != craft) {
                self.applications[target.craft.index()] += 1;
                self.applied.add(craft, target.craft, 1);
            }
        }
        if strategy.has_centre() {
            return;
        }
        if strategy == StrategyKind::Full {
            let samples = facts.len().div_ceil(fitting) as u64;
            self.requests[craft.index()] += facts.len() as u64;
            self.transmissions[craft.index()] += samples;
            self.deliveries.add_to_everybody(craft, samples);
            for other in crafts().filter(|&other| other != craft) {
                self.received_records[other.index()] += facts.len() as u64;
            }
            return;
        }
        let way = |&fact: &FactId| -> Edges {
            let sharers = board.targets(fact).map(|target| target.craft);
            let others = sharers.filter(|&sharer| sharer != craft);
            match strategy {
                StrategyKind::Null => Edges::new(),
                StrategyKind::Limited if board.is_boundary(fact) => {
                    crafts().filter(|&other| other != craft).map(|other| (craft, other)).collect()
                }
                StrategyKind::Limited => Edges::new(),
                _ => others
                    .flat_map(|sharer| {
                        let stops = route(strategy, &fleet.topology, craft, sharer);
                        stops.windows(2).map(|leg| (leg[0], leg[1])).collect::<Vec<_>>()
                    })
                    .collect(),
            }
        };
        let ways: Vec<Edges> = facts.iter().map(way).collect();
        self.carry(&ways.iter().collect::<Vec<_>>(), craft, None, fitting);
    }

    /// The samples that `here` sends for the writes with these ways, and those that follow from them.
    fn carry(&mut self, ways: &[&Edges], here: CraftId, from: Option<CraftId>, fitting: usize) {
        let next: BTreeSet<CraftId> = ways
            .iter()
            .flat_map(|way| way.iter().filter(|edge| edge.0 == here).map(|edge| edge.1))
            .filter(|&next| Some(next) != from)
            .collect();
        for next in next {
            let on_edge: Vec<&Edges> =
                ways.iter().copied().filter(|way| way.contains(&(here, next))).collect();
            self.requests[here.index()] += on_edge.len() as u64;
            for sample in on_edge.chunks(fitting) {
                self.transmissions[here.index()] += 1;
                self.deliveries.add(here, next, 1);
                self.received_records[next.index()] += sample.len() as u64;
                self.carry(sample, next, Some(here), fitting);
            }
        }
    }
}

/// Facts on which two boards that share them disagree, by the board that has the older version; none
/// once the fleet is quiet and every output was sent, where every link leads back.
pub fn disagreements(
    fleet: &FleetView<'_>,
    state: impl Fn(CraftId, FactId) -> FactState,
) -> Vec<(CraftId, FactId)> {
    let mut found = Vec::new();
    for (board, craft) in fleet.boards.iter().zip((0..).map(CraftId)) {
        for fact in (0..board.fact_count).map(FactId) {
            let own = state(craft, fact);
            if board.targets(fact).any(|target| {
                let other = state(target.craft, target.fact);
                own.version < other.version || (own.version == other.version && own != other)
            }) {
                found.push((craft, fact));
            }
        }
    }
    found
}
