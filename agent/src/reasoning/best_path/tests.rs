//! The exact solver against sweeps, repair against solving afresh, plans against the network.

use super::published::PublishedSweeps;
use super::{Combine, CostError, Costs, Plan, Repair, Solver, Stopped, sweep, ways};
use crate::reasoning::prune::sound::Sound;
use crate::reasoning::sample::{Shape, board};
use crate::reasoning::{Kept, naive};
use proptest::prelude::{ProptestConfig, any, proptest};
use proptest::{prop_assert, prop_assert_eq};
use shared_types::ids::FactId;
use shared_types::knowledge::{BoardNetwork, BoardView, Literal};
use shared_types::rng::{Purpose, Stream};

fn drawn(seed: u64) -> (BoardNetwork, Stream) {
    let mut stream = Stream::new(seed, 0, Purpose::Test, 1);
    let shape = Shape {
        facts: stream.between(2, 40),
        rules: stream.between(1, 60),
        actions: stream.below(30),
        associations: stream.between(2, 5),
        is_negating: stream.below(2) == 0,
    };
    let board = board(shape, &mut stream);
    (board, stream)
}

fn initial(board: &BoardNetwork) -> Vec<Literal> {
    board.initial.iter().map(|&fact| Literal::holds(FactId(fact))).collect()
}

/// Whole numbers, so that sums are exact in any order.
fn costs(board: &BoardView<'_>, combine: Combine, lowest: u32, stream: &mut Stream) -> Costs {
    let mut some = |count: usize| -> Vec<f64> {
        (0..count).map(|_| f64::from(stream.between(lowest, 9))).collect()
    };
    let (rules, actions) =
        (some(board.premises.row_count()), some(board.action_outputs.row_count()));
    Costs::new(board, combine, rules, actions).unwrap()
}

fn literals(board: &BoardView<'_>) -> impl Iterator<Item = Literal> + use<> {
    (0..2 * board.fact_count).map(Literal)
}

