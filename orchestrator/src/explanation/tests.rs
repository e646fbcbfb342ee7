//! Explanations of missions whose course is known, and of every fact of a random fleet.

use super::{Subject, Thing, Trial};
use crate::report::explain::{Explanation, Step};
use crate::scenario::{ResolvedScenario, find_preset, load_text};
use shared_types::ids::{CraftId, FactId};
use shared_types::knowledge::{FleetNetwork, Value};
use shared_types::wire::StrategyKind;

fn scenario(name: &str, more: &str) -> ResolvedScenario {
    let preset = find_preset(name).unwrap();
    load_text(name, &format!("{}\n{more}", preset.text), &[]).unwrap()
}

fn answer(scenario: &ResolvedScenario, strategy: StrategyKind, name: &str) -> Explanation {
    let mut network = FleetNetwork::default();
    let trial = Trial::of(scenario, strategy, 0, &mut network);
    trial.explain(trial.subject(name).unwrap())
}

fn told(step: &Step) -> String {
    format!("{} {} {}", step.craft, step.does, step.what)
}

#[test]
fn a_chain_crosses_crafts_by_telling() {
    let scenario = scenario("two-craft", "");
    let answer = answer(&scenario, StrategyKind::Boundary, "aerial.target-confirmed");
    assert!(answer.verdict.starts_with("holds, since turn"), "{answer:?}");
    assert_eq!(
        answer.steps.iter().map(told).collect::<Vec<_>>(),
        [
            "orbiter fires if in-orbit run take-image",
            "orbiter runs take-image",
            "orbiter tells target-seen",
            "aerial fires if airborne and target-seen run fly-over",
            "aerial runs fly-over",
        ]
    );
    assert_eq!(answer.steps[0].gives, ["queues take-image"]);
    assert_eq!(answer.steps[1].gives, ["target-seen"]);
    assert_eq!(answer.rests_on, ["aerial: airborne", "orbiter: in-orbit"]);
    assert!(answer.lacks.is_empty());
}

#[test]
fn changes_are_told_through_relays_and_under_each_crafts_own_name() {
    let scenario = scenario("planetary-survey", "");
    let answer = answer(&scenario, StrategyKind::Hierarchy, "orbiter.survey-complete");
    assert!(answer.steps.is_sorted_by_key(|step| step.turn));
    let report = answer
        .steps
        .iter()
        .find(|step| step.what.contains("sector-surveyed (its name there: north-surveyed)"))
        .unwrap();
    assert_eq!((report.craft.as_str(), report.to.as_deref()), ("aerial-1", Some("orbiter")));
    let relayed = answer.steps.iter().find(|step| step.what == "core-drawn").unwrap();
    assert_eq!(relayed.through.len(), 1, "{relayed:?}");
    // A fact that was taken back is explained by what took it back.
    let calm = super::tests::answer(&scenario, StrategyKind::Hierarchy, "ground-1.wind-high");
    assert!(calm.verdict.contains("known not to hold, since turn"), "{calm:?}");
    assert!(calm.steps.iter().any(|step| step.what == "!wind-high"), "{calm:?}");
}

/// The aerial craft waits for a fact that the orbiter never asserts.
#[test]
fn a_rule_that_did_not_fire_says_what_it_lacks_and_who_could_help() {
    let more = "[run]\nturns = 1\n";
    let scenario = scenario("two-craft", more);
    let rule = "aerial.if airborne and target-seen run fly-over";
    let answer = answer(&scenario, StrategyKind::Boundary, rule);
    assert_eq!(answer.verdict, "has not fired: 1 of 2 premises are not met");
    let lack = &answer.lacks[0];
    assert_eq!((lack.what.as_str(), lack.state.as_str()), ("aerial: target-seen", "unknown"));
    let maker = &lack.makers[0];
    assert_eq!((maker.craft.as_str(), maker.what.as_str()), ("orbiter", "take-image"));
    assert_eq!(maker.standing, "queued in turn 0, not run");
    let fact = super::tests::answer(&scenario, StrategyKind::Boundary, "aerial.target-confirmed");
    assert_eq!(fact.verdict, "is unknown: nothing asserted it");
    assert_eq!(fact.lacks[0].makers[0].standing, "never queued");
    let action = super::tests::answer(&scenario, StrategyKind::Boundary, "aerial.fly-over");
    assert_eq!(action.verdict, "has not run: no rule that runs it fired");
    assert_eq!(action.lacks[0].makers[0].standing, "lacks target-seen");
    let queued = super::tests::answer(&scenario, StrategyKind::Boundary, "orbiter.take-image");
    assert!(queued.verdict.contains("queued since turn 0"), "{queued:?}");
}

#[test]
fn a_rule_that_others_were_preferred_to_says_so() {
    let more = "[run]\nturns = 1\n[[rule]]\nname = \"late\"\ncraft = \"orbiter\"\n\
                if = [\"in-orbit\"]\nthen = [\"idle\"]\n[reasoning]\npolicy = \"best-path\"\n";
    let scenario = scenario("two-craft", more);
    let answer = answer(&scenario, StrategyKind::Boundary, "orbiter.late");
    assert!(answer.verdict.contains("it could have in 1 turns (0 to 0)"), "{answer:?}");
    assert!(answer.verdict.contains("`best-path` chose others"), "{answer:?}");
}

#[test]
fn names_that_mean_nothing_are_refused_with_what_was_meant() {
    let scenario = scenario("two-craft", "");
    let mut network = FleetNetwork::default();
    let trial = Trial::of(&scenario, StrategyKind::Boundary, 0, &mut network);
    let refused = |name: &str| trial.subject(name).unwrap_err().to_string();
    assert!(refused("target-seen").contains("`orbiter.NAME`"));
    assert!(refused("obiter.target-seen").contains("the crafts are orbiter, aerial"));
    assert!(refused("orbiter.target-sen").contains("did you mean `target-seen`?"));
}

/// Every chain begins with what held at the start, and every step of it rests on earlier ones.
#[test]
fn every_fact_of_generated_fleets_is_explained() {
    for trial in 0..3 {
        let text = "fleet.crafts = 4\n[network]\nfacts = 60\nrules = 60\nactions = 40\n\
                    initial = 12\nfinals = 3\nlinks = 20\n";
        let scenario = load_text("generated", text, &[]).unwrap();
        let mut network = FleetNetwork::default();
        let trial = Trial::of(&scenario, StrategyKind::Hierarchy, trial, &mut network);
        let after = shared_types::ids::Turn(trial.replay.turns);
        for craft in (0..4).map(CraftId) {
            for fact in (0..60).map(FactId) {
                let answer = trial.explain(Subject { craft, thing: Thing::Fact(fact) });
                let holds = trial.value(craft, fact, after) == Value::Asserted;
                assert_eq!(holds, answer.verdict.starts_with("holds"), "{answer:?}");
                assert_eq!(holds, answer.lacks.is_empty(), "{answer:?}");
                assert_eq!(holds, !answer.rests_on.is_empty(), "{answer:?}");
                assert!(answer.steps.is_sorted_by_key(|step| step.turn));
            }
        }
    }
}
