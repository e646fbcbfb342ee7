//! What `compare`, `run`, `simulate` and `reproduce` have in common: place the results, run the plan,
//! compute the summary.

use super::planning::plan;
use super::progress::Line;
use super::{Refusal, Setting};
use crate::cli::CommonArguments;
use crate::launch::beside::clean_all;
use crate::launch::os_process::{CraftErrors, Launcher};
use crate::outcome::Outcome;
use crate::results::provenance::{Provenance, RunIdentity};
use crate::results::record::Digest;
use crate::results::resume::Unfinished;
use crate::results::store::{Place, Store};
use crate::results::summary::Summary;
use crate::run::demand::demand;
use crate::run::estimate;
use crate::run::plan::RunPlan;
use crate::run::{Progress as _, Runner};
use crate::scenario::ResolvedScenario;
use crate::supervision::signals::Signals;
use shared_types::transport::RunPaths;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use xxhash_rust::xxh3::xxh3_64;

/// A run that takes longer says so before it starts, s.
const TOLD_FROM_S: f64 = 100.0;

/// What to run besides what the scenario says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Scope {
    /// Trials, and turn times and loads if the scenario measures them.
    #[default]
    All,
    /// Trials only.
    Counts,
    /// Turn times and loads only.
    Times,
}

/// A run that is over.
#[derive(Debug)]
pub(super) struct Executed {
    pub(super) summary: Summary,
    pub(super) directory: PathBuf,
    pub(super) outcome: Outcome,
}

/// What to run and where its results go.
pub(super) struct Job<'a> {
    /// What the results are called.
    pub(super) name: &'a str,
    /// One a fleet size, run one after the other.
    pub(super) scenarios: Vec<ResolvedScenario>,
    /// What to run besides what they say.
    pub(super) scope: Scope,
    /// Fleet sizes that are offered their loads; `None` for all.
    pub(super) load_sizes: Option<&'a [u32]>,
    /// What was typed.
    pub(super) common: &'a CommonArguments,
    /// Where results go.
    pub(super) destination: Destination<'a>,
    /// Which of how many runs of a sweep it is.
    pub(super) part: Option<(usize, usize)>,
}

/// Where the results of a job go.
pub(super) enum Destination<'a> {
    /// Into a directory of their own.
    New(Place<'a>),
    /// To those of a run that was cut off.
    Resumed(Box<Unfinished>),
}

/// Runs a job from start to end, by itself.
pub(super) fn execute(job: Job<'_>, setting: Setting) -> Result<Executed, Refusal> {
    let mut signals = Signals::install().map_err(|error| Refusal::new(error.to_string()))?;
    execute_under(job, setting, &mut signals)
}

/// Runs a job that is one of several: `signals` are listened to beyond its end.
pub(super) fn execute_under(
    job: Job<'_>,
    setting: Setting,
    signals: &mut Signals,
) -> Result<Executed, Refusal> {
    let Job { name, scenarios, scope, load_sizes, common, destination, part } = job;
    let refused = |error: &dyn std::fmt::Display| Refusal::new(error.to_string());
    let plan = plan(scenarios, scope, load_sizes, common)?;
    if !plan.is_simulated {
        clean_all(RunPaths::new(0).base()).map_err(|error| refused(&error))?;
        for fleet in &plan.fleets {
            demand(fleet, plan.seed).claim().map_err(|error| refused(&error))?;
        }
    }
    let first = &plan.fleets[0].scenario;
    let provenance = Provenance::gather(&identity(name, &plan));
    let mut store = match destination {
        Destination::New(place) => {
            Store::create(place, &provenance, &first.to_toml()).map_err(|error| refused(&error))?
        }
        Destination::Resumed(unfinished) => {
            Store::resume(*unfinished, &provenance).map_err(|error| refused(&error))?
        }
    };
    let mut progress = Line::new(setting.is_quiet, part);
    // What holds for every cell of a sweep is said with the first.
    let is_told = !setting.is_quiet && part.is_none_or(|(number, _)| number == 0);
    for notice in first.notices().iter().filter(|_| is_told) {
        progress.say(notice);
    }
    let seconds = estimate::seconds(&plan);
    if seconds > TOLD_FROM_S && is_told && part.is_none() {
        progress.say(&format!("this takes {}", estimate::in_words(seconds)));
    }
    let launcher = Launcher::of_this_executable(CraftErrors::Kept);
    let ran = Runner::new(&plan, &mut store, &mut progress).run(&launcher, signals);
    let outcome = ran.map_err(|error| refused(&error))?;
    let directory = store.directory().to_owned();
    drop(progress);
    let summary = store.finish(outcome).map_err(|error| refused(&error))?;
    Ok(Executed { summary, directory, outcome })
}

/// Says how a run that was cut off goes on.
pub(super) fn tell_how_to_resume(verb: &str, outcome: Outcome, directory: &Path, setting: Setting) {
    let is_cut_off =
        matches!(outcome, Outcome::Interrupted | Outcome::Terminated | Outcome::TimeLimit);
    if is_cut_off && !setting.is_quiet {
        let (program, directory) = (super::program(), directory.display());
        eprintln!("slateswarm: what is complete is kept; to go on from there:");
        eprintln!("  {program} {verb} --resume {directory}");
    }
}

pub(super) fn identity(name: &str, plan: &RunPlan) -> RunIdentity {
    let processes = plan.fleets.iter().map(|fleet| plan.fleet_options(fleet, None).processes());
    let online = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let online = u32::try_from(online).unwrap_or(u32::MAX);
    RunIdentity {
        scenario: name.to_owned(),
        command: std::env::args().skip(1).collect(),
        seed: plan.seed,
        is_simulated: plan.is_simulated,
        processes_max: processes.max().unwrap_or(0),
        cores_used: plan.fleets[0].scenario.scenario().fleet.cores.unwrap_or(online).min(online),
        wake: plan.wake,
        plan: digests(plan),
    }
}

/// Digests of what decides every measurement, by what refusals call it.
fn digests(plan: &RunPlan) -> BTreeMap<String, Digest> {
    let digest = |what: &dyn std::fmt::Debug| Digest(xxh3_64(format!("{what:?}").as_bytes()));
    let scenarios: Vec<String> = plan.fleets.iter().map(|fleet| fleet.scenario.to_toml()).collect();
    let orders: Vec<_> =
        plan.fleets.iter().map(|fleet| (&fleet.strategies, &fleet.order, &fleet.loads)).collect();
    let searched: Vec<_> = plan.fleets.iter().map(|fleet| &fleet.searched).collect();
    let placements: Vec<_> = plan.fleets.iter().map(|fleet| &fleet.placement).collect();
    let measured = (plan.timing, plan.open, &plan.capacity);
    let rest = (plan.trials, measured, plan.wake, plan.turn_limit_ns, plan.is_simulated);
    [
        ("the digest of the scenario", digest(&scenarios)),
        ("the digest of strategies and their order", digest(&(orders, searched))),
        ("the digest of trials and timing", digest(&rest)),
        ("the digest of who runs on which processor", digest(&placements)),
    ]
    .map(|(what, digest)| (what.to_owned(), digest))
    .into()
}
