//! `report`: the tables of a run again, from its directory alone, and beside them a page with pictures.

use super::compare::published_means;
use super::{Refusal, Setting, print_report, program, sweep};
use crate::cli::{Format, ReportArguments};
use crate::outcome::Outcome;
use crate::report::campaign::CampaignReport;
use crate::report::compare::Compare;
use crate::report::page::{PICTURES_FOLDER, Page};
use crate::report::run::Mission;
use crate::results::read::read_run;
use crate::results::store::SCENARIO_FILE;
use crate::results::summary::Summary;
use crate::results::sweep::SweepFile;
use shared_types::scenario::{GeneratedNetwork, Scenario};
use std::path::Path;

/// What `--pictures` says for nothing at all.
const NO_PICTURES: &str = "none";

/// Reads the directory and prints what is there.
///
/// # Errors
/// If it is no run directory.
pub fn report(arguments: &ReportArguments, setting: Setting) -> Result<Outcome, Refusal> {
    if let Some(directory) = SweepFile::find(&arguments.directory) {
        let report = sweep::read(&directory, &arguments.metrics)?;
        write_page(arguments, &directory, setting, || report.page());
        return print_report(&report, setting, arguments.all);
    }
    if !arguments.metrics.is_empty() {
        return Err(Refusal::new(
            "`--metrics` chooses what the table of a sweep shows; a run's has all",
        ));
    }
    let run = read_run(&arguments.directory).map_err(|error| Refusal::new(error.to_string()))?;
    let summary = Summary::of(&run);
    let directory = arguments.directory.clone();
    let provenance = summary.timing.provenance.as_ref();
    let verb = provenance.and_then(|provenance| provenance.command.first().cloned());
    if summary.timing.campaign.is_some() {
        let report = CampaignReport { summary, directory, program: program() };
        return print_report(&report, setting, arguments.all);
    }
    if verb.is_some_and(|verb| verb == "compare" || verb == "reproduce") {
        let published = if is_published(&directory) { published_means() } else { Vec::new() };
        let report = Compare { summary, published, directory, program: program() };
        write_page(arguments, &run.directory, setting, || report.page(&run));
        print_report(&report, setting, arguments.all)
    } else {
        let report = Mission { summary, directory, program: program() };
        write_page(arguments, &run.directory, setting, || report.page(&run));
        print_report(&report, setting, arguments.all)
    }
}

/// Writes the page and the pictures where they are wanted, and says where. A place that cannot be
/// written is no reason to print no tables.
fn write_page(
    arguments: &ReportArguments,
    own: &Path,
    setting: Setting,
    page: impl FnOnce() -> Page,
) {
    let directory = match &arguments.pictures {
        Some(none) if none.as_os_str() == NO_PICTURES => return,
        Some(directory) => directory,
        // A program that reads the other forms asks for files if it wants them.
        None if setting.format != Format::Table => return,
        None => own,
    };
    match page().write(directory) {
        Ok(written) if !setting.is_quiet => {
            let pictures = written.len() - 1;
            let page = written[0].display();
            eprintln!("page      {page}, with {pictures} pictures, also in {PICTURES_FOLDER}/");
        }
        Ok(_) => {}
        Err(error) => eprintln!("no pictures: {error}"),
    }
}

/// Whether the run in `directory` was the published experiment, whatever `--set` made of it.
fn is_published(directory: &Path) -> bool {
    let text = std::fs::read_to_string(directory.join(SCENARIO_FILE)).unwrap_or_default();
    let scenario = toml::from_str::<Scenario>(&text).unwrap_or_default();
    scenario.network == Some(GeneratedNetwork::default())
}
