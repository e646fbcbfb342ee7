//! What a receiver knows of its senders' numbering: nothing is handed over twice, nothing is missed
//! in silence.
//!
//! Per source the table holds the source's incarnation and the next number expected. A number ahead
//! of it opens a hole; a later arrival fills the hole, as the repair of a multicast does that overtook
//! or followed the multicasts around it; a number that is in no hole is a repeat. What is still
//! missing when the losses are taken is a gap. One table serves one service. Not here: which service
//! a sample belongs to (`intake`), and asking again for what is missing (agent, `craft::recovery`),
//! which looks at the holes, opens one behind the last arrival where a source says that it sent more,
//! and closes those whose contents a state has replaced.

use crate::limits::HOLES_MAX;
use std::ops::Range;

/// What a number says about its sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arrival {
    /// Seen for the first time.
    New,
    /// Seen before: not to be handed over again.
    Repeat,
    /// Of an earlier life of its source.
    OldIncarnation,
}

/// Sources are few per receiver (all of them only where everybody talks to everybody), so the table
/// is one sorted array.
#[derive(Debug, Default)]
pub struct Sequences {
    sources: Vec<Source>,
    holes: Vec<Hole>,
    gaps: u64,
    /// Whether numbers ran before this table was made: those below the first that is heard of a source
    /// were never meant for whoever keeps it.
    joins_late: bool,
}

#[derive(Debug)]
struct Source {
    id: u32,
    incarnation: u32,
    next: u64,
}

/// Numbers `first..end` of a source that have not arrived.
#[derive(Debug)]
struct Hole {
    source: u32,
    first: u64,
    end: u64,
    is_counted: bool,
}

impl Hole {
    fn missing(&self) -> u64 {
        if self.is_counted { 0 } else { self.end - self.first }
    }
}

impl Sequences {
    /// The table of a receiver that comes back while its sources number on.
    #[must_use]
    pub fn joining_late() -> Self {
        Self { joins_late: true, ..Self::default() }
    }

    /// Takes note of sample `sequence` of `source` in its life `incarnation`. The largest number is
    /// nobody's, for it has no successor: it is taken for a repeat.
    #[inline]
    pub fn arrive(&mut self, source: u32, incarnation: u32, sequence: u64) -> Arrival {
        let Some(next) = sequence.checked_add(1) else { return Arrival::Repeat };
        let first = if self.joins_late { sequence } else { 0 };
        let index = self.source_from(source, incarnation, first);
        let known = &mut self.sources[index];
        if incarnation < known.incarnation {
            return Arrival::OldIncarnation;
        }
        if incarnation == known.incarnation && sequence == known.next {
            known.next = next;
            return Arrival::New;
        }
        self.arrive_out_of_order(index, incarnation, sequence)
    }

    /// Numbers found missing since the last call. They stay open: a late arrival is still new.
    pub fn take_gaps(&mut self) -> u64 {
        for hole in &mut self.holes {
            self.gaps = self.gaps.saturating_add(hole.missing());
            hole.is_counted = true;
        }
        std::mem::take(&mut self.gaps)
    }

    /// Whether anything is missing.
    #[inline]
    #[must_use]
    pub const fn has_missing(&self) -> bool {
        !self.holes.is_empty()
    }

