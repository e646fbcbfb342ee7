//! The one loop that owns a run.
//!
//! A run is a list of fleets; a fleet is launched once, plays every trial under every strategy (the
//! same seed and the same networks one after the other), then the epochs that measure turn time, then
//! the loads of open mode. Fleets of one size are the blocks of that size: trials are played in the
//! first, the others in each. What
//! comes back is judged against the independent replay and appended to the run's directory at once.
//! Whatever ends a run early, what was measured before is kept. Rendering comes after, from the
//! records alone.

pub mod answers;
pub mod backend;
mod baseline;
pub mod capacity;
pub mod demand;
mod epoch;
pub mod estimate;
mod fleet;
mod guard;
mod inflict;
mod loads;
mod losses;
pub mod measured;
pub mod offer;
mod open_play;
pub mod order;
mod patience;
pub mod plan;
mod play;
mod probing;
mod recovery;
mod repaired;
pub(crate) mod reports;
mod revival;
pub mod silence;
mod simulated;
mod staleness;
pub mod strike;
#[cfg(test)]
mod tests;
mod timing;
pub mod verdict;

pub use fleet::{FleetEnd, FleetOptions, RealFleet};
pub use recovery::Recovery;

use crate::launch::os_process::Launcher;
use crate::outcome::Outcome;
use crate::results::event::Event;
use crate::results::store::{Store, StoreError};
use crate::supervision::signals::Signals;
use backend::Backend;
use baseline::Hops;
use epoch::Rules;
use guard::{Sample, Spin};
use plan::{FleetPlan, RunPlan};
use shared_types::time::Nanos;
use shared_types::transport::clock;
use shared_types::wire::StrategyKind;
use simulated::SimulatedFleet;
use std::collections::BTreeMap;

/// What the loop tells whoever shows its progress.
pub trait Progress {
    /// `done` of `total` epochs are played; now comes `what`.
    fn at(&mut self, done: u64, total: u64, what: &str);

    /// Something that the user must be told at once.
    fn say(&mut self, line: &str);
}

/// How a fleet's part of a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Ended {
    /// As planned.
    Complete,
    /// Early, for this reason: no further fleet is started.
    Early(Outcome),
    /// An epoch of it alone: a craft was lost in it, and its successor takes part in the next.
    Epoch,
}

/// The loop and what it has in hands.
pub struct Runner<'a> {
    plan: &'a RunPlan,
    store: &'a mut Store,
    progress: &'a mut dyn Progress,
    run_ends: Option<Nanos>,
    /// The worst that has happened so far.
    outcome: Outcome,
    /// Epochs played, for the progress.
    done: u64,
    /// Number of the next epoch on the fleet at hand.
    epoch: u32,
    /// Where the last search for capacity ended, by crafts, strategy and burst.
    capacities: BTreeMap<(u32, StrategyKind, u32), f64>,
}

impl<'a> Runner<'a> {
    /// A runner of `plan` that keeps results in `store`. The time limit counts from here.
    pub fn new(plan: &'a RunPlan, store: &'a mut Store, progress: &'a mut dyn Progress) -> Self {
        let limit_ns = plan.time_limit_s.map(|seconds| u64::from(seconds) * 1_000_000_000);
        Self {
            plan,
            progress,
            run_ends: limit_ns.map(|limit_ns| clock::now().plus(limit_ns)),
            outcome: store.outcome_so_far(),
            store,
            done: 0,
            epoch: 0,
            capacities: BTreeMap::new(),
        }
    }

    /// Runs everything that is planned and not done yet; returns how the run ends. Crafts are started with
    /// `launcher`, from this thread.
    ///
    /// # Errors
    /// If results cannot be kept any more; no process is left.
    pub fn run(
        mut self,
        launcher: &Launcher,
        signals: &mut Signals,
    ) -> Result<Outcome, StoreError> {
        for (index, fleet) in self.plan.fleets.iter().enumerate() {
            self.epoch = 0;
            let (block, size) = (self.plan.block_of(index), fleet.scenario.craft_count());
            if self.store.has_fleet(size, block) {
                self.done += self.plan.epochs_of(index);
                continue;
            }
            let ended = if self.plan.is_simulated {
                self.simulate(block, fleet, signals)?
            } else {
                self.play_real(block, fleet, launcher, signals)?
            };
            if let Ended::Early(outcome) = ended {
                self.outcome = self.outcome.worse(outcome);
                break;
            }
            let code = self.outcome.code();
            self.store.event(Event::FleetDone { block, size, code })?;
        }
        Ok(self.outcome)
    }

    fn simulate(
        &mut self,
        block: u32,
        fleet: &FleetPlan,
        signals: &mut Signals,
    ) -> Result<Ended, StoreError> {
        let links = fleet.scenario.link_spec().cloned();
        let size = (fleet.scenario.craft_count(), self.plan.seed);
        let mut backend =
            SimulatedFleet::new(size, links, self.plan.restart, signals, self.run_ends);
        match self.play_trials(&mut backend, block, fleet)? {
            Ended::Complete => self.measure_all(&mut backend, block, fleet),
            ended => Ok(ended),
        }
    }

