//! Literals by cost, cheapest first.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// One entry: a literal and the cost with which it was put in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Entry {
    pub(super) cost: f64,
    pub(super) literal: u32,
}

impl Eq for Entry {}

impl Ord for Entry {
    /// The cheapest is the greatest; of equals the lowest literal, so that nothing depends on chance.
    fn cmp(&self, other: &Self) -> Ordering {
        other.cost.total_cmp(&self.cost).then(other.literal.cmp(&self.literal))
    }
}

impl PartialOrd for Entry {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// A queue in which a literal may stand several times; whoever takes it out looks whether the entry
/// still says the truth.
pub(super) type Queue = BinaryHeap<Entry>;
