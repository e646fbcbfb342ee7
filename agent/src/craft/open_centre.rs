//! The centre in open mode: it holds every home board and answers each request at once.
//!
//! A change is applied to its writer's home board and to every board that shares the fact when it
//! arrives; for each of those boards' clients it waits for their next request and rides on the reply.
//! Not here: the client's side (`open_client`), and the centre of lockstep.

use super::open_client::{ALL_IS_SAID, MORE_IS_NEW, WRITES_NO_MORE, newer_than, news, versions};
use super::outbox::{Counting, Outbox, header};
use super::recovery::{Authors, Evidence};
use super::schedule::Schedule;
use crate::blackboard::{Blackboard, Merged};
use crate::metrics::Measured;
use shared_types::ids::{CraftId, FactId, Turn};
use shared_types::knowledge::{BoardView, Change, FleetView};
use shared_types::limits::INBOX_PAYLOAD_BYTES;
use shared_types::time::Nanos;
use shared_types::transport::Destination;
use shared_types::wire::{
    Class, EpochSpec, Header, INTENDED_BYTES, Kind, OpenSpec, Refusal, Stage,
};
use std::collections::VecDeque;
use std::ops::Range;

/// What the centre keeps for one client.
#[derive(Debug, Default)]
struct Seat {
    board: Blackboard,
    authors: Authors,
    /// Changes of its links since its last reply, in ids of the boards that wrote them, with when they
    /// were meant to be made.
    news: VecDeque<(Change, u64)>,
    writes_no_more: bool,
    /// Number of its client's newest request: an older one may be repeated after it.
    request: u32,
    /// Whether its client is gone.
    is_gone: bool,
    /// Whether its client was told that nothing will come any more.
    is_dismissed: bool,
}

/// The centre of a fleet in open mode.
#[derive(Debug, Default)]
pub(super) struct OpenCentre {
    epoch: u32,
    records_max: usize,
    schedule: Schedule,
    seats: Vec<Seat>,
    /// Whether it knows what its clients know: a first life has nothing to learn.
    pub(super) is_caught_up: bool,
    /// When the changes were meant to be made that were applied since the last stamp.
    applied: Vec<Nanos>,
}

impl OpenCentre {
    /// Starts an epoch of `open`.
    pub(super) fn begin_epoch(&mut self, spec: &EpochSpec, open: &OpenSpec, fleet: &FleetView<'_>) {
        self.epoch = spec.epoch;
        self.records_max = INBOX_PAYLOAD_BYTES / (spec.record_bytes as usize + INTENDED_BYTES);
        self.schedule = Schedule::of(open);
        self.seats.resize_with(fleet.boards.len(), Seat::default);
        for (seat, board) in self.seats.iter_mut().zip(&fleet.boards) {
            seat.board.reset(board);
            seat.authors.reset(board.fact_count, spec.recovery.is_some());
            seat.news.clear();
            (seat.writes_no_more, seat.is_gone, seat.request) = (false, false, 0);
            seat.is_dismissed = false;
        }
        self.applied.clear();
        self.is_caught_up = true;
    }

    pub(super) const fn schedule(&self) -> &Schedule {
        &self.schedule
    }

    pub(super) const fn schedule_mut(&mut self) -> &mut Schedule {
        &mut self.schedule
    }

    /// Changes that no reply has taken yet.
    pub(super) fn left(&self) -> usize {
        self.seats.iter().map(|seat| seat.news.len()).sum()
    }

    /// Digest of every board, by craft.
    pub(super) fn digests(&self) -> Vec<(u32, u64)> {
        (0..).zip(&self.seats).map(|(craft, seat)| (craft, seat.board.digest())).collect()
    }

    /// Applies what a request tells and answers it.
    pub(super) fn receive_request(
        &mut self,
        received: Nanos,
        (kind, header): (Kind, &Header),
        (changes, intended): (&[Change], &[u64]),
        fleet: &FleetView<'_>,
        (counting, measured): (&mut Counting, &mut Measured),
        out: &mut Outbox,
    ) -> Result<(), Refusal> {
        let asker = CraftId(header.source);
        if !matches!(kind, Kind::Result | Kind::Instruction) {
            return Err(Refusal::Kind);
        }
        let is_foreign = changes.iter().any(|change| change.version.writer != asker);
        if asker.index() >= self.seats.len() || is_foreign {
            return Err(Refusal::Record);
        }
        measured.woken(header.source, header.hop_count, received.since(Nanos(header.published_ns)));
        for (&change, &intended_ns) in changes.iter().zip(intended) {
            self.seats[asker.index()].take(fleet.board(asker), change.fact, &change);
            for target in fleet.board(asker).targets(change.fact) {
                let seat = &mut self.seats[target.craft.index()];
                // It may have been learnt as state before the request came. The version alone does not
                // tell: two facts of a board may lead to one of another, each with counts of its own.
                let is_known = seat.board.state(target.fact).version == change.version
                    && seat.authors.is_named(target.fact, change.fact);
                if is_known {
                    continue;
                }
                let merged = seat.take(fleet.board(target.craft), target.fact, &change);
                counting.counters.conflicts += u64::from(merged.conflict);
                measured.applied(asker, 1);
                seat.news.push_back((change, intended_ns));
            }
            self.applied.push(Nanos(intended_ns));
        }
        let seat = &mut self.seats[asker.index()];
        if header.firing_number >= seat.request {
            seat.request = header.firing_number;
            seat.writes_no_more = header.argument & WRITES_NO_MORE != 0;
        }
        self.reply(asker, header, counting, out);
        Ok(())
    }

