//! Every preset reads, checks, compiles, and survives being written back.

use crate::scenario::{
    Base, NameTable, Override, PRESETS, ResolvedScenario, compile, find_preset, load, load_text,
};
use shared_types::ids::{CraftId, FactId};
use shared_types::knowledge::{BoardView, FleetNetwork, Value};
use shared_types::wire::StrategyKind;

fn preset(name: &str) -> ResolvedScenario {
    match load(&Base::Preset(name.to_owned()), [], &[]) {
        Ok(scenario) => scenario,
        Err(error) => panic!("{name}: {:?}", miette::Report::from(error)),
    }
}

fn compiled(scenario: &ResolvedScenario) -> FleetNetwork {
    let mut network = FleetNetwork::default();
    compile(scenario, 7, 3, &mut network);
    network
}

#[test]
fn every_preset_compiles_to_a_valid_network() {
    for known in PRESETS {
        let scenario = preset(known.name);
        assert_eq!(scenario.scenario().name, known.name);
        assert!(!known.description().is_empty());
        assert!(known.text.lines().all(|line| line.chars().count() <= 80), "{}", known.name);
        let network = compiled(&scenario);
        network.view().validate().unwrap();
        assert_eq!(network.view().craft_count(), scenario.craft_count(), "{}", known.name);
        assert_eq!(&network.topology, scenario.topology(), "{}", known.name);
    }
}

#[test]
fn every_preset_written_back_is_the_same_scenario() {
    for known in PRESETS {
        let scenario = preset(known.name);
        let text = scenario.to_toml();
        let again = load_text("scenario.resolved.toml", &text, &[]).unwrap();
        assert_eq!(again, scenario, "{}", known.name);
        assert_eq!(again.to_toml(), text, "{}", known.name);
    }
}

#[test]
fn defaults_are_spelt_out_in_the_resolved_form() {
    let text = preset("two-craft").to_toml();
    for line in ["seed = 1", "turns = 200", "wake = \"adaptive\"", "record-bytes = 16"] {
        assert!(text.lines().any(|written| written == line), "{line} is missing in\n{text}");
    }
}

#[test]
fn presets_have_the_crafts_that_they_promise() {
    for (name, craft_count) in [
        ("compare", 10),
        ("two-craft", 2),
        ("planetary-survey", 9),
        ("hierarchy-13", 13),
        ("generated", 5),
        ("sparse", 100),
    ] {
        assert_eq!(preset(name).craft_count(), craft_count, "{name}");
    }
    assert!(find_preset("two-craft").unwrap().text.lines().count() <= 48, "fits a screen");
}

/// A mission played by its laws alone: every craft runs its first candidate, changes reach all
/// sharers before the next turn. Returns the turns until a final fact held, `None` if none ever did.
fn turns_to_final(network: &FleetNetwork, turns_max: u32) -> Option<u32> {
    let view = network.view();
    let mut values: Vec<Vec<Value>> = view
        .boards
        .iter()
        .map(|board| {
            let value = |fact| match board.initial.binary_search(&fact) {
                Ok(_) => Value::Asserted,
                Err(_) => Value::Unknown,
            };
            (0..board.fact_count).map(value).collect()
        })
        .collect();
    let mut has_run: Vec<Vec<bool>> = view
        .boards
        .iter()
        .map(|board| vec![false; (board.rule_count() + board.action_count()) as usize])
        .collect();
    let mut queued: Vec<Vec<u32>> = vec![Vec::new(); view.boards.len()];
    for turn in 1..=turns_max {
        let mut changes = Vec::new();
        for (craft, board) in view.boards.iter().enumerate() {
            let outputs = fire(board, &values[craft], &mut has_run[craft], &mut queued[craft]);
            changes.extend(outputs.into_iter().map(|output| (craft, output)));
        }
        for (craft, packed) in changes {
            let output = shared_types::knowledge::Literal(packed);
            values[craft][output.fact().index()] = output.wanted();
            for target in view.boards[craft].targets(output.fact()) {
                values[target.craft.index()][target.fact.index()] = output.wanted();
            }
        }
        let is_reached = |(board, values): (&BoardView<'_>, &Vec<Value>)| {
            board.finals.iter().any(|&fact| values[fact as usize] == Value::Asserted)
        };
        if view.boards.iter().zip(&values).any(is_reached) {
            return Some(turn);
        }
    }
    None
}

/// Runs the first candidate of a board; returns its outputs.
fn fire(
    board: &BoardView<'_>,
    values: &[Value],
    has_run: &mut [bool],
    queued: &mut Vec<u32>,
) -> Vec<u32> {
    let is_met = |&packed: &u32| {
        let premise = shared_types::knowledge::Literal(packed);
        premise.is_met_by(values[premise.fact().index()])
    };
    let rule_count = board.rule_count();
    let rule = (0..rule_count).find(|&rule| {
        let may_run = !has_run[rule as usize] || board.repeating_rules.contains(&rule);
        may_run && board.premises.row(rule as usize).iter().all(is_met)
    });
    if let Some(rule) = rule {
        has_run[rule as usize] = true;
        queued.extend(board.queues.row(rule as usize));
        return board.outputs.row(rule as usize).to_vec();
    }
    queued.pop().map_or_else(Vec::new, |action| board.action_outputs.row(action as usize).to_vec())
}

