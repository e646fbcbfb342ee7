//! Records of fixed size: changes, the orchestrator's commands, the crafts' lines and tallies.

use crate::ids::{CraftId, FactId};
use crate::knowledge::{Change, Value, Version};
use crate::wire::{
    DELTA_BYTES, DeltaReader, INTENDED_BYTES, MembershipChange, MissingRow, Receipt, TallyReport,
    TurnCommand, TurnReport, read_receipt, receipt_bytes, write_deltas, write_intended,
    write_receipt,
};
use zerocopy::{FromBytes, IntoBytes};

/// Two bytes of record count, then records. What is accepted has as many records as were announced
/// and, written again, reads the same; only what they cannot fill is refused.
pub(super) fn deltas(bytes: &[u8]) {
    let Some((count, payload)) = bytes.split_first_chunk() else { return };
    let announced = u16::from_le_bytes(*count);
    let count = usize::from(announced);
    let Some(reader) = DeltaReader::new(payload, announced) else {
        let is_filled = payload.len().checked_div(count).map_or(payload.is_empty(), |stride| {
            stride >= DELTA_BYTES && stride * count == payload.len()
        });
        return assert!(!is_filled, "{count} records fill {} bytes", payload.len());
    };
    let (read, intended): (Vec<_>, Vec<_>) =
        (reader.changes().collect(), reader.intended_ns().collect());
    assert_eq!((read.len(), intended.len()), (count, count));
    let Some(changes) = read.into_iter().collect::<Option<Vec<Change>>>() else { return };
    let stride = payload.len().checked_div(count).unwrap_or(DELTA_BYTES);
    let mut written = vec![0xa5; payload.len()];
    write_deltas(&changes, stride, &mut written);
    if let Some(intended_ns) = intended.iter().copied().collect::<Option<Vec<u64>>>() {
        write_intended(&intended_ns, stride, &mut written);
    }
    let again = DeltaReader::new(&written, announced).expect("the same length");
    assert!(again.changes().flatten().eq(changes));
    assert!(again.intended_ns().eq(intended));
}

/// No record, records without padding, with padding, with intended times.
pub(super) fn deltas_seeds() -> Vec<Vec<u8>> {
    let changes: Vec<Change> = (0..5)
        .map(|number| Change {
            fact: FactId(number),
            value: if number % 2 == 0 { Value::Asserted } else { Value::Absent },
            version: Version { count: number + 1, writer: CraftId(number % 3) },
            altered: number > 2,
        })
        .collect();
    let written = |stride: usize| {
        let mut payload = vec![0; changes.len() * stride];
        write_deltas(&changes, stride, &mut payload);
        if stride >= DELTA_BYTES + INTENDED_BYTES {
            write_intended(&[1, 2, 3, u64::MAX, 5], stride, &mut payload);
        }
        [&5_u16.to_le_bytes()[..], &payload].concat()
    };
    let strides = [DELTA_BYTES, DELTA_BYTES + 3, DELTA_BYTES + INTENDED_BYTES, 100];
    strides.into_iter().map(written).chain([vec![0, 0]]).collect()
}

/// Whatever has the length of a control record is one; what it says exists or is refused.
pub(super) fn commands(bytes: &[u8]) {
    if let Ok(command) = TurnCommand::read_from_bytes(bytes) {
        assert_eq!(command.as_bytes(), bytes);
        let opened = command.opened().map_or(TurnCommand::NO_TURN, |turn| turn.0);
        let closed = command.closed().map_or(TurnCommand::NO_TURN, |turn| turn.0);
        assert_eq!((opened, closed), (command.opened, command.closed));
    }
    if let Ok(report) = TurnReport::read_from_bytes(bytes) {
        assert_eq!(report.as_bytes(), bytes);
        assert!(report.phase().is_none_or(|phase| phase as u32 == report.phase));
    }
    if let Ok(change) = MembershipChange::read_from_bytes(bytes) {
        assert_eq!(change.as_bytes(), bytes);
    }
    if let Ok(tally) = TallyReport::read_from_bytes(bytes) {
        assert_eq!(tally.as_bytes(), bytes);
    }
}

/// Two bytes of row count, then a receipt and its rows: as many as announced, and the same once written.
pub(super) fn receipts(bytes: &[u8]) {
    let Some((count, payload)) = bytes.split_first_chunk() else { return };
    let count = u16::from_le_bytes(*count);
    let Some((receipt, rows)) = read_receipt(payload, count) else { return };
    let rows: Vec<MissingRow> = rows.collect();
    assert_eq!(rows.len(), usize::from(count));
    let mut written = vec![0xa5; receipt_bytes(rows.len())];
    write_receipt(&receipt, &rows, &mut written);
    assert_eq!(written, payload);
}

/// Without and with rows.
pub(super) fn receipts_seeds() -> Vec<Vec<u8>> {
    let receipt = Receipt { life: 1, asks: 1, unicast_next: 9, ..Receipt::default() };
    let row = |first| MissingRow { is_multicast: first % 2, first, end: first + 2 };
    let seed = |rows: &[MissingRow]| {
        let mut payload = vec![0; receipt_bytes(rows.len())];
        write_receipt(&receipt, rows, &mut payload);
        let count = u8::try_from(rows.len()).expect("a few rows");
        [&[count, 0][..], &payload].concat()
    };
    vec![seed(&[]), seed(&[row(1), row(4), row(7)])]
}

/// One of each.
pub(super) fn commands_seeds() -> Vec<Vec<u8>> {
    let command = TurnCommand { closed: 3, opened: 4, wants_merged: 0, is_last: 0 };
    let report = TurnReport { turn: 4, phase: 1, firing: 17, owed: 2, held: 1, is_final: 0 };
    let tally = TallyReport { sent: 9, received: 8, left: 1 };
    vec![command.as_bytes().to_vec(), report.as_bytes().to_vec(), tally.as_bytes().to_vec()]
}
