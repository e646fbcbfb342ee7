//! One epoch of a run: prepare it, have it played, judge it, keep what happened.

use super::backend::{Backend, PlayError};
use super::inflict::Infliction;
use super::plan::FleetPlan;
use super::timing::FIRST_TIMING_TRIAL;
use super::verdict::{self, Demands};
use super::{Ended, Runner};
use crate::outcome::Outcome;
use crate::results::event::Event;
use crate::results::record::{Cell, TrialRecord};
use crate::results::store::StoreError;
use crate::scenario::compile;
use agent::oracle::Replay;
use shared_types::knowledge::FleetNetwork;
use shared_types::wire::{EpochSpec, StrategyKind, TrialReport};

/// Discrepancies of one trial that are kept and told; the rest is counted.
const DISCREPANCIES_KEPT: usize = 8;

/// What an epoch is played by, whatever the strategy.
#[derive(Clone, Debug)]
pub(super) struct Rules {
    spec: EpochSpec,
}

/// The networks of a trial and how it must go.
#[derive(Debug)]
pub(super) struct Prepared {
    pub(super) network: FleetNetwork,
    pub(super) replay: Replay,
}

/// Where the measurements of `strategy` on the fleet of `plan` belong.
pub(super) fn cell(block: u32, plan: &FleetPlan, strategy: StrategyKind) -> Cell {
    Cell { block, size: plan.scenario.craft_count(), strategy }
}

impl Rules {
    /// Trial `trial` of `seed`, as the scenario says.
    pub(super) fn of_trial(plan: &FleetPlan, seed: u64, trial: u32) -> Self {
        Self { spec: EpochSpec { seed, ..plan.scenario.epoch_spec(StrategyKind::Null, trial) } }
    }

    /// The same for `turns` turns, whatever is reached.
    pub(super) fn for_turns(mut self, turns: u32) -> Self {
        self.spec.turns_max = turns;
        self.spec.ignores_finals = true;
        self
    }

    /// The epoch `epoch` under `strategy`, on the networks published for epoch `network`.
    pub(super) fn spec(&self, epoch: u32, network: u32, strategy: StrategyKind) -> EpochSpec {
        EpochSpec { epoch, network, strategy, ..self.spec.clone() }
    }

    /// Builds the networks and replays the trial on them.
    pub(super) fn prepare(&self, plan: &FleetPlan) -> Prepared {
        let mut network = FleetNetwork::default();
        compile(&plan.scenario, self.spec.seed, self.spec.trial, &mut network);
        let replay = Replay::of(&network.view(), &self.spec);
        network.script = replay.script();
        Prepared { network, replay }
    }
}

impl Prepared {
    /// `spec` as it is played. Nothing is delivered under `null`, so that no delivery can end a trial
    /// there: it replays the turns of the trial, however that came to its end.
    fn playable(&self, spec: &EpochSpec) -> EpochSpec {
        let mut spec = spec.clone();
        if spec.strategy == StrategyKind::Null {
            spec.turns_max = self.replay.turns;
            spec.ignores_finals = true;
        }
        spec
    }
}

