//! Every item of a board: where it is, and when it was looked at last.

use shared_types::knowledge::BoardView;
use shared_types::time::Nanos;
use std::collections::{BTreeSet, VecDeque};

/// A fact, a rule or an action.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Item {
    /// By its id.
    Fact(u32),
    /// By its id.
    Rule(u32),
    /// By its id.
    Action(u32),
}

/// Where an item is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// On the board.
    Board,
    /// In the stale archive, kept for a while.
    Stale {
        /// Since when.
        since: Nanos,
    },
    /// In the unused archive.
    Unused,
    /// In the ancillary store: at hand, and kept as long as there is room.
    Ancillary,
}

/// All items, facts first, then rules, then actions.
#[derive(Clone, Debug)]
pub struct Items {
    facts: usize,
    rules: usize,
    places: Vec<Place>,
    stamped: Vec<Option<Nanos>>,
    unused: BTreeSet<usize>,
    /// In the order in which they came; an item that left stands there until its turn.
    ancillary: VecDeque<usize>,
    ancillary_count: usize,
    stale: VecDeque<(Nanos, usize)>,
    /// Stale values whose time in the archive is over.
    forgotten: u64,
}

impl Items {
    /// Those of `board`, all on it.
    #[must_use]
    pub fn of(board: &BoardView<'_>) -> Self {
        let (facts, rules) = (board.fact_count as usize, board.premises.row_count());
        let count = facts + rules + board.action_outputs.row_count();
        Self {
            facts,
            rules,
            places: vec![Place::Board; count],
            stamped: vec![None; count],
            unused: BTreeSet::new(),
            ancillary: VecDeque::new(),
            ancillary_count: 0,
            stale: VecDeque::new(),
            forgotten: 0,
        }
    }

    /// How many there are.
    #[must_use]
    pub const fn count(&self) -> usize {
        self.places.len()
    }

    /// Stale values that were kept for their time and are forgotten.
    #[must_use]
    pub const fn forgotten(&self) -> u64 {
        self.forgotten
    }

    /// Where `item` is.
    #[must_use]
    pub fn place(&self, item: Item) -> Place {
        self.places[self.index(item)]
    }

    pub(super) const fn index(&self, item: Item) -> usize {
        match item {
            Item::Fact(fact) => fact as usize,
            Item::Rule(rule) => self.facts + rule as usize,
            Item::Action(action) => self.facts + self.rules + action as usize,
        }
    }

    #[expect(clippy::cast_possible_truncation, reason = "tables stay below 2^32 rows")]
    pub(super) const fn item(&self, index: usize) -> Item {
        if index < self.facts {
            Item::Fact(index as u32)
        } else if index < self.facts + self.rules {
            Item::Rule((index - self.facts) as u32)
        } else {
            Item::Action((index - self.facts - self.rules) as u32)
        }
    }

    pub(super) fn is_fresh(&self, item: Item, now: Nanos, period_ns: u64) -> bool {
        let stamped = self.stamped[self.index(item)];
        stamped.is_some_and(|stamped| now.since(stamped) < period_ns)
    }

    pub(super) fn stamp(&mut self, item: Item, now: Nanos) {
        let at = self.index(item);
        self.stamped[at] = Some(now);
    }

    /// Puts `item` into `place`; returns whether it was elsewhere.
    pub(super) fn put(&mut self, item: Item, place: Place) -> bool {
        let at = self.index(item);
        let before = std::mem::replace(&mut self.places[at], place);
        if std::mem::discriminant(&before) == std::mem::discriminant(&place) {
            self.places[at] = before;
            return false;
        }
        match before {
            Place::Unused => {
                self.unused.remove(&at);
            }
            Place::Ancillary => {
                self.ancillary.retain(|&one| one != at);
                self.ancillary_count -= 1;
            }
            Place::Board | Place::Stale { .. } => {}
        }
        match place {
            Place::Unused => {
                self.unused.insert(at);
            }
            Place::Ancillary => {
                self.ancillary.push_back(at);
                self.ancillary_count += 1;
            }
            Place::Stale { since } => self.stale.push_back((since, at)),
            Place::Board => {}
        }
        true
    }

    /// Puts `item` back and lets it be looked at again soon.
    pub(super) fn return_to_board(&mut self, item: Item) {
        if self.put(item, Place::Board) {
            let at = self.index(item);
            self.stamped[at] = None;
        }
    }

    pub(super) fn in_unused(&self) -> impl Iterator<Item = Item> {
        self.unused.iter().map(|&at| self.item(at))
    }

    /// The oldest of the ancillary store if it holds more than `most`; it is then in the unused archive.
    pub(super) fn overflow(&mut self, most: usize) -> Option<Item> {
        if self.ancillary_count <= most {
            return None;
        }
        let oldest = self.item(*self.ancillary.front()?);
        self.put(oldest, Place::Unused);
        Some(oldest)
    }

    /// Forgets stale values that were kept for `kept_ns`; their items are on the board again, empty.
    pub(super) fn forget_stale(&mut self, now: Nanos, kept_ns: u64) {
        while let Some(&(since, at)) = self.stale.front() {
            if now.since(since) < kept_ns {
                return;
            }
            self.stale.pop_front();
            if self.places[at] == (Place::Stale { since }) {
                self.places[at] = Place::Board;
                self.forgotten += 1;
            }
        }
    }
}
