//! The port through which a process sends and receives, and its adapters.
//!
//! A process owns one [`Endpoint`]. Sending never blocks: a unicast that the receiver's full inbox
//! does not take waits in a bounded local outbox and is tried again on every [`Endpoint::flush`]; a
//! multicast that some receivers missed is repaired by unicast: the sample itself, header unchanged,
//! so that the receiver counts it as the one delivery that it missed ([`Losses::missed_multicasts`] is
//! the number of such repairs). Receiving hands every verified sample to a visitor while it still lies
//! in shared memory. Sequence numbers are put on and checked here, so that the core above never sees
//! a sample twice and every loss is a counter.
//!
//! Adapters: [`memory`] (a deterministic in-process network) and `iceoryx` (shared memory, feature
//! `shell`). One conformance suite holds both to the same laws.

#[cfg(feature = "shell")]
pub mod clock;
#[cfg(feature = "shell")]
pub mod heartbeat;
#[cfg(feature = "shell")]
mod held;
#[cfg(feature = "shell")]
pub mod iceoryx;
#[cfg(feature = "shell")]
mod incoming;
mod intake;
pub mod link;
pub mod memory;
mod outbox;
#[cfg(feature = "shell")]
pub mod paths;
#[cfg(feature = "shell")]
pub mod reclaim;
pub mod sequence;
pub mod topic;

#[cfg(feature = "shell")]
pub use paths::RunPaths;

use crate::ids::CraftId;
use crate::wire::{Header, Losses};
use link::StatedLink;
use sequence::Sequences;

/// Where a sample goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Destination {
    /// The inbox of one craft (the centre is craft N).
    Craft(CraftId),
    /// The inbox of the orchestrator.
    Orchestrator,
    /// Every other craft.
    Multicast,
    /// Every craft, from the orchestrator: turns, epochs, start and stop.
    Turn,
    /// Every craft, from the orchestrator: the networks of an epoch.
    World,
}

/// Services whose samples are numbered per source and may be asked for again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Numbered {
    /// Through the receiver's own inbox, addressed to it.
    Unicast,
    /// To everybody.
    Multicast,
}

impl Numbered {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Unicast, Self::Multicast];
}

/// Why a send failed for good.
#[derive(Debug, thiserror::Error)]
pub enum SendError {
    /// The destination's port was not opened for this epoch.
    #[error("no port is open to {0:?}")]
    NotOpen(Destination),
    /// Longer than the service takes.
    #[error("{needed} bytes do not fit the service, which takes {limit}")]
    TooLong {
        /// Payload bytes.
        needed: usize,
        /// What the service takes.
        limit: usize,
    },
    /// Inbox and outbox are full; the sample was dropped and counted.
    #[error("the outbox to {0:?} is full")]
    OutboxFull(Destination),
    /// The transport itself failed.
    #[error("{operation} failed: {detail}")]
    Transport {
        /// What was tried.
        operation: &'static str,
        /// What the transport said.
        detail: String,
    },
}

/// Which peers a process sends to in an epoch; what it does not need is closed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Peers {
    /// Unicast destinations, ascending.
    pub unicast: Vec<CraftId>,
    /// Whether it sends multicasts.
    pub sends_multicast: bool,
    /// Whether it receives multicasts.
    pub receives_multicast: bool,
}

/// How a process waits when nothing has arrived.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    serde::Serialize,
    serde::Deserialize,
    schemars::JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum WakeMode {
    /// Yields the core and looks again; never sleeps, needs no bells.
    Poll,
    /// Looks again a few times, then sleeps on its bell.
    #[default]
    Adaptive,
    /// Sleeps on its bell at once.
    Block,
}

/// A sample of the `World` service, owned by whoever took it and read where it lies (16-byte aligned,
/// so that an archive is accessed in place). It does not borrow the endpoint.
pub struct WorldSample {
    /// Its header, verified.
    pub header: Header,
    bytes: Box<dyn AsRef<[u8]>>,
}

impl WorldSample {
    /// A sample of `header` over `bytes`.
    #[must_use]
    pub fn new(header: Header, bytes: impl AsRef<[u8]> + 'static) -> Self {
        Self { header, bytes: Box::new(bytes) }
    }
}

