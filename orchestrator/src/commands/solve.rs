//! `solve`: the cheapest way to a mission's end, without a fleet.

use super::{Refusal, Setting, load_scenario, print_report};
use crate::cli::{CommonArguments, SolveArguments};
use crate::explanation::{Thing, find};
use crate::outcome::Outcome;
use crate::report::solve::{Goal, Likely, Solution, Step, Way};
use crate::scenario::{NameTable, ResolvedScenario, compile};
use agent::reasoning::Kept;
use agent::reasoning::best_path::ways::ways;
use agent::reasoning::best_path::{Combine, Costs, Plan, Solver};
use agent::reasoning::outcomes::likeliest;
use agent::reasoning::prune::sound::Sound;
use agent::reasoning::schedule::turns;
use agent::reasoning::whole::{Origin, Whole};
use shared_types::ids::FactId;
use shared_types::knowledge::{BoardView, FleetNetwork, FleetView, Literal};
use std::collections::BTreeSet;

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
    let scenario = load_scenario(&arguments.scenario, &common, false)?;
    let mut network = FleetNetwork::default();
    compile(&scenario, scenario.scenario().run.seed, arguments.trial, &mut network);
    let fleet = network.view();
    let whole = Whole::of(&fleet);
    let view = whole.network().view();
    if view.finals.is_empty() {
        return Err(Refusal::new("the mission declares no final fact: name some under `final`"));
    }
    let combine = if arguments.parallel { Combine::Max } else { Combine::Sum };
    let costs = costs_of(&fleet, &whole, &view, combine, arguments.telling)?;
    let names = scenario.names();
    let Start { known, absent, kept } = start_of(&whole, &fleet, names, arguments)?;
    let mut solver = Solver::default();
    solver.solve(&view, &costs, Some(&kept), known.iter().copied(), None);
    let goals = goals_of(&view, &solver, &absent);
    let Some(&(_, aim)) = goals.first() else {
        return Err(Refusal::new(
            "every final fact is known absent: nothing is left to be planned",
        ));
    };
    let aim = Literal::holds(aim);
    let ways = ways(&view, &costs, &kept, &known, aim, arguments.ways as usize);
    let best = ways.first();
    let (needed, of) = sizes(&whole, &view, &kept, &known);
    let likely = |plan: &Plan| {
        let most = arguments.outcomes as usize;
        let actions = actions_of(&scenario, &whole, plan);
        outcomes(names, &whole, &actions, most, |failing| {
            let mut kept = kept.clone();
            failing.iter().for_each(|&action| kept.actions[action as usize] = false);
            solver.solve(&view, &costs, Some(&kept), known.iter().copied(), Some(aim));
            solver.cost(aim)
        })
    };
    let solution = Solution {
        mission: scenario.scenario().name.clone(),
        combine: if arguments.parallel { "max" } else { "sum" },
        goals: goals.iter().map(|&(cost, fact)| goal(&whole, names, fact, cost)).collect(),
        cost: best.map(|plan| plan.cost),
        cost_once: best.map(|plan| plan.cost_once),
        turns: best.map(|plan| turns_of(&scenario, &whole, &view, plan)),
        steps: best.map_or_else(Vec::new, |plan| steps(&whole, names, plan)),
        rests_on: best
            .iter()
            .flat_map(|plan| &plan.rests_on)
            .map(|literal| name_of(&whole, names, *literal))
            .collect(),
        absent: arguments.absent.clone(),
        ways: ways
            .iter()
            .skip(1)
            .map(|plan| Way { cost: plan.cost, steps: steps(&whole, names, plan) })
            .collect(),
        outcomes: best.map_or_else(Vec::new, likely),
        kept: needed,
        of,
    };
    print_report(&solution, setting, arguments.all)?;
    Ok(Outcome::Success)
}

/// Final facts that are not known absent, with what they cost, the cheapest first.
fn goals_of(
    view: &BoardView<'_>,
    solver: &Solver,
    absent: &BTreeSet<FactId>,
) -> Vec<(f64, FactId)> {
    let mut goals: Vec<(f64, FactId)> = view
        .finals
        .iter()
        .map(|&fact| FactId(fact))
        .filter(|fact| !absent.contains(fact))
        .map(|fact| (solver.cost(Literal::holds(fact)), fact))
        .collect();
    goals.sort_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)));
    goals
}

/// What holds at the start, and what can be done at all.
struct Start {
    known: Vec<Literal>,
    absent: BTreeSet<FactId>,
    kept: Kept,
}

/// The start of the mission with what the command line takes to hold or to be known absent: what rests
/// on an absent fact is left out, on every board that shares it.
fn start_of(
    whole: &Whole,
    fleet: &FleetView<'_>,
    names: &NameTable,
    arguments: &SolveArguments,
) -> Result<Start, Refusal> {
    let view = whole.network().view();
    let facts = |name: &String| -> Result<Vec<FactId>, Refusal> {
        let subject = find(name, names, fleet).map_err(|error| Refusal::new(error.to_string()))?;
        let Thing::Fact(fact) = subject.thing else {
            return Err(Refusal::new(format!("`{name}` is no fact: name one as `CRAFT.FACT`")));
        };
        let linked = fleet.board(subject.craft).targets(fact);
        let own = whole.fact(subject.craft, fact);
        Ok(linked.map(|one| whole.fact(one.craft, one.fact)).chain([own]).collect())
    };
    let mut holds: BTreeSet<FactId> = view.initial.iter().map(|&fact| FactId(fact)).collect();
    for name in &arguments.known {
        holds.extend(facts(name)?);
    }
    let mut kept = Kept::everything(&view);
    let mut absent = BTreeSet::new();
    for name in &arguments.absent {
        for fact in facts(name)? {
            holds.remove(&fact);
            absent.insert(fact);
            for &reader in view.readers.row(fact.index()) {
                if reader & 1 == 0 {
                    kept.rules[(reader >> 1) as usize] = false;
                }
            }
        }
    }
    let known = holds.into_iter().map(Literal::holds);
    let known = known.chain(absent.iter().copied().map(Literal::is_absent)).collect();
    Ok(Start { known, absent, kept })
}

