//! Delta records: one changed fact each, read where they lie.

use crate::ids::{CraftId, FactId};
use crate::knowledge::{Change, Value, Version};
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// Size of a delta record without padding.
pub const DELTA_BYTES: usize = size_of::<DeltaRecord>();

/// Bytes by which a record is longer that carries its change's intended time.
pub const INTENDED_BYTES: usize = size_of::<u64>();

/// One change on the wire, in ids of the board that wrote it; the writer is the version's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct DeltaRecord {
    /// The fact, as the writer's board numbers it.
    pub fact: u32,
    /// Writes of the fact that led to the value.
    pub count: u32,
    /// The craft that wrote it.
    pub writer: u32,
    /// A [`Value`].
    pub value: u8,
    /// 1 if the write altered the value on the writer's board.
    pub is_altering: u8,
    /// Zero.
    pub reserved: [u8; 2],
}

impl From<&Change> for DeltaRecord {
    fn from(change: &Change) -> Self {
        Self {
            fact: change.fact.0,
            count: change.version.count,
            writer: change.version.writer.0,
            value: change.value as u8,
            is_altering: u8::from(change.altered),
            reserved: [0; 2],
        }
    }
}

impl DeltaRecord {
    /// The change, `None` if the value's code does not exist.
    #[must_use]
    pub fn change(&self) -> Option<Change> {
        Some(Change {
            fact: FactId(self.fact),
            value: Value::from_code(self.value)?,
            version: Version { count: self.count, writer: CraftId(self.writer) },
            altered: self.is_altering != 0,
        })
    }
}

/// Writes `changes` as records of `stride` bytes each; what a record does not fill is zeroed.
///
/// # Panics
/// If `payload` is not exactly `changes.len() * stride` bytes, or the stride is below
/// [`DELTA_BYTES`].
pub fn write_deltas(changes: &[Change], stride: usize, payload: &mut [u8]) {
    assert!(stride >= DELTA_BYTES, "invariant: a record fits its stride");
    assert_eq!(payload.len(), changes.len() * stride, "invariant: the loan has the exact length");
    for (change, slot) in changes.iter().zip(payload.chunks_exact_mut(stride)) {
        let (record, padding) = slot.split_at_mut(DELTA_BYTES);
        record.copy_from_slice(DeltaRecord::from(change).as_bytes());
        padding.fill(0);
    }
}

/// Writes into the last bytes of each record of `stride` bytes when its change was meant to be made.
/// Records that carry this are [`INTENDED_BYTES`] longer than others.
///
/// # Panics
/// If a record has no room for it.
pub fn write_intended(intended_ns: &[u64], stride: usize, payload: &mut [u8]) {
    for (intended_ns, slot) in intended_ns.iter().zip(payload.chunks_exact_mut(stride)) {
        assert!(stride >= DELTA_BYTES + INTENDED_BYTES, "invariant: a record fits its stride");
        slot[stride - INTENDED_BYTES..].copy_from_slice(&intended_ns.to_le_bytes());
    }
}

/// Reads the records of a payload in place.
#[derive(Clone, Copy, Debug)]
pub struct DeltaReader<'a> {
    payload: &'a [u8],
    stride: usize,
}

impl<'a> DeltaReader<'a> {
    /// A reader over `count` records; `None` if they do not fill the payload exactly.
    #[must_use]
    pub fn new(payload: &'a [u8], count: u16) -> Option<Self> {
        let count = usize::from(count);
        if count == 0 {
            return payload.is_empty().then_some(Self { payload, stride: DELTA_BYTES });
        }
        let stride = payload.len() / count;
        (stride >= DELTA_BYTES && stride * count == payload.len())
            .then_some(Self { payload, stride })
    }

    /// When each change was meant to be made, ns, as [`write_intended`] wrote it; `None` if records have
    /// no room for that.
    pub fn intended_ns(self) -> impl Iterator<Item = Option<u64>> + use<'a> {
        let has_room = self.stride >= DELTA_BYTES + INTENDED_BYTES;
        self.payload.chunks_exact(self.stride).map(move |slot| {
            slot.last_chunk().filter(|_| has_room).map(|last| u64::from_le_bytes(*last))
        })
    }

    /// The changes in order; `None` for a record whose value does not exist.
    pub fn changes(self) -> impl Iterator<Item = Option<Change>> + use<'a> {
        self.payload.chunks_exact(self.stride).map(|slot| {
            DeltaRecord::read_from_prefix(slot).ok().and_then(|(record, _)| record.change())
        })
    }
}
