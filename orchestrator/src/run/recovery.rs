//! Successors for crafts that died, in a fleet that goes on.
//!
//! A craft's end is known from its pidfd and reaped before anything else. Then, in this order: the janitor
//! frees what it held, on a thread of its own; everybody is told that it is gone, gives the epoch up and
//! says so, so that nothing of it is under way any more; a new life of the craft is started and says that
//! it is ready. From there the next epoch begins as every other. Deaths on the way (of others, of the
//! successor) begin the same again. Every step leaves its time in the [`Recovery`]. Not here: how often a
//! craft is restarted (`supervision::restart`), and what becomes of the trial that lost it (the run's
//! loop).

use super::backend::PlayError;
use super::fleet::{LAST_QUESTION, RealFleet};
use crate::launch::craft_process::CraftProcess;
use crate::launch::janitor::{Janitor, PATIENCE_NS, Reclaimed};
use crate::supervision::watch::CraftEnded;
use agent::process::startup::AgentArguments;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use shared_types::ids::{CraftId, Incarnation};
use shared_types::limits::LIVES_MAX;
use shared_types::time::Nanos;
use shared_types::transport::{Destination, Endpoint as _, clock};
use shared_types::wire::{Class, Header, Kind, MembershipChange};
use std::os::fd::AsFd as _;
use zerocopy::IntoBytes as _;

/// The life of one craft's process.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Life {
    pub(super) incarnation: Incarnation,
    /// Whether it has said so.
    pub(super) is_ready: bool,
}

/// How one death was followed by a new life.
#[derive(Debug)]
pub struct Recovery {
    /// Who died, how, and what it said.
    pub ended: CraftEnded,
    /// The life that follows.
    pub successor: Incarnation,
    /// When the supervisor noticed.
    pub noticed: Nanos,
    /// What the janitor achieved; `None` if the fleet ended before.
    pub reclaimed: Option<Reclaimed>,
    /// When everybody who lives had been told, and had given a trial up; an interval goes on.
    pub known: Option<Nanos>,
    /// When the last of the others heard of it in an interval.
    pub peers_noticed: Option<Nanos>,
    /// When the successor said that it is up.
    pub ready: Option<Nanos>,
    /// When the successor was connected in the next epoch, or in the interval that lost it.
    pub rejoined: Option<Nanos>,
    /// When the successor knew what it had missed of an interval.
    pub caught_up: Option<Nanos>,
    /// Whether the successor died before it was back: another death, with a recovery of its own.
    pub is_cut_short: bool,
    /// When the successor may be started.
    not_before: Nanos,
}

impl Recovery {
    /// Whether nothing more will happen to it.
    #[must_use]
    pub const fn is_over(&self) -> bool {
        self.is_cut_short || self.rejoined.is_some()
    }

    const fn awaits_successor(&self) -> bool {
        !self.is_cut_short && self.ready.is_none()
    }

    /// Whether there is a successor, or will be one, that is not connected yet.
    pub(super) const fn is_awaited(&self) -> bool {
        !self.is_over()
    }
}

