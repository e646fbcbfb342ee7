//! `run` and `simulate`: a mission file or preset, on a real fleet or in one process.

use super::execute::{Destination, Job, Scope, execute, tell_how_to_resume};
use super::resume::{Resumed, with_typed};
use super::{Refusal, Setting, load_scenario, print_report, program};
use crate::cli::{Command, CommonArguments, RunArguments, SimulateArguments};
use crate::outcome::Outcome;
use crate::report::run::Mission;
use crate::results::store::Place;
use crate::scenario::ResolvedScenario;

/// Runs the scenario and prints its table.
///
/// # Errors
/// If something asked for is wrong; nothing was started then.
pub fn run(
    arguments: &RunArguments,
    is_simulated: bool,
    setting: Setting,
) -> Result<Outcome, Refusal> {
    let verb = if is_simulated && !arguments.simulated { "simulate" } else { "run" };
    let Some(directory) = &arguments.resume else {
        let Some(name) = arguments.scenario.as_deref() else {
            return Err(Refusal::new(format!(
                "which scenario? `{verb} two-craft` runs a preset; `list` names them all"
            )));
        };
        let scenario = load_scenario(name, &arguments.common, is_simulated)?;
        let destination = Destination::New(Place::Below(&arguments.common.out));
        return run_from(scenario, &arguments.common, destination, verb, setting);
    };
    let resumed = Resumed::open(directory)?;
    let stored = match (verb, resumed.command) {
        ("run", Command::Run(stored))
        | ("simulate", Command::Simulate(SimulateArguments { run: stored, .. })) => stored,
        (_, command) => return Err(Resumed { command, ..resumed }.of_another_verb()),
    };
    let common = with_typed(stored.common, &arguments.common);
    let destination = Destination::Resumed(Box::new(resumed.unfinished));
    run_from(resumed.scenario, &common, destination, verb, setting)
}

fn run_from(
    scenario: ResolvedScenario,
    common: &CommonArguments,
    destination: Destination<'_>,
    verb: &str,
    setting: Setting,
) -> Result<Outcome, Refusal> {
    let name = scenario.scenario().name.clone();
    let scenarios = vec![scenario];
    let scope = Scope::All;
    let job =
        Job { name: &name, scenarios, scope, load_sizes: None, common, destination, part: None };
    let executed = execute(job, setting)?;
    let report =
        Mission { summary: executed.summary, directory: executed.directory, program: program() };
    tell_how_to_resume(verb, executed.outcome, &report.directory, setting);
    print_report(&report, setting, common.all)?;
    Ok(executed.outcome)
}
