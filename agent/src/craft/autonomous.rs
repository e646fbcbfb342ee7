//! A craft that reasons on its own board and replicates with a strategy.

use super::outbox::{Counting, Held, Outbox, header};
use crate::blackboard::Blackboard;
use crate::blackboard::replica::ReplicaStore;
use crate::control::Control;
use crate::control::acting::Acting;
use crate::reasoning::planner::Planner;
use crate::reasoning::upkeep::Upkeep;
use crate::replication::{Context, Plans, Recipient, Strategy, strategy};
use shared_types::ids::{CraftId, Firing, Turn};
use shared_types::knowledge::{Change, FactState, FleetView};
use shared_types::reasoning::ReasoningReport;
use shared_types::rng::{Purpose, Stream};
use shared_types::time::Nanos;
use shared_types::transport::{Destination, Peers};
use shared_types::wire::{
    Class, EpochSpec, Header, Kind, Refusal, StrategyKind, TurnPhase, TurnReport,
};

/// Final deliveries of the open turn and of the next one, whose first deltas may arrive before the
/// command that opens it.
#[derive(Debug, Default)]
struct Tally {
    /// The next turn to open; the open one is one less.
    next_turn: u32,
    open: u32,
    next: u32,
    /// What the last report said of the open turn; `None` before the first.
    reported: Option<u32>,
    /// The report of the firing, while it is held back.
    fired: Option<TurnReport>,
}

/// The state of an autonomous craft.
#[derive(Debug)]
pub(super) struct Autonomous {
    craft: CraftId,
    spec: Option<EpochSpec>,
    strategy: Box<dyn Strategy>,
    board: Blackboard,
    draws: Stream,
    control: Control,
    acting: Acting,
    upkeep: Upkeep,
    replicas: ReplicaStore,
    keeps_replicas: bool,
    held: Vec<Held>,
    tally: Tally,
    firing_number: u32,
    plans: Plans,
    changes: Vec<Change>,
}

impl Autonomous {
    pub(super) fn new() -> Self {
        Self {
            craft: CraftId(0),
            spec: None,
            strategy: strategy(StrategyKind::Null),
            board: Blackboard::default(),
            draws: Stream::new(0, 0, Purpose::Firing, 0),
            control: Control::default(),
            acting: Acting::default(),
            upkeep: Upkeep::default(),
            replicas: ReplicaStore::default(),
            keeps_replicas: false,
            held: Vec::new(),
            tally: Tally::default(),
            firing_number: 0,
            plans: Plans::default(),
            changes: Vec::new(),
        }
    }

    pub(super) fn begin_epoch(&mut self, craft: CraftId, spec: &EpochSpec, fleet: &FleetView<'_>) {
        self.craft = craft;
        self.strategy = strategy(spec.strategy);
        self.board.reset(fleet.board(craft));
        self.draws = Stream::new(spec.seed, spec.trial, Purpose::Firing, craft.0);
        self.acting = Acting::new(spec.seed, spec.trial, craft);
        self.control.reset(spec.reasoning.policy, craft, fleet);
        self.upkeep.reset(spec.reasoning, fleet.board(craft));
        self.keeps_replicas = spec.strategy.keeps_replicas();
        if self.keeps_replicas {
            self.replicas.reset(fleet);
        }
        self.held.clear();
        self.tally = Tally::default();
        self.firing_number = 0;
        self.spec = Some(spec.clone());
    }

    pub(super) fn plant(&mut self, strategy: Box<dyn Strategy>) {
        self.strategy = strategy;
    }

    pub(super) fn peers(&self, fleet: &FleetView<'_>) -> Peers {
        self.strategy.peers(&Context { craft: self.craft, fleet })
    }

    pub(super) fn has_final(&self, fleet: &FleetView<'_>) -> bool {
        self.board.has_final(fleet.board(self.craft))
    }

    pub(super) const fn board(&self) -> &Blackboard {
        &self.board
    }

    pub(super) fn digest(&self) -> u64 {
        self.board.digest()
    }

    pub(super) fn replica_digest(&self) -> u64 {
        if self.keeps_replicas { self.replicas.digest() } else { 0 }
    }

    /// Merges what is held for `turn`, in an order that does not depend on arrival.
    pub(super) fn close_turn(
        &mut self,
        turn: Turn,
        fleet: &FleetView<'_>,
        counting: &mut Counting,
    ) {
        let board = fleet.board(self.craft);
        self.held.sort_unstable_by_key(|held| (held.turn, held.merge_order()));
        let closed = self.held.partition_point(|held| held.turn <= turn);
        for held in self.held.drain(..closed) {
            let Change { fact, value, version, .. } = held.change;
            if let Some(own) = fleet.board(held.origin).target_on(fact, self.craft) {
                let merged = self.board.merge(board, own, value, version);
                counting.counters.conflicts += u64::from(merged.conflict);
                if merged.accepted {
                    self.control.note_merged(own, value);
                    self.upkeep.note(own, value);
                }
            }
            if self.keeps_replicas {
                self.replicas.tell(held.origin, fact, FactState { value, version });
            }
        }
    }

