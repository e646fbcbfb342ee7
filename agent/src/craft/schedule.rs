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
    /// Records that were skipped.
    missed: usize,
}

impl Schedule {
    /// The schedule of an interval that has not begun.
    pub(super) fn of(open: &OpenSpec) -> Self {
        Self { duration_ns: open.duration_ns, ..Self::default() }
    }

    /// The interval begins at `started` and `trace` is to be played in it. Returns its end.
    pub(super) fn start(&mut self, started: Nanos, trace: &[TraceRecord]) -> Nanos {
        self.started = Some(started);
        (self.played, self.missed) = (0, 0);
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

    /// Records that were played or skipped, always a prefix of the trace.
    pub(super) const fn played(&self) -> usize {
        self.played
    }

    /// Records among them that were skipped.
    pub(super) const fn missed(&self) -> usize {
        self.missed
    }

    /// Skips what was due before `now`: nobody was there to make it.
    pub(super) fn skip_until(&mut self, now: Nanos, trace: &[TraceRecord]) {
        let passed_ns = now.since(self.started());
        let due = trace[..self.playable].partition_point(|record| record.at_ns < passed_ns);
        self.missed += due.saturating_sub(self.played);
        self.played = self.played.max(due);
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

#[cfg(test)]
mod tests {
    use super::{FactId, LATE_PLAY_NS, Nanos, OpenSpec, ReadSeen, Schedule, Seen, TraceRecord};

    const SPEC: OpenSpec =
        OpenSpec { duration_ns: 1_000, slice_ns: 100, asks_every_ns: 10, stamps_stages: true };

    fn trace() -> Vec<TraceRecord> {
        [10, 10, 900, 1_000].map(|at_ns| TraceRecord::write(at_ns, FactId(0), true)).to_vec()
    }

    #[test]
    fn everything_of_one_due_time_is_played_together() {
        let (mut schedule, trace) = (Schedule::of(&SPEC), trace());
        assert_eq!(schedule.next_due(&trace), None, "nobody said when it begins");
        assert_eq!(schedule.start(Nanos(5_000), &trace), Nanos(6_000));
        assert_eq!(schedule.take_due(Nanos(5_009), &trace), None);
        let taken = schedule.take_due(Nanos(5_950), &trace).map(|(at, part)| (at, part.len()));
        assert_eq!(taken, Some((10, 2)), "the next due time is left to the next call");
        assert_eq!(schedule.next_due(&trace), Some(Nanos(5_900)));
        assert!(schedule.take_due(Nanos(5_950), &trace).is_some());
        assert_eq!(schedule.next_due(&trace), None, "what is due at the end is not played");
        assert_eq!((schedule.played(), schedule.left(Nanos(5_950))), (3, 0));
        assert!(!schedule.is_over(Nanos(5_950)) && schedule.is_over(Nanos(6_000)));
    }

    #[test]
    fn what_was_due_before_the_end_is_made_a_little_later_and_then_no_more() {
        let trace = trace();
        let mut schedule = Schedule::of(&SPEC);
        let ends = schedule.start(Nanos(0), &trace);
        assert!(!schedule.is_over(ends), "three records are left");
        assert!(schedule.take_due(ends.plus(LATE_PLAY_NS), &trace).is_some());
        let too_late = ends.plus(LATE_PLAY_NS + 1);
        assert_eq!(schedule.take_due(too_late, &trace), None);
        assert_eq!((schedule.played(), schedule.left(too_late)), (2, 0));
        assert!(schedule.is_over(too_late));
    }

    #[test]
    fn an_older_write_that_arrives_late_does_not_hide_a_newer_one() {
        let mut seen = Seen::default();
        seen.reset(2);
        seen.note(FactId(1), 500);
        seen.note(FactId(1), 300);
        assert_eq!(seen.newest_ns(FactId(1)), 500);
        assert_eq!(seen.newest_ns(FactId(0)), ReadSeen::NOTHING);
        seen.note(FactId(0), 0);
        assert_eq!(seen.newest_ns(FactId(0)), 0);
    }
}
