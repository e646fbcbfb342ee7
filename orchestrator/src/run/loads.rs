//! The cells of open mode of one fleet: every load on networks and a trace of its own, every label in
//! the order of the block, each after an unmeasured part of the same trace.

use super::backend::{Backend, PlayError, PlayedOpen};
use super::epoch::{self, Rules};
use super::inflict::Infliction;
use super::measured::Measured;
use super::offer::Offer;
use super::plan::{FleetPlan, LoadLabel, LoadPlan, OpenPlan};
use super::{Ended, Runner, verdict};
use crate::outcome::Outcome;
use crate::results::event::Event;
use crate::results::load::{LoadHistograms, LoadRecord, SimulatedInterval};
use crate::results::record::{Cell, Counts, Digest, Label, TrialEnd};
use crate::results::statistics::as_float;
use crate::results::store::StoreError;
use agent::oracle::{ExpectedOpen, ObservedOpen, compare_open};
use shared_types::trace::TraceRecord;
use shared_types::wire::{EpochSpec, HEADER_BYTES, OpenSpec, Traffic};

/// One cell on its way.
pub(super) struct Bearing<'a> {
    pub(super) plan: &'a FleetPlan,
    pub(super) open: &'a OpenPlan,
    pub(super) load: &'a LoadPlan,
    pub(super) offer: &'a Offer,
    pub(super) cell: Cell,
    pub(super) label: LoadLabel,
    pub(super) place: u32,
    /// Epoch for which networks and trace were published.
    pub(super) network: u32,
}