    fn play_real(
        &mut self,
        block: u32,
        plan: &FleetPlan,
        launcher: &Launcher,
        signals: &mut Signals,
    ) -> Result<Ended, StoreError> {
        let size = plan.scenario.craft_count();
        let options = self.plan.fleet_options(plan, self.run_ends);
        let processes = options.processes();
        let order = plan.order.iter().map(ToString::to_string).collect();
        self.store.event(Event::FleetStarted { block, size, processes, order })?;
        self.progress.at(self.done, self.plan.epochs(), &format!("starting {size} crafts"));
        let is_measured =
            self.plan.timing.is_some() || self.plan.open.is_some() || self.plan.capacity.is_some();
        let spin_before = is_measured.then(Spin::run);
        let hops_before = self.raw_hops(plan)?;
        let mut fleet = match RealFleet::launch(options, launcher, signals) {
            Ok(fleet) => fleet,
            Err(error) => return self.end_early(plan, "starting the fleet", error),
        };
        let mut ended = self.play_trials(&mut fleet, block, plan)?;
        let mut samples = None;
        if ended == Ended::Complete && is_measured {
            let before = Sample::take(&plan.placement, size, &fleet.process_ids());
            ended = self.measure_all(&mut fleet, block, plan)?;
            samples = Some((before, Sample::take(&plan.placement, size, &fleet.process_ids())));
        }
        self.end_fleet(fleet, plan)?;
        if let (Some(spin_before), Some((before, after)), Ended::Complete) =
            (spin_before, samples, ended)
        {
            let check = before.until(&after, (spin_before, Spin::run()));
            self.store.event(Event::HostChecked { block, size, check })?;
            if let Some((before, after)) = hops_before.zip(self.raw_hops(plan)?) {
                let baseline = before.until(&after);
                self.store.event(Event::BaselineMeasured { block, size, baseline })?;
            }
        }
        Ok(ended)
    }

    /// The raw hop of the host, while no fleet lives; only where loads will need it.
    fn raw_hops(&mut self, plan: &FleetPlan) -> Result<Option<Hops>, StoreError> {
        if plan.loads.is_empty() && plan.searched.is_empty() {
            return Ok(None);
        }
        match Hops::measure(&plan.placement, plan.scenario.craft_count()) {
            Ok(hops) => Ok(Some(hops)),
            Err(error) => {
                self.note(format!("no raw baseline could be measured: {error}"))?;
                Ok(None)
            }
        }
    }

    /// Measures what the plan wants of a fleet that has played its trials.
    fn measure_all(
        &mut self,
        backend: &mut impl Backend,
        block: u32,
        plan: &FleetPlan,
    ) -> Result<Ended, StoreError> {
        if let Some(timing) = &self.plan.timing {
            let ended = self.measure(backend, block, plan, timing)?;
            if ended != Ended::Complete {
                return Ok(ended);
            }
        }
        if let Some(open) = &self.plan.open {
            let ended = self.offer_loads(backend, block, plan, open)?;
            if ended != Ended::Complete {
                return Ok(ended);
            }
        }
        match &self.plan.capacity {
            Some(capacity) => self.search_capacities(backend, block, plan, capacity),
            None => Ok(Ended::Complete),
        }
    }

    /// Ends a fleet and says who did not end by itself, and what could not be removed.
    fn end_fleet(&mut self, mut fleet: RealFleet<'_>, plan: &FleetPlan) -> Result<(), StoreError> {
        self.keep_recoveries(&mut fleet, plan, true)?;
        let end = fleet.end();
        for &craft in &end.report.killed {
            let name = plan.scenario.names().craft(craft);
            self.note(format!("{name} did not end by itself and was killed"))?;
        }
        for error in end.trouble {
            self.note(format!("the fleet could not be ended cleanly: {error}"))?;
        }
        Ok(())
    }

    /// Plays every trial under every strategy.
    fn play_trials(
        &mut self,
        backend: &mut impl Backend,
        block: u32,
        plan: &FleetPlan,
    ) -> Result<Ended, StoreError> {
        for trial in 0..self.plan.trials_of(block) {
            let rules = Rules::of_trial(plan, self.plan.seed, trial);
            let prepared = rules.prepare(plan);
            let network = self.epoch;
            for &strategy in &plan.strategies {
                let cell = epoch::cell(block, plan, strategy);
                let spec = rules.spec(self.epoch, network, strategy);
                match self.play_epoch(backend, plan, cell, &spec, &prepared)? {
                    Ok(record) => self.store.append_trial(&record)?,
                    Err(Ended::Epoch) => {}
                    Err(ended) => return Ok(ended),
                }
                self.done += 1;
            }
        }
        Ok(Ended::Complete)
    }

    /// Keeps a remark with the results and tells the user.
    fn note(&mut self, what: String) -> Result<(), StoreError> {
        self.progress.say(&what);
        self.store.event(Event::Note { what })
    }
}
