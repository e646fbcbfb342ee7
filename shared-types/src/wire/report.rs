//! What a craft counted in one trial.

use super::{LinkCounts, OpenReport};
use crate::ids::CraftId;
use crate::reasoning::ReasoningReport;
use rkyv::{Archive, Deserialize, Serialize};
use zerocopy::{FromBytes, Immutable, IntoBytes};

/// How many classes of traffic there are.
pub const CLASS_COUNT: usize = 7;

/// More of anything no process counts in a trial, nor nanoseconds; sums over fleets stay far below 2^64.
const COUNT_MAX: u64 = 1 << 56;

/// Traffic of one class, counted where it happens.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    Archive,
    Serialize,
    Deserialize,
    serde::Serialize,
    serde::Deserialize,
    IntoBytes,
    Immutable,
)]
#[repr(C)]
pub struct Traffic {
    /// All changes of one firing over one hop (a multicast is one).
    pub requests: u64,
    /// Samples published.
    pub transmissions: u64,
    /// Samples received, a craft's own multicasts not counted.
    pub deliveries: u64,
    /// Records and headers published.
    pub bytes_sent: u64,
    /// Records and headers received.
    pub bytes_received: u64,
}

impl std::ops::AddAssign for Traffic {
    fn add_assign(&mut self, other: Self) {
        self.requests = self.requests.saturating_add(other.requests);
        self.transmissions = self.transmissions.saturating_add(other.transmissions);
        self.deliveries = self.deliveries.saturating_add(other.deliveries);
        self.bytes_sent = self.bytes_sent.saturating_add(other.bytes_sent);
        self.bytes_received = self.bytes_received.saturating_add(other.bytes_received);
    }
}

/// What went wrong or was out of the ordinary; all zero in a lossless run, except `full_inboxes`.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    Archive,
    Serialize,
    Deserialize,
    serde::Serialize,
    serde::Deserialize,
    IntoBytes,
    Immutable,
)]
#[repr(C)]
pub struct Losses {
    /// Samples of another epoch.
    pub late: u64,
    /// Samples refused: version, run, length, checksum, kind, record.
    pub refused: u64,
    /// Samples of an older life of their source.
    pub old_incarnation: u64,
    /// Samples missing in a sequence.
    pub gaps: u64,
    /// Samples that came twice.
    pub repeats: u64,
    /// Sends that found the receiver's inbox full and waited in the outbox.
    pub full_inboxes: u64,
    /// Samples that found the outbox full as well and were dropped.
    pub full_outboxes: u64,
    /// Receivers that missed a multicast and got it by unicast.
    pub missed_multicasts: u64,
    /// What links of the scenario did to samples on their way here; only in intervals that repair it.
    #[serde(default)]
    pub links: LinkCounts,
}

impl std::ops::AddAssign for Losses {
    fn add_assign(&mut self, other: Self) {
        self.late = self.late.saturating_add(other.late);
        self.refused = self.refused.saturating_add(other.refused);
        self.old_incarnation = self.old_incarnation.saturating_add(other.old_incarnation);
        self.gaps = self.gaps.saturating_add(other.gaps);
        self.repeats = self.repeats.saturating_add(other.repeats);
        self.full_inboxes = self.full_inboxes.saturating_add(other.full_inboxes);
        self.full_outboxes = self.full_outboxes.saturating_add(other.full_outboxes);
        self.missed_multicasts = self.missed_multicasts.saturating_add(other.missed_multicasts);
        self.links += other.links;
    }
}

impl Losses {
    /// Whether something was lost for good, so that the run is partial.
    #[must_use]
    pub const fn is_partial(&self) -> bool {
        (self.late | self.refused | self.old_incarnation | self.gaps | self.full_outboxes) > 0
    }
}

/// Everything that one process counted in one trial.
#[derive(Clone, Debug, Default, PartialEq, Eq, Archive, Serialize, Deserialize)]
pub struct Counters {
    /// By [`super::Class`].
    pub traffic: [Traffic; CLASS_COUNT],
    /// Samples of classes replication and reply received, by the craft that sent them (dense, the
    /// centre last).
    pub deliveries_from: Vec<u64>,
    /// Sum of hop counts over the samples for which this craft was a final receiver.
    pub hops: u64,
    /// Firings run.
    pub firings: u64,
    /// Firings that changed a boundary fact.
    pub boundary_firings: u64,
    /// Turns without a candidate.
    pub idle_turns: u64,
    /// Merges decided by the craft id because the counts were equal.
    pub conflicts: u64,
    /// Out of the ordinary.
    pub losses: Losses,
    /// What recovery did.
    pub recovered: Recovered,
}

