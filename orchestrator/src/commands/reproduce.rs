//! `reproduce`: the published tables beside ours.

use super::compare::{PRESET, sized};
use super::execute::{Destination, Job, Scope, execute, tell_how_to_resume};
use super::progress::Line;
use super::resume::{Resumed, with_typed};
use super::{Refusal, Setting, load_scenario, print_report};
use crate::cli::{Command, Pruner, ReproduceArguments};
use crate::expectation::sample;
use crate::networks;
use crate::outcome::Outcome;
use crate::report::published::{PUBLISHED_TRIALS, Published};
use crate::report::ranges::Sample;
use crate::report::reproduce::{FLEET_TABLES, Reproduction, TABLES};
use crate::report::{self, networks::Networks};
use crate::results::networks::Measured;
use crate::results::store::Place;
use crate::results::summary::Deterministic;
use crate::run::Progress as _;
use shared_types::wire::StrategyKind;

/// Simulated trials behind the range of a mean (MEASURING: at least 10,000).
const SAMPLE_TRIALS: u32 = 10_000;

/// The strategies that the source tables.
const TABLED: [StrategyKind; 5] = [
    StrategyKind::Full,
    StrategyKind::Boundary,
    StrategyKind::Limited,
    StrategyKind::Hierarchy,
    StrategyKind::Central,
];

/// Runs the published experiment as often as the source did and prints both.
///
/// # Errors
/// If something asked for is wrong; nothing was started then.
pub fn reproduce(arguments: &ReproduceArguments, setting: Setting) -> Result<Outcome, Refusal> {
    let Some(directory) = &arguments.resume else {
        return reproduce_from(arguments, None, setting);
    };
    let resumed = Resumed::open(directory)?;
    let Command::Reproduce(stored) = &resumed.command else {
        return Err(resumed.of_another_verb());
    };
    let common = with_typed(stored.common.clone(), &arguments.common);
    let stored = ReproduceArguments { common, ..stored.clone() };
    reproduce_from(&stored, Some(resumed), setting)
}

fn reproduce_from(
    arguments: &ReproduceArguments,
    resumed: Option<Resumed>,
    setting: Setting,
) -> Result<Outcome, Refusal> {
    let tables = numbers(&arguments.tables)?;
    let networks = networks(&tables, arguments, setting)?;
    if !tables.iter().any(|table| FLEET_TABLES.contains(table)) {
        let seed = load_scenario(PRESET, &arguments.common, false)?.scenario().run.seed;
        let report =
            Reproduction::new(&[], seed, &Deterministic::default(), &[]).with_networks(networks);
        print_report(&report, setting, arguments.common.all)?;
        return Ok(report.outcome());
    }
    let mut common = arguments.common.clone();
    let published_trials = u32::try_from(PUBLISHED_TRIALS).unwrap_or(u32::MAX);
    common.trials.get_or_insert(published_trials);
    if common.strategies.is_empty() {
        common.strategies = TABLED.to_vec();
    }
    let (base, destination) = match resumed {
        Some(Resumed { scenario, unfinished, .. }) => {
            (scenario, Destination::Resumed(Box::new(unfinished)))
        }
        None => {
            let place = Place::Below(&common.out);
            (load_scenario(PRESET, &common, arguments.simulated)?, Destination::New(place))
        }
    };
    let seed = base.scenario().run.seed;
    let published = Published::embedded();
    let sizes: Vec<u32> = published
        .runs
        .iter()
        .filter(|runs| tables.contains(&25) || tables.contains(&runs.table))
        .map(|runs| runs.crafts)
        .collect();
    let job = Job {
        name: "reproduce",
        scenarios: sized(&base, &sizes)?,
        scope: Scope::Counts,
        load_sizes: None,
        common: &common,
        destination,
        part: None,
    };
    let executed = execute(job, setting)?;
    tell_how_to_resume("reproduce", executed.outcome, &executed.directory, setting);
    let parameters = base.scenario().network.clone().unwrap_or_default();
    let samples: Vec<Sample> = if tables.contains(&25) {
        sizes.iter().map(|&crafts| sample(&parameters, crafts, seed, SAMPLE_TRIALS)).collect()
    } else {
        Vec::new()
    };
    let report = Reproduction::new(&tables, seed, &executed.summary.deterministic, &samples)
        .with_networks(networks);
    print_report(&report, setting, common.all)?;
    Ok(executed.outcome.worse(report.outcome()))
}

/// Tables 1 to 20 beside ours, if some of them were asked for.
fn networks(
    tables: &[u32],
    arguments: &ReproduceArguments,
    setting: Setting,
) -> Result<Option<Networks>, Refusal> {
    let conditions = report::networks::conditions(tables);
    if conditions.is_empty() {
        return Ok(None);
    }
    let seed = load_scenario(PRESET, &arguments.common, false)?.scenario().run.seed;
    let count = arguments.networks;
    let mut progress = Line::new(setting.is_quiet, None);
    let total = conditions.len() as u64;
    let measured: Vec<Measured> = (0..)
        .zip(conditions)
        .map(|(done, condition)| {
            progress.at(done, total, "random networks");
            networks::measure(condition, seed, count)
        })
        .collect();
    let by_text = arguments.pruner == Pruner::Literal;
    Ok(Some(Networks::new(tables, &measured, count, by_text)))
}

/// The table numbers that were asked for.
fn numbers(names: &[String]) -> Result<Vec<u32>, Refusal> {
    let mut numbers = Vec::new();
    for name in names {
        if name == "all" {
            numbers.extend(TABLES);
            continue;
        }
        let number = name.strip_prefix("table-").and_then(|number| number.parse().ok());
        match number.filter(|number| TABLES.contains(number)) {
            Some(number) => numbers.push(number),
            None => {
                return Err(Refusal::new(format!(
                    "unknown table `{name}`: `all`, or table-{} to table-{}",
                    TABLES.start(),
                    TABLES.end()
                )));
            }
        }
    }
    numbers.sort_unstable();
    numbers.dedup();
    Ok(numbers)
}
