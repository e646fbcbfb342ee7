//! What a run does, decided before anything starts.

use super::FleetOptions;
use super::answers::ANSWER_LIMIT_NS;
use super::capacity::Search;
use crate::launch::placement::Placement;
use crate::results::record::Label;
use crate::scenario::ResolvedScenario;
use crate::supervision::restart::RestartPolicy;
use crate::workload::Trace;
use shared_types::time::Nanos;
use shared_types::transport::WakeMode;
use shared_types::transport::reclaim::Steps;
use shared_types::wire::StrategyKind;
use std::collections::BTreeMap;

/// Trial numbers of the epochs that measure time start here, apart from the trials.
const FIRST_TIMING_TRIAL: u32 = 1_000_000;

/// One launch of a fleet and what it plays.
#[derive(Clone, Debug)]
pub struct FleetPlan {
    /// The fleet's scenario, with its number of crafts.
    pub scenario: ResolvedScenario,
    /// The strategies, in the order in which trials are played.
    pub strategies: Vec<StrategyKind>,
    /// What is timed, in the order of this block.
    pub order: Vec<Label>,
    /// What it is offered in open mode, after that.
    pub loads: Vec<LoadPlan>,
    /// Whose capacity is searched after that, in the order of this block.
    pub searched: Vec<LoadLabel>,
    /// Where its processes run.
    pub placement: Placement,
}

impl FleetPlan {
    /// Whether some strategy needs a centre.
    #[must_use]
    pub fn has_centre(&self) -> bool {
        self.strategies.iter().any(|strategy| strategy.has_centre())
    }
}

/// The epochs that measure turn time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimingPlan {
    /// Fresh epochs for each cell.
    pub epochs: u32,
    /// Turns of one epoch.
    pub turns: u32,
    /// Turns of one epoch under `central` and `pipelined`, whose turns are a hundred times longer.
    pub turns_of_round_trips: u32,
    /// How long a cell runs unmeasured before, ns.
    pub warm_up_ns: u64,
}

impl TimingPlan {
    /// The number of the warm-up's trial in `block`; those that are measured follow it. Every block
    /// has networks of its own.
    #[must_use]
    pub const fn first_trial(&self, block: u32) -> u32 {
        FIRST_TIMING_TRIAL.wrapping_add(block.wrapping_mul(self.epochs.wrapping_add(1)))
    }

    /// Turns of one epoch under `strategy`.
    #[must_use]
    pub const fn turns_of(&self, strategy: StrategyKind) -> u32 {
        match strategy {
            StrategyKind::Central | StrategyKind::Pipelined => self.turns_of_round_trips,
            _ => self.turns,
        }
    }
}

/// A load that a fleet is offered, and who bears it.
#[derive(Clone, Debug)]
pub struct LoadPlan {
    /// What tables call it.
    pub name: String,
    /// What is written and read when.
    pub offered: Offered,
    /// Records of its trace, on average.
    pub records: u64,
    /// Who bears it, in the order of this block.
    pub order: Vec<LoadLabel>,
}

/// Where the trace of a load comes from.
#[derive(Clone, Debug)]
pub enum Offered {
    /// Drawn for each block.
    Drawn {
        /// Writes per second of the fleet.
        rate_per_s: f64,
    },
    /// The same in every block.
    Given(Trace),
}

/// Who bears a load.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LoadLabel {
    /// The strategy, and which of its entries in the block.
    pub label: Label,
    /// How often its clients ask the centre, ns; `None` without a centre.
    pub asks_every_ns: Option<u64>,
}

impl std::fmt::Display for LoadLabel {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{}", self.label)?;
        match self.asks_every_ns {
            Some(every_ns) => write!(formatter, " asking every {} us", every_ns / 1000),
            None => Ok(()),
        }
    }
}

/// How loads are measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OpenPlan {
    /// Length of the measured interval, ns.
    pub duration_ns: u64,
    /// Length of the slices in which time to knowledge is kept apart, ns.
    pub slice_ns: u64,
    /// How long a cell runs unmeasured before, ns.
    pub warm_up_ns: u64,
}

/// How capacity is searched.
#[derive(Clone, Debug, PartialEq)]
pub struct CapacityPlan {
    /// How a rate is offered.
    pub open: OpenPlan,
    /// How the search goes.
    pub search: Search,
    /// Writes of one craft that are due together, one search each.
    pub bursts: Vec<u32>,
    /// Loads in percent of a strategy's own capacity at the first burst.
    pub percents: Vec<u32>,
}

/// A run.
#[derive(Clone, Debug)]
pub struct RunPlan {
    /// The fleets, one after the other.
    pub fleets: Vec<FleetPlan>,
    /// Seed of everything that is drawn.
    pub seed: u64,
    /// Trials for each strategy, in the first block; 0 if only turn times are wanted.
    pub trials: u32,
    /// Whether crafts live in one process on a virtual clock.
    pub is_simulated: bool,
    /// Turn times, if they are wanted; never in simulation.
    pub timing: Option<TimingPlan>,
    /// How loads are measured, if some are offered.
    pub open: Option<OpenPlan>,
    /// How capacity is searched, if it is; never in simulation.
    pub capacity: Option<CapacityPlan>,
    /// How processes wait.
    pub wake: WakeMode,
    /// How long a turn may stay unbalanced, ns.
    pub turn_limit_ns: u64,
    /// After how many seconds the run ends.
    pub time_limit_s: Option<u32>,
    /// How crafts that die are followed by successors; `None` if they are not.
    pub restart: Option<RestartPolicy>,
}

impl RunPlan {
    /// Epochs and intervals that will be played, warm-up not counted.
    #[must_use]
    pub fn epochs(&self) -> u64 {
        (0..self.fleets.len()).map(|index| self.epochs_of(index)).sum()
    }

    /// Of these, those of the fleet `index`.
    #[must_use]
    pub fn epochs_of(&self, index: usize) -> u64 {
        let timed = self.timing.map_or(0, |timing| u64::from(timing.epochs));
        let fleet = &self.fleets[index];
        let trials = u64::from(self.trials_of(self.block_of(index)));
        let loads = fleet.loads.iter().map(|load| load.order.len() as u64).sum::<u64>();
        fleet.strategies.len() as u64 * trials
            + fleet.order.len() as u64 * timed
            + loads
            + fleet.searched.len() as u64
    }

    /// Trials of each strategy in `block`: counts are decided by the seed, so once is enough.
    #[must_use]
    pub const fn trials_of(&self, block: u32) -> u32 {
        if block == 0 { self.trials } else { 0 }
    }

    /// Which launch of its size the fleet `index` is, from 0: blocks of one size are compared with
    /// each other, fleets of other sizes are not blocks of it.
    #[must_use]
    pub fn block_of(&self, index: usize) -> u32 {
        let size = self.fleets[index].scenario.craft_count();
        let earlier = &self.fleets[..index];
        let same = earlier.iter().filter(|fleet| fleet.scenario.craft_count() == size).count();
        u32::try_from(same).unwrap_or(u32::MAX)
    }

    /// How the fleet of `plan` is started.
    #[must_use]
    pub fn fleet_options(&self, plan: &FleetPlan, run_ends: Option<Nanos>) -> FleetOptions {
        FleetOptions {
            crafts: plan.scenario.craft_count(),
            has_centre: plan.has_centre(),
            wake: self.wake,
            placement: plan.placement.clone(),
            turn_limit_ns: self.turn_limit_ns,
            answer_limit_ns: ANSWER_LIMIT_NS,
            run_ends,
            restart: self.restart,
            dooms: BTreeMap::new(),
            janitor: Steps::ALL,
        }
    }
}
