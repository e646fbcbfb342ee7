//! A craft in open mode: it replays its part of a trace and applies what arrives at once.
//!
//! Every due write takes the path of a firing: write, change, plan of the strategy, samples. Changes of
//! one due time to the same hop ride in one sample, as many as an inbox takes, whatever the strategy;
//! each is a request of its own. How late a craft is therefore moves no count, and one header says
//! exactly when its changes were meant to be made. No rule runs. Not here: the central strategies, which
//! need a conversation of their own (`open_client`, `open_centre`).

use super::outbox::{Counting, Outbox};
use super::recovery::Authors;
use super::schedule::{Schedule, Seen};
use crate::blackboard::Blackboard;
use crate::blackboard::replica::ReplicaStore;
use crate::metrics::{Measured, Way};
use crate::replication::{Context, Plans, Recipient, Strategy, strategy};
use shared_types::ids::CraftId;
use shared_types::knowledge::{Assignment, Change, FactState, FleetView, Literal};
use shared_types::limits::INBOX_PAYLOAD_BYTES;
use shared_types::time::Nanos;
use shared_types::trace::TraceRecord;
use shared_types::transport::{Destination, Peers};
use shared_types::wire::{Class, EpochSpec, Header, Kind, OpenSpec, Refusal, Stage, StrategyKind};

/// Changes of one due time on their way to one hop.
#[derive(Debug, Default)]
struct Lane {
    changes: Vec<Change>,
}

/// Changes that were applied and await the stamp of their batch.
#[derive(Clone, Copy, Debug)]
pub(super) struct Applied {
    pub(super) intended: Nanos,
    pub(super) way: Way,
    pub(super) changes: u32,
}

/// The state of a craft that replays a trace.
#[derive(Debug)]
pub(super) struct Open {
    pub(super) craft: CraftId,
    epoch: u32,
    sends_altered_only: bool,
    records_max: usize,
    pub(super) strategy: Box<dyn Strategy>,
    pub(super) board: Blackboard,
    pub(super) authors: Authors,
    /// Crafts that are gone.
    pub(super) gone: Vec<CraftId>,
    pub(super) replicas: ReplicaStore,
    pub(super) keeps_replicas: bool,
    schedule: Schedule,
    seen: Seen,
    firing_number: u32,
    plans: Plans,
    /// Per craft, and for everybody last.
    lanes: Vec<Lane>,
    /// Lanes in use, in the order in which they came into use.
    used: Vec<usize>,
    applied: Vec<Applied>,
}

impl Open {
    /// A craft that has begun no epoch yet.
    pub(super) fn new() -> Self {
        Self {
            craft: CraftId(0),
            epoch: 0,
            sends_altered_only: false,
            records_max: 1,
            strategy: strategy(StrategyKind::Null),
            board: Blackboard::default(),
            authors: Authors::default(),
            gone: Vec::new(),
            replicas: ReplicaStore::default(),
            keeps_replicas: false,
            schedule: Schedule::default(),
            seen: Seen::default(),
            firing_number: 0,
            plans: Plans::default(),
            lanes: Vec::new(),
            used: Vec::new(),
            applied: Vec::new(),
        }
    }

    /// Starts an epoch of `open`, whose trace begins when [`Self::start`] says so.
    pub(super) fn begin_epoch(
        &mut self,
        craft: CraftId,
        spec: &EpochSpec,
        open: &OpenSpec,
        fleet: &FleetView<'_>,
    ) {
        self.craft = craft;
        self.epoch = spec.epoch;
        self.sends_altered_only = spec.sends_altered_only;
        self.records_max = INBOX_PAYLOAD_BYTES / spec.record_bytes as usize;
        self.strategy = strategy(spec.strategy);
        self.board.reset(fleet.board(craft));
        self.authors.reset(fleet.board(craft).fact_count, spec.recovery.is_some());
        self.keeps_replicas = spec.strategy.keeps_replicas();
        if self.keeps_replicas {
            self.replicas.reset(fleet);
        }
        self.schedule = Schedule::of(open);
        self.seen.reset(fleet.board(craft).fact_count);
        self.firing_number = 0;
        self.lanes.resize_with(fleet.boards.len() + 1, Lane::default);
        self.applied.clear();
    }

    pub(super) const fn schedule(&self) -> &Schedule {
        &self.schedule
    }

    pub(super) const fn schedule_mut(&mut self) -> &mut Schedule {
        &mut self.schedule
    }

    pub(super) fn peers(&self, fleet: &FleetView<'_>) -> Peers {
        self.strategy.peers(&Context { craft: self.craft, fleet })
    }

    pub(super) const fn board(&self) -> &Blackboard {
        &self.board
    }

    pub(super) fn replica_digest(&self) -> u64 {
        if self.keeps_replicas { self.replicas.digest() } else { 0 }
    }

