//! What each strategy must send for the firings of a trial, counted per process.

use super::central;
use super::deliveries::Deliveries;
use super::digest::replica_digest;
use super::replay::{Fired, Replay};
use super::routes::route;
use shared_types::ids::{CraftId, FactId};
use shared_types::knowledge::{Change, FactState, FleetView};
use shared_types::wire::{Class, EpochSpec, HEADER_BYTES, StrategyKind, Traffic};
use std::collections::{BTreeMap, BTreeSet};

/// What one process must count in a lossless trial.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ExpectedCounts {
    /// The strategy's own traffic.
    pub replication: Traffic,
    /// The centre's answers.
    pub reply: Traffic,
    /// Sum of hop counts over the samples of both classes for which it is a final receiver: one for
    /// each that came directly, the length of the way for one that was passed on.
    pub hops: u64,
    /// Merges decided here by the craft id because the counts were equal.
    pub conflicts: u64,
    /// Firings run.
    pub firings: u64,
    /// Firings of which a change is sent that concerns a boundary fact.
    pub boundary_firings: u64,
    /// Turns without a candidate.
    pub idle_turns: u64,
}

/// What a strategy must do in a lossless trial.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Expected {
    /// The strategy.
    pub strategy: StrategyKind,
    /// Per craft, then for the centre where there is one.
    pub processes: Vec<ExpectedCounts>,
    /// Samples of both classes, by sender and receiver.
    pub deliveries: Deliveries,
    /// Per firing of [`Replay::firings`] the final receivers that it owes a delivery; under the
    /// strategies with a centre, whose ledger is the centre's, always 0.
    pub owed: Vec<u32>,
    /// The newest of what every origin told, for strategies whose receivers keep replicas.
    replicas: BTreeMap<(CraftId, FactId), FactState>,
}

impl Replay {
    /// What `strategy` must send for this trial of `spec` on `fleet`.
    ///
    /// # Panics
    /// If `strategy` is hybrid and the fleet states no groups.
    #[must_use]
    pub fn expected(
        &self,
        fleet: &FleetView<'_>,
        spec: &EpochSpec,
        strategy: StrategyKind,
    ) -> Expected {
        let mut ledger = Ledger::new(self, fleet, spec, strategy);
        if strategy.has_centre() {
            central::count(self, fleet, &mut ledger);
        } else {
            for fired in &self.firings {
                let owed = ledger.count_firing(fleet, fired, self.changes(fired));
                ledger.expected.owed.push(owed);
            }
        }
        ledger.expected
    }
}

impl Expected {
    /// Requests of all processes together, the centre's replies not counted.
    #[must_use]
    pub fn requests(&self) -> u64 {
        self.processes.iter().map(|process| process.replication.requests).sum()
    }

    /// Digest of what `craft` holds of others at the end; 0 if the strategy keeps no replicas.
    #[must_use]
    pub fn replica_digest(&self, craft: CraftId) -> u64 {
        if !self.strategy.keeps_replicas() {
            return 0;
        }
        replica_digest(
            self.replicas
                .iter()
                .filter(|((origin, _), _)| *origin != craft)
                .map(|(&(origin, fact), state)| (origin, fact, state)),
        )
    }
}

/// The expectation while it is counted.
pub(super) struct Ledger {
    pub(super) expected: Expected,
    craft_count: u32,
    record_bytes: u64,
}

impl Ledger {
    /// A ledger with what does not depend on the strategy filled in.
    fn new(
        replay: &Replay,
        fleet: &FleetView<'_>,
        spec: &EpochSpec,
        strategy: StrategyKind,
    ) -> Self {
        let craft_count = fleet.craft_count();
        let process_count = craft_count as usize + usize::from(strategy.has_centre());
        let mut processes = vec![ExpectedCounts::default(); process_count];
        for fired in &replay.firings {
            let board = fleet.board(fired.craft);
            let process = &mut processes[fired.craft.index()];
            process.firings += 1;
            let is_boundary =
                replay.changes(fired).iter().any(|change| board.is_boundary(change.fact));
            process.boundary_firings += u64::from(is_boundary);
        }
        for process in &mut processes[..craft_count as usize] {
            process.idle_turns = u64::from(replay.turns) - process.firings;
        }
        match strategy {
            StrategyKind::Null => {}
            _ if strategy.has_centre() => {
                processes[craft_count as usize].conflicts = replay.conflicts.iter().sum();
            }
            _ => {
                for (process, &conflicts) in processes.iter_mut().zip(&replay.conflicts) {
                    process.conflicts = conflicts;
                }
            }
        }
        let expected = Expected {
            strategy,
            processes,
            deliveries: Deliveries::default(),
            owed: Vec::with_capacity(replay.firings.len()),
            replicas: BTreeMap::new(),
        };
        Self { expected, craft_count, record_bytes: u64::from(spec.record_bytes) }
    }

