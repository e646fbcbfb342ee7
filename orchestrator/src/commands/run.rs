//! `run` and `simulate`: a mission file or preset, on a real fleet or in one process.

use super::execute::{Scope, execute};
use super::{Refusal, Setting, load_scenario, print_report, program};
use crate::cli::RunArguments;
use crate::outcome::Outcome;
use crate::report::run::Mission;

/// Runs the scenario and prints its table.
///
/// # Errors
/// If something asked for is wrong; nothing was started then.
pub fn run(
    arguments: &RunArguments,
    is_simulated: bool,
    setting: Setting,
) -> Result<Outcome, Refusal> {
    let mode = is_simulated.then_some("simulated");
    let scenario = load_scenario(&arguments.scenario, &arguments.common, mode)?;
    let name = scenario.scenario().name.clone();
    let executed = execute(&name, vec![scenario], Scope::All, &arguments.common, setting)?;
    let report =
        Mission { summary: executed.summary, directory: executed.directory, program: program() };
    print_report(&report, setting, arguments.common.all)?;
    Ok(executed.outcome)
}