/// What recovery did in one process; all zero where nothing was lost and nobody died, except
/// `receipts`, `digests` and `states`.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    Archive,
    Serialize,
    Deserialize,
    IntoBytes,
    Immutable,
)]
#[repr(C)]
pub struct Recovered {
    /// Receipts sent, whatever they say.
    pub receipts: u64,
    /// Receipts among them that name something missing.
    pub asked_again: u64,
    /// Samples sent again; the same as the transmissions of class repair without states.
    pub repeats: u64,
    /// Missing samples that cannot be repeated any more, or that nobody repeated: the receiver gave
    /// them up and asked for the state instead. They count as gaps too.
    pub given_up: u64,
    /// Samples sent that nobody confirmed although asked again and again.
    pub unconfirmed: u64,
    /// Samples to a dead process that were not delivered.
    pub discarded: u64,
    /// Digests sent.
    pub digests: u64,
    /// States sent.
    pub states: u64,
    /// Changes that were learnt from states.
    pub learnt: u64,
    /// Questions for a state that stayed without an answer.
    pub states_missed: u64,
    /// Samples of a process that lived no more, of an epoch that was given up, or for a process that
    /// had ended its conversation.
    pub stale: u64,
}

impl std::ops::AddAssign for Recovered {
    fn add_assign(&mut self, other: Self) {
        self.receipts = self.receipts.saturating_add(other.receipts);
        self.asked_again = self.asked_again.saturating_add(other.asked_again);
        self.repeats = self.repeats.saturating_add(other.repeats);
        self.given_up = self.given_up.saturating_add(other.given_up);
        self.unconfirmed = self.unconfirmed.saturating_add(other.unconfirmed);
        self.discarded = self.discarded.saturating_add(other.discarded);
        self.digests = self.digests.saturating_add(other.digests);
        self.states = self.states.saturating_add(other.states);
        self.learnt = self.learnt.saturating_add(other.learnt);
        self.states_missed = self.states_missed.saturating_add(other.states_missed);
        self.stale = self.stale.saturating_add(other.stale);
    }
}

/// One process's report of one trial, sent as an archive.
#[derive(Clone, Debug, Default, PartialEq, Eq, Archive, Serialize, Deserialize)]
pub struct TrialReport {
    /// The craft.
    pub craft: u32,
    /// What it counted.
    pub counters: Counters,
    /// Digest per home board held here: (craft, digest). A craft holds its own, the centre all.
    pub board_digests: Vec<(u32, u64)>,
    /// Digest of the replica store; 0 if the strategy keeps none.
    pub replica_digest: u64,
    /// CPU time of the process in the epoch, from its first turn to its report, in open mode from the
    /// start to the end of the interval, ns; 0 in simulation.
    pub cpu_ns: u64,
    /// Resident memory at the report, bytes; 0 in simulation.
    pub resident_bytes: u64,
    /// What its thinking came to; `None` where it only draws, and for the centre and its clients.
    pub reasoning: Option<ReasoningReport>,
    /// What it measured in open mode; `None` in lockstep.
    pub open: Option<OpenReport>,
}

impl TrialReport {
    /// Whether `own` can have sent it: it is about that process, and counts nothing beyond all measure.
    #[must_use]
    pub fn can_be_of(&self, own: CraftId) -> bool {
        let Counters { traffic, deliveries_from, losses, recovered, .. } = &self.counters;
        let Counters { hops, firings, boundary_firings, idle_turns, conflicts, .. } = self.counters;
        let open = self.open.iter();
        let of_open = open.flat_map(|open| {
            let own = [
                open.records_played,
                open.records_missed,
                open.applied_by_end,
                open.applied_after_end,
                open.run_delay_ns,
                open.sleeps,
                open.proportional_bytes,
            ];
            own.into_iter().chain(open.applied_from.iter().copied())
        });
        let lists = [traffic.as_bytes(), losses.as_bytes(), recovered.as_bytes()];
        let mut counts = [hops, firings, boundary_firings, idle_turns, conflicts]
            .into_iter()
            .chain([self.cpu_ns, self.resident_bytes])
            .chain(deliveries_from.iter().copied())
            .chain(lists.into_iter().flat_map(counts_in))
            .chain(of_open);
        self.craft == own.0 && counts.all(|count| count <= COUNT_MAX)
    }
}

/// The counts in `bytes`, which are nothing else.
fn counts_in(bytes: &[u8]) -> impl Iterator<Item = u64> {
    let counts =
        <[u64]>::ref_from_bytes(bytes).expect("invariant: structures of counts are aligned");
    counts.iter().copied()
}
