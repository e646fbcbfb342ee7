//! What `compare`, `run`, `simulate` and `reproduce` have in common: place the results, run the plan,
//! compute the summary.

use super::progress::Line;
use super::{Refusal, Setting};
use crate::cli::CommonArguments;
use crate::launch::os_process::{CraftErrors, Launcher};
use crate::launch::placement::{Placement, Processors};
use crate::launch::run_root::clean_dead_runs;
use crate::outcome::Outcome;
use crate::results::provenance::{Provenance, RunIdentity};
use crate::results::record::{Digest, Label};
use crate::results::resume::Unfinished;
use crate::results::store::{Place, Store};
use crate::results::summary::Summary;
use crate::run::demand::demand;
use crate::run::order::{balanced_orders, labels};
use crate::run::plan::{FleetPlan, RunPlan, TimingPlan};
use crate::run::{Progress as _, Runner};
use crate::scenario::ResolvedScenario;
use crate::supervision::signals::Signals;
use shared_types::rng::{Purpose, Stream};
use shared_types::scenario::{Fleet, RunMode};
use shared_types::transport::RunPaths;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use xxhash_rust::xxh3::xxh3_64;

/// How long a cell runs unmeasured before its turn times count, ns (MEASURING: at least 200 ms).
const WARM_UP_NS: u64 = 200_000_000;

/// Epochs under `central` and `pipelined` together have this many turns: each takes a hundred round
/// trips a craft.
const TURNS_OF_ROUND_TRIPS: u32 = 100;

/// What to run besides what the scenario says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Scope {
    /// Trials, and turn times if the scenario measures them.
    #[default]
    All,
    /// Trials only.
    Counts,
    /// Turn times only.
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
    let Job { name, scenarios, scope, common, destination, part } = job;
    let refused = |error: &dyn std::fmt::Display| Refusal::new(error.to_string());
    let plan = plan(scenarios, scope, common)?;
    if !plan.is_simulated {
        clean_dead_runs(RunPaths::new(0).base()).map_err(|error| refused(&error))?;
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

pub(super) fn plan(
    scenarios: Vec<ResolvedScenario>,
    scope: Scope,
    common: &CommonArguments,
) -> Result<RunPlan, Refusal> {
    let Some(first) = scenarios.first().map(|scenario| scenario.scenario().clone()) else {
        return Err(Refusal::new("no fleet size is given: `--sizes 2,3` runs two"));
    };
    let is_simulated = first.run.mode == RunMode::Simulated;
    let epochs = first.run.timing_epochs;
    let is_timed = epochs > 0 && !is_simulated && scope != Scope::Counts;
    let timing = is_timed.then(|| TimingPlan {
        epochs,
        turns: first.run.timing_turns,
        turns_of_round_trips: (TURNS_OF_ROUND_TRIPS / epochs).clamp(1, first.run.timing_turns),
        warm_up_ns: WARM_UP_NS,
    });
    let processors = processors(&first.fleet)?;
    let mut draws = Stream::new(first.run.seed, 0, Purpose::Order, 0);
    let blocks = if is_timed { first.run.blocks } else { 1 };
    let mut orders: Vec<_> = scenarios
        .iter()
        .map(|scenario| orders_of(scenario, is_timed, blocks).into_iter())
        .collect();
    let launches = (0..blocks).flat_map(|_| scenarios.iter().cloned().enumerate());
    let fleets = launches.map(|(fleet, scenario)| {
        let strategies = scenario.strategies().to_vec();
        let order = orders[fleet].next().unwrap_or_default();
        let has_centre = strategies.iter().any(|strategy| strategy.has_centre());
        let processes = scenario.craft_count() + u32::from(has_centre);
        let pinning = scenario.scenario().fleet.pinning;
        let placement = Placement::draw(&processors, pinning, processes, &mut draws);
        FleetPlan { scenario, strategies, order, placement }
    });
    Ok(RunPlan {
        fleets: fleets.collect(),
        seed: first.run.seed,
        trials: if scope == Scope::Times { 0 } else { first.run.trials },
        is_simulated,
        timing,
        wake: first.fleet.wake,
        turn_limit_ns: u64::from(first.run.turn_limit_ms) * 1_000_000,
        time_limit_s: common.time_limit_s,
    })
}

/// What is timed in each block of a fleet, in which order.
fn orders_of(scenario: &ResolvedScenario, is_timed: bool, blocks: u32) -> Vec<Vec<Label>> {
    if !is_timed {
        return Vec::new();
    }
    let run = &scenario.scenario().run;
    let (labels, seed) = (labels(scenario.strategies(), blocks, run.controls), run.seed);
    // Placement draws from the stream of craft 0; no fleet has no craft.
    let mut stream = Stream::new(seed, 0, Purpose::Order, scenario.craft_count());
    balanced_orders(&labels, blocks, &mut stream)
}

/// The processors that the fleet may use.
fn processors(fleet: &Fleet) -> Result<Processors, Refusal> {
    let all = Processors::of_this_process().map_err(|error| Refusal::new(error.to_string()))?;
    let cores_max = u32::try_from(all.core_count()).unwrap_or(u32::MAX);
    match fleet.cores {
        Some(cores) => {
            all.confined_to(cores.min(cores_max)).map_err(|error| Refusal::new(error.to_string()))
        }
        None => Ok(all),
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
        plan.fleets.iter().map(|fleet| (&fleet.strategies, &fleet.order)).collect();
    let placements: Vec<_> = plan.fleets.iter().map(|fleet| &fleet.placement).collect();
    let rest = (plan.trials, plan.timing, plan.wake, plan.turn_limit_ns, plan.is_simulated);
    [
        ("the digest of the scenario", digest(&scenarios)),
        ("the digest of strategies and their order", digest(&orders)),
        ("the digest of trials and timing", digest(&rest)),
        ("the digest of who runs on which processor", digest(&placements)),
    ]
    .map(|(what, digest)| (what.to_owned(), digest))
    .into()
}
