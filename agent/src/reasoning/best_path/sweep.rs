//! Least costs by sweeps over all rules until one changes nothing: the plain form of the exact solver,
//! with whose costs it ends.

use super::costs::Costs;
use crate::reasoning::Kept;
use shared_types::knowledge::{BoardView, Literal};

/// What the sweeps found.
#[derive(Clone, Debug, PartialEq)]
pub struct Swept {
    /// Cost of every literal; infinite if it cannot be made to hold.
    pub cost: Vec<f64>,
    /// Sweeps, the last of which changed nothing.
    pub sweeps: u32,
}

/// Sweeps over the rules of `kept` in the order of their numbers, each using what those before it
/// found.
#[must_use]
pub fn sweep(
    board: &BoardView<'_>,
    costs: &Costs,
    kept: &Kept,
    known: impl IntoIterator<Item = Literal>,
) -> Swept {
    let mut cost = vec![f64::INFINITY; 2 * board.fact_count as usize];
    known.into_iter().for_each(|literal| cost[literal.0 as usize] = 0.0);
    let mut sweeps = 0;
    loop {
        sweeps += 1;
        let mut is_changed = false;
        for rule in (0..board.rule_count()).filter(|&rule| kept.rules[rule as usize]) {
            let premises = board.premises.row(rule as usize);
            let of_rule = costs.of_rule(rule, premises, |premise| cost[premise as usize]);
            if of_rule == f64::INFINITY {
                continue;
            }
            let mut relax = |outputs: &[u32], value: f64| {
                for &output in outputs {
                    if value < cost[output as usize] {
                        cost[output as usize] = value;
                        is_changed = true;
                    }
                }
            };
            relax(board.outputs.row(rule as usize), of_rule);
            for &action in board.queues.row(rule as usize) {
                if kept.actions[action as usize] {
                    let outputs = board.action_outputs.row(action as usize);
                    relax(outputs, of_rule + costs.action(action));
                }
            }
        }
        if !is_changed {
            return Swept { cost, sweeps };
        }
    }
}