/// Facts, rules, actions and links that some way to some goal can need, and how many there are.
fn sizes(
    whole: &Whole,
    view: &BoardView<'_>,
    kept: &Kept,
    known: &[Literal],
) -> ([usize; 4], [usize; 4]) {
    let goals = view.finals.iter().map(|&fact| Literal::holds(FactId(fact)));
    let mut needed = Sound::new(view, known.iter().copied(), goals).kept(view);
    for (is_needed, &is_kept) in needed.rules.iter_mut().zip(&kept.rules) {
        *is_needed &= is_kept;
    }
    let [facts, rules, actions] = needed.counts();
    let own = whole.own_rules() as usize;
    let told = needed.rules[own..].iter().filter(|&&is_needed| is_needed).count();
    (
        [facts, rules - told, actions, told / 2 + told % 2],
        [
            view.fact_count as usize,
            own,
            view.action_count() as usize,
            (view.premises.row_count() - own) / 2,
        ],
    )
}

/// Turns until the goal of `plan` holds when every craft does its steps in this order.
fn turns_of(scenario: &ResolvedScenario, whole: &Whole, view: &BoardView<'_>, plan: &Plan) -> u32 {
    let who = |rule: u32| match whole.rule_of(rule) {
        Origin::Rule(craft, _) => Some(craft),
        Origin::Told { .. } => None,
    };
    let duration = |action: u32| {
        let (craft, action) = whole.action_of(action);
        let entry = scenario.action_entry(craft, action);
        entry.and_then(|entry| entry.duration).unwrap_or(1)
    };
    turns(plan, view, who, duration)
}

/// The actions of `plan`, with the likelihood that one run brings about what it presumes.
fn actions_of(scenario: &ResolvedScenario, whole: &Whole, plan: &Plan) -> Vec<(u32, f64)> {
    let actions: BTreeSet<u32> =
        plan.steps.iter().flat_map(|step| step.actions.iter().copied()).collect();
    let likelihood = |action: u32| {
        let (craft, action) = whole.action_of(action);
        scenario.action_entry(craft, action).and_then(|entry| entry.likelihood).unwrap_or(1.0)
    };
    actions.into_iter().map(|action| (action, likelihood(action))).collect()
}

/// The `most` likeliest outcomes of `actions`; `cost_without` says what the goal costs where some cannot
/// succeed.
fn outcomes(
    names: &NameTable,
    whole: &Whole,
    actions: &[(u32, f64)],
    most: usize,
    mut cost_without: impl FnMut(&[u32]) -> f64,
) -> Vec<Likely> {
    let likelihoods: Vec<f64> = actions.iter().map(|&(_, likelihood)| likelihood).collect();
    let shown = likeliest(&likelihoods, most).into_iter().map(|outcome| {
        let failing: Vec<u32> = outcome.failing.iter().map(|&place| actions[place].0).collect();
        let cost = cost_without(&failing);
        let named = failing.iter().map(|&action| {
            let (craft, action) = whole.action_of(action);
            format!("{}: {}", names.craft(craft), names.action(craft, action))
        });
        Likely {
            likelihood: outcome.likelihood,
            failing: named.collect(),
            cost: (cost < f64::INFINITY).then_some(cost),
        }
    });
    shown.collect()
}

/// A rule and an action cost what the mission says; telling another craft what `telling` says.
fn costs_of(
    fleet: &FleetView<'_>,
    whole: &Whole,
    view: &BoardView<'_>,
    combine: Combine,
    telling: f64,
) -> Result<Costs, Refusal> {
    let costs_at = |rule: u32| match whole.rule_of(rule) {
        Origin::Rule(craft, rule) => fleet.board(craft).rule_cost(rule.0),
        Origin::Told { .. } => telling,
    };
    let rules = (0..view.rule_count()).map(costs_at).collect();
    let actions = (0..view.action_count()).map(|action| {
        let (craft, action) = whole.action_of(action);
        fleet.board(craft).action_cost(action.0)
    });
    let actions = actions.collect();
    Costs::new(view, combine, rules, actions)
        .map_err(|error| Refusal::new(format!("{error}; `--telling` takes a number from 0 on")))
}

fn name_of(whole: &Whole, names: &NameTable, literal: Literal) -> String {
    let (craft, fact) = whole.fact_of(literal.fact());
    let sign = if literal == Literal::holds(literal.fact()) { "" } else { "!" };
    format!("{}: {sign}{}", names.craft(craft), names.fact(craft, fact))
}

fn goal(whole: &Whole, names: &NameTable, fact: FactId, cost: f64) -> Goal {
    Goal {
        fact: name_of(whole, names, Literal::holds(fact)),
        cost: (cost < f64::INFINITY).then_some(cost),
    }
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
