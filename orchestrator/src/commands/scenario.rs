//! `list`, `show`, `validate`, `schema`: scenarios without running them.

use super::{Refusal, Setting, load_scenario, print_bytes};
use crate::cli::{CommonArguments, Format, ScenarioArguments};
use crate::outcome::Outcome;
use crate::report::table::wrap;
use crate::scenario::{self, PRESETS, ResolvedScenario, find_preset};
use std::fmt::Write as _;

/// Prints the presets.
///
/// # Errors
/// If standard output cannot be written.
pub fn list(setting: Setting) -> Result<Outcome, Refusal> {
    let mut text = String::new();
    match setting.format {
        Format::Table => {
            for preset in PRESETS {
                let _infallible = writeln!(text, "{:<18}{}", preset.name, preset.description());
            }
            text += "\nPrint one with `slateswarm show NAME`, run it with `slateswarm run NAME`.\n";
        }
        Format::Json => {
            let presets: Vec<serde_json::Value> = PRESETS
                .iter()
                .map(|preset| {
                    serde_json::json!({"name": preset.name, "description": preset.description()})
                })
                .collect();
            text = pretty(&serde_json::Value::Array(presets));
        }
        Format::Csv => {
            text += "name,description\n";
            for preset in PRESETS {
                let _infallible = writeln!(text, "{},\"{}\"", preset.name, preset.description());
            }
        }
    }
    print_bytes(text.as_bytes())
}

/// Prints a preset as the file it is, or the resolved form of a mission file.
///
/// # Errors
/// If there is no such scenario, or it is wrong.
pub fn show(arguments: &ScenarioArguments) -> Result<Outcome, Refusal> {
    match find_preset(&arguments.scenario) {
        Some(preset) if arguments.set.is_empty() => print_bytes(preset.text.as_bytes()),
        _ => print_bytes(resolved(arguments)?.to_toml().as_bytes()),
    }
}

/// Checks a scenario and says what it would run.
///
/// # Errors
/// If it is wrong; the diagnostic names place and remedy.
pub fn validate(arguments: &ScenarioArguments, setting: Setting) -> Result<Outcome, Refusal> {
    let resolved = resolved(arguments)?;
    let scenario = resolved.scenario();
    let strategies: Vec<&str> =
        resolved.strategies().iter().map(|strategy| strategy.name()).collect();
    let text = match setting.format {
        Format::Table => {
            let mut text = wrap(
                "",
                &format!(
                    "{}: {} crafts, {} trials of at most {} turns under {}",
                    scenario.name,
                    resolved.craft_count(),
                    scenario.run.trials,
                    scenario.run.turns,
                    strategies.join(", ")
                ),
            );
            for notice in resolved.notices() {
                text += &wrap("note: ", notice);
            }
            text
        }
        Format::Json | Format::Csv => pretty(&serde_json::json!({
            "name": scenario.name,
            "crafts": resolved.craft_count(),
            "trials": scenario.run.trials,
            "turns": scenario.run.turns,
            "strategies": strategies,
            "notices": resolved.notices(),
        })),
    };
    print_bytes(text.as_bytes())
}

/// Prints the JSON schema of mission files.
///
/// # Errors
/// If standard output cannot be written.
pub fn schema() -> Result<Outcome, Refusal> {
    print_bytes(pretty(&scenario::schema()).as_bytes())
}

fn resolved(arguments: &ScenarioArguments) -> Result<ResolvedScenario, Refusal> {
    let common = CommonArguments { set: arguments.set.clone(), ..CommonArguments::default() };
    load_scenario(&arguments.scenario, &common, false)
}

fn pretty(value: &serde_json::Value) -> String {
    let text = serde_json::to_string_pretty(value).expect("invariant: plain data has a JSON form");
    text + "\n"
}
