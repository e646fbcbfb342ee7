//! What plays trials: a real fleet or the simulator, behind one trait.

use crate::supervision::signals::{Signals, StopRequest};
use crate::supervision::watch::CraftEnded;
use agent::lockstep::Outcome;
use agent::simulation::{Simulation, SimulationError};
use shared_types::ids::{CraftId, Firing, Turn};
use shared_types::knowledge::FleetNetwork;
use shared_types::time::Nanos;
use shared_types::transport::{SendError, clock};
use shared_types::wire::{EpochSpec, Traffic, TrialReport};

/// A trial that was played to its end.
#[derive(Clone, Debug)]
pub struct Played {
    /// How it ended.
    pub outcome: Outcome,
    /// Turns run.
    pub turns: u32,
    /// Digest over (turn, craft, firing).
    pub path_digest: u64,
    /// What was fired, by turn and craft.
    pub path: Vec<(Turn, CraftId, Firing)>,
    /// One report per process, the centre last.
    pub reports: Vec<TrialReport>,
    /// What the clocks say; zero in simulation.
    pub clock: Clocked,
}

/// The part of a trial that comes from clocks and from the ledger's own traffic.
#[derive(Clone, Debug, Default)]
pub struct Clocked {
    /// From the command that opened the first turn to the last report, ns.
    pub duration_ns: u64,
    /// Time of every turn, ns: from the command that opens it to the ledger that closes it.
    pub turn_times_ns: Vec<u64>,
    /// CPU time of the orchestrator in the trial, ns.
    pub orchestrator_cpu_ns: u64,
    /// The orchestrator's own traffic of class control.
    pub control: Traffic,
}

/// Why a trial was not played to its end.
#[derive(Debug)]
pub enum PlayError {
    /// Processes ended.
    Lost(Vec<CraftEnded>),
    /// The turn stayed unbalanced, or a report did not fit.
    Unbalanced {
        /// Turns opened until then.
        turns: u32,
        /// The ledger in words.
        standing: String,
        /// What the processes that answered had counted.
        reports: Vec<TrialReport>,
    },
    /// Somebody asked for an end.
    Stopped(StopRequest),
    /// The time limit of the run was reached.
    TimeLimit,
    /// The system or the transport failed.
    Failed(String),
}

impl From<SendError> for PlayError {
    fn from(error: SendError) -> Self {
        Self::Failed(error.to_string())
    }
}

/// What plays trials.
pub trait Backend {
    /// Plays the trial `spec` on `network`. A spec whose `network` is an earlier epoch's refers to
    /// the networks of the trial played then, which are the same.
    ///
    /// # Errors
    /// If the trial does not come to its end.
    fn play(&mut self, spec: &EpochSpec, network: &FleetNetwork) -> Result<Played, PlayError>;

    /// From the first spawn to the first turn's command, ns; `None` in simulation and before that.
    fn ready_ns(&self) -> Option<u64>;
}

/// A simulated fleet that ends when it is asked to.
#[derive(Debug)]
pub struct SimulatedFleet<'a> {
    /// The fleet.
    pub simulation: Simulation,
    /// Who may ask for an end.
    pub signals: &'a mut Signals,
    /// When the run must be over.
    pub run_ends: Option<Nanos>,
}

impl Backend for SimulatedFleet<'_> {
    fn play(&mut self, spec: &EpochSpec, network: &FleetNetwork) -> Result<Played, PlayError> {
        match self.signals.poll() {
            Ok(Some(request)) => return Err(PlayError::Stopped(request)),
            Ok(None) => {}
            Err(error) => return Err(PlayError::Failed(error.to_string())),
        }
        if self.run_ends.is_some_and(|ends| clock::now() >= ends) {
            return Err(PlayError::TimeLimit);
        }
        match self.simulation.play(spec, &network.view()) {
            Ok(trial) => Ok(Played {
                outcome: trial.outcome,
                turns: trial.turns,
                path_digest: trial.path_digest,
                path: trial.path,
                reports: trial.reports,
                clock: Clocked::default(),
            }),
            Err(SimulationError::Unbalanced { turns, standing, reports, .. }) => {
                Err(PlayError::Unbalanced { turns, standing, reports })
            }
            Err(error) => Err(PlayError::Failed(error.to_string())),
        }
    }

    fn ready_ns(&self) -> Option<u64> {
        None
    }
}
