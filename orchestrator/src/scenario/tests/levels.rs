//! Levels: what is refused, and that the facts which stand for them say what the numbers say.

use super::bad_input::refused;
use crate::scenario::{ResolvedScenario, compile, load_text};
use agent::oracle::Replay;
use proptest::prelude::{ProptestConfig, any, prop_assert, proptest};
use shared_types::ids::{CraftId, FactId, FiringTarget, RuleId};
use shared_types::knowledge::{FleetNetwork, Value};
use shared_types::rng::{Purpose, Stream};
use shared_types::wire::StrategyKind;
use std::fmt::Write as _;

const ROVER: &str = r#"[[craft]]
name = "rover"
initial = ["battery = 80"]
final = ["home"]

[[craft]]
name = "base"

[[rule]]
craft = "rover"
if = ["battery >= 50"]
then = ["battery = 19.5", "drove"]

[[rule]]
craft = "rover"
if = ["drove", "battery < 20.0"]
then = ["home"]
"#;

fn replayed(scenario: &ResolvedScenario, network: &mut FleetNetwork) -> Replay {
    compile(scenario, scenario.scenario().run.seed, 0, network);
    let fleet = network.view();
    fleet.validate().unwrap();
    Replay::of(&fleet, &scenario.epoch_spec(StrategyKind::Boundary, 0))
}

#[test]
fn a_level_above_and_below_leads_a_mission() {
    let scenario = load_text("rover.toml", ROVER, &[]).unwrap();
    let mut network = FleetNetwork::default();
    let replay = replayed(&scenario, &mut network);
    assert_eq!(replay.turns, 2);
    let value = |name: &str| {
        let fact = scenario.names().fact_id(CraftId(0), name).unwrap();
        replay.boards[0][fact.index()].value
    };
    assert_eq!((value("battery >= 50"), value("battery < 20")), (Value::Absent, Value::Asserted));
    assert_eq!(load_text("again", &scenario.to_toml(), &[]).unwrap().scenario().rule.len(), 2);
}

#[test]
fn a_shared_level_is_shared_as_all_its_comparisons() {
    let more = "[[boundary]]\nfact = \"battery\"\n[[rule]]\ncraft = \"base\"\n\
                if = [\"battery < 20\"]\nthen = [\"worried\"]\n";
    let text = ROVER.replace("final = [\"home\"]\n", "") + more;
    let scenario = load_text("rover.toml", &text, &[]).unwrap();
    let mut network = FleetNetwork::default();
    let replay = replayed(&scenario, &mut network);
    let fact = scenario.names().fact_id(CraftId(1), "worried").unwrap();
    assert_eq!(replay.boards[1][fact.index()].value, Value::Asserted);
}

#[test]
fn levels_that_mean_nothing_are_refused() {
    let rows: [(&str, &str, &str, &str); 9] = [
        ("battery >= 50", "battery >= fifty", "is no number", "battery >= 20"),
        ("battery >= 50", "battery >= nan", "is no number", "battery >= 20"),
        ("battery >= 50", "!battery >= 50", "negates a comparison", "turn it round"),
        ("battery >= 50", "battery = 50", "sets a level and asks nothing", "battery >= 50"),
        ("battery = 19.5", "battery < 19.5", "compares a level", "battery = 19.5"),
        ("battery = 19.5", "fuel = 19.5", "nothing compares the level `fuel`", "fuel >= 20"),
        ("battery = 80", "fuel = 80", "nothing compares the level `fuel`", "fuel >= 20"),
        ("battery >= 50", "bat tery >= 50", "cannot name a level", "letters"),
        ("\"drove\"]", "\"battery = 3\"]", "stands twice", "keep one"),
    ];
    for (old, new, message, remedy) in rows {
        let error = refused(&ROVER.replacen(old, new, 1));
        assert!(error.message().contains(message), "{new}: {error}");
        assert!(error.remedy().unwrap().contains(remedy), "{new}: {:?}", error.remedy());
        assert!(error.position().is_some(), "{new}");
    }
    let linked = format!("{ROVER}[[boundary]]\nlink = [\"rover.battery\", \"base.power\"]\n");
    assert!(refused(&linked).message().contains("`battery` is a level"));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// One craft sets a level to numbers in any order while others watch it; the plain form keeps the
    /// number and compares it.
    #[test]
    fn rules_fire_exactly_when_the_number_meets_them(seed in any::<u64>()) {
        let mut stream = Stream::new(seed, 0, Purpose::Test, 0);
        let start = stream.below(20);
        let mut text = format!(
            "[[craft]]\nname = \"a\"\ninitial = [\"on\", \"x = {start}\"]\n[run]\nseed = {}\n",
            seed >> 2
        );
        let settings: Vec<u32> = (0..stream.between(1, 6)).map(|_| stream.below(20)).collect();
        let signs = [">=", "<=", ">", "<"];
        let watches: Vec<(usize, u32)> =
            (0..stream.between(1, 8)).map(|_| (stream.below(4) as usize, stream.below(20))).collect();
        for (number, value) in settings.iter().enumerate() {
            let then = format!("\"x = {value}\", \"set-{number}\"");
            let _infallible = writeln!(text, "[[rule]]\nif = [\"on\"]\nthen = [{then}]");
        }
        for (number, (sign, bound)) in watches.iter().enumerate() {
            let premise = format!("x {} {bound}", signs[*sign]);
            let _infallible =
                writeln!(text, "[[rule]]\nif = [\"{premise}\"]\nthen = [\"seen-{number}\"]");
        }
        // Where nothing can ever meet a comparison the mission is refused as any other is.
        let Ok(scenario) = load_text("levels", &text, &[]) else { return Ok(()) };
        let mut network = FleetNetwork::default();
        let replay = replayed(&scenario, &mut network);
        let meets = |value: u32, (sign, bound): (usize, u32)| match sign {
            0 => value >= bound,
            1 => value <= bound,
            2 => value > bound,
            _ => value < bound,
        };
        let mut level = start;
        let mut has_fired = vec![false; watches.len()];
        for fired in &replay.firings {
            let rules = network.boards[0].view().rule_count();
            let Some(FiringTarget::Rule(RuleId(rule))) = fired.firing.target(rules) else { continue };
            match (rule as usize).checked_sub(settings.len()) {
                None => level = settings[rule as usize],
                Some(watch) => {
                    prop_assert!(meets(level, watches[watch]), "{text}");
                    has_fired[watch] = true;
                }
            }
        }
        // The trial ended because nothing more could fire.
        for (watch, has_fired) in watches.iter().zip(has_fired) {
            prop_assert!(has_fired || !meets(level, *watch), "{text}");
        }
        let known = replay.boards[0].iter().zip(0..).filter(|(state, _)| state.value == Value::Asserted);
        for (_, fact) in known {
            let name = scenario.names().fact(CraftId(0), FactId(fact)).into_owned();
            if let [_, sign, bound] = name.split(' ').collect::<Vec<_>>()[..] {
                let sign = signs.iter().position(|known| *known == sign).unwrap();
                prop_assert!(meets(level, (sign, bound.parse().unwrap())), "{name}: {text}");
            }
        }
    }
}
