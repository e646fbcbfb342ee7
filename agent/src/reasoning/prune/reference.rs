//! The pruners as plain loops over lists, as they would be written from their descriptions. They are
//! what the fast forms are held against, and what their speed is compared with.

use super::{Kinds, Pruned};
use crate::reasoning::Kept;
use shared_types::knowledge::{BoardView, Literal};
use std::collections::BTreeSet;

/// As [`super::published::prune`].
#[must_use]
pub fn published(board: &BoardView<'_>, kinds: Kinds) -> Pruned {
    let mut passes = Passes::new(board, kinds);
    let mut count = 1;
    while passes.pass() {
        count += 1;
    }
    Pruned { kept: passes.kept, passes: count }
}

/// The published pruner, pass by pass.
#[derive(Clone, Debug)]
pub struct Passes<'a> {
    board: BoardView<'a>,
    kinds: Kinds,
    kept: Kept,
}

impl<'a> Passes<'a> {
    /// Before the first pass over `board`.
    #[must_use]
    pub fn new(board: &BoardView<'a>, kinds: Kinds) -> Self {
        Self { board: *board, kinds, kept: Kept::everything(board) }
    }

    /// Makes one pass; returns whether it changed anything.
    pub fn pass(&mut self) -> bool {
        let Self { board, kinds, kept } = self;
        let mut is_changed = false;
        let mut remove = |flag: &mut bool| is_changed |= std::mem::take(flag);
        if kinds.actions {
            for action in 0..kept.actions.len() {
                if board.action_outputs.row(action).is_empty() {
                    remove(&mut kept.actions[action]);
                }
            }
        }
        if kinds.rules {
            for rule in 0..kept.rules.len() {
                let mut queued = board.queues.row(rule).iter();
                let queues_nothing = !queued.any(|&action| kept.actions[action as usize]);
                if board.outputs.row(rule).is_empty() && queues_nothing {
                    remove(&mut kept.rules[rule]);
                }
            }
        }
        if kinds.facts {
            for fact in
                (0..board.fact_count).filter(|&fact| kept.facts[fact as usize]).collect::<Vec<_>>()
            {
                let names = |list: &[u32]| list.iter().any(|&item| Literal(item).fact().0 == fact);
                let of_rules = |list_of: &dyn Fn(usize) -> bool| {
                    (0..kept.rules.len()).any(|rule| kept.rules[rule] && list_of(rule))
                };
                let is_used = of_rules(&|rule| names(board.premises.row(rule)));
                let is_assertable = board.initial.contains(&fact)
                    || of_rules(&|rule| names(board.outputs.row(rule)))
                    || (0..kept.actions.len()).any(|action| {
                        kept.actions[action] && names(board.action_outputs.row(action))
                    });
                if !(is_used && is_assertable) {
                    remove(&mut kept.facts[fact as usize]);
                }
            }
        }
        is_changed
    }
}

/// As [`super::literal::prune`].
#[must_use]
pub fn literal(board: &BoardView<'_>) -> Kept {
    let mut kept = Kept::everything(board);
    loop {
        let before = kept.clone();
        for fact in 0..board.fact_count {
            let names = |list: &[u32]| list.iter().any(|&item| Literal(item).fact().0 == fact);
            let mut rules = (0..kept.rules.len()).filter(|&rule| kept.rules[rule]);
            let is_read = rules.clone().any(|rule| names(board.premises.row(rule)));
            let is_assertable = board.initial.contains(&fact)
                || rules.any(|rule| names(board.outputs.row(rule)))
                || (0..kept.actions.len())
                    .any(|action| kept.actions[action] && names(board.action_outputs.row(action)));
            if !(is_read && is_assertable) {
                kept.facts[fact as usize] = false;
            }
        }
        for rule in 0..kept.rules.len() {
            let is_left = |item: &u32| kept.facts[Literal(*item).fact().index()];
            let has_placeholder = !board.premises.row(rule).iter().all(is_left);
            let is_empty = !board.outputs.row(rule).iter().any(is_left)
                && !board.queues.row(rule).iter().any(|&action| kept.actions[action as usize]);
            if has_placeholder || is_empty {
                kept.rules[rule] = false;
            }
        }
        for action in 0..kept.actions.len() {
            let queues = |rule: usize| board.queues.row(rule).iter().any(|&a| a as usize == action);
            if !(0..kept.rules.len()).any(|rule| kept.rules[rule] && queues(rule)) {
                kept.actions[action] = false;
            }
        }
        if kept == before {
            return kept;
        }
    }
}

/// As [`super::sound::Sound`], from scratch: literals that hold are `known`, `goals` are wanted, and of
/// the `open` facts either value may come from outside and is wanted there.
#[must_use]
pub fn sound(board: &BoardView<'_>, known: &[Literal], goals: &[Literal], open: &[u32]) -> Kept {
    let open: Vec<u32> = open.iter().flat_map(|&fact| [fact << 1, fact << 1 | 1]).collect();
    let mut can_hold: BTreeSet<u32> = known.iter().map(|literal| literal.0).collect();
    can_hold.extend(&open);
    let can_fire = |rule: usize, can_hold: &BTreeSet<u32>| {
        board.premises.row(rule).iter().all(|premise| can_hold.contains(premise))
    };
    let rules = 0..board.premises.row_count();
    loop {
        let before = can_hold.len();
        for rule in rules.clone() {
            if !can_fire(rule, &can_hold) {
                continue;
            }
            can_hold.extend(board.outputs.row(rule));
            for &action in board.queues.row(rule) {
                can_hold.extend(board.action_outputs.row(action as usize));
            }
        }
        if can_hold.len() == before {
            break;
        }
    }
    let mut wanted: BTreeSet<u32> = goals.iter().map(|literal| literal.0).collect();
    wanted.extend(&open);
    let mut kept = Kept::default();
    kept.reset(board, false);
    loop {
        let before = wanted.len();
        for rule in rules.clone().filter(|&rule| can_fire(rule, &can_hold)) {
            let serves = |list: &[u32]| list.iter().any(|output| wanted.contains(output));
            let acts = |action: u32| serves(board.action_outputs.row(action as usize));
            let queues = board.queues.row(rule);
            if serves(board.outputs.row(rule)) || queues.iter().any(|&action| acts(action)) {
                kept.rules[rule] = true;
                for &action in queues {
                    kept.actions[action as usize] |= acts(action);
                }
                wanted.extend(board.premises.row(rule));
            }
        }
        if wanted.len() == before {
            break;
        }
    }
    for fact in 0..board.fact_count {
        let is_alive = |literal: u32| wanted.contains(&literal) && can_hold.contains(&literal);
        let is_goal = goals.iter().any(|goal| goal.fact().0 == fact);
        kept.facts[fact as usize] = is_goal || is_alive(fact << 1) || is_alive(fact << 1 | 1);
    }
    kept
}
