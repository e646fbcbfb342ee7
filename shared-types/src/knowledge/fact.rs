//! The state of one fact, and the change that a firing makes to it.

use crate::ids::{CraftId, FactId};

/// What a board holds to be true of a fact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum Value {
    /// Nobody said anything.
    #[default]
    Unknown = 0,
    /// It holds.
    Asserted = 1,
    /// It is known not to hold: de-asserted, or a collection found it absent.
    Absent = 2,
}

impl Value {
    /// The value with wire code `code`, `None` if there is none.
    #[must_use]
    pub const fn from_code(code: u8) -> Option<Self> {
        match code {
            0 => Some(Self::Unknown),
            1 => Some(Self::Asserted),
            2 => Some(Self::Absent),
            _ => None,
        }
    }
}

/// How new a value is: how often the fact was written, and by whom last.
///
/// A firing writes 1 + the count that this fact has on the firing craft's own board; a delivery
/// carries the writer's version unchanged; an initial value has version (0, 0). The order is the
/// merge rule: the larger count wins, on an equal count the higher craft id.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Version {
    /// Writes of this fact that led to the value.
    pub count: u32,
    /// The craft that wrote it.
    pub writer: CraftId,
}

/// Value and version of one fact on one board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct FactState {
    /// What is held to be true.
    pub value: Value,
    /// How new it is.
    pub version: Version,
}

/// One fact that a firing output, in the ids of the board that fired.
///
/// It is a change whether or not it alters the value; `altered` tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Change {
    /// The fact, as the writer's board numbers it.
    pub fact: FactId,
    /// The value written.
    pub value: Value,
    /// The version written; its writer is the craft that fired.
    pub version: Version,
    /// Whether the writer's board held another value before.
    pub altered: bool,
}
