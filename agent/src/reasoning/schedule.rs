//! How many turns a plan takes when every craft does its steps in the order of the plan.
//!
//! A rule takes a turn, an action its duration, telling none: what a turn tells is known in the next. Crafts
//! work side by side, each at one thing, and a step waits for its premises.

use super::best_path::Plan;
use shared_types::ids::CraftId;
use shared_types::knowledge::BoardView;
use std::collections::BTreeMap;

/// Turns until the goal of `plan` holds, where `who` says which craft runs a rule (nobody tells) and
/// `duration` how many turns an action takes.
#[must_use]
pub fn turns(
    plan: &Plan,
    board: &BoardView<'_>,
    who: impl Fn(u32) -> Option<CraftId>,
    duration: impl Fn(u32) -> u32,
) -> u32 {
    let known = plan.rests_on.iter().map(|literal| (literal.0, 0));
    // When a literal begins to hold. A step may find a premise earlier than by the step that the plan
    // means for it; times only ever fall from pass to pass.
    let mut since: BTreeMap<u32, u32> = known.collect();
    loop {
        let before = since.clone();
        pass(plan, board, &who, &duration, &mut since);
        if since == before {
            return since.get(&plan.goal.0).copied().unwrap_or(0);
        }
    }
}

/// Goes through the steps in their order and notes in `since` what holds earlier than it was thought to.
fn pass(
    plan: &Plan,
    board: &BoardView<'_>,
    who: impl Fn(u32) -> Option<CraftId>,
    duration: impl Fn(u32) -> u32,
    since: &mut BTreeMap<u32, u32>,
) {
    let mut free: BTreeMap<CraftId, u32> = BTreeMap::new();
    for step in &plan.steps {
        let premises = board.premises.row(step.rule as usize).iter();
        let met = premises.map(|premise| since.get(premise).copied().unwrap_or(0)).max();
        let met = met.unwrap_or(0);
        let mut write = |outputs: &[u32], now: u32| {
            for &output in outputs {
                let held = since.entry(output).or_insert(now);
                *held = now.min(*held);
            }
        };
        let outputs = board.outputs.row(step.rule as usize);
        let Some(craft) = who(step.rule) else {
            write(outputs, met);
            continue;
        };
        let mut now = met.max(free.get(&craft).copied().unwrap_or(0)) + 1;
        write(outputs, now);
        for &action in &step.actions {
            now += duration(action);
            write(board.action_outputs.row(action as usize), now);
        }
        free.insert(craft, now);
    }
}

#[cfg(test)]
mod tests {
    use super::turns;
    use crate::reasoning::best_path::{Combine, Costs, Plan, Solver};
    use crate::reasoning::sample::{Shape, board};
    use proptest::prelude::{ProptestConfig, any, prop_assert_eq, proptest};
    use shared_types::ids::{CraftId, FactId};
    use shared_types::knowledge::{BoardView, Literal};
    use shared_types::rng::{Purpose, Stream};
    use std::collections::VecDeque;

    /// Something to do: the rule whose premises it waits for, turns left, what it then writes.
    type Task = (Option<u32>, u32, Vec<u32>);

    /// Turn after turn every craft goes on with its step, or begins the next if its premises hold.
    fn played(
        plan: &Plan,
        board: &BoardView<'_>,
        known: &[Literal],
        who: impl Fn(u32) -> Option<CraftId>,
        duration: impl Fn(u32) -> u32,
    ) -> u32 {
        let mut holds: Vec<u32> = known.iter().map(|literal| literal.0).collect();
        let mut tellings: Vec<u32> = Vec::new();
        let mut queues: Vec<VecDeque<Task>> = vec![VecDeque::new(); 8];
        for step in &plan.steps {
            let Some(craft) = who(step.rule) else {
                tellings.push(step.rule);
                continue;
            };
            let queue = &mut queues[craft.index()];
            let outputs = board.outputs.row(step.rule as usize).to_vec();
            queue.push_back((Some(step.rule), 1, outputs));
            for &action in &step.actions {
                let outputs = board.action_outputs.row(action as usize).to_vec();
                queue.push_back((None, duration(action), outputs));
            }
        }
        let meets = |holds: &[u32], rule: u32| {
            board.premises.row(rule as usize).iter().all(|premise| holds.contains(premise))
        };
        let mut turn = 0;
        loop {
            // What was told is known when the turn opens.
            while let Some(at) = tellings.iter().position(|&rule| meets(&holds, rule)) {
                holds.extend(board.outputs.row(tellings.remove(at) as usize));
            }
            if holds.contains(&plan.goal.0) {
                return turn;
            }
            let mut written = Vec::new();
            for queue in &mut queues {
                let Some((rule, left, outputs)) = queue.front_mut() else { continue };
                if rule.is_none_or(|rule| meets(&holds, rule)) {
                    *left -= 1;
                    *rule = None;
                    if *left == 0 {
                        written.append(outputs);
                        queue.pop_front();
                    }
                }
            }
            holds.extend(written);
            turn += 1;
            assert!(turn < 10_000, "the plan does not come to its end: {plan:?}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(1000))]

        #[test]
        fn turns_are_those_of_playing_the_plan(seed in any::<u64>()) {
            let mut stream = Stream::new(seed, 0, Purpose::Test, 5);
            let shape =
                Shape { facts: 25, rules: 40, actions: 15, associations: 3, is_negating: false };
            let network = board(shape, &mut stream);
            let view = network.view();
            let known: Vec<Literal> =
                network.initial.iter().map(|&fact| Literal::holds(FactId(fact))).collect();
            let crafts: Vec<Option<CraftId>> = (0..shape.rules)
                .map(|rule| {
                    // What queues an action is run by somebody.
                    let is_telling = view.queues.row(rule as usize).is_empty();
                    let craft = stream.below(4);
                    (craft > 0 || !is_telling).then_some(CraftId(craft))
                })
                .collect();
            let durations: Vec<u32> = (0..shape.actions).map(|_| stream.between(1, 5)).collect();
            let costs = Costs::uniform(&view, Combine::Sum);
            let mut solver = Solver::default();
            solver.solve(&view, &costs, None, known.iter().copied(), None);
            for goal in (0..shape.facts).map(|fact| Literal::holds(FactId(fact))) {
                let Some(plan) = solver.plan(&view, &costs, goal) else { continue };
                let who = |rule: u32| crafts[rule as usize];
                let duration = |action: u32| durations[action as usize];
                let needed = turns(&plan, &view, who, duration);
                prop_assert_eq!(needed, played(&plan, &view, &known, who, duration), "{:?}", plan);
            }
        }
    }
}
