//! Campaigns: fleets whose processes are killed and stopped on purpose, again and again, and what is
//! promised of them checked after every single fault.
//!
//! A campaign is a row of rounds. A round on a fleet (`fleets`) kills crafts of one living fleet, at named
//! points and at instants that were drawn, once with what kills at rare moments leave planted beside it
//! (`defects`), stops some for a while, and ends the fleet, which plays trials or intervals of open mode
//! (`stage`, `interval`) meanwhile, these in half of the rounds over links that fail; a round on an
//! orchestrator (`orchestrators`) starts the executable, kills it, and cleans. What is done to whom is
//! drawn from the seed (`draw`); the instants at which it happens are the host's. Every fault becomes one
//! record, kept at the end of its round. Not here: the mechanisms (`run::recovery`,
//! `run::strike`, the janitor), and figures (`results::faults`).

mod accounts;
mod defects;
mod draw;
mod fate;
mod fleets;
mod interval;
mod orchestrators;
mod stage;

use crate::launch::os_process::Launcher;
use crate::launch::placement::Processors;
use crate::outcome::Outcome;
use crate::results::event::Event;
use crate::results::faults::{FaultKind, FaultRecord};
use crate::results::store::{Store, StoreError};
use crate::run::Progress;
use crate::run::backend::PlayError;
use crate::scenario::ResolvedScenario;
use crate::supervision::signals::Signals;
use draw::Draws;
use shared_types::time::Nanos;
use shared_types::transport::clock;
use shared_types::transport::reclaim::Steps;
use std::path::PathBuf;

/// The preset that campaigns play.
pub const PRESET: &str = "campaign";

/// What a campaign does.
#[derive(Clone, Debug)]
pub struct CampaignPlan {
    /// The scenario, once for each fleet size.
    pub scenarios: Vec<ResolvedScenario>,
    /// Kills that are wanted; the campaign ends with the round that reaches them.
    pub kills: u32,
    /// What decides who is hit where.
    pub seed: u64,
    /// The processors that fleets may use.
    pub processors: Processors,
    /// What is started and killed as an orchestrator.
    pub executable: PathBuf,
    /// After how many seconds the campaign ends.
    pub time_limit_s: Option<u32>,
    /// What the janitor does for crafts that died: without a step the campaign must fail.
    pub janitor: Steps,
}

/// About how long a kill takes with everything that is checked after it, s.
const SECONDS_PER_KILL: f64 = 0.5;

/// About how many kills a round on a fleet has: none is cut short because enough was killed.
const KILLS_PER_ROUND: u32 = 10;

impl CampaignPlan {
    /// About how long it takes, s.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        f64::from(self.kills.max(KILLS_PER_ROUND)) * SECONDS_PER_KILL
    }
}

/// A campaign and what it has in hands.
pub struct Campaign<'a> {
    plan: &'a CampaignPlan,
    store: &'a mut Store,
    progress: &'a mut dyn Progress,
    launcher: &'a Launcher,
    signals: &'a mut Signals,
    draws: Draws,
    /// Number of the next record.
    next: u32,
    kills: u32,
    is_clean: bool,
    ends: Option<Nanos>,
}

/// Why a campaign ends before its plan does.
type Early = Option<Outcome>;

impl<'a> Campaign<'a> {
    /// A campaign that keeps its records in `store`.
    pub fn new(
        plan: &'a CampaignPlan,
        store: &'a mut Store,
        progress: &'a mut dyn Progress,
        launcher: &'a Launcher,
        signals: &'a mut Signals,
    ) -> Self {
        let limit_ns = plan.time_limit_s.map(|seconds| u64::from(seconds) * 1_000_000_000);
        Self {
            plan,
            store,
            progress,
            launcher,
            signals,
            draws: Draws::new(plan.seed),
            next: 0,
            kills: 0,
            is_clean: true,
            ends: limit_ns.map(|limit_ns| clock::now().plus(limit_ns)),
        }
    }

    /// Plays rounds until enough was killed; returns how the campaign ends.
    ///
    /// # Errors
    /// If records cannot be kept any more; no process is left.
    pub fn run(mut self) -> Result<Outcome, StoreError> {
        let mut round = 0;
        while self.kills < self.plan.kills {
            let sizes = self.plan.scenarios.len();
            let scenario = &self.plan.scenarios[round % sizes];
            // Every size plays trials, then every size intervals, and so on.
            let is_open = !(round / sizes).is_multiple_of(2);
            round += 1;
            let mut early = self.round_on_fleet(scenario, is_open)?;
            if early.is_none() && self.kills < self.plan.kills {
                early = self.round_on_orchestrator(scenario)?;
            }
            if early.is_some() {
                return Ok(early.unwrap_or_default().worse(self.verdict()));
            }
        }
        Ok(self.verdict())
    }

    const fn verdict(&self) -> Outcome {
        if self.is_clean { Outcome::Success } else { Outcome::Broken }
    }

    /// Keeps a record, numbered.
    fn keep(&mut self, mut record: FaultRecord) -> Result<(), StoreError> {
        record.number = self.next;
        self.next += 1;
        self.kills += u32::from(record.took_effect && record.kind.is_kill());
        self.is_clean &= record.failures.is_empty();
        for (failure, what) in &record.failures {
            let (size, point) = (record.size, &record.point);
            let line = format!("{size} crafts, {point}: {}: {what}", failure.name());
            self.progress.say(&line);
        }
        let what = match record.kind {
            FaultKind::KillCraft => "a craft killed",
            FaultKind::KillOrchestrator => "an orchestrator killed",
            FaultKind::Pause => "crafts stopped",
            FaultKind::Links => "links failed",
        };
        let what = format!("{} crafts: {what}, {}", record.size, record.point);
        self.progress.at(self.kills.into(), self.plan.kills.into(), &what);
        self.store.append_fault(&record)
    }

    /// The end that `error` asks for, which is kept; `None` if it is a failure of the fleet instead.
    fn early(&mut self, error: &PlayError) -> Result<Early, StoreError> {
        Ok(match error {
            PlayError::Stopped(request) => {
                let signal = crate::run::verdict::signal_of(*request);
                self.store.event(Event::Interrupted { signal })?;
                Some(request.outcome)
            }
            PlayError::TimeLimit => Some(Outcome::TimeLimit),
            _ => None,
        })
    }
}