impl Runner<'_> {
    /// Measures every load of a fleet.
    pub(super) fn offer_loads(
        &mut self,
        backend: &mut impl Backend,
        block: u32,
        plan: &FleetPlan,
        open: &OpenPlan,
    ) -> Result<Ended, StoreError> {
        for load in &plan.loads {
            let offer = match Offer::of(plan, open, load, self.plan.seed, block) {
                Ok(offer) => offer,
                Err(error) => {
                    let what = format!("load {}", load.name);
                    return self.end_early(plan, &what, PlayError::Failed(error.to_string()));
                }
            };
            let network = self.epoch;
            for (place, &label) in (0..).zip(&load.order) {
                let cell = epoch::cell(block, plan, label.label.strategy);
                let bearing =
                    Bearing { plan, open, load, offer: &offer, cell, label, place, network };
                match self.bear(backend, &bearing)? {
                    Ok((record, histograms)) => self.store.append_load(&record, &histograms)?,
                    Err(Ended::Epoch) => {}
                    Err(ended) => return Ok(ended),
                }
                self.done += 1;
            }
        }
        Ok(Ended::Complete)
    }

    /// Plays one cell: the unmeasured part, then the interval. The inner error says that the fleet's
    /// part of the run is over.
    pub(super) fn bear(
        &mut self,
        backend: &mut impl Backend,
        bearing: &Bearing<'_>,
    ) -> Result<Result<(LoadRecord, LoadHistograms), Ended>, StoreError> {
        let Bearing { plan, open, load, cell, label, .. } = bearing;
        let phase = format!("{} crafts, {label}, load {}", cell.size, load.name);
        self.progress.at(self.done, self.plan.epochs(), &phase);
        let warm_up_ns = open.warm_up_ns.min(open.duration_ns).max(1);
        let epochs = open.warm_up_ns.div_ceil(warm_up_ns);
        backend.inflict(Vec::new());
        for _ in 0..epochs {
            match self.play_interval(backend, bearing, warm_up_ns)? {
                Ok((_, played)) if !played.is_quiet => self.note(format!(
                    "{phase}: the fleet did not come to rest after the unmeasured part; what was still \
                     under way then counts as lost"
                ))?,
                Ok((_, played)) => self.keep_losses(&played.dead, plan, &phase)?,
                Err(error) => return self.end_cell(backend, bearing, &phase, error).map(Err),
            }
        }
        backend.inflict(Infliction::all_of(&plan.scenario));
        let (spec, played) = match self.play_interval(backend, bearing, open.duration_ns)? {
            Ok(played) => played,
            Err(error) => return self.end_cell(backend, bearing, &phase, error).map(Err),
        };
        let interval = spec.open.as_ref().expect("invariant: an interval of open mode");
        let measured = match Measured::of(bearing.offer, &spec, interval, &played) {
            Ok(measured) => measured,
            Err(what) => {
                return self.end_early(plan, &phase, PlayError::Failed(what)).map(Err);
            }
        };
        self.judge_interval(bearing, &phase, &spec, &played, &measured)?;
        let record = bearing.record(&spec, epochs * warm_up_ns, &played, &measured);
        Ok(Ok((record, measured.histograms)))
    }

    /// A cell that could not be played to its end: it is lost if a craft was, and successors are there
    /// for the next one, else the fleet's part of the run is over.
    fn end_cell(
        &mut self,
        backend: &mut impl Backend,
        bearing: &Bearing<'_>,
        phase: &str,
        error: PlayError,
    ) -> Result<Ended, StoreError> {
        match error {
            PlayError::Lost(lost) => {
                let spec = bearing.spec(self.plan.seed, self.epoch, bearing.open.duration_ns);
                self.go_on_without(lost, backend, bearing.plan, (bearing.cell, &spec, phase))
            }
            error => self.end_early(bearing.plan, phase, error),
        }
    }

    /// Plays the first `duration_ns` of the trace.
    fn play_interval(
        &mut self,
        backend: &mut impl Backend,
        bearing: &Bearing<'_>,
        duration_ns: u64,
    ) -> Result<Result<(EpochSpec, PlayedOpen), PlayError>, StoreError> {
        let Cell { block, size, .. } = bearing.cell;
        let spec = bearing.spec(self.plan.seed, self.epoch, duration_ns);
        let was_ready = backend.ready_ns().is_some();
        let played = backend.play_open(&spec, &bearing.offer.network);
        self.epoch += 1;
        self.keep_recoveries(backend, bearing.plan, false)?;
        if let (false, Some(ready_ns)) = (was_ready, backend.ready_ns()) {
            self.store.event(Event::FleetReady { block, size, ready_ns })?;
        }
        Ok(played.map(|played| (spec, played)))
    }

    /// Holds an interval against the independent replay. A full outbox drops samples above capacity, so
    /// what was lost with one makes the cell saturated, not the run partial.
    fn judge_interval(
        &mut self,
        bearing: &Bearing<'_>,
        phase: &str,
        spec: &EpochSpec,
        played: &PlayedOpen,
        measured: &Measured,
    ) -> Result<(), StoreError> {
        let mut end = TrialEnd::Finished;
        if spec.recovery.is_some() {
            end = self.judge_recovered(bearing, phase, spec, played, measured)?;
        } else if measured.losses.is_partial() {
            end = TrialEnd::Partial;
            if measured.losses.full_outboxes == 0 {
                self.outcome = self.outcome.worse(Outcome::Partial);
                self.note(format!("{phase}: something was lost: {:?}", measured.losses))?;
            }
        } else {
            let observed = ObservedOpen { reports: &played.reports, is_quiet: played.is_quiet };
            let broken = compare_open(spec, &bearing.offer.network.view(), &observed);
            self.keep_discrepancies(bearing.cell, spec, broken.iter().map(ToString::to_string))?;
            if !played.is_quiet && measured.saturated.is_none() {
                self.note(format!("{phase}: the fleet did not come to rest"))?;
            }
        }
        let (epoch, trial) = (spec.epoch, spec.trial);
        self.store.event(Event::EpochDone { cell: bearing.cell, epoch, trial, end })
    }
}

