//! The epochs that measure turn time: a fleet that is warm, fresh networks every epoch, no end
//! condition, every strategy and the floor `null` on the same networks.

use super::backend::Backend;
use super::epoch::{self, Prepared, Rules};
use super::plan::{FleetPlan, TimingPlan};
use super::{Ended, Runner};
use crate::results::record::{Cell, Counts, Overhead, TimingRecord, TrialRecord};
use crate::results::statistics::{Distribution, TIME_NS_MAX, second_half_ratio, time_histogram};
use crate::results::store::StoreError;
use hdrhistogram::Histogram;
use shared_types::transport::clock;
use shared_types::wire::Losses;

/// Trial numbers of the epochs that measure time start here, apart from the trials.
pub(super) const FIRST_TIMING_TRIAL: u32 = 1_000_000;

/// Most unmeasured epochs of a cell, however short they are.
const WARM_UP_EPOCHS_MAX: u32 = 10_000;

/// What the measured epochs of a cell add up to.
struct Tally {
    histogram: Histogram<u64>,
    turn_times_ns: Vec<u64>,
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
        for &strategy in &plan.strategies {
            let cell = epoch::cell(block, plan, strategy);
            let turns = timing.turns_of(strategy);
            let warm_up_began = clock::now();
            let mut warm_up_turns = 0;
            let (rules, prepared) = self.timing_epoch(plan, FIRST_TIMING_TRIAL, turns);
            let network = self.epoch;
            for _ in 0..WARM_UP_EPOCHS_MAX {
                let spec = rules.spec(self.epoch, network, strategy);
                if let Err(ended) = self.play_epoch(backend, plan, cell, &spec, &prepared)? {
                    return Ok(ended);
                }
                warm_up_turns += u64::from(turns);
                if clock::now().since(warm_up_began) >= timing.warm_up_ns {
                    break;
                }
            }
            let warm_up_ns = clock::now().since(warm_up_began);
            let mut tally = Tally::new();
            for number in 1..=timing.epochs {
                let (rules, prepared) = self.timing_epoch(plan, FIRST_TIMING_TRIAL + number, turns);
                let spec = rules.spec(self.epoch, self.epoch, strategy);
                match self.play_epoch(backend, plan, cell, &spec, &prepared)? {
                    Ok(record) => tally.add(&record),
                    Err(ended) => return Ok(ended),
                }
                self.done += 1;
            }
            let ready_ns = backend.ready_ns().unwrap_or(0);
            let record = tally.record(cell, timing, (warm_up_turns, warm_up_ns), ready_ns);
            self.store.append_timing(&record, &tally.histogram)?;
        }
        Ok(Ended::Complete)
    }

    fn timing_epoch(&self, plan: &FleetPlan, trial: u32, turns: u32) -> (Rules, Prepared) {
        let rules = Rules::of_trial(plan, self.plan.seed, trial).for_turns(turns);
        let prepared = rules.prepare(plan);
        (rules, prepared)
    }
}

impl Tally {
    fn new() -> Self {
        Self {
            histogram: time_histogram(),
            turn_times_ns: Vec::new(),
            fleet_cpu_ns: 0,
            orchestrator_cpu_ns: 0,
            processes: 0,
            resident_bytes: 0,
            resident_bytes_max: 0,
            counts: Counts::default(),
            overhead: Overhead::default(),
            losses: Losses::default(),
        }
    }

    fn add(&mut self, record: &TrialRecord) {
        let timing = &record.timing;
        for &time_ns in &timing.turn_times_ns {
            let within = time_ns.clamp(1, TIME_NS_MAX);
            self.histogram.record(within).expect("invariant: the histogram holds its bounds");
        }
        self.turn_times_ns.extend(&timing.turn_times_ns);
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

    fn record(
        &self,
        cell: Cell,
        timing: &TimingPlan,
        (warm_up_turns, warm_up_ns): (u64, u64),
        ready_ns: u64,
    ) -> TimingRecord {
        TimingRecord {
            cell,
            epochs: timing.epochs,
            turns: self.turn_times_ns.len() as u64,
            warm_up_turns,
            warm_up_ns,
            second_half_ratio: second_half_ratio(&self.turn_times_ns),
            turn_time: Distribution::of(&self.histogram),
            fleet_cpu_ns: self.fleet_cpu_ns,
            orchestrator_cpu_ns: self.orchestrator_cpu_ns,
            processes: self.processes,
            resident_bytes: self.resident_bytes,
            resident_bytes_max: self.resident_bytes_max,
            ready_ns,
            counts: self.counts,
            overhead: self.overhead,
            losses: self.losses,
        }
    }
}
