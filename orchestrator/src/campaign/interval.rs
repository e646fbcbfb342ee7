//! The interval of open mode that a fleet plays over and over while its crafts die, and what its boards
//! must hold at the end of each.
//!
//! The fleet goes on through every death, so one interval holds the kill, the recovery and the proof. Not
//! here: who is killed when (`fleets`), and how a fleet recovers (`run::revival`).

use crate::results::faults::Failure;
use crate::run::RealFleet;
use crate::run::backend::{Backend as _, PlayError};
use crate::run::offer::Offer;
use crate::run::verdict;
use crate::scenario::{ResolvedScenario, compile};
use crate::workload::{TraceError, draw_at};
use agent::oracle::{ObservedOpen, compare_recovered};
use shared_types::ids::CraftId;
use shared_types::knowledge::FleetNetwork;
use shared_types::limits::REAL_PATIENCE_NS;
use shared_types::wire::{EpochSpec, LinkCounts, LinkSpec, OpenSpec, RecoverySpec, StrategyKind};

/// Length of an interval, ns.
pub(super) const INTERVAL_NS: u64 = 300_000_000;

/// Writes of each craft, a second.
const RATE_PER_S: f64 = 200.0;

/// How often clients ask the centre, ns.
const ASKS_EVERY_NS: u64 = 2_000_000;

/// Failures of one interval that are told.
const TOLD_MAX: usize = 3;

/// An interval, its networks and its trace.
pub(super) struct IntervalStage {
    network: FleetNetwork,
    /// The epoch that is played next.
    spec: EpochSpec,
    /// What links have done so far.
    links: LinkCounts,
}

impl IntervalStage {
    /// An interval on the networks of trial `trial` of `scenario` under `strategy`, which plays traces, over
    /// links that do what `link` says, else what the scenario says.
    ///
    /// # Errors
    /// If the networks hold nothing to write.
    pub(super) fn new(
        scenario: &ResolvedScenario,
        strategy: StrategyKind,
        trial: u32,
        link: Option<LinkSpec>,
    ) -> Result<Self, TraceError> {
        let seed = scenario.scenario().run.seed;
        let mut network = FleetNetwork::default();
        compile(scenario, seed, trial, &mut network);
        let duration_s = std::time::Duration::from_nanos(INTERVAL_NS).as_secs_f64();
        let rate_per_s = RATE_PER_S * f64::from(scenario.craft_count());
        let drawn = draw_at(scenario.scenario(), (rate_per_s, duration_s), &network.view(), trial)?;
        let records = drawn.crafts.iter().map(Vec::len).max().unwrap_or(0);
        let Offer { network, .. } = Offer::new(network, drawn.crafts, trial, INTERVAL_NS);
        // There and back, twice: who asks again before that asks for what is under way.
        let patient = |link: &LinkSpec| {
            RecoverySpec::patient(REAL_PATIENCE_NS + 4 * (link.delay_ns + link.jitter_ns))
        };
        let spec = EpochSpec {
            seed,
            turns_max: u32::try_from(records).unwrap_or(u32::MAX),
            ignores_finals: true,
            reasoning: shared_types::reasoning::Reasoning::default(),
            recovery: link.as_ref().map(patient).or_else(|| scenario.open_recovery()),
            link: link.or_else(|| scenario.link_spec().cloned()),
            open: Some(OpenSpec {
                duration_ns: INTERVAL_NS,
                slice_ns: INTERVAL_NS,
                asks_every_ns: ASKS_EVERY_NS,
                stamps_stages: false,
            }),
            ..scenario.epoch_spec(strategy, trial)
        };
        Ok(Self { network, spec, links: LinkCounts::default() })
    }

    /// Plays the interval once more; says what was not as it must be.
    ///
    /// # Errors
    /// If the interval does not come to its end.
    pub(super) fn play(
        &mut self,
        fleet: &mut RealFleet<'_>,
    ) -> Result<Vec<(Failure, String)>, PlayError> {
        let spec = self.spec.clone();
        self.spec.epoch += 1;
        let played = fleet.play_open(&spec, &self.network)?;
        if !played.is_quiet {
            let what = "the fleet did not come to rest after an interval".to_owned();
            return Ok(vec![(Failure::Hang, what)]);
        }
        let losses = verdict::losses(&played.reports);
        self.links += losses.links;
        if losses.late + losses.refused > 0 {
            return Ok(vec![(Failure::Restart, format!("something was lost: {losses:?}"))]);
        }
        let died: Vec<CraftId> = played.dead.iter().map(|ended| ended.craft).collect();
        let observed = ObservedOpen { reports: &played.reports, is_quiet: true };
        let broken = compare_recovered(&spec, &self.network.view(), &observed, &died);
        let told = broken.iter().take(TOLD_MAX);
        Ok(told.map(|what| (Failure::WrongBoards, what.to_string())).collect())
    }

    /// What links have done to samples in all intervals.
    pub(super) const fn links(&self) -> LinkCounts {
        self.links
    }
}