    /// Makes the writes and reads of the next due time, if it has come; says whether it had.
    pub(super) fn play(
        &mut self,
        now: Nanos,
        trace: &[TraceRecord],
        fleet: &FleetView<'_>,
        (counting, measured): (&mut Counting, &mut Measured),
        out: &mut Outbox,
    ) -> bool {
        let Some((at_ns, together)) = self.schedule.take_due(now, trace) else { return false };
        let intended = self.schedule.started().plus(at_ns);
        let mut header = Header::new(Class::Replication, Kind::Delta);
        header.origin = self.craft.0;
        header.epoch = self.epoch;
        header.firing_number = self.firing_number;
        header.intended_ns = intended.0;
        for record in together {
            let fact = record.fact();
            match record.holds() {
                None => {
                    let made_ns = now.since(self.schedule.started());
                    measured.read(made_ns, self.seen.newest_ns(fact));
                }
                Some(holds) => {
                    measured.stage(Stage::Schedule, now.since(intended));
                    self.seen.note(fact, at_ns);
                    let literal =
                        if holds { Literal::holds(fact) } else { Literal::is_absent(fact) };
                    self.write(literal, fleet, counting);
                }
            }
        }
        out.made = Some(now);
        self.send_lanes(&header, counting, out);
        true
    }

    /// Passes a delta on where the strategy says so, and applies what concerns this board.
    pub(super) fn receive_delta(
        &mut self,
        received: Nanos,
        header: &Header,
        changes: &[Change],
        fleet: &FleetView<'_>,
        (counting, measured): (&mut Counting, &mut Measured),
        out: &mut Outbox,
    ) -> Result<(), Refusal> {
        let origin = CraftId(header.origin);
        if changes.iter().any(|change| change.version.writer != origin) {
            return Err(Refusal::Record);
        }
        // How long the sample was under way, earlier hops included.
        let hop_ns = received.since(Nanos(header.published_ns));
        let wake_ns = u32::try_from(hop_ns).unwrap_or(u32::MAX).saturating_add(header.argument);
        let context = Context { craft: self.craft, fleet };
        self.plans.clear();
        let source = CraftId(header.source);
        // Crafts that disagree on who is gone must not pass a change round in a circle.
        if u32::from(header.hop_count) < fleet.craft_count() {
            self.strategy.plan_relay(&context, origin, source, changes, &mut self.plans);
        }
        self.fill_lanes();
        let onward =
            Header { hop_count: header.hop_count.saturating_add(1), argument: wake_ns, ..*header };
        self.send_lanes(&onward, counting, out);

        let (board, origin_board) = (fleet.board(self.craft), fleet.board(origin));
        let intended = Nanos(header.intended_ns);
        let intended_ns = intended.since(self.schedule.started());
        let mut applied = 0;
        for change in changes {
            let &Change { fact, value, version, .. } = change;
            if let Some(own) = origin_board.target_on(fact, self.craft) {
                let merged = self.board.merge(board, own, value, version);
                counting.counters.conflicts += u64::from(merged.conflict);
                if merged.accepted {
                    self.authors.learnt(own, fact);
                }
                self.seen.note(own, intended_ns);
                applied += 1;
            }
            if self.keeps_replicas {
                self.replicas.tell(origin, fact, FactState { value, version });
            }
        }
        if applied > 0 || self.keeps_replicas {
            counting.counters.hops += u64::from(header.hop_count);
        }
        if applied > 0 {
            let way = Way { received, wake_ns: u64::from(wake_ns), hops: header.hop_count };
            measured.woken(header.source, header.hop_count, way.wake_ns);
            measured.applied(origin, applied);
            self.applied.push(Applied { intended, way, changes: applied });
        }
        Ok(())
    }

    /// Stamps what was applied since the last call as known at `now`.
    pub(super) fn stamp_applied(&mut self, now: Nanos, measured: &mut Measured) {
        for Applied { intended, way, changes } in self.applied.drain(..) {
            measured.known(now, intended, way, changes);
        }
    }

    fn write(&mut self, assignment: Assignment, fleet: &FleetView<'_>, counting: &mut Counting) {
        let board = fleet.board(self.craft);
        let change = self.board.write(board, self.craft, assignment);
        self.authors.wrote(&change);
        self.firing_number += 1;
        let sent = if self.sends_altered_only && !change.altered { &[][..] } else { &[change] };
        counting.fired(board, sent);
        self.plans.clear();
        self.strategy.plan(&Context { craft: self.craft, fleet }, sent, &mut self.plans);
        self.fill_lanes();
    }

    /// Moves what is planned into the lanes.
    fn fill_lanes(&mut self) {
        let everybody = self.lanes.len() - 1;
        for request in &self.plans.requests {
            let index = match request.to {
                Recipient::One(craft) => craft.index(),
                Recipient::Everybody => everybody,
            };
            let lane = &mut self.lanes[index].changes;
            if lane.is_empty() {
                self.used.push(index);
            }
            lane.extend_from_slice(&self.plans.changes[request.changes.clone()]);
        }
    }

    /// Puts what is in the lanes into samples.
    fn send_lanes(&mut self, header: &Header, counting: &mut Counting, out: &mut Outbox) {
        let everybody = self.lanes.len() - 1;
        for index in self.used.drain(..) {
            let to = if index == everybody {
                Destination::Multicast
            } else {
                Destination::Craft(CraftId::from_index(index))
            };
            let lane = &mut self.lanes[index].changes;
            for fitting in lane.chunks(self.records_max) {
                let range = out.put_changes(fitting);
                out.send_batch(to, *header, range, counting);
            }
            lane.clear();
        }
    }
}
