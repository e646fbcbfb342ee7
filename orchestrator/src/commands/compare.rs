//! `compare`: the published experiment on real fleets of several sizes, under every strategy.

use super::execute::{Destination, Job, Scope, execute, tell_how_to_resume};
use super::resume::{Resumed, with_typed};
use super::{Refusal, Setting, load_scenario, print_report, program};
use crate::cli::{Command, CompareArguments, LoadSizes};
use crate::outcome::Outcome;
use crate::report::compare::{Compare, PublishedMean};
use crate::report::published::{PUBLISHED_TRIALS, Published, is_source_inconsistent};
use crate::results::figure::Figure;
use crate::results::store::Place;
use crate::scenario::ResolvedScenario;
use shared_types::scenario::GeneratedNetwork;
use shared_types::wire::StrategyKind;

/// The preset that `compare` runs unless it is told another.
pub const PRESET: &str = "compare";

/// Fleet sizes of a preset, and those of them that are offered loads, unless others are asked for.
fn usual_sizes(preset: &str) -> (&'static [u32], &'static [u32]) {
    match preset {
        "paper" => (&[2, 3, 5, 10, 20, 50], &[2, 3, 5, 10, 20, 50]),
        _ => (&[2, 3, 5, 10], &[10]),
    }
}

/// Runs the comparison and prints its table.
///
/// # Errors
/// If something asked for is wrong; nothing was started then.
pub fn compare(arguments: &CompareArguments, setting: Setting) -> Result<Outcome, Refusal> {
    let Some(directory) = &arguments.resume else {
        let preset = arguments.preset.as_deref().unwrap_or(PRESET);
        let base = load_scenario(preset, &arguments.common, arguments.simulated)?;
        let destination = Destination::New(Place::Below(&arguments.common.out));
        return compare_from(&base, arguments, destination, setting);
    };
    let resumed = Resumed::open(directory)?;
    let Command::Compare(stored) = resumed.command else { return Err(resumed.of_another_verb()) };
    let common = with_typed(stored.common, &arguments.common);
    let stored = CompareArguments { common, ..stored };
    let destination = Destination::Resumed(Box::new(resumed.unfinished));
    compare_from(&resumed.scenario, &stored, destination, setting)
}

fn compare_from(
    base: &ResolvedScenario,
    arguments: &CompareArguments,
    destination: Destination<'_>,
    setting: Setting,
) -> Result<Outcome, Refusal> {
    let preset = arguments.preset.as_deref().unwrap_or(PRESET);
    let sizes = arguments.sizes.as_deref().unwrap_or(usual_sizes(preset).0);
    let scenarios = sized(base, sizes)?;
    let counts_only = arguments.no_timing || arguments.simulated;
    let scope = match (counts_only, arguments.timing_only) {
        (true, _) => Scope::Counts,
        (_, true) => Scope::Times,
        _ => Scope::All,
    };
    let load_sizes = load_sizes(arguments, sizes, usual_sizes(preset).1)?;
    let job = Job {
        name: preset,
        scenarios,
        scope,
        load_sizes: Some(&load_sizes),
        common: &arguments.common,
        destination,
        part: None,
    };
    let executed = execute(job, setting)?;
    // Published means stand beside the published experiment only, whatever `--set` made of it.
    let is_published = base.scenario().network == Some(GeneratedNetwork::default());
    let report = Compare {
        summary: executed.summary,
        published: if is_published { published_means() } else { Vec::new() },
        directory: executed.directory,
        program: program(),
    };
    tell_how_to_resume("compare", executed.outcome, &report.directory, setting);
    print_report(&report, setting, arguments.common.all)?;
    Ok(executed.outcome)
}

/// The sizes that are offered loads.
fn load_sizes(
    arguments: &CompareArguments,
    sizes: &[u32],
    usual: &[u32],
) -> Result<Vec<u32>, Refusal> {
    let Some(LoadSizes(asked)) = &arguments.load_sizes else {
        return Ok(usual.to_vec());
    };
    match asked.iter().find(|size| !sizes.contains(size)) {
        None => Ok(asked.clone()),
        Some(size) => Err(Refusal::new(format!(
            "`--load-sizes {size}`: no fleet of {size} is run; add it to `--sizes`"
        ))),
    }
}

/// The published means of requests, marked where no rule explains them.
pub(super) fn published_means() -> Vec<PublishedMean> {
    let published = Published::embedded();
    let of = |size: u32, strategy: StrategyKind| {
        let value = published.means_of(size)?.requests(strategy)?;
        Some(PublishedMean {
            size,
            strategy,
            figure: Figure {
                value: Some(value),
                n: PUBLISHED_TRIALS as u64,
                low: None,
                high: None,
                unit: "requests",
                load: None,
                label: "published mean of requests a trial (Straub 2016, Table 25)".to_owned(),
            },
            is_explained: !is_source_inconsistent(size, strategy),
        })
    };
    let sizes = published.means.iter().map(|row| row.label);
    sizes
        .flat_map(|size| StrategyKind::ALL.into_iter().filter_map(move |kind| of(size, kind)))
        .collect()
}

/// The scenario for each of `sizes`.
pub(super) fn sized(
    base: &ResolvedScenario,
    sizes: &[u32],
) -> Result<Vec<ResolvedScenario>, Refusal> {
    let mut unique = sizes.to_vec();
    unique.sort_unstable();
    unique.dedup();
    Ok(unique.iter().map(|&size| base.with_craft_count(size)).collect::<Result<_, _>>()?)
}
