//! A client of the centre in open mode: it replays its part of a trace through a conversation.
//!
//! Its board lives at the centre; what it knows is a mirror, written by its own writes and by what it
//! reads from replies. One request is under way at a time. Writes that are due meanwhile wait: under
//! `central` each is a request of its own, under `central-batched` all that wait are one. A client that
//! has nothing to send asks at an interval what is new. Changes of one sample differ in when they were
//! meant to be made, so each carries that time. When the interval is over, everything is sent and the
//! centre says that nothing will come any more, the client asks no longer. Not here: the centre's side
//! (`open_centre`).

use super::open::Applied;
use super::outbox::{Counting, Outbox, header};
use super::recovering::{is_news, within};
use super::recovery::{Authors, Evidence};
use super::schedule::{Schedule, Seen};
use crate::blackboard::Blackboard;
use crate::metrics::{Measured, Way};
use shared_types::ids::{CraftId, Turn};
use shared_types::knowledge::{Change, FactState, FleetView, Literal};
use shared_types::limits::INBOX_PAYLOAD_BYTES;
use shared_types::time::Nanos;
use shared_types::trace::TraceRecord;
use shared_types::transport::Destination;
use shared_types::wire::{
    Class, EpochSpec, Header, INTENDED_BYTES, Kind, OpenSpec, Refusal, Stage, StrategyKind,
};
use std::collections::VecDeque;
use std::ops::Range;

/// Flag of a request: its sender will write no more.
pub(super) const WRITES_NO_MORE: u32 = 1;

/// Flag of a reply: nothing will come any more.
pub(super) const ALL_IS_SAID: u32 = 1;

/// Flag of a reply: it did not hold everything that is new.
pub(super) const MORE_IS_NEW: u32 = 2;

/// A write that no request has taken yet.
#[derive(Clone, Copy, Debug)]
struct Unsent {
    change: Change,
    intended_ns: u64,
    made: Nanos,
}

/// The state of a client that replays a trace.
#[derive(Debug, Default)]
pub(super) struct OpenClient {
    craft: CraftId,
    centre: CraftId,
    epoch: u32,
    sends_altered_only: bool,
    /// Changes of one request.
    records_max: usize,
    asks_every_ns: u64,
    mirror: Blackboard,
    authors: Authors,
    /// Whether an answer may come to a question that was given up.
    recovers: bool,
    schedule: Schedule,
    seen: Seen,
    unsent: VecDeque<Unsent>,
    /// Whether a reply is awaited.
    awaits_reply: bool,
    /// Number of the last request, from 1 in each epoch: a reply says which one it answers.
    request: u32,
    /// When it asks what is new, if it has nothing to send until then.
    asks_at: Nanos,
    is_finished: bool,
    /// Whether the interval was given up: nothing is asked any more.
    has_given_up: bool,
    applied: Vec<Applied>,
}

impl OpenClient {
    /// Starts an epoch of `open`.
    pub(super) fn begin_epoch(
        &mut self,
        craft: CraftId,
        spec: &EpochSpec,
        open: &OpenSpec,
        fleet: &FleetView<'_>,
    ) {
        self.craft = craft;
        self.centre = CraftId(fleet.craft_count());
        self.epoch = spec.epoch;
        self.sends_altered_only = spec.sends_altered_only;
        self.records_max = match spec.strategy {
            StrategyKind::Central => 1,
            _ => INBOX_PAYLOAD_BYTES / (spec.record_bytes as usize + INTENDED_BYTES),
        };
        self.asks_every_ns = open.asks_every_ns.max(1);
        self.mirror.reset(fleet.board(craft));
        self.recovers = spec.recovery.is_some();
        self.authors.reset(fleet.board(craft).fact_count, self.recovers);
        self.schedule = Schedule::of(open);
        self.seen.reset(fleet.board(craft).fact_count);
        self.unsent.clear();
        self.awaits_reply = false;
        self.request = 0;
        (self.is_finished, self.has_given_up) = (false, false);
        self.applied.clear();
    }

    /// The trace begins at `started`; returns when it ends. Clients ask one after the other.
    pub(super) fn start(&mut self, started: Nanos, trace: &[TraceRecord]) -> Nanos {
        let clients = u64::from(self.centre.0).max(1);
        let share = self.asks_every_ns / clients * (u64::from(self.craft.0) + 1);
        self.asks_at = started.plus(share);
        self.schedule.start(started, trace)
    }

    pub(super) const fn schedule(&self) -> &Schedule {
        &self.schedule
    }