#[test]
fn every_mission_reaches_its_final_fact() {
    for (name, turns_max) in [("two-craft", 6), ("planetary-survey", 40), ("hierarchy-13", 40)] {
        let turns = turns_to_final(&compiled(&preset(name)), turns_max);
        assert!(turns.is_some(), "{name} is not over after {turns_max} turns");
    }
}

fn fact(names: &NameTable, craft: &str, fact: &str) -> (CraftId, FactId) {
    let craft = names.craft_id(craft).unwrap();
    (craft, names.fact_id(craft, fact).unwrap())
}

#[test]
fn a_shared_fact_is_linked_from_each_sharer_to_every_other() {
    let scenario = preset("planetary-survey");
    let network = compiled(&scenario);
    let names = scenario.names();
    let sharers: Vec<(CraftId, FactId)> = ["aerial-1", "ground-1", "ground-2", "ground-3"]
        .map(|craft| fact(names, craft, "water-found"))
        .to_vec();
    for &(craft, own) in &sharers {
        let view = network.view();
        let targets: Vec<(CraftId, FactId)> =
            view.board(craft).targets(own).map(|target| (target.craft, target.fact)).collect();
        let others: Vec<_> = sharers.iter().copied().filter(|(other, _)| *other != craft).collect();
        assert_eq!(targets, others, "{}", names.craft(craft));
    }
}

#[test]
fn a_link_joins_facts_of_different_names() {
    let scenario = preset("planetary-survey");
    let (orbiter, summary) = fact(scenario.names(), "orbiter", "south-surveyed");
    let (aerial, own) = fact(scenario.names(), "aerial-2", "sector-surveyed");
    let network = compiled(&scenario);
    assert_eq!(network.view().board(aerial).target_on(own, orbiter), Some(summary));
    assert_eq!(network.view().board(orbiter).target_on(summary, aerial), Some(own));
}

#[test]
fn a_shared_fact_that_holds_somewhere_at_the_start_holds_on_all_its_boards() {
    let scenario = preset("planetary-survey");
    let network = compiled(&scenario);
    for craft in ["aerial-1", "ground-1", "ground-3"] {
        let (craft, wind) = fact(scenario.names(), craft, "wind-high");
        assert!(network.view().board(craft).initial.contains(&wind.0));
    }
}

#[test]
fn groups_are_led_by_the_member_nearest_the_root() {
    let scenario = preset("planetary-survey");
    let id = |name| scenario.names().craft_id(name).unwrap();
    let leader_parent = &scenario.topology().leader_parent;
    assert_eq!(leader_parent[id("ground-3").index()], id("aerial-1").0);
    assert_eq!(leader_parent[id("aerial-2").index()], id("orbiter").0);
    assert!(scenario.strategies().contains(&StrategyKind::Hybrid));
}

#[test]
fn positions_give_delay_and_range() {
    let scenario = preset("planetary-survey");
    let id = |name| scenario.names().craft_id(name).unwrap();
    let links = scenario.links();
    // 397.6 km up and 21.1 km across at the speed of light.
    let up_ns = links.delay_ns(id("aerial-1"), id("orbiter"));
    assert!((1_326_000..1_328_500).contains(&up_ns), "{up_ns}");
    assert_eq!(up_ns, links.delay_ns(id("orbiter"), id("aerial-1")));
    assert!(!links.is_out_of_range(id("ground-1"), id("orbiter")));
    assert_eq!(scenario.notices().len(), 1);
}

#[test]
fn a_mission_is_the_same_in_every_trial_and_a_generated_network_is_not() {
    let (mut first, mut second) = (FleetNetwork::default(), FleetNetwork::default());
    for (name, is_same) in [("two-craft", true), ("generated", false)] {
        let scenario = preset(name);
        compile(&scenario, 7, 0, &mut first);
        compile(&scenario, 7, 1, &mut second);
        assert_eq!(first == second, is_same, "{name}");
    }
}

#[test]
fn a_fleet_by_number_can_be_counted_anew_and_a_listed_one_cannot() {
    assert_eq!(preset("compare").with_craft_count(3).unwrap().craft_count(), 3);
    let error = preset("two-craft").with_craft_count(3).unwrap_err();
    assert!(error.message().contains("[[craft]] lists 2"), "{}", error.message());
}

#[test]
fn a_simulated_sparse_fleet_may_have_ten_thousand_crafts() {
    let overrides = [
        Override::set("fleet.crafts=10000").unwrap(),
        Override::set("run.mode=simulated").unwrap(),
    ];
    let scenario = load(&Base::Preset("sparse".to_owned()), [], &overrides).unwrap();
    assert_eq!(scenario.craft_count(), 10_000);
}
