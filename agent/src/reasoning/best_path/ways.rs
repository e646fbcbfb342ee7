//! The cheapest ways to a goal, one after the other.
//!
//! Whoever goes another way than the best leaves out one of its steps. So every step of a plan is left out
//! in turn, the best of what remains comes next, and its steps are left out in turn beside those that are
//! left out already. A way that is found twice counts once; one that does more than another for nothing is
//! none.

use super::costs::Costs;
use super::plan::Plan;
use super::solver::Solver;
use crate::reasoning::Kept;
use shared_types::knowledge::{BoardView, Literal};
use std::collections::{BTreeMap, BTreeSet};

/// Searches after which no further way is looked for.
pub const SEARCHES_MAX: usize = 10_000;

/// Up to `most` ways to `goal` from `known` through what is `kept`, the cheapest first.
#[must_use]
pub fn ways(
    board: &BoardView<'_>,
    costs: &Costs,
    kept: &Kept,
    known: &[Literal],
    goal: Literal,
    most: usize,
) -> Vec<Plan> {
    let (mut kept, mut solver) = (kept.clone(), Solver::default());
    let mut best_without = |left_out: &[u32]| {
        let kept_before: Vec<bool> =
            left_out.iter().map(|&rule| std::mem::take(&mut kept.rules[rule as usize])).collect();
        solver.solve(board, costs, Some(&kept), known.iter().copied(), Some(goal));
        for (&rule, is_kept) in left_out.iter().zip(kept_before) {
            kept.rules[rule as usize] = is_kept;
        }
        solver.plan(board, costs, goal)
    };
    // By cost, whose bits are in its order because it is not below zero; then by what is left out.
    let mut open: BTreeMap<(u64, Vec<u32>), Plan> = BTreeMap::new();
    open.extend(best_without(&[]).map(|plan| ((plan.cost.to_bits(), Vec::new()), plan)));
    let (mut found, mut searches) = (Vec::new(), 1);
    let mut known_ways: BTreeSet<Vec<u32>> = BTreeSet::new();
    let mut seen: BTreeSet<Vec<u32>> = BTreeSet::new();
    while found.len() < most
        && let Some(((_, left_out), plan)) = open.pop_first()
    {
        let mut rules: Vec<u32> = plan.steps.iter().map(|step| step.rule).collect();
        rules.sort_unstable();
        for &rule in &rules {
            let mut without = left_out.clone();
            without.push(rule);
            without.sort_unstable();
            if searches < SEARCHES_MAX && seen.insert(without.clone()) {
                searches += 1;
                open.extend(
                    best_without(&without).map(|plan| ((plan.cost.to_bits(), without), plan)),
                );
            }
        }
        if known_ways.insert(rules) {
            found.push(plan);
        }
    }
    found
}