    pub(super) const fn mirror(&self) -> &Blackboard {
        &self.mirror
    }

    /// Whether it was told that nothing will come any more.
    pub(super) const fn is_finished(&self) -> bool {
        self.is_finished
    }

    /// What it still has to do at `now`.
    pub(super) fn left(&self, now: Nanos) -> usize {
        self.schedule.left(now) + self.unsent.len() + usize::from(!self.is_finished)
    }

    /// When there is something to do without a message.
    pub(super) fn next_due(&self, trace: &[TraceRecord]) -> Option<Nanos> {
        let asks = !self.awaits_reply && !self.is_finished && self.schedule.has_started();
        let asks_at = asks.then_some(self.asks_at);
        [self.schedule.next_due(trace), asks_at].into_iter().flatten().min()
    }

    /// Makes the writes and reads of the next due time, or asks; says whether either was due.
    pub(super) fn play(
        &mut self,
        now: Nanos,
        trace: &[TraceRecord],
        fleet: &FleetView<'_>,
        (counting, measured): (&mut Counting, &mut Measured),
        out: &mut Outbox,
    ) -> bool {
        let Some((at_ns, together)) = self.schedule.take_due(now, trace) else {
            return self.exchange(now, counting, out);
        };
        let board = fleet.board(self.craft);
        let intended = self.schedule.started().plus(at_ns);
        for record in together {
            let fact = record.fact();
            let Some(holds) = record.holds() else {
                let made_ns = now.since(self.schedule.started());
                measured.read(made_ns, self.seen.newest_ns(fact));
                continue;
            };
            measured.stage(Stage::Schedule, now.since(intended));
            self.seen.note(fact, at_ns);
            let literal = if holds { Literal::holds(fact) } else { Literal::is_absent(fact) };
            let change = self.mirror.write(board, self.craft, literal);
            self.authors.wrote(&change);
            let is_sent = change.altered || !self.sends_altered_only;
            counting.fired(board, if is_sent { std::slice::from_ref(&change) } else { &[] });
            if is_sent {
                self.unsent.push_back(Unsent { change, intended_ns: intended.0, made: now });
            }
        }
        self.exchange(now, counting, out);
        true
    }

    /// Reads a reply and sends the next request, if it has a reason for one.
    pub(super) fn receive_reply(
        &mut self,
        received: Nanos,
        header: &Header,
        (changes, intended): (&[Change], &[u64]),
        fleet: &FleetView<'_>,
        (counting, measured): (&mut Counting, &mut Measured),
        out: &mut Outbox,
    ) -> Result<(), Refusal> {
        let is_awaited = self.awaits_reply && header.firing_number == self.request;
        if !is_awaited && !self.recovers {
            return Err(Refusal::Kind);
        }
        let board = fleet.board(self.craft);
        // A change has come to the centre before.
        let hops = header.hop_count.saturating_add(1);
        let way = Way { received, wake_ns: received.since(Nanos(header.published_ns)), hops };
        measured.woken(header.source, header.hop_count, way.wake_ns);
        for (change, &intended_ns) in changes.iter().zip(intended) {
            let origin = change.version.writer;
            let own = fleet.board(origin).target_on(change.fact, self.craft);
            let own = own.ok_or(Refusal::Record)?;
            if self.mirror.merge(board, own, change.value, change.version).accepted {
                self.authors.learnt(own, change.fact);
            }
            let intended = Nanos(intended_ns);
            self.seen.note(own, intended.since(self.schedule.started()));
            measured.applied(origin, 1);
            self.applied.push(Applied { intended, way, changes: 1 });
        }
        if !is_awaited {
            // The conversation has gone on without this answer; what it tells is true all the same.
            counting.counters.recovered.stale += 1;
            return Ok(());
        }
        self.awaits_reply = false;
        self.is_finished = header.argument & ALL_IS_SAID != 0;
        let has_more = header.argument & MORE_IS_NEW != 0;
        self.asks_at = if has_more { received } else { received.plus(self.asks_every_ns) };
        self.exchange(received, counting, out);
        Ok(())
    }

    /// Sends nothing any more: the interval was given up.
    pub(super) fn give_up(&mut self) {
        self.unsent.clear();
        (self.is_finished, self.has_given_up) = (true, true);
    }

    /// Stamps what was applied since the last call as known at `now`.
    pub(super) fn stamp_applied(&mut self, now: Nanos, measured: &mut Measured) {
        for Applied { intended, way, changes } in self.applied.drain(..) {
            measured.known(now, intended, way, changes);
        }
    }

