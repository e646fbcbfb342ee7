//! The two ends of the networks' service: the orchestrator publishes, crafts hold the newest sample.

use super::{Publisher, Sample, Subscriber};

/// This process's end.
#[derive(Debug)]
pub(super) enum World {
    Publisher { publisher: Publisher, sequence: u64 },
    Subscriber(Subscriber),
}

/// Lends the bytes of a sample that stays where it lies.
pub(super) struct HeldSample(pub(super) Sample);

impl AsRef<[u8]> for HeldSample {
    fn as_ref(&self) -> &[u8] {
        self.0.payload()
    }
}
