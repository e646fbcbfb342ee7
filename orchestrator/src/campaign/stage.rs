//! What a fleet plays over and over while its crafts die, and how it must go: a trial, or an interval of
//! open mode.

use super::interval::IntervalStage;
use crate::results::faults::Failure;
use crate::run::RealFleet;
use crate::run::backend::{Backend as _, PlayError};
use crate::run::verdict::{self, Demands};
use crate::scenario::{ResolvedScenario, compile};
use crate::workload::TraceError;
use agent::oracle::{Expected, Replay};
use shared_types::knowledge::FleetNetwork;
use shared_types::wire::{EpochSpec, LinkCounts, LinkSpec, StrategyKind};

/// Failures of one trial that are told.
const TOLD_MAX: usize = 3;

/// What is played.
pub(super) enum Stage<'a> {
    /// A trial: a death takes it, and the next one must go as without.
    Trial(Box<TrialStage<'a>>),
    /// An interval, which goes on through deaths.
    Interval(Box<IntervalStage>),
}

impl<'a> Stage<'a> {
    /// Trial `trial` of `scenario` under `strategy`, or the interval on its networks, over links that do
    /// what `link` says if it says something.
    ///
    /// # Errors
    /// If the networks hold nothing that an interval could write.
    pub(super) fn new(
        scenario: &'a ResolvedScenario,
        strategy: StrategyKind,
        trial: u32,
        is_interval: bool,
        link: Option<LinkSpec>,
    ) -> Result<Self, TraceError> {
        Ok(if is_interval {
            Self::Interval(Box::new(IntervalStage::new(scenario, strategy, trial, link)?))
        } else {
            Self::Trial(Box::new(TrialStage::new(scenario, strategy, trial)))
        })
    }

    /// Plays it once more; says what was not as it must be.
    ///
    /// # Errors
    /// If it does not come to its end.
    pub(super) fn play(
        &mut self,
        fleet: &mut RealFleet<'_>,
    ) -> Result<Vec<(Failure, String)>, PlayError> {
        match self {
            Self::Trial(trial) => trial.play(fleet),
            Self::Interval(interval) => interval.play(fleet),
        }
    }

    /// What links have done to samples in all that was played; nothing in trials.
    pub(super) fn links(&self) -> LinkCounts {
        match self {
            Self::Trial(_) => LinkCounts::default(),
            Self::Interval(interval) => interval.links(),
        }
    }
}

/// A trial, its networks and its replay.
pub(super) struct TrialStage<'a> {
    scenario: &'a ResolvedScenario,
    network: FleetNetwork,
    replay: Replay,
    expected: Expected,
    /// The epoch that is played next.
    spec: EpochSpec,
}

impl<'a> TrialStage<'a> {
    fn new(scenario: &'a ResolvedScenario, strategy: StrategyKind, trial: u32) -> Self {
        let seed = scenario.scenario().run.seed;
        let spec = EpochSpec { seed, ..scenario.epoch_spec(strategy, trial) };
        let mut network = FleetNetwork::default();
        compile(scenario, seed, trial, &mut network);
        let replay = Replay::of(&network.view(), &spec);
        network.script = replay.script();
        let expected = replay.expected(&network.view(), &spec, strategy);
        Self { scenario, network, replay, expected, spec }
    }

    fn play(&mut self, fleet: &mut RealFleet<'_>) -> Result<Vec<(Failure, String)>, PlayError> {
        let spec = self.spec.clone();
        self.spec.epoch += 1;
        let played = fleet.play(&spec, &self.network)?;
        let losses = verdict::losses(&played.reports);
        if losses.is_partial() {
            // Nothing hides it, but nothing was to be lost either.
            return Ok(vec![(Failure::Restart, format!("something was lost: {losses:?}"))]);
        }
        let view = self.network.view();
        let demands = Demands {
            replay: &self.replay,
            expected: &self.expected,
            fleet: &view,
            names: self.scenario.names(),
        };
        let broken = verdict::judge(&demands, &spec, &played);
        let told = broken.iter().take(TOLD_MAX).map(|discrepancy| {
            let is_board = discrepancy.metric.is_digest();
            let failure = if is_board { Failure::WrongBoards } else { Failure::UndetectedLoss };
            (failure, discrepancy.to_string())
        });
        Ok(told.collect())
    }
}
