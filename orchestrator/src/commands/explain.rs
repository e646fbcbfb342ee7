//! `explain`: why something holds at the end of a trial of a finished run, or why it did not come about.

use super::{Refusal, Setting, print_report};
use crate::cli::ExplainArguments;
use crate::explanation::Trial;
use crate::outcome::Outcome;
use crate::results::read::{RunData, read_run};
use crate::results::record::{Digest, TrialFacts};
use crate::results::store::SCENARIO_FILE;
use crate::scenario::{ResolvedScenario, load_text};
use shared_types::knowledge::FleetNetwork;
use shared_types::wire::StrategyKind;

/// Replays the trial and prints the answer.
///
/// # Errors
/// If the directory holds no run that can be replayed, or the question means nothing in it.
pub fn explain(arguments: &ExplainArguments, setting: Setting) -> Result<Outcome, Refusal> {
    let run = read_run(&arguments.directory).map_err(|error| Refusal::new(error.to_string()))?;
    let text = run.scenario.as_ref().ok_or_else(|| {
        Refusal::new(format!(
            "`{}` lacks {SCENARIO_FILE}, from which trials are replayed; name another run",
            run.directory.display()
        ))
    })?;
    let stored = load_text(SCENARIO_FILE, text, &[])?;
    let record = record_of(&run, arguments, &stored);
    let size = arguments.size.or(record.map(|facts| facts.cell.size));
    let scenario = match size {
        Some(size) if size != stored.craft_count() => stored.with_craft_count(size)?,
        _ => stored,
    };
    let strategy = arguments
        .strategy
        .or(record.map(|facts| facts.cell.strategy))
        .unwrap_or(StrategyKind::Boundary);
    let mut network = FleetNetwork::default();
    let trial = Trial::of(&scenario, strategy, arguments.trial, &mut network);
    let subject = match &arguments.subject {
        Some(name) => trial.subject(name).map_err(|error| Refusal::new(error.to_string()))?,
        None => trial.final_fact().ok_or_else(|| {
            Refusal::new("no final fact holds at the end: ask about one, as `CRAFT.FACT`")
        })?,
    };
    let mut explanation = trial.explain(subject);
    explanation.is_recorded_path =
        record.map(|facts| facts.path_digest == Digest(trial.path_digest()));
    print_report(&explanation, setting, arguments.all)
}

/// The run's record of the trial that is asked about: of the largest fleet, unless a size is asked for,
/// and of a strategy that tells something.
fn record_of<'r>(
    run: &'r RunData,
    arguments: &ExplainArguments,
    scenario: &ResolvedScenario,
) -> Option<&'r TrialFacts> {
    let records = run.trials.iter().map(|record| &record.deterministic);
    let fits = records.filter(|facts| {
        facts.trial == arguments.trial
            && arguments.size.is_none_or(|size| size == facts.cell.size)
            && arguments.strategy.is_none_or(|strategy| strategy == facts.cell.strategy)
    });
    let wanted = scenario.strategies();
    fits.max_by_key(|facts| {
        let strategy = facts.cell.strategy;
        let place = wanted.iter().position(|&one| one == strategy).unwrap_or(wanted.len());
        (facts.cell.size, strategy != StrategyKind::Null, std::cmp::Reverse(place))
    })
}
