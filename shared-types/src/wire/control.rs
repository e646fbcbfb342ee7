//! Control messages of fixed size: the orchestrator's turn commands and the crafts' turn reports.

use crate::ids::{Firing, Turn};
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// Orchestrator to all crafts. One message may close a turn and open the next: the craft then
/// merges what it holds for the closed one and fires for the opened one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct TurnCommand {
    /// The turn that is closed; [`TurnCommand::NO_TURN`] if none is.
    pub closed: u32,
    /// The turn that is opened; [`TurnCommand::NO_TURN`] if none is.
    pub opened: u32,
    /// 1 if crafts shall report [`TurnPhase::Merged`] after merging the closed turn.
    pub wants_merged: u32,
    /// 1 if no turn follows in this epoch: crafts of the central strategies sign off.
    pub is_last: u32,
}

impl TurnCommand {
    /// Stands for "no turn".
    pub const NO_TURN: u32 = u32::MAX;

    /// The turn that is closed.
    #[must_use]
    pub fn closed(&self) -> Option<Turn> {
        (self.closed != Self::NO_TURN).then_some(Turn(self.closed))
    }

    /// The turn that is opened.
    #[must_use]
    pub fn opened(&self) -> Option<Turn> {
        (self.opened != Self::NO_TURN).then_some(Turn(self.opened))
    }
}

/// What a [`TurnReport`] is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum TurnPhase {
    /// The craft has fired (or was idle) and sent; `owed` is final from now on.
    Fired = 0,
    /// More deliveries of the turn have arrived.
    Held = 1,
    /// The closed turn is merged.
    Merged = 2,
}

/// Craft to orchestrator: one line of the turn's ledger. Numbers are totals of the turn so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct TurnReport {
    /// The turn.
    pub turn: u32,
    /// A [`TurnPhase`].
    pub phase: u32,
    /// What was fired; [`Firing::IDLE`] for nothing, and always so for the centre.
    pub firing: u32,
    /// Final deliveries that the craft's firing owes.
    pub owed: u32,
    /// Final deliveries that the craft holds for the turn.
    pub held: u32,
    /// 1 if the craft's end condition is met (a final fact newly asserted by its own firing or, where
    /// the scenario lets deliveries count, true after the merge).
    pub is_final: u32,
}

impl TurnReport {
    /// The phase, if it is one that this version knows.
    #[must_use]
    pub const fn phase(&self) -> Option<TurnPhase> {
        match self.phase {
            0 => Some(TurnPhase::Fired),
            1 => Some(TurnPhase::Held),
            2 => Some(TurnPhase::Merged),
            _ => None,
        }
    }

    /// The firing.
    #[must_use]
    pub const fn firing(&self) -> Firing {
        Firing(self.firing)
    }
}

/// Craft to orchestrator in open mode: what it has sent and received in the epoch, of the classes
/// replication and reply. The fleet is quiet once what was sent has been received and nobody has
/// anything left.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, FromBytes, IntoBytes, Immutable, KnownLayout,
)]
#[repr(C)]
pub struct TallyReport {
    /// Copies sent: a multicast counts once for each receiver.
    pub sent: u64,
    /// Samples received.
    pub received: u64,
    /// What it still has to do: records to play, samples in the outbox, changes that no reply has
    /// taken yet.
    pub left: u64,
}
