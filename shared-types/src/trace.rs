//! What a craft is to write and read at which time: its part of a trace of open mode.
//!
//! A record has a fixed size and is read where it lies. A trace depends on no state, so every strategy
//! is offered the same events. Not here: where traces come from (orchestrator, `workload`), and what a
//! craft does with one.

use crate::ids::FactId;
use crate::knowledge::Value;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// One write or read of one craft.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, FromBytes, IntoBytes, Immutable, KnownLayout,
)]
#[repr(C)]
pub struct TraceRecord {
    /// When it is due, ns from the start of the trial.
    pub at_ns: u64,
    /// The fact, as the craft's board numbers it.
    pub fact: u32,
    /// 0 for a read, else the [`Value`] to write.
    code: u32,
}

/// A craft's records as words, two a record: the form in which they travel in an archive.
#[must_use]
pub fn to_words(records: &[TraceRecord]) -> Vec<u64> {
    let words = |record: &TraceRecord| -> [u64; 2] { zerocopy::transmute!(*record) };
    records.iter().flat_map(words).collect()
}

/// The records that `words` are, read in place.
///
/// # Panics
/// If there is half a record: whoever checks an archive looks at this.
#[must_use]
pub fn from_words(words: &[u64]) -> &[TraceRecord] {
    <[TraceRecord]>::ref_from_bytes(words.as_bytes())
        .expect("invariant: two words have size and alignment of a record")
}

impl TraceRecord {
    /// `fact` is read at `at_ns`.
    #[must_use]
    pub const fn read(at_ns: u64, fact: FactId) -> Self {
        Self { at_ns, fact: fact.0, code: Value::Unknown as u32 }
    }

    /// `fact` is asserted or, if not `holds`, de-asserted at `at_ns`.
    #[must_use]
    pub const fn write(at_ns: u64, fact: FactId, holds: bool) -> Self {
        let value = if holds { Value::Asserted } else { Value::Absent };
        Self { at_ns, fact: fact.0, code: value as u32 }
    }

    /// The fact, as the craft's board numbers it.
    #[must_use]
    pub const fn fact(&self) -> FactId {
        FactId(self.fact)
    }

    /// What is written: whether the fact holds from then on; `None` for a read.
    #[must_use]
    pub const fn holds(&self) -> Option<bool> {
        match self.code {
            0 => None,
            code => Some(code == Value::Asserted as u32),
        }
    }
}
