//! The pruner that reproduces the published counts, in one pass.
//!
//! Passes over actions, rules and facts are repeated until one changes nothing: an action goes when it
//! asserts nothing, a rule when it asserts nothing and queues no action that is left, a fact when no
//! rule that is left reads it or nothing that is left asserts it. A fact that goes shortens no list and
//! takes no rule with it, actions that nobody queues stay, and goals are not protected. So the order
//! actions, rules, facts is complete after one pass, and the second only finds that out; it is counted
//! and not made. The loops as published are in [`super::reference`].

use super::{Kinds, Pruned};
use crate::reasoning::Kept;
use shared_types::knowledge::{BoardView, Literal};

/// Prunes `board`; facts in `board.initial` count as asserted.
#[must_use]
pub fn prune(board: &BoardView<'_>, kinds: Kinds) -> Pruned {
    let mut kept = Kept::everything(board);
    if kinds.actions {
        for (is_kept, outputs) in kept.actions.iter_mut().zip(board.action_outputs.rows()) {
            *is_kept = !outputs.is_empty();
        }
    }
    if kinds.rules {
        let rows = board.outputs.rows().zip(board.queues.rows());
        for (is_kept, (outputs, queues)) in kept.rules.iter_mut().zip(rows) {
            *is_kept =
                !outputs.is_empty() || queues.iter().any(|&action| kept.actions[action as usize]);
        }
    }
    if kinds.facts {
        prune_facts(board, &mut kept);
    }
    let is_whole = kept.facts.iter().chain(&kept.rules).chain(&kept.actions).all(|&kept| kept);
    Pruned { kept, passes: if is_whole { 1 } else { 2 } }
}

/// Some kept rule reads the fact.
const READ: u8 = 1;
/// It is asserted, or something that is kept asserts it.
const ASSERTABLE: u8 = 2;

fn prune_facts(board: &BoardView<'_>, kept: &mut Kept) {
    let mut marks = vec![0_u8; board.fact_count as usize];
    for &fact in board.initial {
        marks[fact as usize] = ASSERTABLE;
    }
    let mut mark = |literals: &[u32], mark: u8| {
        for &packed in literals {
            marks[Literal(packed).fact().index()] |= mark;
        }
    };
    let rows = board.premises.rows().zip(board.outputs.rows());
    for ((premises, outputs), _) in rows.zip(&kept.rules).filter(|&(_, &is_kept)| is_kept) {
        mark(premises, READ);
        mark(outputs, ASSERTABLE);
    }
    let rows = board.action_outputs.rows().zip(&kept.actions);
    for (outputs, _) in rows.filter(|&(_, &is_kept)| is_kept) {
        mark(outputs, ASSERTABLE);
    }
    for (is_kept, mark) in kept.facts.iter_mut().zip(marks) {
        *is_kept = mark == READ | ASSERTABLE;
    }
}
