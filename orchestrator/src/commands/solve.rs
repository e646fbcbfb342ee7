//! `solve`: the cheapest way to a mission's end, without a fleet.

use super::{Refusal, Setting, load_scenario, print_report};
use crate::cli::{CommonArguments, SolveArguments};
use crate::outcome::Outcome;
use crate::report::solve::{Goal, Solution, Step};
use crate::scenario::{NameTable, compile};
use agent::reasoning::best_path::{Combine, Costs, Plan, Solver};
use agent::reasoning::prune::sound::Sound;
use agent::reasoning::whole::{Origin, Whole};
use shared_types::ids::FactId;
use shared_types::knowledge::{BoardView, FleetNetwork, Literal};

/// Plans the mission of a scenario and prints the cheapest plan.
///
/// # Errors
/// If the scenario is wrong, or nothing is final in it.
pub fn solve(arguments: &SolveArguments, setting: Setting) -> Result<Outcome, Refusal> {
    let common = CommonArguments {
        set: arguments.set.clone(),
        seed: arguments.seed,
        ..CommonArguments::default()
    };
    let scenario = load_scenario(&arguments.scenario, &common, None)?;
    let mut network = FleetNetwork::default();
    compile(&scenario, scenario.scenario().run.seed, arguments.trial, &mut network);
    let fleet = network.view();
    let whole = Whole::of(&fleet);
    let view = whole.network().view();
    if view.finals.is_empty() {
        return Err(Refusal::new("the mission declares no final fact: name some under `final`"));
    }
    let combine = if arguments.parallel { Combine::Max } else { Combine::Sum };
    let costs = costs_of(&whole, &view, combine, arguments.telling)?;
    let known = || view.initial.iter().map(|&fact| Literal::holds(FactId(fact)));
    let mut solver = Solver::default();
    solver.solve(&view, &costs, None, known(), None);
    let mut goals: Vec<(f64, FactId)> = view
        .finals
        .iter()
        .map(|&fact| (solver.cost(Literal::holds(FactId(fact))), FactId(fact)))
        .collect();
    goals.sort_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)));
    let literals = view.finals.iter().map(|&fact| Literal::holds(FactId(fact)));
    let kept = Sound::new(&view, known(), literals).kept(&view);
    let [facts, rules, actions] = kept.counts();
    let own = whole.own_rules() as usize;
    let told = kept.rules[own..].iter().filter(|&&is_kept| is_kept).count();
    let names = scenario.names();
    let best = solver.plan(&view, &costs, Literal::holds(goals[0].1));
    let solution = Solution {
        mission: scenario.scenario().name.clone(),
        combine: if arguments.parallel { "max" } else { "sum" },
        goals: goals.iter().map(|&(cost, fact)| goal(&whole, names, fact, cost)).collect(),
        cost: best.as_ref().map(|plan| plan.cost),
        cost_once: best.as_ref().map(|plan| plan.cost_once),
        steps: best.as_ref().map_or_else(Vec::new, |plan| steps(&whole, names, plan)),
        rests_on: best
            .iter()
            .flat_map(|plan| &plan.rests_on)
            .map(|literal| name_of(&whole, names, literal.fact()))
            .collect(),
        kept: [facts, rules - told, actions, told / 2 + told % 2],
        of: [
            view.fact_count as usize,
            own,
            view.action_count() as usize,
            (view.premises.row_count() - own) / 2,
        ],
    };
    print_report(&solution, setting, arguments.all)?;
    Ok(Outcome::Success)
}

/// A rule and an action cost 1 each; telling another craft what `telling` says.
fn costs_of(
    whole: &Whole,
    view: &BoardView<'_>,
    combine: Combine,
    telling: f64,
) -> Result<Costs, Refusal> {
    let own = whole.own_rules() as usize;
    let mut rules = vec![1.0; view.premises.row_count()];
    rules[own..].fill(telling);
    let actions = vec![1.0; view.action_outputs.row_count()];
    Costs::new(view, combine, rules, actions)
        .map_err(|error| Refusal::new(format!("{error}; `--telling` takes a number from 0 on")))
}

fn name_of(whole: &Whole, names: &NameTable, fact: FactId) -> String {
    let (craft, fact) = whole.fact_of(fact);
    format!("{}: {}", names.craft(craft), names.fact(craft, fact))
}

fn goal(whole: &Whole, names: &NameTable, fact: FactId, cost: f64) -> Goal {
    Goal { fact: name_of(whole, names, fact), cost: (cost < f64::INFINITY).then_some(cost) }
}

fn steps(whole: &Whole, names: &NameTable, plan: &Plan) -> Vec<Step> {
    let step = |step: &agent::reasoning::best_path::Step| match whole.rule_of(step.rule) {
        Origin::Rule(craft, rule) => Step {
            craft: names.craft(craft).to_owned(),
            runs: names.rule(craft, rule).into_owned(),
            actions: step
                .actions
                .iter()
                .map(|&action| {
                    let (craft, action) = whole.action_of(action);
                    names.action(craft, action).into_owned()
                })
                .collect(),
            tells: None,
        },
        Origin::Told { from: (craft, fact), to } => Step {
            craft: names.craft(craft).to_owned(),
            runs: names.fact(craft, fact).into_owned(),
            actions: Vec::new(),
            tells: Some(names.craft(to.craft).to_owned()),
        },
    };
    plan.steps.iter().map(step).collect()
}
