//! When a craft of open mode plays what, and what its reads see.
//!
//! Records are played in order and by due time: everything of one time together, so that how late a
//! craft is moves no count. What is due after the end of the interval is not played; what was due before
//! it is, up to [`LATE_PLAY_NS`] late. Not here: what playing a record means (the roles).

use shared_types::ids::FactId;
use shared_types::limits::LATE_PLAY_NS;
use shared_types::time::Nanos;
use shared_types::trace::TraceRecord;
use shared_types::wire::{OpenSpec, ReadSeen};

/// A craft's place in its part of a trace.
#[derive(Clone, Debug, Default)]
pub(super) struct Schedule {
    duration_ns: u64,
    /// When the interval began; `None` before it is known.
    started: Option<Nanos>,
    /// Records that were played.
    played: usize,
    /// Records that are due before the end.
    playable: usize,
}

impl Schedule {
    /// The schedule of an interval that has not begun.
    pub(super) fn of(open: &OpenSpec) -> Self {
        Self { duration_ns: open.duration_ns, ..Self::default() }
    }

    /// The interval begins at `started` and `trace` is to be played in it. Returns its end.
    pub(super) fn start(&mut self, started: Nanos, trace: &[TraceRecord]) -> Nanos {
        self.started = Some(started);
        self.played = 0;
        self.playable = trace.partition_point(|record| record.at_ns < self.duration_ns);
        self.ends()
    }

    /// When the interval began; the origin of time before it did.
    pub(super) fn started(&self) -> Nanos {
        self.started.unwrap_or_default()
    }

    /// When it ends.
    pub(super) fn ends(&self) -> Nanos {
        self.started().plus(self.duration_ns)
    }

    /// Records that were played, always a prefix of the trace.
    pub(super) const fn played(&self) -> usize {
        self.played
    }

    /// Records that will still be played, as it looks at `now`.
    pub(super) fn left(&self, now: Nanos) -> usize {
        if self.started.is_none() || self.is_too_late(now) {
            0
        } else {
            self.playable - self.played
        }
    }

    /// When the next record is due.
    pub(super) fn next_due(&self, trace: &[TraceRecord]) -> Option<Nanos> {
        let started = self.started?;
        let next = trace[..self.playable].get(self.played)?;
        Some(started.plus(next.at_ns))
    }

    /// The records of the next due time, and this time (ns from the start), if it has come by `now`.
    pub(super) fn take_due<'a>(
        &mut self,
        now: Nanos,
        trace: &'a [TraceRecord],
    ) -> Option<(u64, &'a [TraceRecord])> {
        if self.next_due(trace)? > now || self.is_too_late(now) {
            return None;
        }
        let rest = &trace[self.played..self.playable];
        let together = rest.chunk_by(|left, right| left.at_ns == right.at_ns).next()?;
        self.played += together.len();
        Some((together[0].at_ns, together))
    }

    /// Whether the interval has begun, or its beginning is known.
    pub(super) const fn has_started(&self) -> bool {
        self.started.is_some()
    }

    /// Whether the interval is over and nothing will be played any more.
    pub(super) fn is_over(&self, now: Nanos) -> bool {
        now >= self.ends() && self.left(now) == 0
    }

    /// Whether it is too late for what was not played.
    fn is_too_late(&self, now: Nanos) -> bool {
        now > self.ends().plus(LATE_PLAY_NS)
    }
}

/// Per fact of a board the newest intended time of a write that was made or applied there.
#[derive(Clone, Debug, Default)]
pub(super) struct Seen {
    /// One more than the time, ns from the start; 0 for none.
    newest: Vec<u64>,
}

impl Seen {
    /// Nothing was written yet.
    pub(super) fn reset(&mut self, facts: u32) {
        self.newest.clear();
        self.newest.resize(facts as usize, 0);
    }

    /// A write of `fact`, intended at `intended_ns` from the start, was made or applied.
    #[inline]
    pub(super) fn note(&mut self, fact: FactId, intended_ns: u64) {
        let newest = &mut self.newest[fact.index()];
        *newest = (*newest).max(intended_ns.saturating_add(1));
    }

    /// The newest of them, [`ReadSeen::NOTHING`] for none.
    #[inline]
    pub(super) fn newest_ns(&self, fact: FactId) -> u64 {
        match self.newest[fact.index()] {
            0 => ReadSeen::NOTHING,
            after => after - 1,
        }
    }
}
