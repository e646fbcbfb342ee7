//! The naive solver: forward chaining without a plan (Straub 2016, Figure 14).
//!
//! One loop runs every rule whose premises hold, in the order of their numbers, with its actions, and
//! then looks for the goal. The published counters came from something that we could not find: no
//! variant gives them, so ours are set beside them and nothing is claimed.

use super::Kept;
use shared_types::ids::FactId;
use shared_types::knowledge::{BoardView, Literal};

/// Loops after which the solver gives up, as published.
pub const LOOPS_MAX: u32 = 1000;

/// What the naive solver did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Naive {
    /// Loops.
    pub loops: u32,
    /// Rules run.
    pub rules: u64,
    /// Actions run.
    pub actions: u64,
    /// Whether the goal was reached.
    pub is_solved: bool,
}

/// Chains forwards from `start` until `goal` holds, nothing new can, or [`LOOPS_MAX`] loops are over.
#[must_use]
pub fn chain(board: &BoardView<'_>, kept: &Kept, start: &[FactId], goal: FactId) -> Naive {
    let mut holds = vec![false; board.fact_count as usize];
    start.iter().for_each(|fact| holds[fact.index()] = true);
    let mut naive = Naive { is_solved: holds[goal.index()], ..Naive::default() };
    while !naive.is_solved && naive.loops < LOOPS_MAX {
        naive.loops += 1;
        let mut is_new = false;
        for rule in (0..board.rule_count()).filter(|&rule| kept.rules[rule as usize]) {
            let premises = board.premises.row(rule as usize);
            let mut facts = premises.iter().map(|&packed| Literal(packed).fact().index());
            let is_read = facts.clone().any(|at| kept.facts[at]);
            if !is_read || !facts.all(|at| holds[at] || !kept.facts[at]) {
                continue;
            }
            naive.rules += 1;
            let mut assert = |outputs: &[u32]| {
                for &packed in outputs {
                    let at = Literal(packed).fact().index();
                    is_new |= !std::mem::replace(&mut holds[at], true);
                }
            };
            assert(board.outputs.row(rule as usize));
            for &action in board.queues.row(rule as usize) {
                if kept.actions[action as usize] {
                    naive.actions += 1;
                    assert(board.action_outputs.row(action as usize));
                }
            }
        }
        naive.is_solved = holds[goal.index()];
        if !is_new {
            break;
        }
    }
    naive
}
