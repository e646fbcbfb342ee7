//! The header of every sample, its checksum, and why a sample is refused.

use crate::ids::CraftId;
#[cfg(feature = "shell")]
use iceoryx2::prelude::ZeroCopySend;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// Version of header, records and archives; a sample of another version is refused.
pub const FORMAT_VERSION: u16 = 1;

/// Size of a header, which every figure of bytes includes once per sample.
pub const HEADER_BYTES: usize = size_of::<Header>();

/// What a sample is counted as. Identities hold for `Replication` and `Reply` only.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Class {
    /// A strategy's own traffic: requests.
    Replication = 0,
    /// The centre's answers.
    Reply = 1,
    /// What was lost, sent again.
    Repair = 2,
    /// What was received.
    Ack = 3,
    /// Counted when lost and never repaired.
    BestEffort = 4,
    /// Turns, epochs, start and stop.
    Control = 5,
    /// Reports.
    Telemetry = 6,
}

impl Class {
    /// Whether samples of the class go from craft to craft, the centre included.
    #[must_use]
    pub const fn is_between_crafts(self) -> bool {
        matches!(self, Self::Replication | Self::Reply | Self::Repair | Self::Ack)
    }
}

/// What the payload of a sample is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Kind {
    /// Delta records of one firing.
    Delta = 0,
    /// Craft to centre: takes part from now on. No payload.
    Register = 1,
    /// Craft to centre: what shall I run this turn? No payload.
    Instruction = 2,
    /// Craft to centre: what my firing output (delta records).
    Result = 3,
    /// Craft to centre: is the final fact in `argument` reached? No payload.
    Check = 4,
    /// Craft to centre: takes part no longer. No payload.
    SignOff = 5,
    /// Centre to craft: `argument` answers, the records are the changes of the asker's links since
    /// its last reply (ids of the board that wrote them).
    Reply = 6,
    /// Orchestrator to all: a [`super::TurnCommand`].
    TurnCommand = 7,
    /// Craft to orchestrator: a [`super::TurnReport`].
    TurnReport = 8,
    /// Orchestrator to all: an epoch begins ([`super::EpochSpec`] archive; the network is on `world`).
    EpochBegin = 9,
    /// Craft to orchestrator: boards are reset and ports are open. No payload.
    EpochReady = 10,
    /// Orchestrator to all: everybody's ports are open, update the connections. No payload.
    Connect = 11,
    /// Craft to orchestrator: connections are up. No payload.
    Connected = 12,
    /// Orchestrator to all: the trial is over; report. No payload.
    EpochEnd = 13,
    /// Craft to orchestrator: a [`super::TrialReport`] archive.
    TrialReport = 14,
    /// Craft to orchestrator: the process is up. No payload.
    Ready = 15,
    /// Orchestrator to all: end the process. No payload.
    Stop = 16,
    /// An archive of networks on the `world` service.
    World = 17,
    /// Payload of a benchmark or test.
    Probe = 18,
    /// Orchestrator to all: the trace of open mode begins at `intended_ns`. No payload.
    Go = 19,
    /// Orchestrator to all: how much is under way? `argument` numbers the question. No payload.
    Tally = 20,
    /// Craft to orchestrator: a [`super::TallyReport`]; `argument` is the question's.
    TallyReport = 21,
    /// Between processes: a [`super::Receipt`]. Unnumbered, class ack.
    Receipt = 22,
    /// Between processes: which versions the sender holds of the facts `firing_number..turn` of the
    /// receiver's board (delta records, facts as the receiver numbers them); `argument` numbers the
    /// question. Unnumbered, class ack.
    Digest = 23,
    /// The answer to a digest: what the asker lacks (delta records, each in its writer's ids);
    /// `argument`, `firing_number` and `turn` are the question's, `sequence` and `intended_ns` the
    /// numbers of the next unicast and multicast. `hop_count` is 1 if further facts follow after
    /// `turn`, else 0. Unnumbered, class repair.
    State = 24,
    /// Orchestrator to all: a [`super::MembershipChange`].
    Membership = 25,
}

impl Kind {
    /// Whether samples of this kind are numbered, so that a lost one is noticed and a repeated one is
    /// not handed over. The others may be lost or repeated without harm.
    #[must_use]
    pub const fn is_numbered(self) -> bool {
        !matches!(self, Self::Receipt | Self::Digest | Self::State)
    }
}

macro_rules! from_code {
    ($name:ident, $last:ident, $($variant:ident),+) => {
        impl $name {
            /// The variant with wire code `code`, `None` if there is none.
            #[must_use]
            pub const fn from_code(code: u8) -> Option<Self> {
                $(if code == Self::$variant as u8 { return Some(Self::$variant); })+
                None
            }
        }
    };
}
from_code!(Class, Telemetry, Replication, Reply, Repair, Ack, BestEffort, Control, Telemetry);
from_code!(
    Kind,
    Membership,
    Delta,
    Register,
    Instruction,
    Result,
    Check,
    SignOff,
    Reply,
    TurnCommand,
    TurnReport,
    EpochBegin,
    EpochReady,
    Connect,
    Connected,
    EpochEnd,
    TrialReport,
    Ready,
    Stop,
    World,
    Probe,
    Go,
    Tally,
    TallyReport,
    Receipt,
    Digest,
    State,
    Membership
);

