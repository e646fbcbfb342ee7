//! Keeps a board small while a mission goes on (Straub 2016, chapter VI).
//!
//! Every fact, rule and action is an item with a place: on the board, or in one of three stores. Once
//! an expiration period every item is looked at and gets one status ([`Status`]), which decides its
//! place and two lists: what need not be collected any more, and what is at hand without being on the
//! board. Work is done in slices of a given number of items, so that a step of the craft is never held
//! up; a cycle is over when every item was looked at once within the period.
//!
//! What can serve a goal at all is what the sound pruner keeps; what is on one of the best ways to it is
//! told by the caller, who plans. Boundary facts are never taken off a board while another may read
//! them. Time is an argument. The whole assessment from scratch stands in [`mod@reference`].

mod items;
pub mod reference;
mod settings;

#[cfg(test)]
mod tests;

pub use items::{Item, Items, Place};
pub use settings::{Lifetime, Settings, SettingsError, Status};

use super::prune::sound::Sound;
use shared_types::ids::FactId;
use shared_types::knowledge::{BoardView, Literal};
use shared_types::time::Nanos;
use std::collections::BTreeSet;

/// What one slice did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Slice {
    /// Items looked at, by [`Status`].
    pub statuses: [u32; 5],
    /// Items that changed their place.
    pub moved: u32,
}

/// The maintenance of one board.
#[derive(Clone, Debug)]
pub struct Maintenance {
    settings: Settings,
    sound: Sound,
    items: Items,
    /// By fact: how long it may be relied upon, when it was written, and whether a newer value of it has
    /// replaced what is held.
    lifetimes: Vec<Lifetime>,
    written: Vec<Option<Nanos>>,
    is_replaced: Vec<bool>,
    /// By item: whether it is on one of the best ways.
    is_needed: Vec<bool>,
    do_not_collect: BTreeSet<u32>,
    available: BTreeSet<u32>,
    /// The next item that is looked at.
    next: usize,
}

impl Maintenance {
    /// Everything on the board, nothing looked at yet; `sound` tells what can serve a goal.
    #[must_use]
    pub fn new(board: &BoardView<'_>, settings: Settings, sound: Sound) -> Self {
        let items = Items::of(board);
        let facts = board.fact_count as usize;
        Self {
            settings,
            sound,
            is_needed: vec![false; items.count()],
            items,
            lifetimes: vec![Lifetime::Lasting; facts],
            written: vec![None; facts],
            is_replaced: vec![false; facts],
            do_not_collect: BTreeSet::new(),
            available: BTreeSet::new(),
            next: 0,
        }
    }

    /// How long values of `fact` may be relied upon from now on.
    pub fn set_lifetime(&mut self, fact: FactId, lifetime: Lifetime) {
        self.lifetimes[fact.index()] = lifetime;
    }

    /// `fact` was written at `now` and is `value` from then on. A value that differs from one that is
    /// held replaces it: the old one is kept in the stale archive, to explain later why a rule ran.
    pub fn note_write(
        &mut self,
        board: &BoardView<'_>,
        fact: FactId,
        is_known: Option<Literal>,
        now: Nanos,
    ) {
        let at = fact.index();
        for literal in [Literal::holds(fact), Literal::is_absent(fact)] {
            self.sound.set_known(board, literal, is_known == Some(literal));
        }
        self.is_replaced[at] = false;
        self.written[at] = is_known.map(|_| now);
        self.take_back(Item::Fact(fact.0));
        self.bring_back(board);
    }

    /// Another source has a newer value of `fact` than the board: the board's is stale.
    pub fn note_replaced(&mut self, fact: FactId) {
        self.is_replaced[fact.index()] = true;
    }

    /// A goal is added or dropped.
    pub fn set_goal(&mut self, board: &BoardView<'_>, goal: Literal, is_goal: bool) {
        self.sound.set_goal(board, goal, is_goal);
        self.bring_back(board);
    }

    /// Which items are on the best ways to the goals: those of the plans in use and of as many
    /// near-best ones as the caller keeps.
    pub fn set_needed(&mut self, needed: impl IntoIterator<Item = Item>) {
        self.is_needed.fill(false);
        for item in needed {
            let at = self.items.index(item);
            self.is_needed[at] = true;
            // What a way needs must be on the board, wherever it was put.
            self.take_back(item);
        }
    }

    /// Looks at up to `budget` items at `now`.
    pub fn slice(&mut self, board: &BoardView<'_>, now: Nanos, budget: usize) -> Slice {
        let mut slice = Slice::default();
        for _ in 0..budget.min(self.items.count()) {
            let item = self.items.item(self.next);
            self.next = (self.next + 1) % self.items.count();
            let status = self.status(board, item, now);
            slice.statuses[status as usize] += 1;
            slice.moved += u32::from(self.act(board, item, status, now));
        }
        self.items.forget_stale(now, self.settings.stale_kept_ns);
        slice
    }

