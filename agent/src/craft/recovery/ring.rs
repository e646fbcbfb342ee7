//! What was sent, so that it can be sent again: the changes themselves, not their bytes.
//!
//! One ring a process, of a fixed number of samples. An entry that is overwritten can no longer be
//! repeated; whoever misses it is told the state instead. Buffers of entries are reused, so that the
//! steady state allocates nothing. Not here: who asks, and how often it is repeated.

use shared_types::ids::CraftId;
use shared_types::knowledge::Change;
use shared_types::limits::RING_SAMPLES;
use shared_types::transport::Numbered;
use shared_types::wire::Header;

/// Changes that an entry has room for from the start.
const CHANGES_EXPECTED: usize = 8;

/// A sample that was sent.
#[derive(Debug)]
pub(super) struct Sent {
    /// Its receiver; nobody in particular for a multicast.
    pub(super) receiver: CraftId,
    /// As it was sent, with destination and number.
    pub(super) header: Header,
    pub(super) changes: Vec<Change>,
    /// When the changes were meant to be made, where the sample carries that.
    pub(super) intended: Vec<u64>,
    /// How often it was repeated.
    pub(super) repeats: u32,
}

/// Forgotten to make room: a sample to `receiver` with this number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Forgotten {
    pub(super) receiver: CraftId,
    pub(super) number: u64,
}

/// The last samples that a process sent.
#[derive(Debug, Default)]
pub(super) struct Ring {
    entries: Vec<Sent>,
    /// Where the next one goes.
    next: usize,
    /// How many of the entries are of this epoch.
    filled: usize,
}

impl Ring {
    /// Forgets everything and keeps the memory.
    pub(super) const fn clear(&mut self) {
        self.next = 0;
        self.filled = 0;
    }

    /// Keeps a sample; says which one is forgotten for it.
    pub(super) fn keep(
        &mut self,
        receiver: CraftId,
        header: &Header,
        changes: &[Change],
        intended: &[u64],
    ) -> Option<Forgotten> {
        let mut forgotten = None;
        if self.next == self.entries.len() {
            // Room for the usual, so that an entry seldom grows when another sample takes its place.
            self.entries.push(Sent {
                receiver,
                header: *header,
                changes: Vec::with_capacity(CHANGES_EXPECTED),
                intended: Vec::with_capacity(CHANGES_EXPECTED),
                repeats: 0,
            });
        }
        let entry = &mut self.entries[self.next];
        if self.filled == RING_SAMPLES {
            let number = entry.header.sequence;
            forgotten = Some(Forgotten { receiver: entry.receiver, number });
        }
        entry.receiver = receiver;
        entry.header = *header;
        entry.changes.clear();
        entry.changes.extend_from_slice(changes);
        entry.intended.clear();
        entry.intended.extend_from_slice(intended);
        entry.repeats = 0;
        self.next = (self.next + 1) % RING_SAMPLES;
        self.filled = (self.filled + 1).min(RING_SAMPLES);
        forgotten
    }

    /// The sample that `receiver` got as number `number` of `service`, if it is still kept.
    pub(super) fn find(
        &mut self,
        receiver: CraftId,
        service: Numbered,
        number: u64,
    ) -> Option<&mut Sent> {
        let receiver = match service {
            Numbered::Unicast => receiver,
            Numbered::Multicast => CraftId::NONE,
        };
        let filled = self.filled;
        self.entries[..filled]
            .iter_mut()
            .find(|sent| sent.receiver == receiver && sent.header.sequence == number)
    }
}

#[cfg(test)]
mod tests {
    use super::{CraftId, Forgotten, Header, Numbered, RING_SAMPLES, Ring};
    use shared_types::wire::{Class, Kind};

    fn header(sequence: u64) -> Header {
        Header { sequence, ..Header::new(Class::Replication, Kind::Delta) }
    }

    #[test]
    fn what_was_sent_is_found_until_a_whole_ring_was_sent_after_it() {
        let mut ring = Ring::default();
        let (one, other) = (CraftId(1), CraftId(2));
        assert_eq!(ring.keep(one, &header(0), &[], &[]), None);
        assert!(ring.find(one, Numbered::Unicast, 0).is_some());
        assert!(ring.find(other, Numbered::Unicast, 0).is_none());
        assert!(ring.find(one, Numbered::Multicast, 0).is_none());
        for number in 1..RING_SAMPLES as u64 {
            assert_eq!(ring.keep(other, &header(number), &[], &[]), None);
        }
        let forgotten = Forgotten { receiver: one, number: 0 };
        assert_eq!(ring.keep(CraftId::NONE, &header(7), &[], &[]), Some(forgotten));
        assert!(ring.find(one, Numbered::Unicast, 0).is_none());
        assert!(ring.find(one, Numbered::Multicast, 7).is_some(), "a multicast is anybody's");
        ring.clear();
        assert!(ring.find(other, Numbered::Unicast, 5).is_none());
    }
}
