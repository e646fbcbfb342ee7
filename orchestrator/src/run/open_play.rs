//! One interval of open mode on a real fleet.
//!
//! Every process is told one instant ahead at which the trace begins; then the orchestrator sleeps, in
//! one wait, to the interval's end. After it, it asks how much every process has sent and received
//! until nothing is under way: what was sent when all were asked must be what had been received when
//! all were asked the time before. A fleet that does not come to rest is given up after a grace, with
//! whatever it reports. In an epoch that recovers, deaths are followed by new lives all the while. Not
//! here: what the numbers mean, and how a new life comes in (`revival`).

use super::backend::{PlayError, PlayedOpen};
use super::fleet::{LAST_QUESTION, RealFleet};
use super::play::taking_part;
use super::reports::Reports;
use agent::simulation::SimulationError;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use shared_types::knowledge::FleetNetwork;
use shared_types::limits::SLEEP_NS_MAX;
use shared_types::time::Nanos;
use shared_types::transport::clock;
use shared_types::wire::{Class, EpochSpec, Header, Kind, TallyReport, Traffic, TrialReport};
use std::os::fd::AsFd as _;
use zerocopy::FromBytes;

/// How far ahead of the trace its beginning is told, ns: a part for all, and one for each process,
/// since they hear of it one after the other where processors are few.
const AHEAD_NS: u64 = 10_000_000;
const AHEAD_PER_PROCESS_NS: u64 = 200_000;

/// How long after the end of the interval the first question is put, ns, and the next ones after
/// the last answer.
const QUESTION_PAUSE_NS: u64 = 2_000_000;

/// How long after the end of the interval a fleet may be restless, ns, and how many exchanges with
/// the centre longer.
const QUIET_GRACE_NS: u64 = 1_000_000_000;
const QUIET_GRACE_EXCHANGES: u64 = 3;

/// The same in patiences of a fleet that recovers: it asks again with growing pauses, and who was stopped
/// has much to ask for.
const QUIET_GRACE_PATIENCES: u64 = 2_000;

/// An answer that takes so long comes from somebody who was stopped, ns.
const STOPPED_NS: u64 = 100_000_000;

/// How long after the end of the interval of `spec` a fleet may be restless before it is given up, ns.
pub(super) fn grace_ns(spec: &EpochSpec) -> u64 {
    let asks_every_ns = spec.open.map_or(0, |open| open.asks_every_ns);
    let patience_ns = spec.recovery.map_or(0, |recovery| recovery.patience_ns);
    QUIET_GRACE_NS
        .saturating_add(asks_every_ns.saturating_mul(QUIET_GRACE_EXCHANGES))
        .saturating_add(patience_ns.saturating_mul(QUIET_GRACE_PATIENCES))
}

