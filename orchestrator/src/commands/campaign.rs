//! `campaign`: kills and stops processes of fleets on purpose and checks what is promised.

use super::planning::processors;
use super::progress::Line;
use super::{Refusal, Setting, load_scenario, print_report, program};
use crate::campaign::{Campaign, CampaignPlan, PRESET};
use crate::cli::{CampaignArguments, CommonArguments, JanitorStep};
use crate::launch::beside::clean_all;
use crate::launch::os_process::{CraftErrors, Launcher};
use crate::outcome::Outcome;
use crate::report::campaign::CampaignReport;
use crate::results::faults::{FaultRecord, Step};
use crate::results::provenance::{Provenance, RunIdentity};
use crate::results::read::read_run;
use crate::results::store::{Place, Store};
use crate::run::{Progress as _, estimate};
use crate::supervision::signals::Signals;
use shared_types::scenario::{Faults, Restart, RunMode, Scenario};
use shared_types::transport::reclaim::Steps;
use shared_types::transport::{RunPaths, WakeMode};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Runs the campaign and prints its table.
///
/// # Errors
/// If something asked for is wrong; nothing was started then.
pub fn campaign(arguments: &CampaignArguments, setting: Setting) -> Result<Outcome, Refusal> {
    let refused = |error: &dyn std::fmt::Display| Refusal::new(error.to_string());
    let mut signals = Signals::install().map_err(|error| refused(&error))?;
    let common = CommonArguments {
        set: arguments.set.clone(),
        seed: Some(arguments.seed),
        ..CommonArguments::default()
    };
    let base = load_scenario(PRESET, &common, false)?;
    refuse_what_campaigns_decide(base.scenario())?;
    let plan = CampaignPlan {
        scenarios: super::compare::sized(&base, &arguments.sizes)?,
        kills: arguments.kills,
        seed: arguments.seed,
        processors: processors(&base.scenario().fleet)?,
        // The link names what runs, also if its file was replaced meanwhile.
        executable: PathBuf::from("/proc/self/exe"),
        time_limit_s: arguments.time_limit_s,
        janitor: arguments.without.map_or(Steps::ALL, JanitorStep::left_out),
    };
    clean_all(RunPaths::new(0).base()).map_err(|error| refused(&error))?;
    let provenance = Provenance::gather(&identity(&plan));
    let mut store = Store::create(Place::Below(&arguments.out), &provenance, &base.to_toml())
        .map_err(|error| refused(&error))?;
    let mut progress = Line::new(setting.is_quiet, None);
    if !setting.is_quiet {
        let (kills, takes) = (plan.kills, estimate::in_words(plan.seconds()));
        let what = if kills == 1 { "kill takes" } else { "kills take" };
        progress.say(&format!("{kills} {what} {takes}"));
    }
    let launcher = Launcher::of_this_executable(CraftErrors::Kept);
    let ran = Campaign::new(&plan, &mut store, &mut progress, &launcher, &mut signals).run();
    let outcome = ran.map_err(|error| refused(&error))?;
    drop(progress);
    let directory = store.directory().to_owned();
    let faults = read_run(&directory).map_err(|error| refused(&error))?.faults;
    keep_times(&store, &faults).map_err(|error| refused(&error))?;
    let summary = store.finish(outcome).map_err(|error| refused(&error))?;
    print_report(&CampaignReport { summary, directory, program: program() }, setting, false)?;
    Ok(outcome)
}

/// Refuses keys that a campaign would not look at: it draws faults and ways to wait, plays trials and
/// intervals in turn, and puts a successor into the place of everybody whom it kills.
fn refuse_what_campaigns_decide(scenario: &Scenario) -> Result<(), Refusal> {
    let Scenario { run, fleet, faults, .. } = scenario;
    let decided = [
        ("run.mode", run.mode != RunMode::default()),
        ("fleet.wake", fleet.wake != WakeMode::default()),
        ("faults", *faults != Faults { restart: Restart::OnFailure, ..Faults::default() }),
    ];
    match decided.into_iter().find(|&(_, is_stated)| is_stated) {
        None => Ok(()),
        Some((key, _)) => Err(Refusal::new(format!(
            "`{key}` is the campaign's own to decide, from `--seed`: leave it out, or play it with \
             `run {PRESET}`"
        ))),
    }
}

/// Keeps the times of recoveries as histograms, step by step.
fn keep_times(
    store: &Store,
    faults: &[FaultRecord],
) -> Result<(), crate::results::store::StoreError> {
    for step in Step::ALL {
        let times: Vec<u64> =
            faults.iter().filter_map(|fault| fault.times_ns.get(&step).copied()).collect();
        if !times.is_empty() {
            store.keep_recovery_times(step, times)?;
        }
    }
    Ok(())
}

fn identity(plan: &CampaignPlan) -> RunIdentity {
    let largest = plan.scenarios.iter().map(crate::scenario::ResolvedScenario::craft_count).max();
    let cores = u32::try_from(plan.processors.core_count()).unwrap_or(u32::MAX);
    RunIdentity {
        scenario: PRESET.to_owned(),
        command: std::env::args().skip(1).collect(),
        seed: plan.seed,
        is_simulated: false,
        processes_max: largest.unwrap_or(0) + 1,
        cores_used: cores,
        wake: WakeMode::default(),
        plan: BTreeMap::new(),
    }
}
