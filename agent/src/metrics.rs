//! Times of a craft in open mode, as histograms that never grow while they are filled.
//!
//! Every event is recorded, none sampled. Not here: who reads the clock (the shells), and quantiles
//! with intervals (orchestrator, results).

use hdrhistogram::Histogram;

/// Longest time that is told from a longer one, ns.
const TIME_NS_MAX: u64 = 60_000_000_000;

/// What is measured between which points: one event a change, of `wake` one a sample.
#[derive(Clone, Debug)]
pub struct Stages {
    /// Intended to made, at the origin: how late the schedule is.
    pub schedule: Histogram<u64>,
    /// Send called to receive returned, at a final receiver; over several hops their sum, relay work
    /// apart.
    pub wake: Histogram<u64>,
    /// Receive returned to applied: the end of the batch, an upper bound.
    pub apply: Histogram<u64>,
    /// Intended to applied at a board that shares the fact: time to knowledge.
    pub knowledge: Histogram<u64>,
}

impl Default for Stages {
    fn default() -> Self {
        let empty = || {
            Histogram::new_with_bounds(1, TIME_NS_MAX, 3).expect("invariant: the bounds are valid")
        };
        Self { schedule: empty(), wake: empty(), apply: empty(), knowledge: empty() }
    }
}

impl Stages {
    /// Forgets everything and keeps the memory.
    pub fn reset(&mut self) {
        for stage in [&mut self.schedule, &mut self.wake, &mut self.apply, &mut self.knowledge] {
            stage.reset();
        }
    }
}

/// Counts `times` events of `duration_ns`; what is beyond the bounds counts at the bound.
pub(crate) fn note(stage: &mut Histogram<u64>, duration_ns: u64, times: u64) {
    if times > 0 {
        let value = duration_ns.clamp(stage.low(), stage.high());
        stage.record_n(value, times).expect("invariant: the value lies within the bounds");
    }
}
