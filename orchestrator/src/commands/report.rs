//! `report`: the tables of a run again, from its directory alone.

use super::compare::published_means;
use super::{Refusal, Setting, print_report, program};
use crate::cli::ReportArguments;
use crate::outcome::Outcome;
use crate::report::compare::Compare;
use crate::report::run::Mission;
use crate::results::read::read_run;
use crate::results::summary::Summary;

/// Reads the directory and prints what is there.
///
/// # Errors
/// If it is no run directory.
pub fn report(arguments: &ReportArguments, setting: Setting) -> Result<Outcome, Refusal> {
    let run = read_run(&arguments.directory).map_err(|error| Refusal::new(error.to_string()))?;
    let summary = Summary::of(&run);
    let directory = arguments.directory.clone();
    let scenario = summary.deterministic.scenario.as_deref();
    if scenario.is_some_and(|name| ["compare", "reproduce"].contains(&name)) {
        let published = published_means();
        let report = Compare { summary, published, directory, program: program() };
        print_report(&report, setting, arguments.all)
    } else {
        let report = Mission { summary, directory, program: program() };
        print_report(&report, setting, arguments.all)
    }
}
