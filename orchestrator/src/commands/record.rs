//! `record`: the trace of a scenario as a file.

use super::{Refusal, load_scenario, print_bytes};
use crate::cli::{CommonArguments, RecordArguments};
use crate::outcome::Outcome;
use crate::scenario::{ResolvedScenario, compile};
use crate::workload::{self, Trace};
use shared_types::knowledge::{FleetNetwork, FleetView};
use std::path::Path;

/// Prints the trace of one trial as CSV.
///
/// # Errors
/// If the scenario or the file that it names is wrong, or nothing can be drawn from it.
pub fn record(arguments: &RecordArguments) -> Result<Outcome, Refusal> {
    let common = CommonArguments {
        set: arguments.set.clone(),
        seed: arguments.seed,
        ..CommonArguments::default()
    };
    let scenario = load_scenario(&arguments.scenario, &common, false)?;
    let mut network = FleetNetwork::default();
    compile(&scenario, scenario.scenario().run.seed, arguments.trial, &mut network);
    let fleet = network.view();
    let trace = match &scenario.scenario().trace.file {
        Some(path) => trace_from_file(path, &scenario, &fleet)?,
        None => workload::draw(scenario.scenario(), &fleet, arguments.trial)?,
    };
    let mut file = Vec::new();
    workload::write(&trace, scenario.names(), &mut file)
        .map_err(|error| Refusal::new(format!("cannot write the trace: {error}")))?;
    print_bytes(&file)
}

/// Reads the trace in `path` for the fleet of `scenario`.
pub(super) fn trace_from_file(
    path: &Path,
    scenario: &ResolvedScenario,
    fleet: &FleetView<'_>,
) -> Result<Trace, Refusal> {
    let shown = path.display().to_string();
    let file = std::fs::File::open(path)
        .map_err(|error| Refusal::new(format!("cannot read the trace `{shown}`: {error}")))?;
    let file = std::io::BufReader::new(file);
    Ok(workload::read(&shown, file, fleet, scenario.names())?)
}
