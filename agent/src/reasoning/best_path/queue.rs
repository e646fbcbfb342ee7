//! Literals by cost, cheapest first: a heap for any order, and a queue for costs that never fall.

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

/// A heap in which a literal may stand several times; whoever takes it out looks whether the entry
/// still says the truth.
pub(super) type Heap = BinaryHeap<Entry>;

/// Buckets: one for costs that equal the last one taken, one for each bit in which others differ first.
const BUCKETS: usize = 65;

/// A queue into which nothing is put that costs less than what was taken out last (the radix heap of Ahuja,
/// Mehlhorn, Orlin and Tarjan 1990, on the bits of the costs). An entry moves at most once a bit and lies
/// beside others meanwhile, so that large queues do not wait for memory. Of equals the last one put in
/// comes first.
#[derive(Clone, Debug)]
pub(super) struct RisingQueue {
    /// Bits of the cost that was taken out last.
    last: u64,
    buckets: [Vec<Entry>; BUCKETS],
}

impl Default for RisingQueue {
    fn default() -> Self {
        Self { last: 0, buckets: [const { Vec::new() }; BUCKETS] }
    }
}

impl RisingQueue {
    /// Empties it; any cost may come again.
    pub(super) fn clear(&mut self) {
        self.last = 0;
        self.buckets.iter_mut().for_each(Vec::clear);
    }

    /// Puts `entry` in, which costs no less than what was taken out last.
    #[inline]
    pub(super) fn push(&mut self, entry: Entry) {
        let difference = entry.cost.to_bits() ^ self.last;
        debug_assert!(entry.cost.to_bits() >= self.last, "costs never fall");
        self.buckets[(u64::BITS - difference.leading_zeros()) as usize].push(entry);
    }

    /// Takes out the cheapest.
    #[inline]
    pub(super) fn pop(&mut self) -> Option<Entry> {
        if self.buckets[0].is_empty() {
            self.refill()?;
        }
        self.buckets[0].pop()
    }

    /// Spreads the first bucket that holds something over those before it.
    fn refill(&mut self) -> Option<()> {
        let first = self.buckets.iter().position(|bucket| !bucket.is_empty())?;
        let mut entries = std::mem::take(&mut self.buckets[first]);
        self.last = entries.iter().map(|entry| entry.cost.to_bits()).min()?;
        entries.drain(..).for_each(|entry| self.push(entry));
        // Its memory is used again.
        self.buckets[first] = entries;
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::{Entry, Heap, RisingQueue};
    use shared_types::rng::{Purpose, Stream};

    #[test]
    fn the_queue_gives_what_the_heap_gives() {
        let mut stream = Stream::new(1, 0, Purpose::Test, 4);
        let (mut queue, mut heap) = (RisingQueue::default(), Heap::new());
        for round in 0..100 {
            queue.clear();
            heap.clear();
            let mut floor = 0.0;
            for literal in 0..500 {
                // Whole costs, fractions, and the same ones again and again.
                let more = f64::from(stream.below(40)) / f64::from(1 + round % 3);
                let entry = Entry { cost: floor + more, literal };
                queue.push(entry);
                heap.push(entry);
                if stream.below(3) == 0 {
                    floor = queue.pop().map_or(floor, |entry| entry.cost);
                    assert_eq!(heap.pop().map(|entry| entry.cost), Some(floor));
                }
            }
            while let Some(entry) = queue.pop() {
                assert_eq!(heap.pop().map(|other| other.cost), Some(entry.cost));
            }
            assert!(heap.is_empty());
        }
    }
}
