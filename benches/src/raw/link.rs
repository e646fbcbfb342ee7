//! What workloads ask of a transport: one sample to everybody else or to one peer, and what has arrived.

use super::RawError;
use super::port::SampleHeader;

/// One process's connections to all others of a measurement.
pub trait Link {
    /// Sends one sample of [`super::port::PAYLOAD_BYTES`] bytes to everybody else.
    ///
    /// # Errors
    /// If somebody does not get it.
    fn send(&mut self, header: SampleHeader) -> Result<(), RawError>;

    /// The header of the next sample, `None` if none has arrived. May also wait for one.
    ///
    /// # Errors
    /// If the transport fails, or the sample is not what its header says.
    fn receive(&mut self) -> Result<Option<SampleHeader>, RawError>;
}

/// One process's connections to all others, each by itself.
pub trait Peers {
    /// Sends one sample of [`super::port::PAYLOAD_BYTES`] bytes to `peer`, counted among the others
    /// from 0; `false` if that one has no room for it.
    ///
    /// # Errors
    /// If the transport fails.
    fn try_send(&mut self, peer: usize, header: SampleHeader) -> Result<bool, RawError>;

    /// The header of the next sample, `None` if none has arrived.
    ///
    /// # Errors
    /// If the transport fails, or the sample is not what its header says.
    fn receive(&mut self) -> Result<Option<SampleHeader>, RawError>;
}