    /// Sends what waits or, when it is time, asks; says whether it sent something.
    fn exchange(&mut self, now: Nanos, counting: &mut Counting, out: &mut Outbox) -> bool {
        if self.awaits_reply || self.is_finished || !self.schedule.has_started() {
            return false;
        }
        if self.unsent.is_empty() && now < self.asks_at {
            return false;
        }
        let to = Destination::Craft(self.centre);
        let fitting = self.unsent.len().min(self.records_max);
        let kind = if fitting > 0 { Kind::Result } else { Kind::Instruction };
        let is_last = fitting == self.unsent.len() && self.schedule.is_over(now);
        let mut header = header(Class::Replication, kind, self.craft, self.epoch, Turn(0));
        header.argument = if is_last { WRITES_NO_MORE } else { 0 };
        self.request += 1;
        header.firing_number = self.request;
        self.awaits_reply = true;
        if let Some(oldest) = self.unsent.front() {
            header.intended_ns = oldest.intended_ns;
            out.made = Some(oldest.made);
            let taken = self.unsent.drain(..fitting);
            let range = out.put_timed(taken.map(|unsent| (unsent.change, unsent.intended_ns)));
            out.send_batch(to, header, range, counting);
        } else {
            header.intended_ns = now.0;
            out.send(to, header, 0..0, counting);
        }
        true
    }

    /// The client recovers; its writes have at least the count `floor`.
    pub(super) fn begin_recovery(&mut self, floor: u32, _: &FleetView<'_>) {
        self.mirror.set_count_floor(floor);
    }

    /// Comes at `now` to an interval already begun.
    pub(super) fn join(&mut self, now: Nanos, trace: &[TraceRecord]) {
        self.schedule.skip_until(now, trace);
        self.asks_at = self.asks_at.max(now);
    }

    /// No answer will come to what was asked: asks anew from `now` on.
    pub(super) fn begin_again(&mut self, now: Nanos) {
        self.awaits_reply = false;
        self.is_finished = self.has_given_up;
        self.asks_at = now;
    }

    /// A centre that asks for the mirror takes what it is told for all that was said before: a request
    /// that it has not answered yet, it may never see.
    pub(super) fn stop_waiting(&mut self, now: Nanos) {
        if self.awaits_reply {
            self.awaits_reply = false;
            self.asks_at = now;
        }
    }

    /// The versions in the mirror of `facts`.
    pub(super) fn digest(&self, facts: Range<u32>, out: &mut Vec<Change>) {
        out.extend(versions(&self.mirror, facts));
    }

    /// What a centre that knows `known` lacks of `facts`.
    pub(super) fn tell(&self, facts: Range<u32>, known: &[Change], out: &mut Vec<Change>) {
        out.extend(news(&self.mirror, &self.authors, facts, known));
    }

    /// Takes over what the centre told as state; returns how much of it was news.
    pub(super) fn learn(&mut self, changes: &[Change], fleet: &FleetView<'_>) -> u64 {
        let board = fleet.board(self.craft);
        let mut learnt = 0;
        for change in changes {
            let &Change { fact, value, version, .. } = change;
            let own = if version.writer == self.craft {
                Some(fact)
            } else {
                fleet.board(version.writer).target_on(fact, self.craft)
            };
            if let Some(own) = own
                && self.mirror.merge(board, own, value, version).accepted
            {
                self.authors.learnt(own, fact);
                learnt += 1;
            }
        }
        learnt
    }
}

/// What `known` holds that is newer than `board`.
pub(super) fn newer_than(board: &Blackboard, known: &[Change]) -> Option<Evidence> {
    Evidence::of(known.iter().filter(|held| {
        held.fact.0 < board.fact_count() && held.version > board.state(held.fact).version
    }))
}

/// The versions that `board` holds of `facts`.
pub(super) fn versions(
    board: &Blackboard,
    facts: Range<u32>,
) -> impl Iterator<Item = Change> + use<'_> {
    within(facts, board.fact_count()).filter_map(|fact| {
        let FactState { value, version } = board.state(fact);
        (version.count > 0).then_some(Change { fact, value, version, altered: false })
    })
}

/// What `board` holds of `facts` that is newer than `known`, in the writers' ids.
pub(super) fn news(
    board: &Blackboard,
    authors: &Authors,
    facts: Range<u32>,
    known: &[Change],
) -> impl Iterator<Item = Change> {
    within(facts, board.fact_count()).flat_map(move |fact| {
        let changes = authors.changes(board, fact);
        changes.filter(move |change| is_news(change, fact, known))
    })
}
