//! The digests, defined once in words: xxh3 with 64 bits over rows of little-endian numbers, no
//! separators, no padding, nothing before the first row or after the last.

use shared_types::ids::{CraftId, FactId, Firing, Turn};
use shared_types::knowledge::FactState;
use xxhash_rust::xxh3::xxh3_64;

/// Digest of what was fired: (turn u32, craft u32, firing u32) of every firing that is not idle,
/// sorted by turn, then craft. A firing is a rule's id or, for an action, the number of rules plus
/// the action's id. The sorting is the caller's.
#[must_use]
pub fn path_digest(path: impl IntoIterator<Item = (Turn, CraftId, Firing)>) -> u64 {
    let mut bytes = Vec::new();
    for (turn, craft, firing) in path {
        for number in [turn.0, craft.0, firing.0] {
            bytes.extend_from_slice(&number.to_le_bytes());
        }
    }
    xxh3_64(&bytes)
}

/// Digest of one board: (value u8, count u32, writer u32) of every fact in id order, 9 bytes each; a
/// fact that nobody wrote has version (0, 0).
#[must_use]
pub fn board_digest(states: &[FactState]) -> u64 {
    let mut bytes = Vec::with_capacity(states.len() * 9);
    for state in states {
        push_state(&mut bytes, state);
    }
    xxh3_64(&bytes)
}

/// Digest of a replica store: (origin u32, fact u32, value u8, count u32, writer u32) of every
/// replica held, 17 bytes each, sorted by origin, then fact. The sorting is the caller's.
#[must_use]
pub fn replica_digest<'a>(
    replicas: impl IntoIterator<Item = (CraftId, FactId, &'a FactState)>,
) -> u64 {
    let mut bytes = Vec::new();
    for (origin, fact, state) in replicas {
        bytes.extend_from_slice(&origin.0.to_le_bytes());
        bytes.extend_from_slice(&fact.0.to_le_bytes());
        push_state(&mut bytes, state);
    }
    xxh3_64(&bytes)
}

fn push_state(bytes: &mut Vec<u8>, state: &FactState) {
    bytes.push(state.value as u8);
    bytes.extend_from_slice(&state.version.count.to_le_bytes());
    bytes.extend_from_slice(&state.version.writer.0.to_le_bytes());
}
