//! What `--resume DIR` takes from a run's directory: the arguments with which it was started, and its
//! scenario. Not here: what of the results stands (`results::resume`).

use super::Refusal;
use crate::cli::{Cli, Command, CommonArguments};
use crate::results::resume::Unfinished;
use crate::results::store::SCENARIO_FILE;
use crate::scenario::{ResolvedScenario, load_text};
use clap::Parser as _;
use std::path::Path;

/// A run that is to go on.
pub(super) struct Resumed {
    /// Its results.
    pub(super) unfinished: Unfinished,
    /// What was typed when it was started.
    pub(super) command: Command,
    /// Its scenario.
    pub(super) scenario: ResolvedScenario,
}

impl Resumed {
    /// Opens the run in `directory`.
    pub(super) fn open(directory: &Path) -> Result<Self, Refusal> {
        let unfinished =
            Unfinished::open(directory).map_err(|error| Refusal::new(error.to_string()))?;
        let command = parse(&unfinished.provenance().command)?;
        let label = unfinished.directory().join(SCENARIO_FILE);
        let scenario = load_text(&label.display().to_string(), unfinished.scenario(), &[])?;
        Ok(Self { unfinished, command, scenario })
    }

    /// The refusal of a run that another verb started.
    pub(super) fn of_another_verb(&self) -> Refusal {
        let typed = &self.unfinished.provenance().command;
        let verb = typed.first().map_or("another verb", String::as_str);
        let directory = self.unfinished.directory().display();
        Refusal::new(format!(
            "`{directory}` was started by `slateswarm {verb}`; resume it with that"
        ))
    }
}

/// `stored`, with what may be said anew each time.
pub(super) fn with_typed(stored: CommonArguments, typed: &CommonArguments) -> CommonArguments {
    CommonArguments { all: typed.all, time_limit_s: typed.time_limit_s, ..stored }
}

/// The command line of words that were typed once.
pub(super) fn parse(words: &[String]) -> Result<Command, Refusal> {
    let words = std::iter::once("slateswarm").chain(words.iter().map(String::as_str));
    let parsed = Cli::try_parse_from(words);
    let cli = parsed.map_err(|error| {
        Refusal::new(format!("the run was started by a command that is no more: {error}"))
    })?;
    Ok(cli.command)
}
