//! Every preset reads, checks, compiles, and survives being written back.

use crate::scenario::{
    Base, NameTable, Override, PRESETS, ResolvedScenario, compile, find_preset, load,
    load_simulated, load_text,
};
use agent::lockstep::Outcome;
use agent::oracle::{Observed, Replay, compare};
use agent::simulation::Simulation;
use shared_types::ids::{CraftId, FactId};
use shared_types::knowledge::FleetNetwork;
use shared_types::scenario::RunMode;
use shared_types::transport::link::StatedLink;
use shared_types::transport::memory::MemoryOptions;
use shared_types::wire::{EpochSpec, LinkSpec, StrategyKind};

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
        let dead = scenario.notices().iter().find(|notice| notice.contains("rule"));
        assert_eq!(dead, None, "{}", known.name);
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

#[test]
fn every_mission_reaches_its_final_fact_in_every_trial() {
    for (name, turns_max) in [("two-craft", 4), ("planetary-survey", 40), ("hierarchy-13", 40)] {
        let scenario = preset(name);
        let network = compiled(&scenario);
        for trial in 0..100 {
            let spec = scenario.epoch_spec(StrategyKind::Boundary, trial);
            let replay = Replay::of(&network.view(), &spec);
            assert_eq!(replay.outcome, Outcome::Finished, "{name}, trial {trial}");
            assert!(replay.turns <= turns_max, "{name}, trial {trial}: {} turns", replay.turns);
        }
    }
}

#[test]
fn what_is_simulated_plays_turns_or_its_open_mode_and_is_written_back_so() {
    for known in PRESETS {
        let stated = preset(known.name).scenario().run.mode;
        let simulated = load_simulated(&Base::Preset(known.name.to_owned()), [], &[]).unwrap();
        let mode = simulated.scenario().run.mode;
        assert!(mode.is_simulated() && mode.is_open() == stated.is_open(), "{}", known.name);
        let again = load_text("scenario.resolved.toml", &simulated.to_toml(), &[]).unwrap();
        assert_eq!(again.scenario().run.mode, mode, "{}", known.name);
    }
    let open = load_simulated(&Base::Preset("map".to_owned()), [], &[]).unwrap();
    assert_eq!(open.scenario().run.mode, RunMode::SimulatedOpen);
}

#[test]
fn every_preset_plays_as_replayed_under_all_its_strategies() {
    for known in PRESETS {
        // Only simulated turns repair what links do.
        let scenario = load_simulated(&Base::Preset(known.name.to_owned()), [], &[]).unwrap();
        let network = compiled(&scenario);
        let fleet = network.view();
        let mut simulation = Simulation::new(fleet.craft_count(), MemoryOptions::default());
        if let Some(link) = scenario.link_spec() {
            simulation.network().set_link(StatedLink::new(link.clone(), 7));
        }
        for &strategy in scenario.strategies() {
            if strategy == StrategyKind::Null {
                continue; // Replays a script that the run adds.
            }
            let spec = EpochSpec { turns_max: 60, ..scenario.epoch_spec(strategy, 3) };
            let replay = Replay::of(&fleet, &spec);
            let played = simulation.play(&spec, &fleet).unwrap();
            let observed = Observed {
                trial: spec.trial,
                turns: played.turns,
                outcome: played.outcome,
                path_digest: played.path_digest,
                reports: &played.reports,
            };
            let expected = replay.expected(&fleet, &spec, strategy);
            let differences: Vec<String> =
                compare(&replay, &expected, &observed).iter().map(ToString::to_string).collect();
            assert!(differences.is_empty(), "{}: {differences:#?}", known.name);
        }
    }
}

#[test]
fn positions_delay_a_simulated_mission_and_change_nothing_else() {
    let scenario = preset("planetary-survey");
    let network = compiled(&scenario);
    let spec = scenario.epoch_spec(StrategyKind::Boundary, 0);
    let play = |link: Option<&LinkSpec>| {
        let mut simulation = Simulation::new(9, MemoryOptions::default());
        if let Some(link) = link {
            simulation.network().set_link(StatedLink::new(link.clone(), 7));
        }
        simulation.play(&spec, &network.view()).unwrap()
    };
    let (near, far) = (play(None), play(scenario.link_spec()));
    assert_eq!(near.path, far.path);
    // The order goes down and two summaries come up, over 400 km each.
    let slower_ns = far.duration_ns.saturating_sub(near.duration_ns);
    assert!(slower_ns >= 2 * 1_326_000, "{slower_ns}");
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
    let links = scenario.link_spec().unwrap();
    // 397.6 km up and 21.1 km across at the speed of light.
    let up_ns = links.delay_ns(id("aerial-1"), id("orbiter"));
    assert!((1_326_000..1_328_500).contains(&up_ns), "{up_ns}");
    assert_eq!(up_ns, links.delay_ns(id("orbiter"), id("aerial-1")));
    assert!(!scenario.links().is_out_of_range(id("ground-1"), id("orbiter")));
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