    /// Items that one cycle looks at, so that all are within a period of `cycles` cycles.
    #[must_use]
    pub fn share(&self) -> usize {
        self.items.count().div_ceil(self.settings.cycles_per_period as usize)
    }

    /// The status of `item` at `now`.
    #[must_use]
    pub fn status(&self, board: &BoardView<'_>, item: Item, now: Nanos) -> Status {
        if self.items.is_fresh(item, now, self.settings.period_ns) {
            return Status::Current;
        }
        if let Item::Fact(fact) = item
            && self.is_stale(fact as usize, now)
        {
            return Status::Stale;
        }
        if !self.can_serve(board, item) {
            return Status::Unused;
        }
        if self.is_needed[self.items.index(item)] || Self::is_kept_here(board, item) {
            Status::Used
        } else {
            Status::Unlikely
        }
    }

    /// What can serve a goal.
    #[must_use]
    pub const fn sound(&self) -> &Sound {
        &self.sound
    }

    /// Where `item` is.
    #[must_use]
    pub fn place(&self, item: Item) -> Place {
        self.items.place(item)
    }

    /// Facts that need not be collected: they serve nothing, or are at hand already.
    pub fn do_not_collect(&self) -> impl Iterator<Item = FactId> {
        self.do_not_collect.iter().copied().map(FactId)
    }

    /// Facts that are at hand in the ancillary store.
    pub fn available(&self) -> impl Iterator<Item = FactId> {
        self.available.iter().copied().map(FactId)
    }

    fn is_stale(&self, fact: usize, now: Nanos) -> bool {
        let Some(written) = self.written[fact] else { return false };
        self.is_replaced[fact] || self.lifetimes[fact].is_over(written, now)
    }

    fn can_serve(&self, board: &BoardView<'_>, item: Item) -> bool {
        match item {
            Item::Fact(fact) => self.sound.keeps_fact(FactId(fact)),
            Item::Rule(rule) => self.sound.keeps_rule(rule),
            Item::Action(action) => self.sound.keeps_action(board, action),
        }
    }

    /// Boundary facts stay: another board may read them.
    fn is_kept_here(board: &BoardView<'_>, item: Item) -> bool {
        matches!(item, Item::Fact(fact) if board.is_boundary(FactId(fact)))
    }

    /// Puts `item` where its status says; returns whether that is another place.
    fn act(&mut self, board: &BoardView<'_>, item: Item, status: Status, now: Nanos) -> bool {
        let place = match status {
            Status::Current => return false,
            Status::Stale => Place::Stale { since: now },
            Status::Unused => Place::Unused,
            Status::Unlikely => Place::Ancillary,
            Status::Used => Place::Board,
        };
        self.items.stamp(item, now);
        if let Item::Fact(fact) = item {
            self.list(fact, status);
            if status == Status::Stale {
                self.drop_value(board, fact);
            }
        }
        let is_moved = self.items.put(item, place);
        if status == Status::Unlikely
            && let Some(Item::Fact(oldest)) = self.items.overflow(self.settings.ancillary_items_max)
        {
            self.available.remove(&oldest);
        }
        is_moved
    }

    /// What its status says of collecting a fact.
    fn list(&mut self, fact: u32, status: Status) {
        let (is_useless, is_at_hand) = match status {
            Status::Unused => (true, false),
            Status::Unlikely => {
                let is_held = self.written[fact as usize].is_some();
                (is_held, is_held)
            }
            Status::Current | Status::Stale | Status::Used => (false, false),
        };
        for (list, is_in) in
            [(&mut self.do_not_collect, is_useless), (&mut self.available, is_at_hand)]
        {
            if is_in {
                list.insert(fact);
            } else {
                list.remove(&fact);
            }
        }
    }

    /// A stale value is relied upon no longer.
    fn drop_value(&mut self, board: &BoardView<'_>, fact: u32) {
        self.written[fact as usize] = None;
        self.is_replaced[fact as usize] = false;
        for literal in [Literal::holds(FactId(fact)), Literal::is_absent(FactId(fact))] {
            self.sound.set_known(board, literal, false);
        }
    }

    /// Takes back what can serve a goal again, and looks through what need not be collected.
    fn bring_back(&mut self, board: &BoardView<'_>) {
        let unused: Vec<Item> = self.items.in_unused().collect();
        for item in unused {
            if self.can_serve(board, item) {
                self.take_back(item);
            }
        }
    }

    /// Puts `item` on the board, where it may be collected like any other.
    fn take_back(&mut self, item: Item) {
        self.items.return_to_board(item);
        if let Item::Fact(fact) = item {
            self.do_not_collect.remove(&fact);
            self.available.remove(&fact);
        }
    }
}