impl RealFleet<'_> {
    /// Plays the trace of `network` as `spec.open` says.
    pub(super) fn play_interval(
        &mut self,
        spec: &EpochSpec,
        network: &FleetNetwork,
    ) -> Result<PlayedOpen, PlayError> {
        let Some(open) = spec.open else {
            return Err(PlayError::Failed("the epoch is not one of open mode".to_owned()));
        };
        if !spec.strategy.plays_traces() {
            return Err(SimulationError::NotOpen(spec.strategy).into());
        }
        self.control = Traffic::default();
        let mut dead = self.begin_lastingly(spec, network)?;
        let processes = taking_part(self, spec);
        let ahead_ns = AHEAD_NS + u64::from(processes) * AHEAD_PER_PROCESS_NS;
        let started = clock::now().plus(ahead_ns);
        let mut go = Header::new(Class::Control, Kind::Go);
        go.intended_ns = started.0;
        self.tell_with(spec, go, &[])?;
        self.note_ready(started);
        self.plan_blows(started);
        let ends = started.plus(open.duration_ns);
        let cpu_start = clock::process_cpu();
        let orchestrator_sleeps =
            self.lastingly(spec, started, &mut dead, |fleet| fleet.sleep(ends))?;
        let orchestrator_cpu_ns = clock::process_cpu().since(cpu_start);
        let grace_ns = grace_ns(spec);
        let is_quiet = self.lastingly(spec, started, &mut dead, |fleet| {
            let given_up = clock::now().max(ends).plus(grace_ns);
            fleet.await_quiet(spec, given_up)
        })?;
        let reports = self.collect(spec)?;
        self.note_reported(&reports);
        if !is_quiet {
            // Who has reported begins nothing new; what is still under way must not be late in the
            // next epoch.
            self.await_quiet(spec, clock::now().plus(QUIET_GRACE_NS))?;
        }
        Ok(PlayedOpen {
            reports,
            is_quiet,
            orchestrator_cpu_ns,
            orchestrator_sleeps,
            control: self.control,
            dead,
            ..PlayedOpen::default()
        })
    }

    /// Sleeps until `until`, or until a process ends, a signal comes or the run's time is up: crafts
    /// do not wake it. Returns how often it woke.
    pub(super) fn sleep(&mut self, until: Nanos) -> Result<u64, PlayError> {
        const NANOS_PER_SECOND: u64 = 1_000_000_000;
        let until = self.options.run_ends.map_or(until, |ends| ends.min(until));
        let mut wakes = 0;
        loop {
            // Heartbeats are looked at, too.
            let look = until.min(clock::now().plus(SLEEP_NS_MAX));
            let look = self.next_strike().map_or(look, |due| due.min(look));
            let left_ns = look.since(clock::now());
            let timeout = Timespec {
                tv_sec: i64::try_from(left_ns / NANOS_PER_SECOND).unwrap_or(i64::MAX),
                tv_nsec: i64::try_from(left_ns % NANOS_PER_SECOND).unwrap_or(0),
            };
            let (processes, signals) = (self.watch.as_fd(), self.signals.as_fd());
            let mut others = [processes, signals]
                .map(|descriptor| PollFd::from_borrowed_fd(descriptor, PollFlags::IN));
            match poll(&mut others, Some(&timeout)) {
                Ok(_) | Err(Errno::INTR) => {}
                Err(error) => return Err(PlayError::Failed(format!("sleeping: {error}"))),
            }
            wakes += 1;
            self.look_around()?;
            if clock::now() >= until {
                return Ok(wakes);
            }
        }
    }

    /// Asks until the fleet is quiet; says whether it became so before it is given up.
    fn await_quiet(&mut self, spec: &EpochSpec, mut given_up: Nanos) -> Result<bool, PlayError> {
        let mut received_before = None;
        loop {
            self.sleep(clock::now().plus(QUESTION_PAUSE_NS))?;
            let asked = clock::now();
            let total = self.ask(spec)?;
            let waited_ns = clock::now().since(asked);
            if spec.recovery.is_some() && waited_ns >= STOPPED_NS {
                // Who was stopped meanwhile begins to catch up only now.
                given_up = given_up.plus(waited_ns);
            }
            if total.left == 0 && received_before == Some(total.sent) {
                return Ok(true);
            }
            received_before = (total.left == 0).then_some(total.received);
            if clock::now() >= given_up {
                return Ok(false);
            }
        }
    }

    /// What all processes together have sent, received and left to do.
    fn ask(&mut self, spec: &EpochSpec) -> Result<TallyReport, PlayError> {
        // No question is put twice: an answer to an earlier one may still be under way.
        let question = self.questions;
        self.questions = (question + 1) % LAST_QUESTION;
        let mut header = Header::new(Class::Control, Kind::Tally);
        header.argument = question;
        self.tell_with(spec, header, &[])?;
        let mut total = TallyReport::default();
        let processes = taking_part(self, spec);
        self.await_each(Kind::TallyReport, processes, &mut |_, header, payload| {
            let is_meant = header.epoch == spec.epoch && header.argument == question;
            let Ok(tally) = TallyReport::read_from_bytes(payload) else { return false };
            if is_meant {
                total.sent += tally.sent;
                total.received += tally.received;
                total.left += tally.left;
            }
            is_meant
        })?;
        Ok(total)
    }

    /// Asks for the reports.
    fn collect(&mut self, spec: &EpochSpec) -> Result<Vec<TrialReport>, PlayError> {
        let processes = taking_part(self, spec);
        let mut reports = Reports::of(processes as usize);
        let mut fault = None;
        self.tell_with(spec, Header::new(Class::Control, Kind::EpochEnd), &[])?;
        self.await_each(Kind::TrialReport, processes, &mut |source, header, payload| {
            if header.epoch != spec.epoch {
                return false;
            }
            // A report that cannot be read will not come again.
            reports.take(source, header, payload).unwrap_or_else(|what| {
                fault.get_or_insert(what);
                true
            })
        })?;
        match fault {
            None => Ok(reports.into_received()),
            Some(fault) => Err(PlayError::Failed(fault)),
        }
    }
}
