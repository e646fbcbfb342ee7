//! What happens to a sample on its way: a verdict, given by a plain value that a test or scenario
//! sets up. The memory network asks for one verdict per sample and receiver when it is sent, a real
//! process behind links for each sample that comes (`transport::incoming`).

mod stated;

pub use crate::wire::LinkCounts;
pub use stated::{StatedLink, carried_ns};

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
    /// It is lost because nothing passes between the two at that time.
    CutOff,
    /// It arrives twice.
    Duplicate,
    /// It arrives twice, each time this many nanoseconds later.
    Doubled {
        /// How much later, ns.
        delay_ns: u64,
        /// Whether everything behind it on the same way arrives after it, as with [`Self::Delay`].
        keeps_order: bool,
    },
}

impl LinkCounts {
    /// Counts `verdict` on a sample.
    pub(super) fn count(&mut self, verdict: Verdict) {
        let delay_ns = match verdict {
            Verdict::Delay(ns) | Verdict::Overtaken(ns) => ns,
            Verdict::Doubled { delay_ns, .. } => delay_ns,
            _ => 0,
        };
        self.lost += u64::from(verdict == Verdict::Drop);
        self.cut_off += u64::from(verdict == Verdict::CutOff);
        let is_doubled = matches!(verdict, Verdict::Duplicate | Verdict::Doubled { .. });
        self.doubled += u64::from(is_doubled);
        self.delayed += u64::from(delay_ns > 0);
    }
}

/// Judges every sample.
pub trait Link {
    /// A trial of that number begins at `now`.
    fn begin(&mut self, now: Nanos, trial: u32) {
        let _ = (now, trial);
    }

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