impl Runner<'_> {
    /// Plays one epoch and judges it. The inner error says that the fleet's part of the run is over.
    pub(super) fn play_epoch(
        &mut self,
        backend: &mut impl Backend,
        plan: &FleetPlan,
        cell: Cell,
        spec: &EpochSpec,
        prepared: &Prepared,
    ) -> Result<Result<TrialRecord, Ended>, StoreError> {
        let Cell { block, size, strategy } = cell;
        let part = if spec.ignores_finals && spec.trial >= FIRST_TIMING_TRIAL {
            "turn times".to_owned()
        } else {
            format!("trial {}", spec.trial)
        };
        let phase = format!("{size} crafts, {strategy}, {part}");
        self.progress.at(self.done, self.plan.epochs(), &phase);
        let is_timed = spec.trial >= FIRST_TIMING_TRIAL;
        backend.inflict(if is_timed { Vec::new() } else { Infliction::all_of(&plan.scenario) });
        let was_ready = backend.ready_ns().is_some();
        let result = backend.play(&prepared.playable(spec), &prepared.network);
        self.epoch += 1;
        self.keep_recoveries(backend, plan, false)?;
        if let (false, Some(ready_ns)) = (was_ready, backend.ready_ns()) {
            self.store.event(Event::FleetReady { block, size, ready_ns })?;
        }
        let fleet = prepared.network.view();
        let expected = prepared.replay.expected(&fleet, spec, strategy);
        let names = plan.scenario.names();
        let demands =
            Demands { replay: &prepared.replay, expected: &expected, fleet: &fleet, names };
        let played = match result {
            Ok(played) => played,
            Err(PlayError::Unbalanced { turns, standing, reports }) => {
                // What the trial demands up to the turn that stands still.
                let rules = EpochSpec { turns_max: turns, ignores_finals: true, ..spec.clone() };
                let replay = Replay::of(&fleet, &rules);
                let expected = replay.expected(&fleet, &rules, strategy);
                let suspects = verdict::suspects(&expected, &reports, names);
                return self.fault(cell, spec, standing, suspects, &reports).map(Err);
            }
            Err(PlayError::Lost(lost)) => {
                return self.go_on_without(lost, backend, plan, (cell, spec, &phase)).map(Err);
            }
            Err(error) => return self.end_early(plan, &phase, error).map(Err),
        };
        let record = verdict::record(&demands, cell, spec, &played);
        if record.timing.losses.is_partial() {
            self.outcome = self.outcome.worse(Outcome::Partial);
            self.note(format!("{phase}: something was lost: {:?}", record.timing.losses))?;
        } else {
            let broken = verdict::judge(&demands, spec, &played);
            self.keep_discrepancies(cell, spec, broken.iter().map(ToString::to_string))?;
        }
        let (epoch, trial) = (spec.epoch, spec.trial);
        let end = record.deterministic.end;
        self.store.event(Event::EpochDone { cell, epoch, trial, end })?;
        Ok(Ok(record))
    }

    /// Keeps why a run ends before its plan does.
    pub(super) fn end_early(
        &mut self,
        plan: &FleetPlan,
        phase: &str,
        error: PlayError,
    ) -> Result<Ended, StoreError> {
        let outcome = match error {
            PlayError::Lost(lost) => {
                self.keep_losses(&lost, plan, phase)?;
                Outcome::Partial
            }
            PlayError::Stopped(request) => {
                self.store.event(Event::Interrupted { signal: verdict::signal_of(request) })?;
                request.outcome
            }
            PlayError::TimeLimit => {
                self.note(format!("the time limit was reached in {phase}"))?;
                Outcome::TimeLimit
            }
            PlayError::Unbalanced { standing, .. } | PlayError::Failed(standing) => {
                self.note(format!("{phase}: {standing}"))?;
                Outcome::Partial
            }
        };
        Ok(Ended::Early(outcome))
    }

    /// A turn that stayed unbalanced: a loss if one was counted, else a broken promise; says between
    /// which crafts.
    fn fault(
        &mut self,
        cell: Cell,
        spec: &EpochSpec,
        standing: String,
        suspects: Vec<String>,
        reports: &[TrialReport],
    ) -> Result<Ended, StoreError> {
        let losses = verdict::losses(reports);
        let mut what = vec![standing];
        what.extend(suspects);
        if losses.is_partial() {
            for line in what {
                self.note(line)?;
            }
            self.note(format!("something was lost: {losses:?}"))?;
            return Ok(Ended::Early(Outcome::Partial));
        }
        self.keep_discrepancies(cell, spec, what.into_iter())?;
        Ok(Ended::Early(Outcome::Broken))
    }

    pub(super) fn keep_discrepancies(
        &mut self,
        cell: Cell,
        spec: &EpochSpec,
        broken: impl ExactSizeIterator<Item = String>,
    ) -> Result<(), StoreError> {
        let count = broken.len();
        if count == 0 {
            return Ok(());
        }
        self.outcome = self.outcome.worse(Outcome::Broken);
        for what in broken.take(DISCREPANCIES_KEPT) {
            self.progress.say(&what);
            self.store.event(Event::Discrepancy { cell, trial: spec.trial, what })?;
        }
        if count > DISCREPANCIES_KEPT {
            self.note(format!("{} further differences", count - DISCREPANCIES_KEPT))?;
        }
        Ok(())
    }
}
