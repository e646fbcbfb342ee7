//! `central`, `central-batched`, `pipelined`: the centre, one more process that holds every board.
//!
//! It draws what a craft runs from that craft's own random stream and board, as the board stood at
//! the start of the turn. A result applies to its own board on arrival and to linked boards when all
//! results of the turn are in; what a link changed rides on the first reply of the next turn, the
//! last turn's on the reply to the sign-off.

use crate::blackboard::Blackboard;
use crate::control::Control;
use crate::control::acting::Acting;
use crate::craft::{Counting, Held, Outbox, header};
use shared_types::ids::{CraftId, FactId, Firing, Turn};
use shared_types::knowledge::{Change, FleetView, Value};
use shared_types::rng::{Purpose, Stream};
use shared_types::transport::{Destination, Peers};
use shared_types::wire::{
    Class, EpochSpec, Header, Kind, Refusal, StrategyKind, TurnPhase, TurnReport,
};

/// What the centre knows of one craft.
#[derive(Debug)]
struct Seat {
    board: Blackboard,
    draws: Stream,
    control: Control,
    acting: Acting,
    /// What it was told to run this turn; `None` until it asked.
    firing: Option<Firing>,
    firing_number: u32,
    /// Whether its part of the turn is in.
    is_settled: bool,
    /// Final facts that its firing of this turn newly asserted.
    reached: Vec<FactId>,
    /// Changes of its links since its last reply, in ids of the boards that wrote them.
    news: Vec<Change>,
    /// Checks that wait for the end of the turn.
    waiting: Vec<FactId>,
}

/// The centre of a fleet.
#[derive(Debug, Default)]
pub struct Centre {
    spec: Option<EpochSpec>,
    seats: Vec<Seat>,
    turn: Option<Turn>,
    settled: usize,
    is_applied: bool,
    signed_off: usize,
    held: Vec<Held>,
    changes: Vec<Change>,
}

impl Centre {
    /// Starts an epoch: every board as before its first turn.
    pub fn begin_epoch(&mut self, spec: &EpochSpec, fleet: &FleetView<'_>) {
        let draws = |craft: usize| {
            Stream::new(spec.seed, spec.trial, Purpose::Firing, CraftId::from_index(craft).0)
        };
        self.seats.truncate(fleet.boards.len());
        for craft in self.seats.len()..fleet.boards.len() {
            self.seats.push(Seat::new(draws(craft)));
        }
        for (craft, (seat, board)) in self.seats.iter_mut().zip(&fleet.boards).enumerate() {
            seat.board.reset(board);
            seat.draws = draws(craft);
            seat.acting = Acting::new(spec.seed, spec.trial, CraftId::from_index(craft));
            seat.control.reset(spec.reasoning.policy, CraftId::from_index(craft), fleet);
            seat.firing_number = 0;
            seat.news.clear();
            seat.clear_turn();
        }
        self.spec = Some(spec.clone());
        self.turn = None;
        self.settled = 0;
        self.is_applied = false;
        self.signed_off = 0;
        self.held.clear();
    }

    /// The ports that the centre needs: one to every craft.
    #[must_use]
    pub fn peers(fleet: &FleetView<'_>) -> Peers {
        let unicast = (0..fleet.craft_count()).map(CraftId).collect();
        Peers { unicast, ..Peers::default() }
    }

    /// Takes note that `turn` is open. A request of the turn may arrive before the command that
    /// opens it; whichever comes first does the work.
    pub fn open_turn(&mut self, turn: Turn) {
        if self.turn == Some(turn) {
            return;
        }
        self.turn = Some(turn);
        self.settled = 0;
        self.is_applied = false;
        for seat in &mut self.seats {
            seat.clear_turn();
        }
    }

    /// Answers a request, at once or when the turn's results are in.
    ///
    /// # Errors
    /// If the request does not fit the conversation or names something that does not exist.
    pub fn receive_request(
        &mut self,
        kind: Kind,
        header: &Header,
        changes: &[Change],
        fleet: &FleetView<'_>,
        counting: &mut Counting,
        out: &mut Outbox,
    ) -> Result<(), Refusal> {
        let asker = CraftId(header.source);
        if asker.index() >= self.seats.len() {
            return Err(Refusal::Record);
        }
        self.open_turn(Turn(header.turn));
        match kind {
            Kind::Register => self.reply(asker, 0, false, counting, out),
            Kind::Instruction => self.instruct(asker, fleet, counting, out)?,
            Kind::Result => self.take_result(asker, changes, fleet, counting, out)?,
            Kind::Check => self.check(asker, FactId(header.argument), counting, out),
            Kind::SignOff => {
                self.reply(asker, 0, true, counting, out);
                self.signed_off += 1;
                out.is_finished = self.signed_off == self.seats.len();
            }
            _ => return Err(Refusal::Kind),
        }
        Ok(())
    }

    /// Digest of every board, by craft.
    #[must_use]
    pub fn digests(&self) -> Vec<(u32, u64)> {
        (0..).zip(&self.seats).map(|(craft, seat)| (craft, seat.board.digest())).collect()
    }

    fn spec(&self) -> &EpochSpec {
        self.spec.as_ref().expect("invariant: an epoch began")
    }

    fn turn_number(&self) -> u32 {
        self.turn.map_or(0, |turn| turn.0)
    }

    fn instruct(
        &mut self,
        asker: CraftId,
        fleet: &FleetView<'_>,
        counting: &mut Counting,
        out: &mut Outbox,
    ) -> Result<(), Refusal> {
        let seat = &mut self.seats[asker.index()];
        if seat.firing.is_some() {
            return Err(Refusal::Kind);
        }
        let board = fleet.board(asker);
        let choose = || seat.control.choose(&seat.board, board, &mut seat.draws);
        let firing = seat.acting.at_hand().unwrap_or_else(choose);
        seat.firing = Some(firing);
        self.reply(asker, firing.0, true, counting, out);
        if firing.is_idle() {
            self.settle(asker, fleet, counting, out);
        }
        Ok(())
    }

