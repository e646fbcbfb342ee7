//! Default < file < environment < flag, for any key.

use crate::scenario::{Base, Override, ScenarioError, load};
use shared_types::scenario::{CraftCount, LinkingModel, OneOrMany};
use shared_types::wire::StrategyKind;
use std::io::Write;

fn file(text: &str) -> tempfile::NamedTempFile {
    let mut file = tempfile::NamedTempFile::new().unwrap();
    file.write_all(text.as_bytes()).unwrap();
    file
}

fn variable(name: &str, value: &str) -> (String, String) {
    (name.to_owned(), value.to_owned())
}

fn refusal(environment: &[(&str, &str)], settings: &[&str]) -> ScenarioError {
    let environment = environment.iter().map(|(name, value)| variable(name, value));
    let overrides: Vec<Override> =
        settings.iter().map(|setting| Override::set(setting).unwrap()).collect();
    load(&Base::Preset("generated".to_owned()), environment, &overrides).unwrap_err()
}

#[test]
fn a_later_layer_overrides_an_earlier_one() {
    let file = file("[fleet]\ncrafts = 3\n[network]\n[run]\nseed = 10\ntrials = 20\nturns = 30\n");
    let base = Base::File(file.path().to_owned());
    let environment =
        [variable("SLATESWARM_RUN__TRIALS", "21"), variable("SLATESWARM_RUN__TURNS", "31")];
    let flags = [Override::flag("--turns 32", "run.turns", "32")];
    let scenario = load(&base, environment, &flags).unwrap();
    let run = &scenario.scenario().run;
    assert_eq!(run.timing_turns, 200, "default");
    assert_eq!(run.seed, 10, "file");
    assert_eq!(run.trials, 21, "environment");
    assert_eq!(run.turns, 32, "flag");
}

#[test]
fn of_two_settings_of_a_key_the_later_holds() {
    let settings = ["run.seed=5", "run.seed = 6"].map(|setting| Override::set(setting).unwrap());
    let scenario = load(&Base::Preset("two-craft".to_owned()), [], &settings).unwrap();
    assert_eq!(scenario.scenario().run.seed, 6);
}

#[test]
fn values_from_outside_are_toml_or_bare_words() {
    let settings = [
        "network.linking=sparse",
        "fleet.crafts={ orbital = 1, ground = 4 }",
        "replication.strategy=boundary",
        "link.delay-ms=2.5",
        "name=night run",
    ]
    .map(|setting| Override::set(setting).unwrap());
    let scenario = load(&Base::Preset("generated".to_owned()), [], &settings).unwrap();
    let written = scenario.scenario();
    assert_eq!(written.network.as_ref().unwrap().linking, LinkingModel::Sparse);
    assert_eq!(written.fleet.crafts.as_ref().map(CraftCount::total), Some(5));
    assert_eq!(written.replication.strategies, Some(OneOrMany(vec![StrategyKind::Boundary])));
    assert!((written.link.delay_ms - 2.5).abs() < f64::EPSILON);
    assert_eq!(written.name, "night run");
    assert_eq!(scenario.crafts()[1].name, "ground-0");
}

#[test]
fn strategy_and_strategies_override_each_other() {
    let settings =
        ["replication.strategies=[\"full\", \"null\"]", "replication.strategy=\"limited\""]
            .map(|setting| Override::set(setting).unwrap());
    let scenario = load(&Base::Preset("compare".to_owned()), [], &settings).unwrap();
    assert_eq!(scenario.strategies(), [StrategyKind::Limited]);
}

#[test]
fn entries_of_a_list_are_set_by_their_position() {
    let settings = ["rule.0.repeat=true", "craft.1.name=drone"];
    let settings = settings.map(|setting| Override::set(setting).unwrap());
    let error = load(&Base::Preset("two-craft".to_owned()), [], &settings).unwrap_err();
    assert!(error.message().contains("`aerial`"), "the file still says aerial: {error}");
    let scenario = load(&Base::Preset("two-craft".to_owned()), [], &settings[..1]).unwrap();
    assert!(scenario.scenario().rule[0].repeat && !scenario.scenario().rule[1].repeat);
}

#[test]
fn variables_without_a_section_are_left_alone() {
    let environment = [variable("SLATESWARM_TEST_LOCK", "x"), variable("HOME__X", "y")];
    assert!(load(&Base::Preset("two-craft".to_owned()), environment, &[]).is_ok());
}

#[test]
fn errors_of_variables_and_flags_name_them() {
    for (environment, settings, source, message) in [
        (
            &[("SLATESWARM_RUN__SEAD", "7")][..],
            &[][..],
            "SLATESWARM_RUN__SEAD",
            "unknown key `sead`",
        ),
        (
            &[("SLATESWARM_RUN__SEED", "x")],
            &[],
            "SLATESWARM_RUN__SEED",
            "`seed` takes a whole number",
        ),
        (&[], &["run.turns=0"], "--set run.turns=0", "`run.turns` is 0"),
        (
            &[("SLATESWARM_RUN__TURNS", "0")],
            &["run.turns=0"],
            "--set run.turns=0",
            "`run.turns` is 0",
        ),
        (&[], &["run..turns=3"], "--set run..turns=3", "not valid TOML"),
        (&[], &["run.turns=[3"], "--set run.turns=[3", "not valid TOML"),
        (&[], &["craft.9.name=x"], "--set craft.9.name=x", "`craft` takes a list"),
        (&[], &["fleet.crafts=200"], "--set fleet.crafts=200", "200 crafts are more than the 128"),
    ] {
        let error = refusal(environment, settings);
        let position = error.position().unwrap_or_else(|| panic!("{error} has no place"));
        assert_eq!(position.source, source);
        assert!(error.message().contains(message), "{error}");
        assert!(error.remedy().is_some(), "{error}");
    }
}

#[test]
fn a_setting_without_a_value_is_refused() {
    let error = Override::set("run.turns").unwrap_err();
    assert!(error.message().contains("sets nothing"));
    assert!(error.remedy().unwrap().contains("--set run.seed=7"));
}

#[test]
fn a_value_cannot_smuggle_in_another_key() {
    let error = refusal(&[("SLATESWARM_RUN__SEED", "7\ntrials = 3")], &[]);
    assert!(error.message().contains("`seed` takes a whole number"), "{error}");
}