    /// Who owes something, once per range of numbers.
    pub fn debtors(&self) -> impl Iterator<Item = u32> + use<'_> {
        self.holes.iter().map(|hole| hole.source)
    }

    /// The ranges that are missing of `source`.
    pub fn missing(&self, source: u32) -> impl Iterator<Item = Range<u64>> + use<'_> {
        let of_source = self.holes.iter().filter(move |hole| hole.source == source);
        of_source.map(|hole| hole.first..hole.end)
    }

    /// The number that is expected next of `source`.
    #[must_use]
    pub fn next(&self, source: u32) -> u64 {
        let index = self.sources.binary_search_by_key(&source, |known| known.id);
        index.map_or(0, |index| self.sources[index].next)
    }

    /// Takes note that `source` lives its life `incarnation`; `false` if that is over.
    pub fn meet(&mut self, source: u32, incarnation: u32) -> bool {
        let index = self.source(source, incarnation);
        let known = &mut self.sources[index];
        if incarnation > known.incarnation {
            *known = Source { id: source, incarnation, next: 0 };
            self.forget_holes(source);
        }
        incarnation >= self.sources[index].incarnation
    }

    /// `source` says that it has sent everything below `end`: what has not arrived is missing.
    pub fn announce(&mut self, source: u32, incarnation: u32, end: u64) {
        if !self.meet(source, incarnation) {
            return;
        }
        let index = self.source(source, incarnation);
        let first = self.sources[index].next;
        if first < end {
            self.sources[index].next = end;
            self.open(Hole { source, first, end, is_counted: false });
        }
    }

    /// Everything that `source` sent below `end` is known otherwise: nothing of it is missing. Returns
    /// how many numbers were.
    pub fn cover(&mut self, source: u32, incarnation: u32, end: u64) -> u64 {
        if !self.meet(source, incarnation) {
            return 0;
        }
        let index = self.source(source, incarnation);
        self.sources[index].next = self.sources[index].next.max(end);
        self.close_below(source, end)
    }

    /// What is missing of `source` below `end` will not come: a gap. Returns how many numbers.
    pub fn give_up(&mut self, source: u32, end: u64) -> u64 {
        let holes = self.holes.iter().filter(|hole| hole.source == source && hole.first < end);
        let uncounted: u64 =
            holes.filter(|hole| !hole.is_counted).map(|hole| hole.end.min(end) - hole.first).sum();
        self.gaps = self.gaps.saturating_add(uncounted);
        self.close_below(source, end)
    }

    fn close_below(&mut self, source: u32, end: u64) -> u64 {
        let mut closed = 0;
        self.holes.retain_mut(|hole| {
            if hole.source != source || hole.first >= end {
                return true;
            }
            let until = hole.end.min(end);
            closed += until - hole.first;
            hole.first = until;
            hole.first < hole.end
        });
        closed
    }

    /// Where `source` stands in the table.
    fn source(&mut self, source: u32, incarnation: u32) -> usize {
        self.source_from(source, incarnation, 0)
    }

    /// The same; of one that is new, numbers from `first` on are expected.
    fn source_from(&mut self, source: u32, incarnation: u32, first: u64) -> usize {
        match self.sources.binary_search_by_key(&source, |known| known.id) {
            Ok(index) => index,
            Err(index) => {
                self.sources.insert(index, Source { id: source, incarnation, next: first });
                index
            }
        }
    }

    #[cold]
    fn arrive_out_of_order(&mut self, index: usize, incarnation: u32, sequence: u64) -> Arrival {
        let known = &mut self.sources[index];
        let source = known.id;
        if incarnation > known.incarnation {
            *known = Source { id: source, incarnation, next: 0 };
            self.forget_holes(source);
        }
        let known = &mut self.sources[index];
        if sequence < known.next {
            return self.fill(source, sequence);
        }
        let first = known.next;
        known.next = sequence + 1;
        if first < sequence {
            self.open(Hole { source, first, end: sequence, is_counted: false });
        }
        Arrival::New
    }

    /// A new life starts over; what the old one still owed is a gap.
    fn forget_holes(&mut self, source: u32) {
        let gaps = &mut self.gaps;
        self.holes.retain(|hole| {
            let stays = hole.source != source;
            if !stays {
                *gaps = gaps.saturating_add(hole.missing());
            }
            stays
        });
    }

    fn open(&mut self, hole: Hole) {
        if self.holes.len() == HOLES_MAX {
            let oldest = self.holes.remove(0);
            self.gaps = self.gaps.saturating_add(oldest.missing());
        }
        self.holes.push(hole);
    }

    fn fill(&mut self, source: u32, sequence: u64) -> Arrival {
        let holds =
            |hole: &Hole| hole.source == source && (hole.first..hole.end).contains(&sequence);
        let Some(index) = self.holes.iter().position(holds) else { return Arrival::Repeat };
        let hole = &mut self.holes[index];
        let (end, is_counted) = (hole.end, hole.is_counted);
        if sequence == hole.first {
            hole.first += 1;
        } else {
            hole.end = sequence;
            if sequence + 1 < end {
                self.open(Hole { source, first: sequence + 1, end, is_counted });
            }
            return Arrival::New;
        }
        if hole.first == hole.end {
            self.holes.remove(index);
        }
        Arrival::New
    }
}