    /// Counts what one firing sends and returns how many final receivers it has.
    fn count_firing(&mut self, fleet: &FleetView<'_>, fired: &Fired, changes: &[Change]) -> u32 {
        let board = fleet.board(fired.craft);
        let boundary: Vec<Change> =
            changes.iter().copied().filter(|change| board.is_boundary(change.fact)).collect();
        match self.expected.strategy {
            StrategyKind::Full if !changes.is_empty() => {
                self.keep_replicas(fired.craft, changes);
                self.send_to_others(fired.craft, 1, changes.len())
            }
            StrategyKind::Limited if !boundary.is_empty() => {
                self.keep_replicas(fired.craft, &boundary);
                self.send_to_others(fired.craft, self.craft_count - 1, boundary.len())
            }
            StrategyKind::Boundary | StrategyKind::Hierarchy | StrategyKind::Hybrid => {
                self.send_to_sharers(fleet, fired.craft, &boundary)
            }
            _ => 0,
        }
    }

    /// One sample to every other craft, sent as `samples` (1 multicast, or one unicast each).
    fn send_to_others(&mut self, craft: CraftId, samples: u32, records: usize) -> u32 {
        let bytes = self.sample_bytes(records);
        for (process, receiver) in self.expected.processes.iter_mut().zip(0_u32..) {
            if receiver == craft.0 {
                let sent = &mut process.replication;
                sent.requests += u64::from(samples);
                sent.transmissions += u64::from(samples);
                sent.bytes_sent += u64::from(samples) * bytes;
            } else {
                process.replication.deliveries += 1;
                process.replication.bytes_received += bytes;
                process.hops += 1;
            }
        }
        self.expected.deliveries.add_to_everybody(craft, 1);
        self.craft_count - 1
    }

    /// One sample over every edge that leads to a sharer of some change, carrying the changes that
    /// some craft beyond it shares; each sharer is a final receiver once.
    fn send_to_sharers(
        &mut self,
        fleet: &FleetView<'_>,
        craft: CraftId,
        changes: &[Change],
    ) -> u32 {
        let mut edges = BTreeMap::<(CraftId, CraftId), BTreeSet<FactId>>::new();
        let mut hops = BTreeMap::<CraftId, u64>::new();
        for change in changes {
            for target in fleet.board(craft).targets(change.fact) {
                let way = route(self.expected.strategy, &fleet.topology, craft, target.craft);
                for edge in way.windows(2) {
                    edges.entry((edge[0], edge[1])).or_default().insert(change.fact);
                }
                hops.insert(target.craft, way.len() as u64 - 1);
            }
        }
        for ((from, to), facts) in edges {
            self.send(Class::Replication, from, to, 1, facts.len());
        }
        for (&receiver, &hops) in &hops {
            self.expected.processes[receiver.index()].hops += hops;
        }
        u32::try_from(hops.len()).expect("invariant: sharers are crafts")
    }

    /// Counts `samples` unicasts with `records` records in all, at both ends. Hops are the caller's.
    pub(super) fn send(
        &mut self,
        class: Class,
        from: CraftId,
        to: CraftId,
        samples: u64,
        records: usize,
    ) {
        let bytes = (samples - 1) * HEADER_BYTES as u64 + self.sample_bytes(records);
        let sent = self.traffic(from, class);
        sent.requests += samples;
        sent.transmissions += samples;
        sent.bytes_sent += bytes;
        let received = self.traffic(to, class);
        received.deliveries += samples;
        received.bytes_received += bytes;
        self.expected.deliveries.add(from, to, samples);
    }

    fn traffic(&mut self, process: CraftId, class: Class) -> &mut Traffic {
        let process = &mut self.expected.processes[process.index()];
        match class {
            Class::Reply => &mut process.reply,
            _ => &mut process.replication,
        }
    }

    fn sample_bytes(&self, records: usize) -> u64 {
        HEADER_BYTES as u64 + records as u64 * self.record_bytes
    }

    fn keep_replicas(&mut self, origin: CraftId, changes: &[Change]) {
        for change in changes {
            let told = FactState { value: change.value, version: change.version };
            let held = self.expected.replicas.entry((origin, change.fact)).or_default();
            if told.version > held.version {
                *held = told;
            }
        }
    }
}