    fn take_result(
        &mut self,
        asker: CraftId,
        told: &[Change],
        fleet: &FleetView<'_>,
        counting: &mut Counting,
        out: &mut Outbox,
    ) -> Result<(), Refusal> {
        let altered_only = self.spec().sends_altered_only;
        let turn = self.turn_number();
        let seat = &mut self.seats[asker.index()];
        let (Some(firing), false) = (seat.firing, seat.is_settled) else {
            return Err(Refusal::Kind);
        };
        let board = fleet.board(asker);
        let effect = seat.acting.spend(board, firing);
        effect.bring(&mut seat.board, board, asker, firing, &mut self.changes);
        seat.control.note_fired(board, (firing, effect), &self.changes);
        seat.reached.extend_from_slice(seat.board.reached());
        if altered_only {
            self.changes.retain(|change| change.altered);
        }
        if self.changes != told {
            return Err(Refusal::Record);
        }
        let number = seat.firing_number;
        seat.firing_number += 1;
        self.held.extend(self.changes.iter().map(|&change| Held {
            turn: Turn(turn),
            origin: asker,
            firing_number: number,
            change,
        }));
        self.reply(asker, 0, false, counting, out);
        self.settle(asker, fleet, counting, out);
        Ok(())
    }

    /// Answers whether the asker's final fact is reached: newly asserted by its own firing of this
    /// turn or, where deliveries count as well, true once the turn is applied. A fact that its own
    /// firing asserted and a delivery of the same turn took back was reached.
    fn check(&mut self, asker: CraftId, fact: FactId, counting: &mut Counting, out: &mut Outbox) {
        let own_firing_only = self.spec().own_firing_only;
        let seat = &mut self.seats[asker.index()];
        if !own_firing_only && !self.is_applied {
            seat.waiting.push(fact);
            return;
        }
        let is_true = !own_firing_only && seat.board.state(fact).value == Value::Asserted;
        let answer = is_true || seat.reached.contains(&fact);
        self.reply(asker, u32::from(answer), false, counting, out);
    }

    /// Notes that a craft's part of the turn is in; with the last one the turn is applied to linked
    /// boards, waiting checks are answered and the turn is reported.
    fn settle(
        &mut self,
        craft: CraftId,
        fleet: &FleetView<'_>,
        counting: &mut Counting,
        out: &mut Outbox,
    ) {
        self.seats[craft.index()].is_settled = true;
        self.settled += 1;
        if self.settled < self.seats.len() {
            return;
        }
        let deliveries = self.apply_links(fleet, counting);
        self.is_applied = true;
        for index in 0..self.seats.len() {
            let waiting = std::mem::take(&mut self.seats[index].waiting);
            for &fact in &waiting {
                self.check(CraftId::from_index(index), fact, counting, out);
            }
        }
        out.reports.push(TurnReport {
            turn: self.turn_number(),
            phase: TurnPhase::Fired as u32,
            firing: Firing::IDLE.0,
            owed: deliveries,
            held: deliveries,
            is_final: u32::from(self.is_final(fleet)),
        });
    }

    fn apply_links(&mut self, fleet: &FleetView<'_>, counting: &mut Counting) -> u32 {
        let mut deliveries = 0;
        self.held.sort_unstable_by_key(Held::merge_order);
        for held in self.held.drain(..) {
            let change = held.change;
            for target in fleet.board(held.origin).targets(change.fact) {
                let seat = &mut self.seats[target.craft.index()];
                let board = fleet.board(target.craft);
                let merged = seat.board.merge(board, target.fact, change.value, change.version);
                counting.counters.conflicts += u64::from(merged.conflict);
                if merged.accepted {
                    seat.control.note_merged(target.fact, change.value);
                }
                seat.news.push(change);
                deliveries += 1;
            }
        }
        deliveries
    }

    /// Whether the centre itself ends the trial: only `central-batched` looks for final facts here.
    fn is_final(&self, fleet: &FleetView<'_>) -> bool {
        let spec = self.spec();
        spec.strategy == StrategyKind::CentralBatched
            && self.seats.iter().zip(&fleet.boards).any(|(seat, board)| {
                !seat.reached.is_empty() || (!spec.own_firing_only && seat.board.has_final(board))
            })
    }

    fn reply(
        &mut self,
        asker: CraftId,
        argument: u32,
        carries_news: bool,
        counting: &mut Counting,
        out: &mut Outbox,
    ) {
        let centre = CraftId::from_index(self.seats.len());
        let (epoch, turn) = (self.spec().epoch, Turn(self.turn_number()));
        let mut header = header(Class::Reply, Kind::Reply, centre, epoch, turn);
        header.argument = argument;
        let mut range = 0..0;
        if carries_news {
            let news = &mut self.seats[asker.index()].news;
            range = out.put_changes(news);
            news.clear();
        }
        out.send(Destination::Craft(asker), header, range, counting);
    }
}

impl Seat {
    fn new(draws: Stream) -> Self {
        Self {
            board: Blackboard::default(),
            draws,
            control: Control::default(),
            acting: Acting::default(),
            firing: None,
            firing_number: 0,
            is_settled: false,
            reached: Vec::new(),
            news: Vec::new(),
            waiting: Vec::new(),
        }
    }

    fn clear_turn(&mut self) {
        self.firing = None;
        self.is_settled = false;
        self.reached.clear();
        self.waiting.clear();
    }
}