impl std::ops::Deref for WorldSample {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        (*self.bytes).as_ref()
    }
}

impl std::fmt::Debug for WorldSample {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("WorldSample")
            .field("header", &self.header)
            .field("bytes", &self.len())
            .finish()
    }
}

/// What a process sends and receives through.
///
/// Every sample handed to the visitor of [`Self::drain`] has passed [`Header::verify`] and the
/// sequence check. Order is kept per source and destination service, except around the repair of a
/// missed multicast, which may come before or after its neighbours (docs/decisions/0008).
pub trait Endpoint {
    /// Opens what the epoch needs and closes the rest. Unicast to the orchestrator, and the services
    /// `Turn` and `World`, are always open.
    ///
    /// # Errors
    /// If a port cannot be opened.
    fn open_ports(&mut self, peers: &Peers) -> Result<(), SendError>;

    /// Brings up the connections to every port that is open by now.
    ///
    /// # Errors
    /// If the transport fails.
    fn update_connections(&mut self) -> Result<(), SendError>;

    /// Sends one sample: loans `length` zeroed bytes, lets `write` fill them where they lie, fills the
    /// header's run, source, incarnation, destination, sequence, length and checksum, sends. `write` is
    /// called again, and must write the same, where the sample has to wait or to be repaired.
    ///
    /// # Errors
    /// If the sample is lost for good. A full inbox is no error: the sample waits in the outbox.
    fn send(
        &mut self,
        to: Destination,
        header: Header,
        length: usize,
        write: &mut dyn FnMut(&mut [u8]),
    ) -> Result<(), SendError>;

    /// The newest `World` sample, if one arrived since the last call. It stays where it lies until
    /// it is dropped; drop the old one first.
    ///
    /// # Errors
    /// If the transport fails; a refused sample is counted and `None`.
    fn take_world(&mut self) -> Result<Option<WorldSample>, SendError>;

    /// Tries again what waits in the outbox; returns how many samples still wait.
    ///
    /// # Errors
    /// If the transport fails.
    fn flush(&mut self) -> Result<usize, SendError>;

    /// Whether anything waits in the outbox for `to`.
    fn holds_back(&self, to: Destination) -> bool;

    /// Hands the samples that have arrived to `visit`, with where they were addressed to; returns how
    /// many there were. `World` samples are not among them: see [`Self::take_world`]. A sender that
    /// never pauses cannot keep the caller here: one call hands over a bounded number.
    ///
    /// # Errors
    /// If the transport fails; refused samples are counted, not errors.
    fn drain(
        &mut self,
        visit: &mut dyn FnMut(Destination, &Header, &[u8]),
    ) -> Result<usize, SendError>;

    /// The number that the next sample to `to` gets.
    fn next_number(&self, to: Destination) -> u64;

    /// Sends a sample to the inbox of `receiver` with destination and number as its header says: one
    /// that was sent before, or one of a kind that is not numbered. Else as [`Self::send`].
    ///
    /// # Errors
    /// If the sample is lost for good.
    fn send_past_numbering(
        &mut self,
        receiver: CraftId,
        header: Header,
        length: usize,
        write: &mut dyn FnMut(&mut [u8]),
    ) -> Result<(), SendError>;

    /// What was received of the numbered samples of `service`, by source.
    fn numbers(&mut self, service: Numbered) -> &mut Sequences;

    /// Discards what waits for `craft`, which is gone; returns how many samples that were.
    fn discard(&mut self, craft: CraftId) -> usize;

    /// Wakes the sleepers among those that this endpoint sent to since the last call.
    fn ring(&mut self);

    /// From now on what crafts send comes here over `link`, and at once where that is `None`; what an
    /// earlier link still holds up is gone. To be asked for only where loss is repaired. Networks that
    /// judge samples as they are sent know their links already and do nothing here.
    fn expose(&mut self, link: Option<StatedLink>) {
        let _ = link;
    }

    /// What was lost, refused or repeated since the last call. To be called when the fleet is quiet:
    /// what is still on its way as a repair would count as a gap.
    fn take_losses(&mut self) -> Losses;
}
