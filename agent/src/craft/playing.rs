//! What a [`Craft`] does in open mode, whatever its role.

use super::open::Open;
use super::outbox::{Counting, Outbox};
use super::schedule::Schedule;
use super::{Craft, Role};
use crate::blackboard::Blackboard;
use crate::metrics::Measured;
use shared_types::knowledge::FleetView;
use shared_types::time::Nanos;
use shared_types::trace::TraceRecord;
use shared_types::wire::{Class, EpochSpec, HeldFact, OpenReport, OpenSpec, TallyReport};

impl Craft {
    /// Starts an epoch of open mode.
    ///
    /// # Panics
    /// If the strategy is a central one: those play no traces.
    pub(super) fn begin_open_epoch(
        &mut self,
        spec: &EpochSpec,
        open: &OpenSpec,
        fleet: &FleetView<'_>,
    ) {
        assert!(!spec.strategy.has_centre(), "invariant: the caller refuses central strategies");
        self.measured.begin(open, fleet.boards.len() + 1, &self.beside);
        if self.craft.0 == fleet.craft_count() {
            self.role = Role::Absent;
            return;
        }
        if !matches!(self.role, Role::Open(_)) {
            self.role = Role::Open(Box::new(Open::new()));
        }
        if let Role::Open(craft) = &mut self.role {
            craft.begin_epoch(self.craft, spec, open, fleet);
        }
    }

    /// The trace of open mode, of which `trace` is this craft's part, begins at `started`.
    pub fn go(&mut self, started: Nanos, trace: &[TraceRecord]) {
        if let Some(schedule) = self.schedule_mut() {
            let ends = schedule.start(started, trace);
            let reads = trace.iter().filter(|record| record.holds().is_none()).count();
            self.measured.start(started, ends, reads);
        }
    }

    /// When the next record of `trace` is due.
    #[must_use]
    pub fn next_due(&self, trace: &[TraceRecord]) -> Option<Nanos> {
        self.schedule().and_then(|schedule| schedule.next_due(trace))
    }

    /// Makes what this craft's `trace` has for the next due time, if that has come by `now`; says
    /// whether it had.
    pub fn play_due(
        &mut self,
        now: Nanos,
        trace: &[TraceRecord],
        fleet: &FleetView<'_>,
        out: &mut Outbox,
    ) -> bool {
        let books = (&mut self.counting, &mut self.measured);
        match &mut self.role {
            Role::Open(craft) => craft.play(now, trace, fleet, books, out),
            _ => false,
        }
    }

    /// What is received from now on arrived at `now`.
    #[inline]
    pub const fn arrive(&mut self, now: Nanos) {
        self.arrived = now;
    }

    /// What was applied since the last call is known at `now`.
    #[inline]
    pub fn stamp_applied(&mut self, now: Nanos) {
        if let Role::Open(craft) = &mut self.role {
            craft.stamp_applied(now, &mut self.measured);
        }
    }

    /// What the craft measures in open mode.
    #[must_use]
    pub const fn measured(&self) -> &Measured {
        &self.measured
    }

    /// The board; `None` outside of open mode.
    #[must_use]
    pub fn open_board(&self) -> Option<&Blackboard> {
        match &self.role {
            Role::Open(craft) => Some(craft.board()),
            _ => None,
        }
    }

    /// What is under way between this process and the others at `now`, of whose samples `waiting` are
    /// in the outbox.
    #[must_use]
    pub fn tally(&self, now: Nanos, waiting: usize) -> TallyReport {
        let [replication, reply] = [Class::Replication, Class::Reply]
            .map(|class| &self.counting.counters.traffic[class as usize]);
        let left = self.schedule().map_or(0, |schedule| schedule.left(now));
        TallyReport {
            sent: (replication.transmissions + reply.transmissions) * self.copies,
            received: replication.deliveries + reply.deliveries,
            left: (left + waiting) as u64,
        }
    }

    /// What is told of open mode only.
    pub(super) fn report_open(&self) -> Option<OpenReport> {
        let written = self.open_board().into_iter().flat_map(Blackboard::written);
        let held = written.map(|(fact, state)| HeldFact {
            fact: fact.0,
            value: state.value as u8,
            count: state.version.count,
            writer: state.version.writer.0,
        });
        Some(OpenReport {
            records_played: self.schedule()?.played() as u64,
            held: held.collect(),
            ..self.measured.report()
        })
    }

    pub(super) const fn counting_and_measured(&mut self) -> (&mut Counting, &mut Measured) {
        (&mut self.counting, &mut self.measured)
    }

    fn schedule(&self) -> Option<&Schedule> {
        match &self.role {
            Role::Open(craft) => Some(craft.schedule()),
            _ => None,
        }
    }

    fn schedule_mut(&mut self) -> Option<&mut Schedule> {
        match &mut self.role {
            Role::Open(craft) => Some(craft.schedule_mut()),
            _ => None,
        }
    }
}
