//! What happens to a sample on its way: a verdict, given by a plain value that a test or scenario
//! sets up. The memory network asks for one verdict per sample and receiver.

use crate::ids::CraftId;
use crate::rng::{Purpose, Stream};
use crate::time::Nanos;
use crate::wire::Header;

/// What happens to one sample on its way to one receiver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// It arrives.
    Pass,
    /// It arrives this many nanoseconds later, and so does everything behind it on the same way: a
    /// link is a queue.
    Delay(u64),
    /// It arrives this many nanoseconds later, and what is sent after it may arrive before it.
    Overtaken(u64),
    /// It is lost.
    Drop,
    /// It arrives twice.
    Duplicate,
}

/// Judges every sample.
pub trait Link {
    /// The verdict on the sample of `header`, sent at `now`, on its way to `receiver`
    /// ([`CraftId::ORCHESTRATOR`] for the orchestrator).
    fn judge(&mut self, now: Nanos, receiver: CraftId, header: &Header) -> Verdict;
}

/// A rule written as a closure.
impl<F: FnMut(Nanos, CraftId, &Header) -> Verdict> Link for F {
    fn judge(&mut self, now: Nanos, receiver: CraftId, header: &Header) -> Verdict {
        self(now, receiver, header)
    }
}

/// Loses and doubles samples at random, each independently of all others.
#[derive(Clone, Debug)]
pub struct Lossy {
    stream: Stream,
    /// Chance that a sample is lost.
    pub loss: f64,
    /// Chance that a sample that is not lost arrives twice.
    pub duplication: f64,
}

impl Lossy {
    /// A lossy link drawn from `seed`.
    #[must_use]
    pub fn new(seed: u64, loss: f64, duplication: f64) -> Self {
        Self { stream: Stream::new(seed, 0, Purpose::Faults, 0), loss, duplication }
    }
}

impl Link for Lossy {
    fn judge(&mut self, _now: Nanos, _receiver: CraftId, _header: &Header) -> Verdict {
        if self.stream.unit() < self.loss {
            Verdict::Drop
        } else if self.stream.unit() < self.duplication {
            Verdict::Duplicate
        } else {
            Verdict::Pass
        }
    }
}
