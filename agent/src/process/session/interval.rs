//! The steps of a process in open mode, and what the kernel says of its interval.
//!
//! A step takes what has arrived, passes on, then makes what is due, each due time with a look at the
//! clock of its own. One look at the clock before each sample is when that one was received and when
//! the one before it was applied, so that a delta costs one such look at its receiver. Waiting ends
//! when the next record is due. Not here: orders other than those of an interval.

use super::{Session, SessionError, Surroundings, Usage, order};
use crate::craft::dispatch::dispatch_stamped;
use shared_types::ids::CraftId;
use shared_types::knowledge::FleetView;
use shared_types::limits::DUE_TIMES_PER_STEP_MAX;
use shared_types::time::Nanos;
use shared_types::transport::Endpoint;
use shared_types::transport::link::{Link as _, StatedLink};
use shared_types::wire::{
    Class, EndHeard, EpochSpec, Header, Kind, MembershipChange, OpenSpec, TrialReport,
};
use zerocopy::IntoBytes;

/// The interval of one epoch, as the kernel sees it.
#[derive(Debug)]
pub(super) struct Interval {
    duration_ns: u64,
    started: Option<Nanos>,
    /// When the next record is due.
    next_due: Option<Nanos>,
    /// CPU time of the process at the start and at the end.
    cpu_start_ns: Option<u64>,
    cpu_end_ns: Option<u64>,
    usage_start: Usage,
    usage_end: Option<Usage>,
    /// Whether this life came when the trace had begun, and when it had caught up.
    joins: bool,
    caught_up: Option<Nanos>,
    ends_heard: Vec<EndHeard>,
    /// The links that act from its beginning on, and the trial that they are drawn for.
    link: Option<(StatedLink, u32)>,
}

impl Interval {
    /// An interval of `spec` that has not begun.
    pub(super) fn of(open: &OpenSpec, spec: &EpochSpec) -> Self {
        let link = spec.link.clone();
        Self {
            duration_ns: open.duration_ns,
            started: None,
            next_due: None,
            cpu_start_ns: None,
            cpu_end_ns: None,
            usage_start: Usage { run_delay_ns: 0, sleeps: 0 },
            usage_end: None,
            joins: false,
            caught_up: None,
            ends_heard: Vec::new(),
            link: link.map(|link| (StatedLink::new(link, spec.seed), spec.trial)),
        }
    }

    /// When there is something to do without a message: a record is due, or the interval ends.
    pub(super) fn next_look(&self) -> Option<Nanos> {
        let started = self.started?;
        let end = self.cpu_end_ns.is_none().then(|| started.plus(self.duration_ns));
        [self.next_due, end].into_iter().flatten().min()
    }

    /// Notes the CPU time at the start and at the end, when they come.
    #[inline]
    fn look(&mut self, now: Nanos, cpu_ns: impl Fn() -> u64) {
        let Some(started) = self.started else { return };
        if self.cpu_start_ns.is_none() && now >= started {
            self.cpu_start_ns = Some(cpu_ns());
        }
        if self.cpu_end_ns.is_none() && now >= started.plus(self.duration_ns) {
            self.cpu_end_ns = Some(cpu_ns());
        }
    }
}

impl<E: Endpoint, S: Surroundings<E>> Session<E, S> {
    /// The trace begins at `started`, or has begun then where the process joins. Those that play it
    /// already are not meant.
    pub(super) fn go(&mut self, started: Nanos, joins: bool, fleet: &FleetView<'_>) {
        let Some(interval) = self.interval.as_mut().filter(|interval| interval.started.is_none())
        else {
            return;
        };
        let trace = fleet.trace_of(self.craft.id());
        if joins {
            self.craft.join(self.surroundings.now(), started, trace);
        } else {
            self.craft.go(started, trace);
        }
        if let Some((mut link, trial)) = interval.link.take() {
            link.begin(started, trial);
            self.endpoint.expose(Some(link));
        }
        interval.joins = joins;
        interval.started = Some(started);
        interval.next_due = self.craft.next_due(trace);
        interval.usage_start = self.surroundings.usage();
    }