    /// Forgets what no reply has taken: the interval was given up.
    pub(super) fn give_up(&mut self) {
        self.seats.iter_mut().for_each(|seat| seat.news.clear());
    }

    /// Stamps what was applied since the last call as applied at `now`.
    pub(super) fn stamp_applied(&mut self, now: Nanos, measured: &mut Measured) {
        for intended in self.applied.drain(..) {
            measured.stage(Stage::AppliedAtCentre, now.since(intended));
        }
    }

    fn reply(
        &mut self,
        asker: CraftId,
        request: &Header,
        counting: &mut Counting,
        out: &mut Outbox,
    ) {
        let is_silent =
            self.is_caught_up && self.seats.iter().all(|seat| seat.writes_no_more || seat.is_gone);
        let centre = CraftId::from_index(self.seats.len());
        let Seat { news, is_dismissed, .. } = &mut self.seats[asker.index()];
        let fitting = news.len().min(self.records_max);
        let mut header = header(Class::Reply, Kind::Reply, centre, self.epoch, Turn(0));
        header.intended_ns = request.intended_ns;
        header.firing_number = request.firing_number;
        header.argument = match (fitting < news.len(), is_silent) {
            (true, _) => MORE_IS_NEW,
            (false, true) => ALL_IS_SAID,
            (false, false) => 0,
        };
        *is_dismissed = header.argument == ALL_IS_SAID;
        let range = out.put_timed(news.drain(..fitting));
        out.send(Destination::Craft(asker), header, range, counting);
    }

    /// The centre recovers; in a later life it has everything to learn.
    pub(super) fn begin_recovery(&mut self, is_reborn: bool, _: &FleetView<'_>) {
        self.is_caught_up = !is_reborn;
    }

    /// Clients that were dismissed too early: what others had lost came after it.
    pub(super) fn dismissed_too_early(&self) -> impl Iterator<Item = CraftId> + use<'_> {
        let seats = (0..).map(CraftId).zip(&self.seats);
        let missed = |seat: &Seat| seat.is_dismissed && !seat.news.is_empty() && !seat.is_gone;
        seats.filter(move |(_, seat)| missed(seat)).map(|(craft, _)| craft)
    }

    /// Whether something waits for the next request of `client`.
    pub(super) fn has_news_for(&self, client: CraftId) -> bool {
        self.seats.get(client.index()).is_some_and(|seat| !seat.news.is_empty())
    }

    /// A client that is gone writes no more; one that is back may.
    pub(super) fn member_changed(&mut self, craft: CraftId, is_gone: bool) {
        if let Some(seat) = self.seats.get_mut(craft.index()) {
            (seat.writes_no_more, seat.is_gone, seat.request) = (false, is_gone, 0);
            seat.is_dismissed = false;
            if is_gone {
                seat.news.clear();
            }
        }
    }

    /// The versions on the board of `client` of `facts`.
    pub(super) fn digest(&self, client: CraftId, facts: Range<u32>, out: &mut Vec<Change>) {
        out.extend(versions(&self.seats[client.index()].board, facts));
    }

    /// What `client` knows of its board that is newer than here.
    pub(super) fn newer_at(&self, client: CraftId, known: &[Change]) -> Option<Evidence> {
        self.seats.get(client.index()).and_then(|seat| newer_than(&seat.board, known))
    }

    /// What a client that knows `known` lacks of `facts`.
    pub(super) fn tell(
        &self,
        client: CraftId,
        facts: Range<u32>,
        known: &[Change],
        out: &mut Vec<Change>,
    ) {
        if let Some(seat) = self.seats.get(client.index()) {
            out.extend(news(&seat.board, &seat.authors, facts, known));
        }
    }

    /// Takes over what `client` told of its mirror; what is news to others waits for their next
    /// request. Returns how much of it was news to the client's own board.
    pub(super) fn learn(
        &mut self,
        client: CraftId,
        changes: &[Change],
        fleet: &FleetView<'_>,
    ) -> u64 {
        let mut learnt = 0;
        for change in changes {
            let writer = change.version.writer;
            let home = &mut self.seats[writer.index()];
            let merged = home.take(fleet.board(writer), change.fact, change);
            learnt += u64::from(merged.accepted);
            for target in fleet.board(writer).targets(change.fact) {
                let seat = &mut self.seats[target.craft.index()];
                let merged = seat.take(fleet.board(target.craft), target.fact, change);
                if merged.accepted && target.craft != client {
                    seat.news.push_back((*change, 0));
                }
            }
        }
        learnt
    }
}

impl Seat {
    /// Merges a change that is called `own` here.
    fn take(&mut self, board: &BoardView<'_>, own: FactId, change: &Change) -> Merged {
        let merged = self.board.merge(board, own, change.value, change.version);
        if merged.accepted {
            self.authors.learnt(own, change.fact);
        }
        merged
    }
}
