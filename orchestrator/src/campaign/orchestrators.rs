//! A round on an orchestrator: the executable is started with a fleet, killed, and cleaned up after.
//!
//! It runs below a base of its own, so that what is left of it cannot be mistaken for anything else
//! (`launch::beside`). Its crafts must end by themselves, and one `clean` must remove all files.

use super::draw::OrchestratorPoint;
use super::{Campaign, Early};
use crate::launch::beside::{PARENT_VARIABLE, base_beside};
use crate::launch::craft_process::{CraftProcess, HowEnded};
use crate::launch::leftovers;
use crate::launch::run_root::clean_dead_runs;
use crate::results::faults::{Failure, FaultKind, FaultRecord, Step};
use crate::results::store::StoreError;
use crate::run::backend::PlayError;
use crate::scenario::ResolvedScenario;
use rustix::event::{Timespec, poll};
use rustix::process::Signal;
use shared_types::time::Nanos;
use shared_types::transport::paths::BASE_VARIABLE;
use shared_types::transport::{RunPaths, WakeMode, clock};
use shared_types::wire::StrategyKind;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// The latest random instant of a kill after the executable was started, us.
const RANDOM_US_MAX: u32 = 150_000;

/// The latest instant after the point that is meant, us.
const CREATING_US_MAX: u32 = 8_000;
const PLAYING_US_MAX: u32 = 200_000;
const SHUTDOWN_US_MAX: u32 = 20_000;
const RESTART_US_MAX: u32 = 40_000;

/// How long an orchestrator may take to come to the point, or to be gone, ns.
const PATIENCE_NS: u64 = 60_000_000_000;

/// Between two looks, ns.
const LOOK_NS: i64 = 500_000;

/// Where a killed orchestrator had its files.
struct Site {
    base: PathBuf,
    results: PathBuf,
}

impl Site {
    /// The run that the orchestrator has made, once it has.
    fn run(&self) -> Option<RunPaths> {
        RunPaths::list(&self.base).ok()?.pop()
    }
}

impl Campaign<'_> {
    /// Starts an orchestrator with a fleet of the scenario's size, kills it, and looks what is left.
    pub(super) fn round_on_orchestrator(
        &mut self,
        scenario: &ResolvedScenario,
    ) -> Result<Early, StoreError> {
        let point = self.draws.orchestrator_point();
        let strategy = self.draws.strategy(scenario.strategies());
        let wake = self.draws.wake();
        let size = scenario.craft_count();
        let results = self.store.directory().join("killed");
        let site = Site { base: base_beside(RunPaths::new(0).base(), std::process::id()), results };
        let mut record = FaultRecord {
            number: 0,
            size,
            strategy,
            wake,
            is_open: false,
            links_fail: false,
            kind: FaultKind::KillOrchestrator,
            point: point.name().to_owned(),
            craft: None,
            took_effect: false,
            failures: Vec::new(),
            times_ns: BTreeMap::new(),
        };
        let killed = self.start_and_kill(point, &site, (size, strategy, wake), &mut record);
        if let Err(error) = killed {
            if let Some(outcome) = self.early(&error)? {
                clean_up(&site, clock::now(), &mut record);
                return Ok(Some(outcome));
            }
            record.failures.push((Failure::Hang, format!("{error:?}")));
        }
        self.keep(record)?;
        Ok(None)
    }

    /// Does it; what was seen goes into `record`.
    fn start_and_kill(
        &mut self,
        point: OrchestratorPoint,
        site: &Site,
        (size, strategy, wake): (u32, StrategyKind, WakeMode),
        record: &mut FaultRecord,
    ) -> Result<(), PlayError> {
        let system = |error: std::io::Error| PlayError::Failed(error.to_string());
        let arguments = command_line(&site.results, size, strategy, wake);
        let parent = OsString::from(std::process::id().to_string());
        let environment =
            [(BASE_VARIABLE, site.base.as_os_str()), (PARENT_VARIABLE, parent.as_os_str())];
        let mut process = self
            .launcher
            .spawn_orchestrator(&self.plan.executable, arguments, environment)
            .map_err(|error| PlayError::Failed(error.to_string()))?;
        let delay_ns = self.come_to_the_point(point, site, &mut process)?;
        self.wait(clock::now().plus(delay_ns), &mut process)?;
        let run = site.run();
        process.signal(Signal::KILL).map_err(system)?;
        let killed = clock::now();
        let how = self.await_end(&mut process)?;
        record.took_effect = how == HowEnded::Killed(Signal::KILL.as_raw());
        record.times_ns.insert(Step::Noticed, clock::now().since(killed));
        if !record.took_effect {
            let said = process.said();
            record.failures.push((Failure::Restart, format!("it ended by itself: {how}: {said}")));
        }
        clean_up(site, killed, record);
        if let Some(run) = run {
            record.failures.extend(super::fate::left_behind(&run, &[]));
        }
        Ok(())
    }

    /// Waits until the orchestrator is where it is to be killed; returns how long to wait from there.
    fn come_to_the_point(
        &mut self,
        point: OrchestratorPoint,
        site: &Site,
        process: &mut CraftProcess,
    ) -> Result<u64, PlayError> {
        let system = |error: std::io::Error| PlayError::Failed(error.to_string());
        if point == OrchestratorPoint::Random {
            return Ok(self.draws.delay_ns(RANDOM_US_MAX));
        }
        self.wait_until(process, || site.run().map(drop))?;
        if point == OrchestratorPoint::Creating {
            return Ok(self.draws.delay_ns(CREATING_US_MAX));
        }
        let events = || site.results.join("latest/events.jsonl");
        let has_played = || {
            let text = std::fs::read_to_string(events()).ok()?;
            text.contains("\"epoch-done\"").then_some(())
        };
        self.wait_until(process, has_played)?;
        Ok(match point {
            OrchestratorPoint::Shutdown => {
                process.signal(Signal::INT).map_err(system)?;
                self.draws.delay_ns(SHUTDOWN_US_MAX)
            }
            OrchestratorPoint::Restart => {
                let crafts = site.run().map(|run| leftovers::find(&run)).unwrap_or_default();
                if let Some(craft) = crafts.first() {
                    craft.kill();
                }
                self.draws.delay_ns(RESTART_US_MAX)
            }
            _ => self.draws.delay_ns(PLAYING_US_MAX),
        })
    }

    /// Looks until `happened` says something, the orchestrator has ended, or the campaign must end.
    fn wait_until(
        &mut self,
        process: &mut CraftProcess,
        happened: impl Fn() -> Option<()>,
    ) -> Result<(), PlayError> {
        let given_up = clock::now().plus(PATIENCE_NS);
        while happened().is_none() {
            self.look(process)?;
            if clock::now() >= given_up {
                return Err(PlayError::Failed("an orchestrator did not come to the point".into()));
            }
        }
        Ok(())
    }

    fn wait(&mut self, until: Nanos, process: &mut CraftProcess) -> Result<(), PlayError> {
        while clock::now() < until {
            self.look(process)?;
        }
        Ok(())
    }

    /// Sleeps a little, and looks whether the campaign must end.
    fn look(&mut self, process: &mut CraftProcess) -> Result<(), PlayError> {
        let system = |error: std::io::Error| PlayError::Failed(error.to_string());
        // A sleep that a signal cuts short is as good.
        let _slept = poll(&mut [], Some(&Timespec { tv_sec: 0, tv_nsec: LOOK_NS }));
        process.listen();
        if let Some(request) = self.signals.poll().map_err(system)? {
            return Err(PlayError::Stopped(request));
        }
        if self.ends.is_some_and(|ends| clock::now() >= ends) {
            return Err(PlayError::TimeLimit);
        }
        Ok(())
    }

    fn await_end(&mut self, process: &mut CraftProcess) -> Result<HowEnded, PlayError> {
        let given_up = clock::now().plus(PATIENCE_NS);
        loop {
            let ended = process.try_wait().map_err(|error| PlayError::Failed(error.to_string()))?;
            if let Some(how) = ended {
                return Ok(how);
            }
            if clock::now() >= given_up {
                return Err(PlayError::Failed("a killed orchestrator is still there".into()));
            }
            self.look(process)?;
        }
    }
}