    /// Somebody is gone, or lives again: an interval on `fleet` goes on without it, and with it.
    pub(super) fn member_changed(
        &mut self,
        change: MembershipChange,
        fleet: Option<&FleetView<'_>>,
    ) -> Result<(), SessionError> {
        let Self { endpoint, surroundings, craft, out, interval, .. } = self;
        if let (Some(interval), Some(fleet)) = (interval, fleet) {
            let now = surroundings.now();
            if change.is_up == 0 {
                let MembershipChange { craft, incarnation, .. } = change;
                let is_known =
                    |end: &EndHeard| (end.craft, end.incarnation) == (craft, incarnation);
                if !interval.ends_heard.iter().any(is_known) {
                    interval.ends_heard.push(EndHeard { craft, incarnation, at_ns: now.0 });
                }
            }
            craft.member_changed(now, &change, fleet);
            dispatch_stamped(endpoint, &mut || surroundings.now(), out, craft)?;
            interval.next_due = craft.next_due(fleet.trace_of(craft.id()));
        }
        if change.is_up == 0 {
            // What waits for it would reach its successor, to which it means nothing.
            endpoint.discard(CraftId(change.craft));
        }
        Ok(())
    }

    /// One step in open mode. Returns how much there was to do.
    pub(super) fn step_open(&mut self, fleet: &FleetView<'_>) -> Result<usize, SessionError> {
        let Self { endpoint, surroundings, craft, out, orders, interval, .. } = self;
        let is_staged = craft.measured().is_staged();
        let mut clock = || surroundings.now();
        if !is_staged {
            craft.arrive(clock());
        }
        let arrived = endpoint.drain(&mut |_, header, payload| {
            match (header.class(), header.kind()) {
                (Some(class), Some(kind)) if class.is_between_crafts() => {
                    if is_staged {
                        let now = clock();
                        craft.stamp_applied(now);
                        craft.arrive(now);
                    }
                    // A refusal is counted by the craft and changes nothing.
                    let _refusal = craft.receive(class, kind, header, payload, fleet, out);
                }
                _ => match order(header, payload) {
                    Some(order) => orders.push(order),
                    None => craft.counting_mut().counters.losses.refused += 1,
                },
            }
        })?;
        if arrived > 0 {
            craft.stamp_applied(clock());
            dispatch_stamped(endpoint, &mut clock, out, craft)?;
        }
        let Some(interval) = interval else { return Ok(arrived) };
        let trace = fleet.trace_of(craft.id());
        let mut played = 0;
        while played < DUE_TIMES_PER_STEP_MAX {
            let now = clock();
            interval.look(now, || surroundings.cpu_ns());
            if !craft.play_due(now, trace, fleet, out) {
                break;
            }
            dispatch_stamped(endpoint, &mut clock, out, craft)?;
            played += 1;
        }
        interval.next_due = craft.next_due(trace);
        if interval.joins && interval.caught_up.is_none() && craft.is_caught_up() {
            interval.caught_up = Some(clock());
        }
        Ok(arrived + played)
    }

    /// Tells the orchestrator how much is under way.
    pub(super) fn answer_tally(&mut self, question: u32) -> Result<(), SessionError> {
        let waiting = self.endpoint.flush()?;
        let tally = self.craft.tally(self.surroundings.now(), waiting);
        if let Some(interval) = &mut self.interval {
            let surroundings = &self.surroundings;
            interval.usage_end.get_or_insert_with(|| surroundings.usage());
        }
        let mut header = Header::new(Class::Control, Kind::TallyReport);
        header.argument = question;
        self.tell_with(header, tally.as_bytes())
    }

    /// The orchestrator says that the epoch is over. In lockstep everybody knows when it is: who must be
    /// told so gives it up.
    pub(super) fn end_epoch(&mut self) -> Result<(), SessionError> {
        if self.interval.is_none() && !self.has_reported {
            self.craft.abandon_epoch();
        }
        self.report()
    }

    /// Adds what the kernel says of the interval, in open mode.
    pub(super) fn add_interval(&self, report: &mut TrialReport) {
        let Some(interval) = &self.interval else { return };
        let until = interval.cpu_end_ns.unwrap_or_else(|| self.surroundings.cpu_ns());
        report.cpu_ns = interval.cpu_start_ns.map_or(0, |start_ns| until.saturating_sub(start_ns));
        if let Some(open) = &mut report.open {
            let (start, end) = (interval.usage_start, interval.usage_end.unwrap_or_default());
            open.run_delay_ns = end.run_delay_ns.saturating_sub(start.run_delay_ns);
            open.sleeps = end.sleeps.saturating_sub(start.sleeps);
            open.proportional_bytes = self.surroundings.proportional_bytes();
            open.caught_up_ns = interval.caught_up.map_or(0, |at| at.0);
            open.ends_heard.clone_from(&interval.ends_heard);
        }
    }
}
