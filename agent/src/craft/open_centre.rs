//! The centre in open mode: it holds every home board and answers each request at once.
//!
//! A change is applied to its writer's home board and to every board that shares the fact when it
//! arrives; for each of those boards' clients it waits for their next request and rides on the reply.
//! Not here: the client's side (`open_client`), and the centre of lockstep.

use super::open_client::{ALL_IS_SAID, MORE_IS_NEW, WRITES_NO_MORE};
use super::outbox::{Counting, Outbox, header};
use super::schedule::Schedule;
use crate::blackboard::Blackboard;
use crate::metrics::Measured;
use shared_types::ids::{CraftId, Turn};
use shared_types::knowledge::{Change, FleetView};
use shared_types::limits::INBOX_PAYLOAD_BYTES;
use shared_types::time::Nanos;
use shared_types::transport::Destination;
use shared_types::wire::{
    Class, EpochSpec, Header, INTENDED_BYTES, Kind, OpenSpec, Refusal, Stage,
};
use std::collections::VecDeque;

/// What the centre keeps for one client.
#[derive(Debug, Default)]
struct Seat {
    board: Blackboard,
    /// Changes of its links since its last reply, in ids of the boards that wrote them, with when they
    /// were meant to be made.
    news: VecDeque<(Change, u64)>,
    writes_no_more: bool,
}

/// The centre of a fleet in open mode.
#[derive(Debug, Default)]
pub(super) struct OpenCentre {
    epoch: u32,
    records_max: usize,
    schedule: Schedule,
    seats: Vec<Seat>,
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
            seat.news.clear();
            seat.writes_no_more = false;
        }
        self.applied.clear();
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
            let home = &mut self.seats[asker.index()].board;
            home.merge(fleet.board(asker), change.fact, change.value, change.version);
            for target in fleet.board(asker).targets(change.fact) {
                let seat = &mut self.seats[target.craft.index()];
                let board = fleet.board(target.craft);
                let merged = seat.board.merge(board, target.fact, change.value, change.version);
                counting.counters.conflicts += u64::from(merged.conflict);
                measured.applied(asker, 1);
                seat.news.push_back((change, intended_ns));
            }
            self.applied.push(Nanos(intended_ns));
        }
        self.seats[asker.index()].writes_no_more = header.argument & WRITES_NO_MORE != 0;
        self.reply(asker, header.intended_ns, counting, out);
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
        intended_ns: u64,
        counting: &mut Counting,
        out: &mut Outbox,
    ) {
        let is_silent = self.seats.iter().all(|seat| seat.writes_no_more);
        let centre = CraftId::from_index(self.seats.len());
        let news = &mut self.seats[asker.index()].news;
        let fitting = news.len().min(self.records_max);
        let mut header = header(Class::Reply, Kind::Reply, centre, self.epoch, Turn(0));
        header.intended_ns = intended_ns;
        header.argument = match (fitting < news.len(), is_silent) {
            (true, _) => MORE_IS_NEW,
            (false, true) => ALL_IS_SAID,
            (false, false) => 0,
        };
        let range = out.put_timed(news.drain(..fitting));
        out.send(Destination::Craft(asker), header, range, counting);
    }
}
