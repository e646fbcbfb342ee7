//! What users write: scenario files and traces.

use crate::scenario::{PRESETS, ResolvedScenario, compile, find_preset, load_text};
use crate::workload;
use shared_types::knowledge::{FleetNetwork, FleetView};
use std::io::Cursor;

/// Networks are built of fleets up to this size, and of boards up to so many facts, rules and actions.
const CRAFTS_BUILT_MAX: u32 = 8;
const ITEMS_BUILT_MAX: u32 = 3000;

/// A scenario is refused at a place in its text, or it can be written down and read again, and its
/// networks hold what crafts demand of them.
pub(super) fn read(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    match load_text("any.toml", text, &[]) {
        Ok(scenario) => check(&scenario),
        Err(error) => {
            let position = error.position().expect("every refusal of a text has a place");
            assert!(position.line <= text.matches('\n').count() + 1, "{error}");
            assert!(!error.message().is_empty());
        }
    }
}

pub(super) fn check(scenario: &ResolvedScenario) {
    let text = scenario.to_toml();
    let again = load_text("any.toml", &text, &[]);
    let again = again.unwrap_or_else(|error| panic!("{error} in what was written:\n{text}"));
    assert_eq!(again.scenario(), scenario.scenario());
    let items = scenario.scenario().network.as_ref().map_or(0, |network| {
        network.facts.saturating_add(network.rules).saturating_add(network.actions)
    });
    if scenario.craft_count() <= CRAFTS_BUILT_MAX && items <= ITEMS_BUILT_MAX {
        let mut network = FleetNetwork::default();
        compile(scenario, scenario.scenario().run.seed, 0, &mut network);
        let archive = network.to_archive();
        let view = FleetView::from_archive(&archive);
        assert!(view.is_ok(), "{:?}: {text}", view.err());
    }
}

/// The presets.
pub(super) fn seeds() -> Vec<Vec<u8>> {
    PRESETS.iter().map(|preset| preset.text.as_bytes().to_vec()).collect()
}

/// The preset of two crafts, and one that has no facts.
fn surveyed() -> (ResolvedScenario, FleetNetwork) {
    let preset = find_preset("two-craft").expect("a preset");
    let text = format!("{}\n[[craft]]\nname = \"idle\"\nparent = \"orbiter\"\n", preset.text);
    let scenario = load_text("survey", &text, &[]).unwrap_or_else(|error| panic!("{error}"));
    let mut network = FleetNetwork::default();
    compile(&scenario, 1, 0, &mut network);
    (scenario, network)
}

/// A trace is refused, or it is the same after it was written and read again.
pub(super) fn traces(bytes: &[u8]) {
    let (scenario, network) = surveyed();
    let (fleet, names) = (network.view(), scenario.names());
    let Ok(trace) = workload::read("any.csv", Cursor::new(bytes), &fleet, names) else { return };
    let mut written = Vec::new();
    workload::write(&trace, names, &mut written).expect("memory takes every trace");
    let again = workload::read("again.csv", Cursor::new(&written), &fleet, names);
    assert_eq!(again.as_ref(), Ok(&trace));
}

/// Every value, by name and by number, quoted, at equal times.
pub(super) fn traces_seeds() -> Vec<Vec<u8>> {
    let rows = "time_ns,craft,fact,value\n0,orbiter,target-seen,true\n0,orbiter,0,read\n\
                7,\"aerial\",target-seen,false\n9, orbiter ,in-orbit,true\n";
    vec![rows.as_bytes().to_vec(), rows.replace('\n', "\r\n").into_bytes()]
}
