//! Open mode on the wire: how an epoch is played, and what a craft measured in it.
//!
//! Histograms travel in the V2 format of HdrHistogram, uncompressed, so that this crate needs no
//! histograms and a report can be read by other tools. All times are ns of `CLOCK_MONOTONIC`.

use rkyv::{Archive, Deserialize, Serialize};

/// How a trace is played. Part of an [`super::EpochSpec`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Archive, Serialize, Deserialize)]
pub struct OpenSpec {
    /// Length of the measured interval, ns from its start. What is due later is not played; what is
    /// applied later counts as applied after the end.
    pub duration_ns: u64,
    /// Length of the slices in which time to knowledge is kept apart, ns; intervals are resampled from
    /// slices.
    pub slice_ns: u64,
    /// How long a client of the centre waits between two exchanges that it has no other reason for, ns.
    pub asks_every_ns: u64,
    /// Whether every stage is stamped; else time to knowledge alone, to see what the stamps cost.
    pub stamps_stages: bool,
}

/// A stage of a change's way, or another quantity that has one histogram a craft.
#[derive(
    Clone,
    Copy,
    Debug,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Archive,
    Serialize,
    Deserialize,
    serde::Serialize,
    serde::Deserialize,
)]
#[serde(rename_all = "kebab-case")]
#[rkyv(derive(Clone, Copy, Debug))]
#[repr(u8)]
pub enum Stage {
    /// Intended to made, at the origin: how late the schedule is. One event a write.
    Schedule,
    /// Made to send called, at the origin. One event a sample.
    Publish,
    /// Send called to receive returned over one hop between processes that may run on the same core
    /// only. One event a sample.
    WakeSameCore,
    /// The same between processes of different cores, or that are not pinned.
    WakeOtherCore,
    /// The same over several hops: their sum, relay work apart.
    WakeRelayed,
    /// Receive returned to applied: the end of the batch, an upper bound. One event a change.
    Apply,
    /// Intended to applied at the centre (central strategies only). One event a change.
    AppliedAtCentre,
    /// Time to knowledge: intended to applied at a board that shares the fact. One event a change and
    /// board.
    Knowledge,
    /// Time to knowledge of changes that came over one hop. Changes never known are in none of these.
    KnowledgeOneHop,
    /// Over two hops; under a central strategy all changes: writer to centre, centre to reader.
    KnowledgeTwoHops,
    /// Over three hops.
    KnowledgeThreeHops,
    /// Over four hops.
    KnowledgeFourHops,
    /// Over five hops or more.
    KnowledgeMoreHops,
    /// Records of one sample of class replication, as sent. No time.
    RecordsPerSample,
}

impl Stage {
    /// All of them, in the order of the tables.
    pub const ALL: [Self; 14] = [
        Self::Schedule,
        Self::Publish,
        Self::WakeSameCore,
        Self::WakeOtherCore,
        Self::WakeRelayed,
        Self::Apply,
        Self::AppliedAtCentre,
        Self::Knowledge,
        Self::KnowledgeOneHop,
        Self::KnowledgeTwoHops,
        Self::KnowledgeThreeHops,
        Self::KnowledgeFourHops,
        Self::KnowledgeMoreHops,
        Self::RecordsPerSample,
    ];

    /// Time to knowledge by the hops that a change came over: one, two, ..., five or more.
    pub const BY_HOPS: [Self; 5] = [
        Self::KnowledgeOneHop,
        Self::KnowledgeTwoHops,
        Self::KnowledgeThreeHops,
        Self::KnowledgeFourHops,
        Self::KnowledgeMoreHops,
    ];