impl Bearing<'_> {
    fn spec(&self, seed: u64, epoch: u32, duration_ns: u64) -> EpochSpec {
        let rules = Rules::of_trial(self.plan, seed, self.offer.trial);
        let records = self.offer.trace.iter().map(Vec::len).max().unwrap_or(0);
        EpochSpec {
            turns_max: u32::try_from(records).unwrap_or(u32::MAX),
            ignores_finals: true,
            reasoning: shared_types::reasoning::Reasoning::default(),
            recovery: self.plan.scenario.open_recovery(),
            link: self.plan.scenario.link_spec().cloned(),
            open: Some(OpenSpec {
                duration_ns,
                slice_ns: self.open.slice_ns,
                asks_every_ns: self.label.asks_every_ns.unwrap_or(self.open.duration_ns),
                stamps_stages: self.label.label.again != Label::UNSTAMPED,
            }),
            ..rules.spec(epoch, self.network, self.label.label.strategy)
        }
    }

    fn record(
        &self,
        spec: &EpochSpec,
        warm_up_ns: u64,
        played: &PlayedOpen,
        measured: &Measured,
    ) -> LoadRecord {
        let (writes, boundary_writes) = self.offer.writes();
        let (needed, duration_ns) = (self.offer.needed(), self.offer.duration_ns);
        let is_exact = !spec.strategy.has_centre()
            && played.is_quiet
            && !spec.sends_altered_only
            && spec.recovery.is_none()
            && !measured.losses.is_partial();
        LoadRecord {
            cell: self.cell,
            again: self.label.label.again,
            place: self.place,
            load: self.load.name.clone(),
            offered_per_s: as_float(writes) * 1e9 / as_float(duration_ns),
            duration_ns,
            asks_every_ns: self.label.asks_every_ns,
            warm_up_ns,
            writes,
            unplayed: writes.saturating_sub(measured.writes_played),
            needed,
            applied_by_end: measured.applied_by_end,
            applied_after_end: measured.applied_after_end,
            censored: measured.censored,
            saturated: measured.saturated,
            counts: measured.counts,
            expected: is_exact.then(|| self.expected(spec, played)),
            overhead: measured.overhead,
            losses: measured.losses,
            recovery: measured.recovery,
            stages: measured.stages.clone(),
            shares: measured.shares.clone(),
            second_half_ratio: measured.second_half_ratio,
            reads: measured.reads,
            stale_reads: measured.stale_reads,
            staleness: measured.histograms.staleness.as_ref().map(Into::into),
            fleet_cpu_ns: measured.fleet_cpu_ns,
            orchestrator_cpu_ns: played.orchestrator_cpu_ns,
            orchestrator_sleeps: played.orchestrator_sleeps,
            run_delay_ns: measured.run_delay_ns,
            sleeps: measured.sleeps,
            proportional_bytes: measured.proportional_bytes,
            processes: u32::try_from(played.reports.len()).unwrap_or(u32::MAX),
            sharers: as_float(needed) / as_float(boundary_writes.max(1)),
            boundary_fraction: as_float(boundary_writes) / as_float(writes.max(1)),
            simulated: played.virtual_ns.map(|virtual_ns| simulated(virtual_ns, played)),
        }
    }

    /// The traffic that the records which were played demand.
    fn expected(&self, spec: &EpochSpec, played: &PlayedOpen) -> Counts {
        let part = |report: &shared_types::wire::TrialReport| -> &[TraceRecord] {
            let records =
                self.offer.trace.get(report.craft as usize).map_or(&[][..], Vec::as_slice);
            let played = report.open.as_ref().map_or(0, |open| open.records_played);
            &records[..usize::try_from(played).unwrap_or(usize::MAX).min(records.len())]
        };
        let trace: Vec<&[TraceRecord]> = played.reports.iter().map(part).collect();
        let expected = ExpectedOpen::of(spec, &self.offer.network.view(), &trace);
        let sum = |counts: &[u64]| counts.iter().sum::<u64>();
        let (requests, transmissions) = (sum(&expected.requests), sum(&expected.transmissions));
        let crafts = || (0..self.cell.size).map(shared_types::ids::CraftId);
        let deliveries = crafts()
            .flat_map(|from| crafts().map(move |to| (from, to)))
            .map(|(from, to)| expected.deliveries.between(from, to))
            .sum();
        let bytes = |samples: u64, records: u64| {
            samples * HEADER_BYTES as u64 + records * u64::from(spec.record_bytes)
        };
        let replication = Traffic {
            requests,
            transmissions,
            deliveries,
            bytes_sent: bytes(transmissions, requests),
            bytes_received: bytes(deliveries, sum(&expected.received_records)),
        };
        Counts { replication, ..Counts::default() }
    }
}

/// What only the simulator knows of an interval.
fn simulated(virtual_ns: u64, played: &PlayedOpen) -> SimulatedInterval {
    let homes = verdict::home_digests(&played.reports);
    let replicas = played.reports.iter().map(|report| report.replica_digest);
    SimulatedInterval {
        virtual_ns,
        board_digest: Digest(verdict::digest_of(homes.iter().map(|&(_, digest)| digest))),
        replica_digest: Digest(verdict::digest_of(replicas)),
    }
}

#[cfg(test)]
mod tests;
