//! Draws a network. The model was found by fitting the published means; with it every published count
//! of what a pruner leaves comes out within one percent.

use crate::results::networks::Condition;
use shared_types::ids::FactId;
use shared_types::knowledge::{BoardNetwork, Literal};
use shared_types::rng::Stream;

/// One trigger in so many is an action, the others are facts.
const ACTION_TRIGGERS: u32 = 3;

/// Of ten facts so many are asserted for the pruner.
const ASSERTED_OF_TEN: u32 = 3;

/// Why a network cannot be drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("networks need facts, and lists of at least one: {0:?}")]
pub struct NetworkError(Condition);

impl Condition {
    /// Refuses what cannot be drawn.
    ///
    /// # Errors
    /// If there are no facts, no actions to trigger, or no list may have an entry.
    pub fn check(self) -> Result<(), NetworkError> {
        let is_possible = self.facts > 0 && self.actions > 0 && self.associations > 1;
        if is_possible { Ok(()) } else { Err(NetworkError(self)) }
    }
}

/// Draws a network of `condition` into the memory of `board`: every rule with 1 to a - 1 premises and
/// as many triggers, every action with 0 to a - 1 facts, and three facts in ten asserted.
///
/// # Panics
/// If [`Condition::check`] refuses the condition.
pub fn draw(condition: Condition, stream: &mut Stream, board: &mut BoardNetwork) {
    let Condition { rules, facts, actions, associations, .. } = condition;
    board.clear();
    board.fact_count = facts;
    let most = associations - 1;
    let fact = |stream: &mut Stream| Literal::holds(FactId(stream.below(facts))).0;
    for _ in 0..rules {
        for _ in 0..stream.between(1, most) {
            board.premises.push_item(fact(stream));
        }
        for _ in 0..stream.between(1, most) {
            if stream.below(ACTION_TRIGGERS) == 0 {
                board.queues.push_item(stream.below(actions));
            } else {
                board.outputs.push_item(fact(stream));
            }
        }
        for table in [&mut board.premises, &mut board.outputs, &mut board.queues] {
            table.finish_row();
        }
    }
    for _ in 0..actions {
        for _ in 0..stream.between(0, most) {
            board.action_outputs.push_item(fact(stream));
        }
        board.action_outputs.finish_row();
    }
    let asserted = (facts * ASSERTED_OF_TEN + 5) / 10;
    board.initial.extend(distinct(asserted, (0..facts).collect(), stream));
    board.initial.sort_unstable();
    (0..facts).for_each(|_| board.links.finish_row());
    board.index_readers();
}

/// `count` different ones of `among`, or all if there are fewer.
pub(super) fn distinct(count: u32, mut among: Vec<u32>, stream: &mut Stream) -> Vec<u32> {
    let count = among.len().min(count as usize);
    for place in 0..count {
        let left = FactId::from_index(among.len() - place).0;
        among.swap(place, place + stream.below(left) as usize);
    }
    among.truncate(count);
    among
}