    /// Chooses, fires, plans, reports.
    pub(super) fn open_turn(
        &mut self,
        now: Nanos,
        turn: Turn,
        fleet: &FleetView<'_>,
        counting: &mut Counting,
        out: &mut Outbox,
    ) {
        self.tally.next_turn = turn.0 + 1;
        self.tally.open = std::mem::take(&mut self.tally.next);
        let board = fleet.board(self.craft);
        let firing = self.choose(turn, fleet);
        let mut changes = std::mem::take(&mut self.changes);
        let effect = self.acting.spend(board, firing);
        let is_final = effect.bring(&mut self.board, board, self.craft, firing, &mut changes);
        self.control.note_fired(board, (firing, effect), &changes);
        changes.iter().for_each(|change| self.upkeep.note(change.fact, change.value));
        self.upkeep.open_turn(turn);
        self.plans.clear();
        if firing.is_idle() {
            counting.counters.idle_turns += 1;
        } else {
            if self.spec().sends_altered_only {
                changes.retain(|change| change.altered);
            }
            counting.fired(board, &changes);
            let context = Context { craft: self.craft, fleet };
            self.strategy.plan(&context, &changes, &mut self.plans);
            let epoch = self.spec().epoch;
            let mut header = header(Class::Replication, Kind::Delta, self.craft, epoch, turn);
            header.firing_number = self.firing_number;
            header.intended_ns = now.0;
            self.firing_number += 1;
            self.send_plans(&header, counting, out);
        }
        self.changes = changes;
        self.tally.reported = None;
        self.tally.fired = Some(TurnReport {
            turn: turn.0,
            phase: TurnPhase::Fired as u32,
            firing: firing.0,
            owed: self.plans.owed,
            held: 0,
            is_final: u32::from(is_final),
        });
        if !self.strategy.expects_deliveries() {
            self.report(out);
        }
    }

    /// Whether the board is due to be pruned or maintained.
    pub(super) const fn has_upkeep(&self) -> bool {
        self.upkeep.is_due()
    }

    /// Prunes and maintains the board, where that is due.
    pub(super) fn upkeep(&mut self, fleet: &FleetView<'_>, clock: &mut impl FnMut() -> Nanos) {
        self.upkeep.run(self.craft, fleet.board(self.craft), self.control.planner(), clock);
    }

    /// What the craft's thinking came to; `None` where it only drew.
    pub(super) fn reasoning(&self) -> Option<ReasoningReport> {
        let reasoning = self.spec().reasoning;
        let [plans, costs_changed] = self.control.planner().map_or([0; 2], Planner::work);
        let has_report = self.control.planner().is_some() || reasoning.has_upkeep();
        has_report.then(|| ReasoningReport { plans, costs_changed, ..*self.upkeep.report() })
    }

    /// Holds a delta for the end of its turn and passes it on where the strategy says so.
    pub(super) fn receive_delta(
        &mut self,
        header: &Header,
        changes: &[Change],
        fleet: &FleetView<'_>,
        counting: &mut Counting,
        out: &mut Outbox,
    ) -> Result<(), Refusal> {
        let (origin, turn) = (CraftId(header.origin), header.turn);
        if changes.iter().any(|change| change.version.writer != origin) {
            return Err(Refusal::Record);
        }
        if turn.checked_add(1) != Some(self.tally.next_turn) && turn != self.tally.next_turn {
            counting.counters.losses.late += 1;
            return Ok(());
        }
        let context = Context { craft: self.craft, fleet };
        let source = CraftId(header.source);
        self.plans.clear();
        self.strategy.plan_relay(&context, origin, source, changes, &mut self.plans);
        if !self.plans.requests.is_empty() {
            let mut onward = *header;
            onward.hop_count = onward.hop_count.saturating_add(1);
            self.send_plans(&onward, counting, out);
        }
        let held_before = self.held.len();
        let board = fleet.board(origin);
        let concern = changes.iter().filter(|change| {
            self.keeps_replicas || board.target_on(change.fact, self.craft).is_some()
        });
        self.held.extend(concern.map(|&change| Held {
            turn: Turn(turn),
            origin,
            firing_number: header.firing_number,
            change,
        }));
        if self.held.len() > held_before {
            counting.counters.hops += u64::from(header.hop_count);
            let tally = &mut self.tally;
            *(if turn == tally.next_turn { &mut tally.next } else { &mut tally.open }) += 1;
        }
        Ok(())
    }

    /// Whether the report of the firing is held back.
    pub(super) const fn holds_report(&self) -> bool {
        self.tally.fired.is_some()
    }

    /// Reports the firing or, once that is done, further deliveries of the open turn.
    pub(super) fn report(&mut self, out: &mut Outbox) {
        let tally = &mut self.tally;
        if let Some(fired) = tally.fired.take() {
            out.reports.push(TurnReport { held: tally.open, ..fired });
        } else if tally.reported.is_some_and(|reported| reported != tally.open) {
            out.reports.push(TurnReport {
                turn: tally.next_turn - 1,
                phase: TurnPhase::Held as u32,
                firing: Firing::IDLE.0,
                owed: 0,
                held: tally.open,
                is_final: 0,
            });
        } else {
            return;
        }
        tally.reported = Some(tally.open);
    }

    fn spec(&self) -> &EpochSpec {
        self.spec.as_ref().expect("invariant: an epoch began")
    }

    /// What to fire: the action at hand, else as the policy says or, under `null`, read from the script.
    fn choose(&mut self, turn: Turn, fleet: &FleetView<'_>) -> Firing {
        if self.spec().strategy == StrategyKind::Null {
            let script = fleet.script.get(self.craft.index());
            let firing = script.and_then(|firings| firings.get(turn.index()));
            return firing.map_or(Firing::IDLE, |&firing| Firing(firing));
        }
        let board = fleet.board(self.craft);
        let choose = || self.control.choose(&self.board, board, &mut self.draws);
        self.acting.at_hand().unwrap_or_else(choose)
    }

    fn send_plans(&self, header: &Header, counting: &mut Counting, out: &mut Outbox) {
        let base = out.put_changes(&self.plans.changes).start;
        for request in &self.plans.requests {
            let to = match request.to {
                Recipient::One(craft) => Destination::Craft(craft),
                Recipient::Everybody => Destination::Multicast,
            };
            let range = base + request.changes.start..base + request.changes.end;
            out.send(to, *header, range, counting);
        }
    }
}
