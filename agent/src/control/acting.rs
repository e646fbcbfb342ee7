//! What becomes of a firing: an action may take several turns, and may be in vain.
//!
//! An action of d turns is the firing of its craft in d turns on end; the craft does nothing else
//! meanwhile, and only the last of them can change anything. Whether it brings about what it presumes is
//! drawn then, from a stream of the craft's own. One that was in vain has run like any other, except
//! that one which may repeat stays queued and may be tried again. Rules take one turn and are certain.
//! Not here: which firing is chosen (`control`).

use crate::blackboard::Blackboard;
use shared_types::ids::{CraftId, Firing, FiringTarget};
use shared_types::knowledge::{BoardView, Change};
use shared_types::rng::{Purpose, Stream};

/// What a firing comes to in one turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    /// It writes and queues what it says.
    Done,
    /// An action that goes on in the next turn; nothing changes.
    Underway,
    /// An action that is over and has brought about nothing.
    InVain,
}

impl Effect {
    /// Brings `firing` with this effect to the board; `changes` and what is returned are as
    /// [`Blackboard::fire`] has them.
    pub fn bring(
        self,
        state: &mut Blackboard,
        board: &BoardView<'_>,
        craft: CraftId,
        firing: Firing,
        changes: &mut Vec<Change>,
    ) -> bool {
        match self {
            Self::Done => state.fire(board, craft, firing, changes),
            Self::Underway => {
                changes.clear();
                state.rest()
            }
            Self::InVain => {
                changes.clear();
                state.fail(firing)
            }
        }
    }
}

/// The action that a craft is at, and what its actions come to.
#[derive(Clone, Debug)]
pub struct Acting {
    outcomes: Stream,
    /// With the turns that it still takes.
    at_hand: Option<(Firing, u32)>,
}

impl Default for Acting {
    fn default() -> Self {
        Self::new(0, 0, CraftId(0))
    }
}

impl Acting {
    /// Before the first turn of `trial` of `seed`.
    #[must_use]
    pub fn new(seed: u64, trial: u32, craft: CraftId) -> Self {
        Self { outcomes: Stream::new(seed, trial, Purpose::Outcomes, craft.0), at_hand: None }
    }

    /// The action that is not over: what the craft fires next.
    #[must_use]
    pub fn at_hand(&self) -> Option<Firing> {
        self.at_hand.map(|(firing, _)| firing)
    }

    /// The craft spends a turn on `firing`.
    pub fn spend(&mut self, board: &BoardView<'_>, firing: Firing) -> Effect {
        let Some(FiringTarget::Action(action)) = firing.target(board.rule_count()) else {
            return Effect::Done;
        };
        let left = match self.at_hand {
            Some((same, left)) if same == firing => left,
            _ => board.action_duration(action.0),
        };
        if left > 1 {
            self.at_hand = Some((firing, left - 1));
            return Effect::Underway;
        }
        self.at_hand = None;
        let likelihood = board.action_likelihood(action.0);
        // What is certain draws nothing.
        if likelihood < 1.0 && self.outcomes.unit() >= likelihood {
            Effect::InVain
        } else {
            Effect::Done
        }
    }
}
