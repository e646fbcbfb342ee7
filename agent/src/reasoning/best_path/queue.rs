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
    /// The cheapest is the greatest; of equals the lowest literal, so that nothing depends on chance. No cost
    /// is below zero, so costs are in the order of their bits.
    fn cmp(&self, other: &Self) -> Ordering {
        (other.cost.to_bits(), other.literal).cmp(&(self.cost.to_bits(), self.literal))
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
