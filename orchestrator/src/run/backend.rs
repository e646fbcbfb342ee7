//! What plays trials: a real fleet or the simulator, behind one trait.

use super::answers::Mute;
use super::inflict::Infliction;
use super::recovery::Recovery;
use super::silence::Relieved;
use crate::supervision::signals::StopRequest;
use crate::supervision::watch::CraftEnded;
use agent::lockstep::Outcome;
use agent::simulation::{SimulatedTrial, SimulationError};
use shared_types::ids::{CraftId, Firing, Turn};
use shared_types::knowledge::FleetNetwork;
use shared_types::transport::SendError;
use shared_types::transport::link::LinkCounts;
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
    /// What the clocks say; zero in simulation, but for the virtual time that passed.
    pub clock: Clocked,
    /// What the links did on purpose; absent where nothing happened on them.
    pub links: Option<LinkCounts>,
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

/// An epoch of open mode that was played to its end.
#[derive(Clone, Debug, Default)]
pub struct PlayedOpen {
    /// One report per process, the centre last; each has its part of open mode.
    pub reports: Vec<TrialReport>,
    /// Whether the fleet became quiet after the end of the interval; else it was given up after a
    /// grace, and what had not arrived by then is unknown.
    pub is_quiet: bool,
    /// CPU time of the orchestrator in the interval, ns; 0 in simulation.
    pub orchestrator_cpu_ns: u64,
    /// Times that the orchestrator slept and was woken in the interval; 0 in simulation.
    pub orchestrator_sleeps: u64,
    /// The orchestrator's own traffic of class control.
    pub control: Traffic,
    /// Who died and has a successor that played on.
    pub dead: Vec<CraftEnded>,
    /// What the links did where nobody but the simulator sees it; real processes report it.
    pub links: LinkCounts,
    /// Virtual time from the beginning until nothing was due or under way, ns; `None` for real processes.
    pub virtual_ns: Option<u64>,
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

impl From<SimulatedTrial> for Played {
    fn from(trial: SimulatedTrial) -> Self {
        let SimulatedTrial { outcome, turns, path_digest, path, reports, duration_ns, links } =
            trial;
        let clock = Clocked { duration_ns, ..Clocked::default() };
        let links = Some(links).filter(|&links| links != LinkCounts::default());
        Self { outcome, turns, path_digest, path, reports, clock, links }
    }
}

impl From<SimulationError> for PlayError {
    fn from(error: SimulationError) -> Self {
        match error {
            SimulationError::Unbalanced { turns, standing, reports, .. } => {
                Self::Unbalanced { turns, standing, reports }
            }
            error => Self::Failed(error.to_string()),
        }
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

    /// From now on every turn is held open for `percent` percent longer than it took: a control, to see
    /// whether comparisons find it. Nothing happens where there is no clock.
    fn slow_down(&mut self, percent: u64) {
        let _ = percent;
    }

    /// Plays the trace that `network` holds, as `spec.open` says. Networks are referred to as in
    /// [`Self::play`].
    ///
    /// # Errors
    /// If the epoch does not come to its end.
    fn play_open(
        &mut self,
        spec: &EpochSpec,
        network: &FleetNetwork,
    ) -> Result<PlayedOpen, PlayError>;

    /// What befalls processes in the next trial or interval; nothing where there are none.
    fn inflict(&mut self, faults: Vec<Infliction>) {
        let _ = faults;
    }

    /// Puts successors into the places of processes that ended; the epoch under way is given up.
    ///
    /// # Errors
    /// [`PlayError::Lost`] where nobody is restarted, or no more; else why it cannot go on.
    fn recover(&mut self, lost: Vec<CraftEnded>) -> Result<(), PlayError> {
        Err(PlayError::Lost(lost))
    }

    /// Recoveries that are over since the last call; with `all` those under way as well.
    fn take_recoveries(&mut self, all: bool) -> Vec<Recovery> {
        let _ = all;
        Vec::new()
    }

    /// Silences of processes that are over since the last call.
    fn take_relieved(&mut self) -> Vec<Relieved> {
        Vec::new()
    }

    /// Processes that were killed since the last call because they did not answer.
    fn take_mute(&mut self) -> Vec<Mute> {
        Vec::new()
    }

    /// From the first spawn to the first turn's command, ns; `None` in simulation and before that.
    fn ready_ns(&self) -> Option<u64>;
}
