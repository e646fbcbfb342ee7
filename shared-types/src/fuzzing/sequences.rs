//! Numbering: records of four bytes (source, incarnation, number, which end of the numbers).

use crate::limits::HOLES_MAX;
use crate::transport::sequence::{Arrival, Sequences};
use std::collections::{BTreeMap, BTreeSet};

/// A number is new once in a life, whatever came before it; an earlier life is refused. While no hole
/// had to be forgotten, every number that was not seen is new; but the largest is nobody's.
pub(super) fn arrive(bytes: &[u8]) {
    let mut sequences = Sequences::default();
    let mut lives: BTreeMap<u32, (u32, BTreeSet<u64>)> = BTreeMap::new();
    for (place, record) in bytes.chunks_exact(4).enumerate() {
        let (source, incarnation) = (u32::from(record[0] % 3), u32::from(record[1] % 4));
        let number = u64::from(record[2]);
        let sequence = if record[3] % 8 == 7 { u64::MAX - number } else { number };
        if sequence == u64::MAX {
            assert_eq!(sequences.arrive(source, incarnation, sequence), Arrival::Repeat);
            continue;
        }
        let (life, seen) = lives.entry(source).or_insert_with(|| (incarnation, BTreeSet::new()));
        let meant = if incarnation < *life {
            Arrival::OldIncarnation
        } else {
            if incarnation > *life {
                (*life, *seen) = (incarnation, BTreeSet::new());
            }
            if seen.insert(sequence) { Arrival::New } else { Arrival::Repeat }
        };
        let arrival = sequences.arrive(source, incarnation, sequence);
        let may_be_forgotten = place >= HOLES_MAX && arrival == Arrival::Repeat;
        assert!(
            arrival == meant || may_be_forgotten,
            "{sequence} of {source} in life {incarnation}: {arrival:?} instead of {meant:?}"
        );
        if record[3] == 6 {
            let _gaps = sequences.take_gaps();
        }
    }
}

/// In order, out of order, with a new life and the largest numbers.
pub(super) fn seeds() -> Vec<Vec<u8>> {
    let in_order: Vec<u8> = (0..20).flat_map(|number| [number % 3, 0, number / 3, 0]).collect();
    let out_of_order: Vec<u8> = (0..20).rev().flat_map(|number| [1, 0, number * 2, 0]).collect();
    let lives: Vec<u8> = (0..12).flat_map(|number| [0, number / 4, number % 4, 6]).collect();
    vec![in_order, out_of_order, lives, [[0, 0, 3, 7], [0, 0, 1, 7], [0, 0, 1, 7]].concat()]
}
