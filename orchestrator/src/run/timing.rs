//! The epochs that measure turn time: a fleet that is warm, fresh networks every epoch, no end
//! condition, every strategy and the floor `null` on the same networks, in the order of the block.

use super::backend::Backend;
use super::epoch::{self, Prepared, Rules};
use super::plan::{FleetPlan, TimingPlan};
use super::{Ended, Runner};
use crate::results::record::{Cell, Counts, Overhead, TimingRecord, TrialRecord};
use crate::results::statistics::{Distribution, histogram_of, second_half_ratio};
use crate::results::store::StoreError;
use shared_types::transport::clock;
use shared_types::wire::Losses;

/// Trial numbers of the epochs that measure time start here, apart from the trials.
pub(super) const FIRST_TIMING_TRIAL: u32 = 1_000_000;

/// Most unmeasured epochs of a cell, however short they are.
const WARM_UP_EPOCHS_MAX: u32 = 10_000;

/// What the measured epochs of a cell add up to.
#[derive(Default)]
struct Tally {
    /// Epoch by epoch.
    turn_times_ns: Vec<Vec<u64>>,
    fleet_cpu_ns: u64,
    orchestrator_cpu_ns: u64,
    processes: u32,
    resident_bytes: u64,
    resident_bytes_max: u64,
    counts: Counts,
    overhead: Overhead,
    losses: Losses,
}

impl Runner<'_> {
    /// Measures every cell of a fleet.
    pub(super) fn measure(
        &mut self,
        backend: &mut impl Backend,
        block: u32,
        plan: &FleetPlan,
        timing: &TimingPlan,
    ) -> Result<Ended, StoreError> {
        for (place, &label) in (0..).zip(&plan.order) {
            let strategy = label.strategy;
            let cell = epoch::cell(block, plan, strategy);
            let turns = timing.turns_of(strategy);
            backend.slow_down(label.planted_slowdown_percent());
            let warm_up_began = clock::now();
            let mut warm_up_turns = 0;
            let first = timing.first_trial(block);
            let (rules, prepared) = self.timing_epoch(plan, first, turns);
            let network = self.epoch;
            for _ in 0..WARM_UP_EPOCHS_MAX {
                let spec = rules.spec(self.epoch, network, strategy);
                match self.play_epoch(backend, plan, cell, &spec, &prepared)? {
                    Ok(_) | Err(Ended::Epoch) => {}
                    Err(ended) => return Ok(ended),
                }
                warm_up_turns += u64::from(turns);
                if clock::now().since(warm_up_began) >= timing.warm_up_ns {
                    break;
                }
            }
            let warm_up_ns = clock::now().since(warm_up_began);
            let mut tally = Tally::default();
            for number in 1..=timing.epochs {
                let (rules, prepared) = self.timing_epoch(plan, first + number, turns);
                let spec = rules.spec(self.epoch, self.epoch, strategy);
                match self.play_epoch(backend, plan, cell, &spec, &prepared)? {
                    Ok(record) => tally.add(&record),
                    Err(Ended::Epoch) => {}
                    Err(ended) => return Ok(ended),
                }
                self.done += 1;
            }
            let ready_ns = backend.ready_ns().unwrap_or(0);
            let record = TimingRecord {
                cell,
                again: label.again,
                place,
                epochs: u32::try_from(tally.turn_times_ns.len()).unwrap_or(u32::MAX),
                warm_up_turns,
                warm_up_ns,
                ready_ns,
                ..tally.record(cell)
            };
            self.store.append_timing(&record, &tally.turn_times_ns)?;
        }
        backend.slow_down(0);
        Ok(Ended::Complete)
    }

    fn timing_epoch(&self, plan: &FleetPlan, trial: u32, turns: u32) -> (Rules, Prepared) {
        let rules = Rules::of_trial(plan, self.plan.seed, trial).for_turns(turns);
        let prepared = rules.prepare(plan);
        (rules, prepared)
    }
}

impl Tally {
    fn add(&mut self, record: &TrialRecord) {
        let timing = &record.timing;
        self.turn_times_ns.push(timing.turn_times_ns.clone());
        self.fleet_cpu_ns += timing.processes.iter().map(|process| process.cpu_ns).sum::<u64>();
        self.orchestrator_cpu_ns += timing.orchestrator_cpu_ns;
        self.processes = u32::try_from(timing.processes.len()).unwrap_or(u32::MAX);
        let resident = timing.processes.iter().map(|process| process.resident_bytes);
        self.resident_bytes = self.resident_bytes.max(resident.clone().sum());
        self.resident_bytes_max = self.resident_bytes_max.max(resident.max().unwrap_or(0));
        self.counts += record.deterministic.measured;
        self.overhead += timing.overhead;
        self.losses += timing.losses;
    }

    /// What was measured; where it belongs and what came before is the caller's.
    fn record(&self, cell: Cell) -> TimingRecord {
        let turn_times: Vec<u64> = self.turn_times_ns.concat();
        TimingRecord {
            cell,
            again: 0,
            place: 0,
            epochs: 0,
            turns: turn_times.len() as u64,
            warm_up_turns: 0,
            warm_up_ns: 0,
            second_half_ratio: second_half_ratio(&turn_times),
            turn_time: Distribution::of(&histogram_of(turn_times)),
            fleet_cpu_ns: self.fleet_cpu_ns,
            orchestrator_cpu_ns: self.orchestrator_cpu_ns,
            processes: self.processes,
            resident_bytes: self.resident_bytes,
            resident_bytes_max: self.resident_bytes_max,
            ready_ns: 0,
            counts: self.counts,
            overhead: self.overhead,
            losses: self.losses,
        }
    }
}
