//! What happened in a run besides its measurements: the lines of `events.jsonl`.

use super::baseline::Baseline;
use super::host::HostCheck;
use super::record::{Cell, TrialEnd};
use serde::{Deserialize, Serialize};

/// How a process ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ProcessEnd {
    /// It ended by itself with this code.
    Exit(i32),
    /// This signal ended it.
    Signal(i32),
    /// The orchestrator killed it after so many ns without a heartbeat.
    Silent(u64),
    /// The orchestrator killed it after so many ns without an answer, though it went round.
    Mute(u64),
}

/// After which step a silence was over.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Relief {
    /// The sweep of what was never finished: the process went on.
    Sweep,
    /// SIGKILL.
    Kill,
}

impl std::fmt::Display for ProcessEnd {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Exit(code) => write!(formatter, "exit code {code}"),
            Self::Signal(signal) => write!(formatter, "signal {signal}"),
            Self::Silent(ns) => {
                write!(formatter, "killed after {:.1} s without a heartbeat", *ns as f64 / 1e9)
            }
            Self::Mute(ns) => {
                write!(formatter, "killed after {:.1} s without an answer", *ns as f64 / 1e9)
            }
        }
    }
}

/// Something that happened in a run, in the order in which it happened.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum Event {
    /// The processes of a fleet are being started.
    FleetStarted {
        /// Which launch.
        block: u32,
        /// Crafts, a centre not counted.
        size: u32,
        /// Processes, a centre counted.
        processes: u32,
        /// Labels in the order in which they are measured; empty if no times are.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        order: Vec<String>,
    },
    /// Every craft of the fleet has its ports open.
    FleetReady {
        /// Which launch.
        block: u32,
        /// Crafts, a centre not counted.
        size: u32,
        /// From the first spawn to GO, ns.
        ready_ns: u64,
    },
    /// A trial or timing epoch is over.
    EpochDone {
        /// Where it belongs.
        #[serde(flatten)]
        cell: Cell,
        /// Number of the epoch on its fleet.
        epoch: u32,
        /// Trial of the seed.
        trial: u32,
        /// How it ended.
        end: TrialEnd,
    },
    /// A block's times are measured: what was seen of the host around it.
    HostChecked {
        /// Which launch.
        block: u32,
        /// Crafts, a centre not counted.
        size: u32,
        /// As measured.
        #[serde(flatten)]
        check: HostCheck,
    },
    /// What a raw hop took before and after a block's fleet.
    BaselineMeasured {
        /// Which launch.
        block: u32,
        /// Crafts, a centre not counted.
        size: u32,
        /// As measured.
        #[serde(flatten)]
        baseline: Baseline,
    },
    /// Everything that was planned for a fleet is done and kept.
    FleetDone {
        /// Which launch.
        block: u32,
        /// Crafts, a centre not counted.
        size: u32,
        /// Exit code of the run, if it ended now.
        code: u8,
    },
    /// The run was cut off, and goes on.
    Resumed {
        /// Fleets that are complete.
        fleets: u64,
    },
    /// A process of the fleet is gone.
    CraftLost {
        /// Crafts of its fleet.
        size: u32,
        /// Its name in the scenario.
        name: String,
        /// How it ended.
        end: ProcessEnd,
        /// What the run was doing: starting, turn 17 of trial 3, ...
        phase: String,
    },
    /// A process ran and did not go on. One line a silence, once it is over.
    CraftSilent {
        /// Crafts of its fleet.
        size: u32,
        /// Its name in the scenario.
        name: String,
        /// Which life of it; lives are numbered across the fleet.
        incarnation: u32,
        /// How long it gave no heartbeat, ns.
        silent_ns: u64,
        /// What helped.
        helped: Relief,
        /// Unfinished files that the sweep removed.
        swept: u64,
    },
    /// A process went round and did not answer the orchestrator: it was killed.
    CraftMute {
        /// Crafts of its fleet.
        size: u32,
        /// Its name in the scenario.
        name: String,
        /// Which life of it; lives are numbered across the fleet.
        incarnation: u32,
        /// What was waited for.
        answer: String,
        /// For how long, ns.
        waited_ns: u64,
        /// How the process stood in the end, in words.
        standing: String,
    },
    /// A craft that was lost lives again, and the fleet went on. Times count from when its end was
    /// noticed, ns.
    CraftRestarted {
        /// Crafts of its fleet.
        size: u32,
        /// Its name in the scenario.
        name: String,
        /// Which life it lives now; lives are numbered across the fleet.
        incarnation: u32,
        /// Until what it held was freed and removed.
        reclaimed_ns: u64,
        /// Until everybody else had been told, and had given the trial up (an interval goes on).
        known_ns: u64,
        /// Until the last of the others heard of it, in an interval.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        peers_noticed_ns: Option<u64>,
        /// Until its new process was up.
        ready_ns: u64,
        /// Until it was connected in the next trial, or in the interval that had lost it.
        rejoined_ns: u64,
        /// Until it knew what it had missed of the interval.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        caught_up_ns: Option<u64>,
    },
    /// An identity does not hold.
    Discrepancy {
        /// Where it belongs.
        #[serde(flatten)]
        cell: Cell,
        /// Trial of the seed.
        trial: u32,
        /// What differs, where, and by how much.
        what: String,
    },
    /// Something that the reader of the results must know.
    Note {
        /// In a sentence.
        what: String,
    },
    /// A signal asked the run to end.
    Interrupted {
        /// Its number.
        signal: i32,
    },
    /// The last line of a run that ended by itself.
    Ended {
        /// Exit code of the orchestrator.
        code: u8,
    },
}

/// One line of `events.jsonl`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct EventLine {
    /// Since the directory was created, ns.
    pub at_ns: u64,
    /// What happened.
    #[serde(flatten)]
    pub event: Event,
}
