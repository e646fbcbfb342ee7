//! Samples that a link holds up on their way to one real process: copied out of shared memory, until they
//! are due.
//!
//! A bounded queue by due time, then by order of coming. Copies lie in buffers that are used again, so that
//! the steady state does not allocate. Not here: who is held up, and for how long ([`super::incoming`]).

use super::intake::Through;
use crate::limits::HELD_SAMPLES_MAX;
use crate::time::Nanos;
use crate::wire::Header;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// The samples that are held up.
#[derive(Debug, Default)]
pub(super) struct Held {
    /// When it is due, its number and where it lies.
    queue: BinaryHeap<Reverse<(Nanos, u64, usize)>>,
    copies: Vec<Copied>,
    free: Vec<usize>,
    taken: u64,
}

/// A sample outside shared memory.
#[derive(Debug)]
pub(super) struct Copied {
    pub(super) through: Through,
    pub(super) header: Header,
    pub(super) payload: Vec<u8>,
}

impl Held {
    /// Keeps a sample until `due`; `false` if there is no room, and it is lost.
    pub(super) fn keep(
        &mut self,
        due: Nanos,
        through: Through,
        header: &Header,
        payload: &[u8],
    ) -> bool {
        if self.queue.len() >= HELD_SAMPLES_MAX {
            return false;
        }
        let place = self.free.pop().unwrap_or_else(|| {
            self.copies.push(Copied { through, header: *header, payload: Vec::new() });
            self.copies.len() - 1
        });
        let copy = &mut self.copies[place];
        (copy.through, copy.header) = (through, *header);
        copy.payload.clear();
        copy.payload.extend_from_slice(payload);
        self.taken += 1;
        self.queue.push(Reverse((due, self.taken, place)));
        true
    }

    /// When the next one is due.
    pub(super) fn next_due(&self) -> Option<Nanos> {
        self.queue.peek().map(|Reverse((due, ..))| *due)
    }

    /// The next one that is due at `now`, with its number; its place is free for others from then on.
    pub(super) fn release(&mut self, now: Nanos) -> Option<(u64, &Copied)> {
        if self.next_due()? > now {
            return None;
        }
        let Reverse((_, number, place)) = self.queue.pop()?;
        self.free.push(place);
        Some((number, &self.copies[place]))
    }

    /// Whether nothing is held up.
    pub(super) fn is_empty(&self) -> bool {
        self.queue.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::{HELD_SAMPLES_MAX, Held, Nanos, Through};
    use crate::wire::{Class, Header, Kind};

    fn keep(held: &mut Held, due_ns: u64, sequence: u64) -> bool {
        let header = Header { sequence, ..Header::new(Class::Replication, Kind::Delta) };
        let payload = vec![u8::try_from(sequence % 256).unwrap(); 8];
        held.keep(Nanos(due_ns), Through::Inbox, &header, &payload)
    }

    fn released(held: &mut Held, now_ns: u64) -> Vec<u64> {
        let mut all = Vec::new();
        while let Some((_, copy)) = held.release(Nanos(now_ns)) {
            assert_eq!(u64::from(copy.payload[0]), copy.header.sequence % 256);
            all.push(copy.header.sequence);
        }
        all
    }

    #[test]
    fn samples_come_when_they_are_due_and_in_the_order_of_coming_at_one_time() {
        let mut held = Held::default();
        for (due_ns, sequence) in [(30, 0), (10, 1), (20, 2), (10, 3)] {
            assert!(keep(&mut held, due_ns, sequence));
        }
        assert_eq!(held.next_due(), Some(Nanos(10)));
        assert!(released(&mut held, 9).is_empty());
        assert_eq!(released(&mut held, 20), [1, 3, 2]);
        assert_eq!((held.next_due(), held.is_empty()), (Some(Nanos(30)), false));
        assert_eq!(released(&mut held, 30), [0]);
        assert_eq!((held.next_due(), held.is_empty()), (None, true));
    }

    #[test]
    fn a_full_queue_takes_nothing_and_buffers_are_used_again() {
        let mut held = Held::default();
        for round in 0..3 {
            for sequence in 0..HELD_SAMPLES_MAX as u64 {
                assert!(keep(&mut held, round, sequence));
            }
            assert!(!keep(&mut held, round, 0));
            assert_eq!(released(&mut held, round).len(), HELD_SAMPLES_MAX);
        }
        assert_eq!(held.copies.len(), HELD_SAMPLES_MAX);
    }
}
