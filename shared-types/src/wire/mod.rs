//! What travels between processes: a header of fixed size, then records.
//!
//! Every sample carries its [`Header`] as iceoryx2 user header (in the memory transport: beside the
//! payload) and a payload whose meaning [`Kind`] gives. Delta records are fixed-size rows that are
//! read where they lie; control messages are one fixed row; what has no fixed size (the network of an
//! epoch, the report of a trial) is one rkyv archive. A checksum covers header and payload and is
//! verified before anything is believed.

mod control;
mod delta;
mod epoch;
mod header;
mod link;
mod open;
mod recovery;
mod report;

pub use control::{TallyReport, TurnCommand, TurnPhase, TurnReport};
pub use delta::{
    DELTA_BYTES, DeltaReader, DeltaRecord, INTENDED_BYTES, write_deltas, write_intended,
};
pub use epoch::{EpochSpec, StrategyKind};
pub use header::{Class, FORMAT_VERSION, HEADER_BYTES, Header, Kind, Refusal};
pub use link::{CutOff, LinkCounts, LinkSpec, OutageSpec};
pub use open::{EndHeard, GO_JOINING, HeldFact, OpenReport, OpenSpec, ReadSeen, Stage};
pub use recovery::{
    MembershipChange, MissingRow, Receipt, RecoverySpec, read_receipt, receipt_bytes, write_receipt,
};
pub use report::{
    ArchivedTrialReport, CLASS_COUNT, Counters, Losses, Recovered, Traffic, TrialReport,
};