    /// The name in tables and files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Schedule => "schedule",
            Self::Publish => "publish",
            Self::WakeSameCore => "wake-same-core",
            Self::WakeOtherCore => "wake-other-core",
            Self::WakeRelayed => "wake-relayed",
            Self::Apply => "apply",
            Self::AppliedAtCentre => "applied-at-centre",
            Self::Knowledge => "knowledge",
            Self::KnowledgeOneHop => "knowledge-one-hop",
            Self::KnowledgeTwoHops => "knowledge-two-hops",
            Self::KnowledgeThreeHops => "knowledge-three-hops",
            Self::KnowledgeFourHops => "knowledge-four-hops",
            Self::KnowledgeMoreHops => "knowledge-more-hops",
            Self::RecordsPerSample => "records-per-sample",
        }
    }
}

/// `argument` of a [`super::Kind::Go`] for those that come to an interval which has begun.
pub const GO_JOINING: u32 = 1;

/// What a read saw.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Archive, Serialize, Deserialize)]
pub struct ReadSeen {
    /// Number of the read among the reads of this craft's trace, from 0.
    pub number: u32,
    /// When it was made, ns from the start of the interval.
    pub at_ns: u64,
    /// Intended time of the newest write of the fact that this board had made or applied, ns from the
    /// start of the interval; [`ReadSeen::NOTHING`] if none was.
    pub seen_ns: u64,
}

impl ReadSeen {
    /// No write was seen.
    pub const NOTHING: u64 = u64::MAX;
}

/// What a board holds of a fact when the craft reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Archive, Serialize, Deserialize)]
pub struct HeldFact {
    /// The fact, as this board numbers it.
    pub fact: u32,
    /// A [`crate::knowledge::Value`].
    pub value: u8,
    /// Writes that led to the value.
    pub count: u32,
    /// The craft that wrote last.
    pub writer: u32,
}

/// The end of a process, as another one was told of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Archive, Serialize, Deserialize)]
pub struct EndHeard {
    /// Who ended; the centre is craft N.
    pub craft: u32,
    /// In which life.
    pub incarnation: u32,
    /// When it was told, ns of the monotonic clock.
    pub at_ns: u64,
}

/// What one process measured in an epoch of open mode.
#[derive(Clone, Debug, Default, PartialEq, Eq, Archive, Serialize, Deserialize)]
pub struct OpenReport {
    /// Records of its part of the trace that it has played: always a prefix.
    pub records_played: u64,
    /// Records among them that were due before this life of the craft began: skipped, not made.
    pub records_missed: u64,
    /// Per origin craft (dense), the changes that were applied at this process' board (at all home
    /// boards, for the centre's report under a central strategy; knowledge is counted at the clients).
    pub applied_from: Vec<u64>,
    /// Changes known here by the end of the interval.
    pub applied_by_end: u64,
    /// Changes known here after it.
    pub applied_after_end: u64,
    /// One V2 histogram for each stage that has events, in their order, [`Stage::Knowledge`] left out.
    pub stages: Vec<(Stage, Vec<u8>)>,
    /// Time to knowledge, one V2 histogram for each slice of the interval (by the time of the
    /// application; what comes after the end is in the last). Empty slices are empty.
    pub knowledge_slices: Vec<Vec<u8>>,
    /// How the parts of time to knowledge share it: see `agent::metrics`. Rows of (class of the total,
    /// part, share in steps, events).
    pub shares: Vec<[u32; 4]>,
    /// What its reads saw, in their order.
    pub reads: Vec<ReadSeen>,
    /// What its board holds of every fact that was written or delivered in the epoch, by fact; of
    /// the others it holds the initial value.
    pub held: Vec<HeldFact>,
    /// Time that the process was ready to run and did not, ns (schedstat), from the word to begin to
    /// the first question after the end; 0 in simulation.
    pub run_delay_ns: u64,
    /// Times that the process slept, as the kernel counts them, over the same time; 0 in simulation.
    pub sleeps: u64,
    /// Proportional set size of the process, bytes; 0 in simulation.
    pub proportional_bytes: u64,
    /// When a life that joined the interval knew what it had missed, ns of the monotonic clock; 0 if it
    /// was there from the start, or never came to know.
    pub caught_up_ns: u64,
    /// Ends of others that it was told of in the interval.
    pub ends_heard: Vec<EndHeard>,
}