/// Runs `plan` from `known`: every step finds its premises, and the goal holds at the end.
fn leads_to_its_goal(plan: &Plan, board: &BoardView<'_>, known: &[Literal]) -> bool {
    let mut holds: Vec<u32> = known.iter().map(|literal| literal.0).collect();
    let rests = plan.rests_on.iter().all(|literal| holds.contains(&literal.0));
    let runs = plan.steps.iter().all(|step| {
        let is_ready = board.premises.row(step.rule as usize).iter().all(|p| holds.contains(p));
        holds.extend(board.outputs.row(step.rule as usize));
        for &action in &step.actions {
            holds.extend(board.action_outputs.row(action as usize));
        }
        is_ready && step.actions.iter().all(|a| board.queues.row(step.rule as usize).contains(a))
    });
    rests && runs && holds.contains(&plan.goal.0)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn the_solver_ends_with_the_costs_of_the_sweeps(seed in any::<u64>(), is_sum in any::<bool>()) {
        let (network, mut stream) = drawn(seed);
        let (view, known) = (network.view(), initial(&network));
        let combine = if is_sum { Combine::Sum } else { Combine::Max };
        let costs = costs(&view, combine, 0, &mut stream);
        let everything = Kept::everything(&view);
        let swept = sweep::sweep(&view, &costs, &everything, known.iter().copied());
        let mut solver = Solver::default();
        let stopped = solver.solve(&view, &costs, None, known.iter().copied(), None);
        prop_assert_eq!(stopped, Stopped::Exhausted);
        for literal in literals(&view) {
            prop_assert_eq!(solver.cost(literal), swept.cost[literal.0 as usize]);
        }
        // Early exit gives the same cost and plan.
        let goal = Literal(stream.below(2 * view.fact_count));
        let whole = solver.plan(&view, &costs, goal);
        let stopped = solver.solve(&view, &costs, None, known.iter().copied(), Some(goal));
        let is_reached = swept.cost[goal.0 as usize] < f64::INFINITY;
        prop_assert_eq!(stopped == Stopped::AtGoal, is_reached);
        let plan = solver.plan(&view, &costs, goal);
        prop_assert_eq!(&plan, &whole);
        prop_assert_eq!(plan.is_some(), is_reached);
        if let Some(plan) = plan {
            prop_assert_eq!(plan.cost, swept.cost[goal.0 as usize]);
            prop_assert!(leads_to_its_goal(&plan, &view, &known), "{plan:?}");
            prop_assert!(!is_sum || plan.cost_once <= plan.cost, "{plan:?}");
        }
    }

    #[test]
    fn the_sound_pruner_never_changes_the_cost_of_a_goal(seed in any::<u64>()) {
        let (network, mut stream) = drawn(seed);
        let (view, known) = (network.view(), initial(&network));
        let costs = costs(&view, Combine::Sum, 0, &mut stream);
        let goals = [0; 3].map(|_| Literal(stream.below(2 * view.fact_count)));
        let kept = Sound::new(&view, known.iter().copied(), goals).kept(&view);
        for goal in goals {
            let cost_with = |kept: Option<&Kept>| {
                let mut solver = Solver::default();
                solver.solve(&view, &costs, kept, known.iter().copied(), Some(goal));
                solver.cost(goal)
            };
            prop_assert_eq!(cost_with(Some(&kept)), cost_with(None));
        }
    }

    #[test]
    fn repaired_costs_are_those_of_solving_afresh(
        seed in any::<u64>(),
        is_sum in any::<bool>(),
        changes in 1_u32..15,
    ) {
        let (network, mut stream) = drawn(seed);
        let (view, mut known) = (network.view(), initial(&network));
        let combine = if is_sum { Combine::Sum } else { Combine::Max };
        let mut costs = costs(&view, combine, 1, &mut stream);
        let mut repair = Repair::new(&view, costs.clone(), known.iter().copied()).unwrap();
        for _ in 0..changes {
            if stream.below(4) == 0 {
                let (rule, cost) = (stream.below(view.rule_count()), stream.between(1, 9));
                costs.set_rule(rule, f64::from(cost)).unwrap();
                repair.set_rule_cost(&view, rule, f64::from(cost)).unwrap();
            } else {
                let literal = Literal(stream.below(2 * view.fact_count));
                let is_known = !known.contains(&literal);
                if is_known {
                    known.push(literal);
                } else {
                    known.retain(|&one| one != literal);
                }
                repair.set_known(&view, literal, is_known);
            }
            let mut solver = Solver::default();
            solver.solve(&view, &costs, None, known.iter().copied(), None);
            for literal in literals(&view) {
                prop_assert_eq!(repair.cost(literal), solver.cost(literal), "{:?}", literal);
            }
        }
        let goal = Literal(stream.below(2 * view.fact_count));
        if let Some(plan) = repair.plan(&view, goal) {
            prop_assert!(leads_to_its_goal(&plan, &view, &known), "{plan:?}");
        }
    }

    #[test]
    fn the_cheapest_ways_come_first(seed in any::<u64>(), most in 1_usize..6) {
        let mut stream = Stream::new(seed, 0, Purpose::Test, 4);
        let shape = Shape { facts: 6, rules: 7, actions: 3, associations: 3, is_negating: false };
        let network = board(shape, &mut stream);
        let (view, known) = (network.view(), initial(&network));
        let costs = costs(&view, Combine::Sum, 1, &mut stream);
        let goal = Literal::holds(FactId(stream.below(shape.facts)));
        let everything = Kept::everything(&view);
        let found = ways::ways(&view, &costs, &everything, &known, goal, most);
        // Exhaustive: the best plan of every set of rules.
        let mut all: Vec<(Vec<u32>, f64)> = Vec::new();
        for set in 0_u32..1 << shape.rules {
            let mut kept = everything.clone();
            for (rule, is_kept) in kept.rules.iter_mut().enumerate() {
                *is_kept = set >> rule & 1 == 1;
            }
            let mut solver = Solver::default();
            solver.solve(&view, &costs, Some(&kept), known.iter().copied(), Some(goal));
            let Some(plan) = solver.plan(&view, &costs, goal) else { continue };
            let mut rules: Vec<u32> = plan.steps.iter().map(|step| step.rule).collect();
            rules.sort_unstable();
            if !all.iter().any(|(known, _)| *known == rules) {
                all.push((rules, plan.cost));
            }
        }
        all.sort_by(|one, other| one.1.total_cmp(&other.1));
        prop_assert_eq!(found.len(), most.min(all.len()));
        for (plan, (_, cost)) in found.iter().zip(&all) {
            prop_assert_eq!(plan.cost, *cost);
            prop_assert!(leads_to_its_goal(plan, &view, &known), "{plan:?}");
        }
    }

    #[test]
    fn trying_every_derivation_finds_none_that_is_cheaper(
        seed in any::<u64>(),
        is_sum in any::<bool>(),
    ) {
        let mut stream = Stream::new(seed, 0, Purpose::Test, 2);
        let shape =
            Shape { facts: 5, rules: 6, actions: 2, associations: 2, is_negating: seed & 1 == 0 };
        let network = board(shape, &mut stream);
        let (view, known) = (network.view(), initial(&network));
        let combine = if is_sum { Combine::Sum } else { Combine::Max };
        let costs = costs(&view, combine, 0, &mut stream);
        let mut solver = Solver::default();
        solver.solve(&view, &costs, None, known.iter().copied(), None);
        for goal in literals(&view) {
            let least = least_of_all(goal.0, &view, &costs, &known, &mut Vec::new());
            prop_assert_eq!(solver.cost(goal), least);
        }
    }
}