/// The header of every sample: 80 bytes, little-endian as all that we run on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[cfg_attr(feature = "shell", derive(ZeroCopySend))]
#[repr(C)]
pub struct Header {
    /// [`FORMAT_VERSION`].
    pub format_version: u16,
    /// A [`Class`].
    pub class: u8,
    /// A [`Kind`].
    pub kind: u8,
    /// CRC32C over the header, with this field 0, and the payload.
    pub checksum: u32,
    /// Which run the sample belongs to.
    pub run: u64,
    /// The craft that sent this sample.
    pub source: u32,
    /// Which life of that craft.
    pub incarnation: u32,
    /// The craft whose firing this is about; a relay keeps it.
    pub origin: u32,
    /// The receiver of this sample; [`CraftId::NONE`] for a multicast.
    pub destination: u32,
    /// Trial on the fleet.
    pub epoch: u32,
    /// Lockstep turn.
    pub turn: u32,
    /// Number of this sample from its source to its destination service, from 0, running on across
    /// epochs; a step of more than one is a gap.
    pub sequence: u64,
    /// The origin's firing number, from 0 in each epoch.
    pub firing_number: u32,
    /// What a request asks or a reply answers; in a delta of open mode the time under way before this
    /// hop, ns.
    pub argument: u32,
    /// Hops so far, this one included.
    pub hop_count: u16,
    /// Delta records in the payload.
    pub record_count: u16,
    /// Payload bytes.
    pub length: u32,
    /// When the change was meant to be made, ns.
    pub intended_ns: u64,
    /// When send was called, ns.
    pub published_ns: u64,
}

const _: () = assert!(size_of::<Header>() == 80);

impl Header {
    /// A header of `class` and `kind` with every other field 0, addressed to nobody in particular.
    #[must_use]
    pub const fn new(class: Class, kind: Kind) -> Self {
        Self {
            format_version: FORMAT_VERSION,
            class: class as u8,
            kind: kind as u8,
            checksum: 0,
            run: 0,
            source: 0,
            incarnation: 0,
            origin: 0,
            destination: CraftId::NONE.0,
            epoch: 0,
            turn: 0,
            sequence: 0,
            firing_number: 0,
            argument: 0,
            hop_count: 1,
            record_count: 0,
            length: 0,
            intended_ns: 0,
            published_ns: 0,
        }
    }

    /// The class, if it is one that this version knows.
    #[must_use]
    pub const fn class(&self) -> Option<Class> {
        Class::from_code(self.class)
    }

    /// The kind, if it is one that this version knows.
    #[must_use]
    pub const fn kind(&self) -> Option<Kind> {
        Kind::from_code(self.kind)
    }

    /// The checksum of this header with `payload`.
    #[must_use]
    pub fn checksum_with(&self, payload: &[u8]) -> u32 {
        let blank = Self { checksum: 0, ..*self };
        crc32c::crc32c_append(crc32c::crc32c(blank.as_bytes()), payload)
    }

    /// Sets length and checksum for `payload`. The last thing that is written before sending.
    ///
    /// # Panics
    /// If the payload is longer than 4 GiB, which no service accepts.
    pub fn seal(&mut self, payload: &[u8]) {
        self.length =
            u32::try_from(payload.len()).expect("invariant: services bound their payloads");
        self.checksum = self.checksum_with(payload);
    }

    /// Checks a received sample before anything in it is believed.
    ///
    /// # Errors
    /// Says which check failed first: version, run, length, checksum, kind.
    pub fn verify(&self, payload: &[u8], run: u64) -> Result<(Class, Kind), Refusal> {
        if self.format_version != FORMAT_VERSION {
            return Err(Refusal::Version);
        }
        if self.run != run {
            return Err(Refusal::Foreign);
        }
        if self.length as usize != payload.len() {
            return Err(Refusal::Length);
        }
        if self.checksum != self.checksum_with(payload) {
            return Err(Refusal::Checksum);
        }
        match (self.class(), self.kind()) {
            (Some(class), Some(kind)) => Ok((class, kind)),
            _ => Err(Refusal::Kind),
        }
    }
}

/// A blank header, which a loan of shared memory starts with.
impl Default for Header {
    fn default() -> Self {
        Self::new(Class::Control, Kind::Probe)
    }
}

/// Why a sample was not accepted. Each is a counter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, thiserror::Error)]
pub enum Refusal {
    /// Written by another version of the wire format.
    #[error("another format version")]
    Version,
    /// Of another run.
    #[error("another run")]
    Foreign,
    /// Header and payload disagree on the length, or records do not fill it.
    #[error("wrong length")]
    Length,
    /// Damaged.
    #[error("checksum does not match")]
    Checksum,
    /// A class or kind that does not exist.
    #[error("unknown class or kind")]
    Kind,
    /// Of an earlier life of its source.
    #[error("an older incarnation")]
    Incarnation,
    /// A record that names something that does not exist.
    #[error("a record names something that does not exist")]
    Record,
}
