//! What a [`Craft`] does in open mode, whatever its role.

use super::open::Open;
use super::open_centre::OpenCentre;
use super::open_client::OpenClient;
use super::outbox::{Counting, Outbox};
use super::recovery::Recovery;
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
    /// If the strategy plays no traces.
    pub(super) fn begin_open_epoch(
        &mut self,
        spec: &EpochSpec,
        open: &OpenSpec,
        fleet: &FleetView<'_>,
    ) {
        assert!(spec.strategy.plays_traces(), "invariant: the caller refuses what plays no traces");
        self.measured.begin(open, fleet.boards.len() + 1, &self.beside);
        let is_centre = self.craft.0 == fleet.craft_count();
        match (&mut self.role, spec.strategy.has_centre(), is_centre) {
            (Role::Open(craft), false, false) => craft.begin_epoch(self.craft, spec, open, fleet),
            (Role::OpenClient(client), true, false) => {
                client.begin_epoch(self.craft, spec, open, fleet);
            }
            (Role::OpenCentre(centre), true, true) => centre.begin_epoch(spec, open, fleet),
            (role, false, false) => {
                let mut craft = Box::new(Open::new());
                craft.begin_epoch(self.craft, spec, open, fleet);
                *role = Role::Open(craft);
            }
            (role, true, false) => {
                let mut client = Box::<OpenClient>::default();
                client.begin_epoch(self.craft, spec, open, fleet);
                *role = Role::OpenClient(client);
            }
            (role, true, true) => {
                let mut centre = Box::<OpenCentre>::default();
                centre.begin_epoch(spec, open, fleet);
                *role = Role::OpenCentre(centre);
            }
            (role, false, true) => *role = Role::Absent,
        }
    }

    /// The trace of open mode, of which `trace` is this craft's part, begins at `started`.
    pub fn go(&mut self, started: Nanos, trace: &[TraceRecord]) {
        let ends = match &mut self.role {
            Role::Open(craft) => craft.schedule_mut().start(started, trace),
            Role::OpenClient(client) => client.start(started, trace),
            Role::OpenCentre(centre) => centre.schedule_mut().start(started, &[]),
            _ => return,
        };
        let reads = trace.iter().filter(|record| record.holds().is_none()).count();
        self.measured.start(started, ends, reads);
    }

    /// When there is something to do without a message: a record of `trace` is due, or a question to
    /// the centre.
    #[must_use]
    pub fn next_due(&self, trace: &[TraceRecord]) -> Option<Nanos> {
        let own = match &self.role {
            _ if !self.is_caught_up() => None,
            Role::Open(craft) => craft.schedule().next_due(trace),
            Role::OpenClient(client) => client.next_due(trace),
            _ => None,
        };
        [own, self.next_recovery()].into_iter().flatten().min()
    }

    /// Makes what this craft's `trace` has for the next due time, if that has come by `now`, or asks
    /// the centre, if it is time for that; says whether there was something to do.
    pub fn play_due(
        &mut self,
        now: Nanos,
        trace: &[TraceRecord],
        fleet: &FleetView<'_>,
        out: &mut Outbox,
    ) -> bool {
        let has_asked = self.tend(now, fleet, out);
        if !self.is_caught_up() {
            return has_asked;
        }
        let books = (&mut self.counting, &mut self.measured);
        let has_played = match &mut self.role {
            Role::Open(craft) => craft.play(now, trace, fleet, books, out),
            Role::OpenClient(client) => client.play(now, trace, fleet, books, out),
            _ => false,
        };
        has_asked || has_played
    }

    /// What is received from now on arrived at `now`.
    #[inline]
    pub const fn arrive(&mut self, now: Nanos) {
        self.arrived = now;
    }

    /// What was applied since the last call is known at `now`.
    #[inline]
    pub fn stamp_applied(&mut self, now: Nanos) {
        match &mut self.role {
            Role::Open(craft) => craft.stamp_applied(now, &mut self.measured),
            Role::OpenClient(client) => client.stamp_applied(now, &mut self.measured),
            Role::OpenCentre(centre) => centre.stamp_applied(now, &mut self.measured),
            _ => {}
        }
    }

    /// Begins nothing new any more, once the report of the interval is made: of an interval that did not
    /// become quiet nothing may reach into the next epoch.
    pub fn give_up(&mut self) {
        match &mut self.role {
            Role::OpenClient(client) => client.give_up(),
            Role::OpenCentre(centre) => centre.give_up(),
            _ => {}
        }
    }

    /// What the craft measures in open mode.
    #[must_use]
    pub const fn measured(&self) -> &Measured {
        &self.measured
    }

    /// The board, or what a client of the centre knows of it; `None` for the centre and outside of open
    /// mode.
    #[must_use]
    pub fn open_board(&self) -> Option<&Blackboard> {
        match &self.role {
            Role::Open(craft) => Some(craft.board()),
            Role::OpenClient(client) => Some(client.mirror()),
            _ => None,
        }
    }

    /// The board on which the craft reasons in lockstep; `None` for the centre and its clients.
    #[must_use]
    pub fn board(&self) -> Option<&Blackboard> {
        match &self.role {
            Role::Autonomous(craft) => Some(craft.board()),
            _ => None,
        }
    }

    /// What is under way between this process and the others at `now`, of whose samples `waiting` are
    /// in the outbox.
    #[must_use]
    pub fn tally(&self, now: Nanos, waiting: usize) -> TallyReport {
        let [replication, reply] = [Class::Replication, Class::Reply]
            .map(|class| &self.counting.counters.traffic[class as usize]);
        let left = match &self.role {
            Role::Open(craft) => craft.schedule().left(now),
            Role::OpenClient(client) => client.left(now),
            Role::OpenCentre(centre) => centre.left(),
            _ => 0,
        };
        if let Some(recovery) = &self.recovery {
            // Numbers of processes that are gone cannot balance: the fleet is quiet once nobody has
            // anything left and nobody has sent anything since that was asked before.
            let repair = &self.counting.counters.traffic[Class::Repair as usize];
            let sent = replication.transmissions + reply.transmissions + repair.transmissions;
            let left = (left + waiting + recovery.left()) as u64;
            return TallyReport { sent, received: sent, left };
        }
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
            records_missed: self.schedule()?.missed() as u64,
            held: held.collect(),
            ..self.measured.report()
        })
    }

    /// The parts of the process that sending concerns.
    pub(super) fn books(&mut self) -> (&mut Counting, &mut Measured, Option<&mut Recovery>) {
        (&mut self.counting, &mut self.measured, self.recovery.as_deref_mut())
    }

    fn schedule(&self) -> Option<&Schedule> {
        match &self.role {
            Role::Open(craft) => Some(craft.schedule()),
            Role::OpenClient(client) => Some(client.schedule()),
            Role::OpenCentre(centre) => Some(centre.schedule()),
            _ => None,
        }
    }
}