impl RealFleet<'_> {
    /// Puts successors into the places of `lost`; the epoch under way is given up.
    ///
    /// # Errors
    /// [`PlayError::Lost`] if the fleet restarts nobody, or a craft has used up its budget; else why it
    /// cannot go on.
    pub(super) fn replace(&mut self, lost: Vec<CraftEnded>) -> Result<(), PlayError> {
        self.mourn(lost)?;
        loop {
            match self.bring_back() {
                Err(PlayError::Lost(more)) => self.mourn(more)?,
                ended => return ended,
            }
        }
    }

    /// Recoveries that are over, taken off the list; all of them if the fleet is about to end.
    pub(super) fn recoveries_over(&mut self, all: bool) -> Vec<Recovery> {
        let (over, open) = std::mem::take(&mut self.recoveries)
            .into_iter()
            .partition(|recovery| all || recovery.is_over());
        self.recoveries = open;
        over
    }

    /// Every process is connected in an epoch.
    pub(super) fn note_rejoined(&mut self, now: Nanos) {
        for recovery in &mut self.recoveries {
            if recovery.ready.is_some() {
                recovery.rejoined.get_or_insert(now);
            }
        }
    }

    /// Takes note of deaths.
    pub(super) fn mourn(&mut self, lost: Vec<CraftEnded>) -> Result<(), PlayError> {
        let now = clock::now();
        let Some(restarts) = &mut self.restarts else { return Err(PlayError::Lost(lost)) };
        let pauses: Option<Vec<u64>> =
            lost.iter().map(|ended| restarts.take(ended.craft, now)).collect();
        let lives_left = LIVES_MAX.saturating_sub(self.lives_given) as usize;
        let Some(pauses) = pauses.filter(|pauses| pauses.len() <= lives_left) else {
            return Err(PlayError::Lost(lost));
        };
        for (ended, pause_ns) in lost.into_iter().zip(pauses) {
            self.endpoint.discard(ended.craft);
            let before = self
                .recoveries
                .iter_mut()
                .find(|recovery| recovery.ended.craft == ended.craft && !recovery.is_over());
            if let Some(before) = before {
                before.is_cut_short = true;
            }
            self.lives_given += 1;
            let incarnation = Incarnation(self.lives_given);
            self.lives[ended.craft.index()] = Life { incarnation, is_ready: false };
            self.recoveries.push(Recovery {
                ended,
                successor: incarnation,
                noticed: now,
                reclaimed: None,
                known: None,
                peers_noticed: None,
                ready: None,
                rejoined: None,
                caught_up: None,
                is_cut_short: false,
                not_before: now.plus(pause_ns),
            });
        }
        Ok(())
    }

    /// From the deaths that are known to successors that are ready.
    fn bring_back(&mut self) -> Result<(), PlayError> {
        self.bury()?;
        self.make_known()?;
        self.start_successors()?;
        self.await_up()?;
        for craft in self.note_up(clock::now()) {
            self.tell_membership(craft, self.lives[craft.index()].incarnation, true)?;
        }
        // The networks of the trial are handed to whoever connects.
        self.endpoint.update_connections()?;
        Ok(())
    }

    /// Lets the janitor work where somebody is not reclaimed yet, and goes on looking around meanwhile.
    pub(super) fn bury(&mut self) -> Result<(), PlayError> {
        let failed = |error: std::io::Error| PlayError::Failed(format!("no janitor: {error}"));
        let buried: Vec<usize> = (0..self.recoveries.len())
            .filter(|&index| self.recoveries[index].reclaimed.is_none())
            .collect();
        if buried.is_empty() {
            return Ok(());
        }
        let janitor = Janitor::start(self.root.paths(), self.options.janitor).map_err(failed)?;
        let given_up = clock::now().plus(PATIENCE_NS);
        let mut interruption = None;
        while !janitor.is_done() {
            let (processes, signals) = (self.watch.as_fd(), self.signals.as_fd());
            let all = [janitor.as_fd(), processes, signals];
            // What interrupts is dealt with once the janitor is done.
            let count = if interruption.is_none() { all.len() } else { 1 };
            let mut watched =
                all.map(|descriptor| PollFd::from_borrowed_fd(descriptor, PollFlags::IN));
            let left_ns = given_up.since(clock::now());
            let left = Timespec {
                tv_sec: (left_ns / 1_000_000_000).cast_signed(),
                tv_nsec: (left_ns % 1_000_000_000).cast_signed(),
            };
            match poll(&mut watched[..count], Some(&left)) {
                Ok(0) if clock::now() >= given_up => {
                    return Err(PlayError::Failed(format!(
                        "the janitor was not done after {} s: it waits on what was never finished",
                        PATIENCE_NS / 1_000_000_000
                    )));
                }
                Ok(_) | Err(Errno::INTR) => {}
                Err(error) => return Err(failed(error.into())),
            }
            if interruption.is_none() {
                interruption = self.look_around().err();
            }
        }
        let Reclaimed { result, done } = janitor.finish().map_err(PlayError::Failed)?;
        let detail = result.as_ref().err().map(ToString::to_string);
        let mut result = Some(result);
        for index in buried {
            // One attempt reclaims for all; what it removed is told once.
            let result = result.take().unwrap_or_else(|| Ok(Default::default()));
            self.recoveries[index].reclaimed = Some(Reclaimed { result, done });
        }
        match (interruption, detail) {
            (Some(interruption), _) => Err(interruption),
            // Places are left for some of the dead; that they are missing is told.
            (None, _) => Ok(()),
        }
    }

    /// Tells everybody who lives who is gone.
    pub(super) fn tell_ends(&mut self) -> Result<(), PlayError> {
        let gone: Vec<(CraftId, Incarnation)> = self
            .recoveries
            .iter()
            .filter(|recovery| recovery.awaits_successor())
            .map(|recovery| (recovery.ended.craft, recovery.ended.incarnation))
            .collect();
        gone.into_iter().try_for_each(|(craft, life)| self.tell_membership(craft, life, false))
    }

    /// Tells everybody who lives who is gone, and waits until they have given the epoch up.
    fn make_known(&mut self) -> Result<(), PlayError> {
        self.tell_ends()?;
        self.tell_living(Header::new(Class::Control, Kind::EpochEnd), &[])?;
        let mut question = Header::new(Class::Control, Kind::Tally);
        question.argument = LAST_QUESTION;
        self.tell_living(question, &[])?;
        let hearing: Vec<CraftId> = self.hearing().collect();
        self.await_from(Kind::TallyReport, hearing, &mut |_, header, _| {
            header.argument == LAST_QUESTION
        })?;
        let now = clock::now();
        for recovery in self.recoveries.iter_mut().filter(|recovery| recovery.awaits_successor()) {
            recovery.known.get_or_insert(now);
        }
        Ok(())
    }

    /// Starts a process for every craft that has none, each not before its pause is over.
    pub(super) fn start_successors(&mut self) -> Result<(), PlayError> {
        let mut waiting: Vec<(Nanos, CraftId)> = self
            .recoveries
            .iter()
            .filter(|recovery| recovery.awaits_successor())
            .map(|recovery| (recovery.not_before, recovery.ended.craft))
            .filter(|&(_, craft)| self.watch.process(craft).is_none())
            .collect();
        waiting.sort_unstable();
        for (not_before, craft) in waiting {
            if not_before > clock::now() {
                self.sleep(not_before)?;
            }
            let failed = |error: &dyn std::error::Error| {
                PlayError::Failed(format!("no successor of craft {craft}: {error}"))
            };
            let arguments = self.arguments(craft);
            let started = self.launcher.spawn_all([arguments]).map_err(|error| failed(&error))?;
            for process in started {
                self.watch.add(process).map_err(|error| failed(&error))?;
            }
        }
        Ok(())
    }

    /// Every process is up since `now`; returns who newly is.
    pub(super) fn note_up(&mut self, now: Nanos) -> Vec<CraftId> {
        let mut risen = Vec::new();
        for recovery in self.recoveries.iter_mut().filter(|recovery| recovery.awaits_successor()) {
            recovery.ready = Some(now);
            risen.push(recovery.ended.craft);
        }
        risen
    }

    /// The command line of the present life of `craft`.
    pub(super) fn arguments(&mut self, craft: CraftId) -> AgentArguments {
        AgentArguments {
            run: self.root.run(),
            base: self.root.paths().base().to_owned(),
            craft,
            craft_count: self.options.crafts,
            incarnation: self.lives[craft.index()].incarnation,
            parent_pid: std::process::id(),
            wake: self.options.wake,
            cores: self.options.placement.of(craft).to_vec(),
            beside: self.options.placement.beside(craft),
            doom: self.options.dooms.remove(&craft),
        }
    }

    pub(super) fn tell_membership(
        &mut self,
        craft: CraftId,
        incarnation: Incarnation,
        is_up: bool,
    ) -> Result<(), PlayError> {
        let (craft, incarnation, is_up) = (craft.0, incarnation.0, u32::from(is_up));
        let change = MembershipChange { craft, incarnation, is_up, reserved: 0 };
        self.tell_living(Header::new(Class::Control, Kind::Membership), change.as_bytes())
    }

    /// Tells everybody who lives something, the centre as well if it does.
    fn tell_living(&mut self, header: Header, payload: &[u8]) -> Result<(), PlayError> {
        let centre = CraftId(self.options.crafts);
        if self.hearing().any(|craft| craft == centre) {
            self.send_with(Destination::Craft(centre), header, payload)?;
        }
        self.send_with(Destination::Turn, header, payload)
    }

    /// Processes that live and have said so.
    fn hearing(&self) -> impl Iterator<Item = CraftId> + use<'_> {
        let living = self.watch.living().map(CraftProcess::craft);
        living.filter(|craft| self.lives[craft.index()].is_ready)
    }
}