/// How long crafts may outlive their orchestrator, ns.
const CRAFTS_END_NS: u64 = 1_000_000_000;

/// Cleans what the dead orchestrator left, as the next start of anything would, and notes what did not go.
fn clean_up(site: &Site, killed: Nanos, record: &mut FaultRecord) {
    // A craft that was just being started holds the run's lock until it is executed, and then sees that
    // its orchestrator is gone: within a second, as is promised.
    let mut cleaned = clean_dead_runs(&site.base);
    while cleaned.as_ref().is_ok_and(|report| !report.living.is_empty())
        && clock::now().since(killed) < CRAFTS_END_NS
    {
        let _slept = poll(&mut [], Some(&Timespec { tv_sec: 0, tv_nsec: LOOK_NS }));
        cleaned = clean_dead_runs(&site.base);
    }
    match cleaned {
        Ok(report) => {
            record.failures.extend(report.killed.iter().map(|pid| {
                (Failure::Hang, format!("process {pid} outlived its orchestrator and was killed"))
            }));
            record.failures.extend(
                report
                    .failed
                    .iter()
                    .map(|(run, what)| (Failure::CleanUp, format!("{run}: {what}"))),
            );
            let living = report.living.iter();
            record.failures.extend(
                living.map(|run| (Failure::CleanUp, format!("run {run} is thought to live"))),
            );
        }
        Err(error) => record.failures.push((Failure::CleanUp, error.to_string())),
    }
    record.times_ns.insert(Step::Reclaimed, clock::now().since(killed));
    for place in [&site.base, &site.results] {
        // The results of a killed run are kept for whoever wants them; nobody does here.
        let _may_not_exist = std::fs::remove_dir_all(&site.results);
        if place.exists() {
            record.failures.push((Failure::Left, place.display().to_string()));
        }
    }
}

/// What the orchestrator is told to do: for ever, until it is killed.
fn command_line(
    results: &Path,
    size: u32,
    strategy: StrategyKind,
    wake: WakeMode,
) -> Vec<OsString> {
    let wake = match wake {
        WakeMode::Poll => "poll",
        WakeMode::Adaptive => "adaptive",
        WakeMode::Block => "block",
    };
    let crafts = format!("fleet.crafts={size}");
    let words = ["run", super::PRESET, "--quiet", "--trials", "1000000", "--wake", wake];
    let words = words.into_iter().chain(["--strategies", strategy.name(), "--set", &crafts]);
    let mut line: Vec<OsString> = words.map(OsString::from).collect();
    line.extend(["--out".into(), results.as_os_str().to_owned()]);
    line
}
