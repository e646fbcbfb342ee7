//! Damage: a valid input with a few edits, as bit rot, a torn write or an adversary leave it.

use proptest::prelude::{Strategy, any};
use proptest::sample::{Index, select};

/// Numbers at whose edges readers stumble.
const EDGES: [u64; 8] = [0, 1, 0x7f, 0xff, 0x7fff_ffff, 0xffff_ffff, u64::MAX / 2 + 1, u64::MAX];

/// Words that texts are made of, and some that they are not.
const WORDS: [&str; 14] = [
    "18446744073709551615",
    "4294967295",
    "-1",
    "1e308",
    "1e-320",
    "nan",
    "null",
    "\"",
    "\n",
    ",",
    "[]",
    "{}",
    "\u{0}",
    "\u{1F680}",
];

/// One change of some bytes.
#[derive(Clone, Debug)]
enum Edit {
    /// One bit is turned round.
    Flip(Index, u8),
    /// Some bytes become an edge, as many as it takes.
    Number(Index, u64, usize),
    /// Bytes appear.
    Insert(Index, Vec<u8>),
    /// Bytes vanish.
    Remove(Index, usize),
    /// Bytes stand there twice.
    Repeat(Index, usize),
    /// The rest is lost.
    Cut(Index),
    /// The rest is there and holds nothing, as after a power cut.
    Blank(Index),
}

impl Edit {
    fn apply(&self, bytes: &mut Vec<u8>) {
        let at = |place: &Index, bytes: &[u8]| place.index(bytes.len() + 1);
        match self {
            Self::Flip(place, bit) => {
                let at = at(place, bytes);
                bytes.iter_mut().skip(at).take(1).for_each(|byte| *byte ^= 1 << (bit % 8));
            }
            Self::Number(place, number, width) => {
                let at = at(place, bytes);
                let number = number.to_le_bytes();
                let places = bytes.iter_mut().skip(at).take(*width);
                places.zip(number).for_each(|(byte, new)| *byte = new);
            }
            Self::Insert(place, new) => {
                let at = at(place, bytes);
                bytes.splice(at..at, new.iter().copied());
            }
            Self::Remove(place, length) => {
                let at = at(place, bytes);
                bytes.drain(at..(at + length).min(bytes.len()));
            }
            Self::Repeat(place, length) => {
                let at = at(place, bytes);
                let again = bytes[at..(at + length).min(bytes.len())].to_vec();
                bytes.splice(at..at, again);
            }
            Self::Cut(place) => bytes.truncate(at(place, bytes)),
            Self::Blank(place) => {
                let at = at(place, bytes);
                bytes[at..].fill(0);
            }
        }
    }
}

fn edit() -> impl Strategy<Value = Edit> {
    let place = any::<Index>;
    let word = select(&WORDS[..]).prop_map(|word| word.as_bytes().to_vec());
    let some = proptest::collection::vec(any::<u8>(), 1..12);
    proptest::prop_oneof![
        4 => (place(), any::<u8>()).prop_map(|(place, bit)| Edit::Flip(place, bit)),
        4 => (place(), select(&EDGES[..]), select(&[1_usize, 2, 4, 8][..]))
            .prop_map(|(place, number, width)| Edit::Number(place, number, width)),
        2 => (place(), word).prop_map(|(place, word)| Edit::Insert(place, word)),
        1 => (place(), some).prop_map(|(place, some)| Edit::Insert(place, some)),
        2 => (place(), 1_usize..40).prop_map(|(place, length)| Edit::Remove(place, length)),
        2 => (place(), 1_usize..40).prop_map(|(place, length)| Edit::Repeat(place, length)),
        1 => place().prop_map(Edit::Cut),
        1 => place().prop_map(Edit::Blank),
    ]
}

/// One of `seeds` after a few edits, or none.
pub(crate) fn damaged(seeds: Vec<Vec<u8>>) -> impl Strategy<Value = Vec<u8>> {
    (select(seeds), proptest::collection::vec(edit(), 0..5)).prop_map(|(mut bytes, edits)| {
        edits.iter().for_each(|edit| edit.apply(&mut bytes));
        bytes
    })
}
