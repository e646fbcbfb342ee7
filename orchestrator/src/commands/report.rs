//! `report`: the tables of a run again, from its directory alone.

use super::compare::published_means;
use super::{Refusal, Setting, print_report, program};
use crate::cli::ReportArguments;
use crate::outcome::Outcome;
use crate::report::compare::Compare;
use crate::report::run::Mission;
use crate::results::read::read_run;
use crate::results::store::SCENARIO_FILE;
use crate::results::summary::Summary;
use shared_types::scenario::{GeneratedNetwork, Scenario};
use std::path::Path;

/// Reads the directory and prints what is there.
///
/// # Errors
/// If it is no run directory.
pub fn report(arguments: &ReportArguments, setting: Setting) -> Result<Outcome, Refusal> {
    let run = read_run(&arguments.directory).map_err(|error| Refusal::new(error.to_string()))?;
    let summary = Summary::of(&run);
    let directory = arguments.directory.clone();
    let provenance = summary.timing.provenance.as_ref();
    let verb = provenance.and_then(|provenance| provenance.command.first().cloned());
    if verb.is_some_and(|verb| verb == "compare" || verb == "reproduce") {
        let published = if is_published(&directory) { published_means() } else { Vec::new() };
        let report = Compare { summary, published, directory, program: program() };
        print_report(&report, setting, arguments.all)
    } else {
        let report = Mission { summary, directory, program: program() };
        print_report(&report, setting, arguments.all)
    }
}

/// Whether the run in `directory` was the published experiment, whatever `--set` made of it.
fn is_published(directory: &Path) -> bool {
    let text = std::fs::read_to_string(directory.join(SCENARIO_FILE)).unwrap_or_default();
    let scenario = toml::from_str::<Scenario>(&text).unwrap_or_default();
    scenario.network == Some(GeneratedNetwork::default())
}
