//! What processes tell each other so that losses are repaired and new lives catch up.
//!
//! A [`Receipt`] says what its sender has received of the numbered samples of its receiver, which are
//! missing, and (in its header: `sequence` for unicasts, `intended_ns` for multicasts) up to which number
//! it has sent itself. It is ack, request to repeat and announcement in one, idempotent and unnumbered.
//! Digests and states are delta records; what their headers say stands at [`super::Kind`]. Not here: when
//! any of them is sent (agent, `craft::recovery`).

use rkyv::{Archive, Deserialize, Serialize};
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// How an epoch repairs losses. Part of an [`super::EpochSpec`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Archive, Serialize, Deserialize)]
pub struct RecoverySpec {
    /// How long a process waits for an answer before it asks again, at first, ns: more than a sample
    /// takes there and back. All other times of recovery are fractions and multiples of it.
    pub patience_ns: u64,
    /// Lives that the fleet had given out when the epoch began: whoever lives one of them has been there
    /// since, and whatever it is sent in the epoch is sent to it.
    pub lives: u32,
}

impl RecoverySpec {
    /// Recovery with that patience in a fleet of first lives.
    #[must_use]
    pub const fn patient(patience_ns: u64) -> Self {
        Self { patience_ns, lives: 0 }
    }
}

/// The fixed part of a receipt; rows of [`MissingRow`] follow, as many as `record_count` says.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, FromBytes, IntoBytes, Immutable, KnownLayout,
)]
#[repr(C)]
pub struct Receipt {
    /// The life of the receiver whose samples the numbers below are about.
    pub life: u32,
    /// 1 if a receipt is wanted in return.
    pub asks: u32,
    /// Next unicast that is expected.
    pub unicast_next: u64,
    /// Next multicast that is expected.
    pub multicast_next: u64,
    /// Own unicasts to the receiver below this number cannot be repeated any more.
    pub unicast_kept_from: u64,
    /// Own multicasts below this number cannot be repeated any more.
    pub multicast_kept_from: u64,
}

/// Numbers `first..end` that are missing.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, FromBytes, IntoBytes, Immutable, KnownLayout,
)]
#[repr(C)]
pub struct MissingRow {
    /// 1 for multicasts, 0 for unicasts.
    pub is_multicast: u64,
    /// The first.
    pub first: u64,
    /// One past the last.
    pub end: u64,
}

/// Orchestrator to all: a process is gone, or lives again. Payload of [`super::Kind::Membership`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct MembershipChange {
    /// The process; the centre is craft N.
    pub craft: u32,
    /// The life that has ended or begun.
    pub incarnation: u32,
    /// 1 if it lives from now on, 0 if it is gone.
    pub is_up: u32,
    /// Zero.
    pub reserved: u32,
}

/// Writes a receipt and its rows.
///
/// # Panics
/// If `payload` has not exactly [`receipt_bytes`].
pub fn write_receipt(receipt: &Receipt, rows: &[MissingRow], payload: &mut [u8]) {
    assert_eq!(
        payload.len(),
        receipt_bytes(rows.len()),
        "invariant: the loan has the exact length"
    );
    let (fixed, rest) = payload.split_at_mut(size_of::<Receipt>());
    fixed.copy_from_slice(receipt.as_bytes());
    rest.copy_from_slice(rows.as_bytes());
}

/// Bytes of a receipt with `rows` rows.
#[must_use]
pub const fn receipt_bytes(rows: usize) -> usize {
    size_of::<Receipt>() + rows * size_of::<MissingRow>()
}

/// The receipt in `payload` and its `rows` rows; `None` if they do not fill it exactly.
pub fn read_receipt(
    payload: &[u8],
    rows: u16,
) -> Option<(Receipt, impl Iterator<Item = MissingRow> + use<'_>)> {
    let (receipt, rest) = Receipt::read_from_prefix(payload).ok()?;
    let is_filled = rest.len() == usize::from(rows) * size_of::<MissingRow>();
    let rows = rest.chunks_exact(size_of::<MissingRow>());
    is_filled.then(|| (receipt, rows.filter_map(|row| MissingRow::read_from_bytes(row).ok())))
}

#[cfg(test)]
mod tests {
    use super::{MissingRow, Receipt, read_receipt, receipt_bytes, write_receipt};

    #[test]
    fn a_receipt_reads_as_it_was_written_and_a_short_one_is_refused() {
        let receipt = Receipt { life: 2, asks: 1, unicast_next: 7, ..Receipt::default() };
        let rows = [MissingRow { is_multicast: 1, first: 3, end: 5 }];
        let mut payload = vec![0; receipt_bytes(1)];
        write_receipt(&receipt, &rows, &mut payload);
        let (read, read_rows) = read_receipt(&payload, 1).expect("it is whole");
        assert_eq!((read, read_rows.collect::<Vec<_>>()), (receipt, rows.to_vec()));
        assert!(read_receipt(&payload, 2).is_none() && read_receipt(&payload, 0).is_none());
        assert!(read_receipt(&payload[1..], 1).is_none());
    }
}