/// The least cost of `literal` over all its derivations, each tried in full: by every rule and action that
/// writes it, with premises derived in every way that does not lean on what is being derived.
fn least_of_all(
    literal: u32,
    board: &BoardView<'_>,
    costs: &Costs,
    known: &[Literal],
    derived: &mut Vec<u32>,
) -> f64 {
    if known.contains(&Literal(literal)) {
        return 0.0;
    }
    if derived.contains(&literal) {
        return f64::INFINITY;
    }
    derived.push(literal);
    let mut least = f64::INFINITY;
    for rule in 0..board.rule_count() {
        let writes = board.outputs.row(rule as usize).contains(&literal).then_some(0.0);
        let through = board.queues.row(rule as usize).iter().filter_map(|&action| {
            let outputs = board.action_outputs.row(action as usize);
            outputs.contains(&literal).then(|| costs.action(action))
        });
        let Some(own) = writes.into_iter().chain(through).reduce(f64::min) else { continue };
        let premises = board.premises.row(rule as usize).iter();
        let each = premises.map(|&premise| least_of_all(premise, board, costs, known, derived));
        let together = match costs.combine() {
            Combine::Sum => each.sum(),
            Combine::Max => each.fold(0.0, f64::max),
        };
        least = least.min(costs.rule(rule) + own + together);
    }
    derived.pop();
    least
}

#[test]
fn published_sweeps_and_the_naive_solver_reach_what_can_be_reached() {
    for seed in 0..500 {
        let (network, mut stream) = drawn(seed);
        let (view, everything) = (network.view(), Kept::everything(&network.view()));
        let start: Vec<FactId> = network.initial.iter().copied().map(FactId).collect();
        let published = PublishedSweeps::of(&view, &everything, &start);
        // Without pruning and negation these are the plain sweeps, with 1 a rule and 1 an action.
        if (0..view.premises.row_count())
            .all(|rule| view.premises.row(rule).iter().all(|p| p & 1 == 0))
        {
            let costs = Costs::uniform(&view, Combine::Sum);
            let known = initial(&network);
            let swept = sweep::sweep(&view, &costs, &everything, known.iter().copied());
            assert_eq!(published.iterations, swept.sweeps, "seed {seed}");
        }
        let goal = FactId(stream.below(view.fact_count));
        let naive = naive::chain(&view, &everything, &start, goal);
        assert_eq!(naive.is_solved, published.cost[goal.index()] < f64::INFINITY, "seed {seed}");
        let reached: Vec<FactId> = published.reached().collect();
        if let Some(&goal) = reached.first() {
            assert!(published.path_length(&view, &everything, goal) >= 3);
        }
        assert!(reached.iter().all(|fact| !start.contains(fact)));
    }
}

#[test]
fn a_shared_premise_is_paid_for_twice_and_run_once() {
    // 0 -> 1; 1 -> 2; 1 -> 3; 2 and 3 -> 4.
    let holds = |fact| Literal::holds(FactId(fact));
    let mut board = BoardNetwork { fact_count: 5, ..BoardNetwork::default() };
    for (premises, output) in [(vec![0], 1), (vec![1], 2), (vec![1], 3), (vec![2, 3], 4)] {
        board.premises.push_row(premises.into_iter().map(|fact| holds(fact).0));
        board.outputs.push_row([holds(output).0]);
        board.queues.push_row([]);
    }
    (0..5).for_each(|_| board.links.push_row([]));
    board.index_readers();
    let view = board.view();
    let plan_with = |combine| {
        let costs = Costs::uniform(&view, combine);
        let mut solver = Solver::default();
        let stopped = solver.solve(&view, &costs, None, [holds(0)], Some(holds(4)));
        assert_eq!(stopped, Stopped::AtGoal);
        solver.plan(&view, &costs, holds(4)).unwrap()
    };
    let plan = plan_with(Combine::Sum);
    assert_eq!((plan.cost, plan.cost_once, plan.steps.len()), (5.0, 4.0, 4));
    assert_eq!(plan.rests_on, [holds(0)]);
    assert_eq!(plan_with(Combine::Max).cost, 3.0);
}

#[test]
fn costs_that_are_none_are_refused_with_their_place() {
    let (network, _) = drawn(3);
    let view = network.view();
    let (rules, actions) = (view.premises.row_count(), view.action_outputs.row_count());
    let with = |rules, actions| Costs::new(&view, Combine::Sum, rules, actions);
    let refused = with(vec![f64::NAN; rules], vec![1.0; actions]).unwrap_err();
    assert_eq!(refused, CostError::Value { what: "rule", index: 0 });
    assert!(matches!(with(vec![], vec![]), Err(CostError::Rules { .. })));
    let mut costs = Costs::uniform(&view, Combine::Sum);
    assert!(costs.set_rule(0, -1.0).is_err());
    costs.set_rule(0, 0.0).unwrap();
    assert!(Repair::new(&view, costs, []).is_err(), "free rules cannot be repaired");
}