#[cfg(test)]
mod tests {
    use super::{Arrival, Sequences};
    use proptest::prelude::{Just, Strategy, proptest};

    #[test]
    fn numbers_in_order_are_new_and_leave_no_gap() {
        let mut sequences = Sequences::default();
        for sequence in 0..5 {
            assert_eq!(sequences.arrive(9, 0, sequence), Arrival::New);
            assert_eq!(sequences.arrive(2, 0, sequence), Arrival::New);
        }
        assert_eq!(sequences.take_gaps(), 0);
    }

    #[test]
    fn a_gap_is_counted_once_and_a_late_sample_is_still_new() {
        let mut sequences = Sequences::default();
        assert_eq!(sequences.arrive(1, 0, 4), Arrival::New);
        assert_eq!(sequences.arrive(1, 0, 2), Arrival::New);
        assert_eq!(sequences.take_gaps(), 3);
        assert_eq!(sequences.arrive(1, 0, 3), Arrival::New);
        assert_eq!(sequences.arrive(1, 0, 3), Arrival::Repeat);
        assert_eq!(sequences.take_gaps(), 0);
    }

    #[test]
    fn a_new_life_starts_at_zero_and_the_old_one_is_refused() {
        let mut sequences = Sequences::default();
        assert_eq!(sequences.arrive(1, 0, 0), Arrival::New);
        assert_eq!(sequences.arrive(1, 0, 2), Arrival::New);
        assert_eq!(sequences.arrive(1, 1, 0), Arrival::New);
        assert_eq!(sequences.arrive(1, 0, 3), Arrival::OldIncarnation);
        assert_eq!(sequences.arrive(1, 1, 1), Arrival::New);
        assert_eq!(sequences.take_gaps(), 1, "what the old life still owed");
    }

    #[test]
    fn what_is_announced_and_did_not_come_is_missing_until_it_comes_or_is_covered() {
        let mut sequences = Sequences::default();
        assert_eq!(sequences.arrive(1, 0, 0), Arrival::New);
        sequences.announce(1, 0, 4);
        sequences.announce(1, 0, 2);
        assert!(sequences.missing(1).eq(std::iter::once(1..4)));
        assert_eq!(sequences.arrive(1, 0, 2), Arrival::New);
        assert_eq!(sequences.cover(1, 0, 3), 1, "number 1 is known otherwise");
        assert!(sequences.missing(1).eq(std::iter::once(3..4)));
        assert_eq!((sequences.next(1), sequences.next(2)), (4, 0));
        assert_eq!(sequences.give_up(1, 4), 1);
        assert!(!sequences.has_missing());
        assert_eq!(sequences.take_gaps(), 1, "only what was given up");
        assert_eq!(sequences.arrive(1, 0, 3), Arrival::Repeat, "it is known to be lost");
        assert!(sequences.meet(1, 2) && !sequences.meet(1, 1));
        assert_eq!(sequences.next(1), 0, "a new life counts from the start");
    }

    #[test]
    fn who_joins_late_misses_nothing_of_what_was_before() {
        let mut sequences = Sequences::joining_late();
        assert_eq!(sequences.arrive(1, 0, 40), Arrival::New);
        assert_eq!(sequences.arrive(1, 0, 42), Arrival::New);
        assert_eq!(sequences.take_gaps(), 1, "the one after the first");
        assert_eq!(sequences.arrive(1, 1, 0), Arrival::New);
        assert_eq!(sequences.arrive(1, 1, 2), Arrival::New);
        assert_eq!(sequences.take_gaps(), 1, "a new life of the source starts at zero");
    }

    proptest! {
        #[test]
        fn any_order_with_any_repeats_is_new_exactly_once(
            order in Just((0_u64..40).chain(10..30).collect::<Vec<_>>()).prop_shuffle()
        ) {
            let mut sequences = Sequences::default();
            let new = order
                .iter()
                .filter(|&&sequence| sequences.arrive(3, 0, sequence) == Arrival::New)
                .count();
            assert_eq!(new, 40);
            assert_eq!(sequences.take_gaps(), 0);
        }
    }
}
