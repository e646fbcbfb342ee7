//! What has to be run to make a goal hold, and what that rests on.

use super::costs::Costs;
use super::solver::Via;
use shared_types::knowledge::{BoardView, Literal};
use std::collections::BTreeMap;

/// One rule to run, and the actions it queues that are needed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Step {
    /// The rule.
    pub rule: u32,
    /// The actions, ascending; empty if only the rule's own outputs are needed.
    pub actions: Vec<u32>,
}

/// A way to make a goal hold.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// What shall hold.
    pub goal: Literal,
    /// What to run, in an order in which every rule finds its premises.
    pub steps: Vec<Step>,
    /// What must hold already, ascending.
    pub rests_on: Vec<Literal>,
    /// The least cost of the goal; under [`super::Combine::Sum`] a step that several others need counts
    /// once for each.
    pub cost: f64,
    /// The sum of the costs of all steps and their actions, each once.
    pub cost_once: f64,
}

impl Plan {
    /// The plan for `goal` where `of` says what each literal costs and how it is made to hold; `None`
    /// if it cannot be.
    pub(super) fn towards(
        goal: Literal,
        board: &BoardView<'_>,
        costs: &Costs,
        of: impl Fn(Literal) -> (f64, Option<Via>),
    ) -> Option<Self> {
        let (cost, via) = of(goal);
        via?;
        // Depth first; what is met again is in the plan already.
        let mut place: BTreeMap<u32, usize> = BTreeMap::new();
        let (mut steps, mut rests_on): (Vec<Step>, Vec<Literal>) = (Vec::new(), Vec::new());
        let mut work = vec![(goal, false)];
        while let Some((literal, is_left)) = work.pop() {
            let via = of(literal).1?;
            let Some(rule) = via.rule() else {
                rests_on.push(literal);
                continue;
            };
            let premises = board.premises.row(rule as usize);
            if !is_left && !place.contains_key(&rule) {
                work.push((literal, true));
                work.extend(premises.iter().rev().map(|&premise| (Literal(premise), false)));
                continue;
            }
            let step = *place.entry(rule).or_insert_with(|| {
                steps.push(Step { rule, actions: Vec::new() });
                steps.len() - 1
            });
            if let Via::Action { action, .. } = via
                && let Err(at) = steps[step].actions.binary_search(&action)
            {
                steps[step].actions.insert(at, action);
            }
        }
        rests_on.sort_unstable();
        rests_on.dedup();
        let of_step = |step: &Step| {
            let actions = step.actions.iter().map(|&action| costs.action(action));
            costs.rule(step.rule) + actions.sum::<f64>()
        };
        let cost_once = steps.iter().map(of_step).sum();
        Some(Self { goal, steps, rests_on, cost, cost_once })
    }
}
