//! Plays one case in lockstep: trials one after the other on one fleet, until nothing befalls it any more
//! and one more has come to its end.
//!
//! A trial loses nothing but time to what links do and to pauses. One in which a process ends is given up
//! by all, as real fleets do, and the next one begins once a new life of that process is there. Not here:
//! what happens within a trial (`trial`).

use super::fault::{Fault, What};
use super::judge::judge_numbers;
use super::laws::{Laws, Violation};
use super::play::{Process, failed};
use super::scene::MISSION_FACTS;
use super::weather::{Seen, Weather};
use super::{Case, Played, Stage, Witness};
use crate::craft::{Craft, Outbox};
use crate::simulation::Simulation;
use shared_types::ids::CraftId;
use shared_types::knowledge::FleetView;
use shared_types::reasoning::Reasoning;
use shared_types::rng::{Purpose, Stream};
use shared_types::time::Nanos;
use shared_types::transport::Endpoint;
use shared_types::transport::memory::{MemoryEndpoint, MemoryNetwork, MemoryOptions};
use shared_types::wire::{EpochSpec, MembershipChange, RecoverySpec, TurnCommand};
use std::cell::RefCell;
use std::collections::BTreeSet;
use std::rc::Rc;

/// Longest random time under way, ns.
const JITTER_NS: u32 = 20_000;

/// Patience of the processes, ns.
const PATIENCE_NS: u64 = 100_000;

/// Between two trials, ns.
const PAUSE_NS: u64 = 10_000;

/// Turns of a trial.
const TURNS: u32 = 6;

/// Trials of a case at most; some ten take as long as things begin to befall a fleet.
const TRIALS_MAX: u32 = 500;

/// Something that happens to process `.1` at a time of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Event {
    /// It ends; a new life may begin from then on.
    Kill(Nanos, usize),
    Pause(usize),
    Resume(usize),
}

/// A fleet that plays in lockstep.
pub(super) struct Turns<'a, E> {
    pub(super) case: &'a Case,
    pub(super) fleet: FleetView<'a>,
    pub(super) network: MemoryNetwork,
    wrap: &'a dyn Fn(MemoryEndpoint) -> E,
    pub(super) crafts: &'a mut [Craft],
    pub(super) processes: Vec<Process<E>>,
    /// When a new life of a process that is gone may begin.
    away_until: Vec<Nanos>,
    /// Commands that paused processes have not carried out.
    pub(super) orders: Vec<Option<TurnCommand>>,
    pub(super) events: BTreeSet<(Nanos, u64, Event)>,
    lives: u32,
    pub(super) laws: Laws,
    pub(super) out: Outbox,
    pub(super) draws: Stream,
    witness: Option<Witness<'a>>,
    pub(super) played: Played,
    pub(super) seen: Rc<RefCell<Seen>>,
    /// Plays every trial without faults.
    pub(super) reference: Simulation,
}

/// Plays `case` and holds it against the laws.
pub(super) fn play<'a, E: Endpoint>(
    case: &'a Case,
    stage: &'a mut Stage,
    witness: Option<Witness<'a>>,
    wrap: &'a dyn Fn(MemoryEndpoint) -> E,
) -> Result<Played, Violation> {
    let count = case.scene.crafts() as usize + usize::from(case.strategy.has_centre());
    let options =
        MemoryOptions { seed: case.seed, jitter_ns: JITTER_NS, ..MemoryOptions::default() };
    let network = MemoryNetwork::new(CraftId::from_index(count).0, options);
    let seen = Rc::new(RefCell::new(Seen::default()));
    network.set_link(Weather::new(case, Rc::clone(&seen)));
    let ids = || (0..count).map(CraftId::from_index);
    let mut turns = Turns {
        case,
        fleet: case.scene.network.view(),
        wrap,
        crafts: stage.crafts(count),
        processes: ids().map(|id| Process::new(wrap(network.endpoint(id, 0)))).collect(),
        network,
        away_until: vec![Nanos(0); count],
        orders: vec![None; count],
        events: BTreeSet::new(),
        lives: 0,
        laws: Laws::of(count, MISSION_FACTS),
        out: Outbox::default(),
        draws: Stream::new(case.seed, 0, Purpose::Delivery, 1),
        witness,
        played: Played::default(),
        seen,
        reference: Simulation::new(case.scene.crafts(), MemoryOptions::default()),
    };
    turns.schedule();
    turns.run()
}

impl<E: Endpoint> Turns<'_, E> {
    fn run(mut self) -> Result<Played, Violation> {
        let last = self.case.faults.iter().map(|fault| fault.at_ns.saturating_add(lasts_ns(fault)));
        let calm_from = Nanos(last.max().unwrap_or(0));
        for trial in 0..TRIALS_MAX {
            // A trial in which nobody sends anything takes no time.
            self.network.advance_to(self.network.now().plus(PAUSE_NS));
            self.gather()?;
            let is_last = self.network.now() >= calm_from;
            let has_ended = self.play_trial(&self.spec(trial))?;
            if is_last && has_ended {
                if self.is_whole() {
                    judge_numbers(&mut self.processes, &self.laws, self.case.strategy)?;
                }
                self.played.lost = self.seen.borrow().lost;
                self.played.duration_ns = self.network.now().0;
                return Ok(self.played);
            }
        }
        Err(Violation::Restless)
    }

    fn spec(&self, trial: u32) -> EpochSpec {
        EpochSpec {
            epoch: trial,
            network: 0,
            seed: self.case.seed,
            trial,
            strategy: self.case.strategy,
            own_firing_only: true,
            ignores_finals: true,
            sends_altered_only: self.case.seed.is_multiple_of(3),
            record_bytes: 16,
            turns_max: TURNS,
            open: None,
            reasoning: Reasoning::default(),
            recovery: Some(RecoverySpec { patience_ns: PATIENCE_NS, lives: self.lives }),
            link: None,
        }
    }

    /// Whether nobody has ended since the fleet began.
    pub(super) fn is_whole(&self) -> bool {
        self.processes.iter().all(|process| !process.was_killed)
    }

    pub(super) fn runs(&self, index: usize) -> bool {
        let process = &self.processes[index];
        process.endpoint.is_some() && !process.is_paused
    }

    /// Puts what befalls processes among the events; the links see to the rest.
    fn schedule(&mut self) {
        for (number, fault) in (0..).zip(&self.case.faults) {
            let (begins, ends) = (Nanos(fault.at_ns), Nanos(fault.at_ns).plus(lasts_ns(fault)));
            match fault.what {
                What::Kill(craft) => {
                    self.events.insert((begins, number, Event::Kill(ends, craft.index())));
                }
                What::Pause(craft) => {
                    self.events.insert((begins, number, Event::Pause(craft.index())));
                    self.events.insert((ends, number, Event::Resume(craft.index())));
                }
                _ => {}
            }
        }
    }

    /// Lets the next event happen; says whether a process ended.
    pub(super) fn happen(&mut self) -> Result<(Option<usize>, bool), Violation> {
        let Some((at, _, event)) = self.events.pop_first() else { return Ok((None, false)) };
        self.network.advance_to(at);
        self.tell(|_| format!("{event:?}"));
        match event {
            Event::Kill(returns, index) => Ok((None, self.kill(index, returns))),
            Event::Pause(index) => {
                self.processes[index].is_paused = self.processes[index].endpoint.is_some();
                Ok((None, false))
            }
            Event::Resume(index) => {
                self.processes[index].is_paused = false;
                Ok((Some(index), false))
            }
        }
    }

    fn kill(&mut self, index: usize, returns: Nanos) -> bool {
        self.away_until[index] = self.away_until[index].max(returns);
        let process = &mut self.processes[index];
        if process.endpoint.take().is_none() {
            return false;
        }
        (process.was_killed, process.is_paused) = (true, false);
        let life = process.life;
        self.orders[index] = None;
        self.played.kills += 1;
        self.announce(index, life, false);
        true
    }

    /// Tells everybody who lives that process `index` is gone or back.
    fn announce(&mut self, index: usize, life: u32, is_up: bool) {
        let (now, craft) = (self.network.now(), CraftId::from_index(index).0);
        let change =
            MembershipChange { craft, incarnation: life, is_up: u32::from(is_up), reserved: 0 };
        for other in (0..self.crafts.len()).filter(|&other| other != index) {
            if self.processes[other].endpoint.is_some() {
                self.crafts[other].arrive(now);
                self.crafts[other].member_changed(now, &change, &self.fleet);
            }
        }
    }

    /// Waits between two trials until every process lives and runs.
    fn gather(&mut self) -> Result<(), Violation> {
        loop {
            let now = self.network.now();
            let event = self.events.first().map(|&(at, ..)| at);
            if event.is_some_and(|at| at <= now) {
                if let (Some(index), _) = self.happen()? {
                    self.take_late(index)?;
                }
                continue;
            }
            let gone =
                (0..self.processes.len()).filter(|&it| self.processes[it].endpoint.is_none());
            let Some((back, index)) = gone.map(|it| (self.away_until[it], it)).min() else {
                if self.processes.iter().any(|process| process.is_paused) {
                    let resumed = event.expect("invariant: who is paused is resumed");
                    self.network.advance_to(resumed);
                    continue;
                }
                return Ok(());
            };
            match event.filter(|&at| at <= back) {
                Some(at) => self.network.advance_to(at),
                None => {
                    self.network.advance_to(back);
                    self.begin_life(index);
                }
            }
        }
    }

    fn begin_life(&mut self, index: usize) {
        self.lives += 1;
        let (life, craft) = (self.lives, CraftId::from_index(index));
        self.laws.begin_life(craft);
        self.crafts[index].begin_life(life);
        let endpoint = (self.wrap)(self.network.endpoint(craft, life));
        self.processes[index].endpoint = Some(endpoint);
        self.processes[index].life = life;
        self.announce(index, life, true);
    }

    /// Has everybody who is there take what is under way, which is of the trial before.
    pub(super) fn clear_ways(&mut self) -> Result<(), Violation> {
        loop {
            while let Some(receiver) = self.network.deliver_next() {
                if self.runs(receiver.index()) {
                    self.take_late(receiver.index())?;
                }
            }
            for process in &mut self.processes {
                if let Some(endpoint) = process.endpoint.as_mut().filter(|_| process.waits) {
                    process.waits = endpoint.flush().map_err(failed)? > 0;
                }
            }
            if self.network.in_flight() == 0 {
                return Ok(());
            }
        }
    }

    /// Has process `index` take what has arrived; what it would do about it is of a trial that is over.
    fn take_late(&mut self, index: usize) -> Result<(), Violation> {
        let taken = self.arrive(index);
        self.out = Outbox::default();
        taken
    }

    pub(super) fn tell(&mut self, what: impl FnOnce(&Self) -> String) {
        if let Some(witness) = self.witness.take() {
            witness(self.network.now(), what(self));
            self.witness = Some(witness);
        }
    }

    pub(super) const fn is_witnessed(&self) -> bool {
        self.witness.is_some()
    }
}

/// How long a fault lasts; here everybody comes back.
const fn lasts_ns(fault: &Fault) -> u64 {
    match fault.lasts_ns {
        Fault::FOR_EVER => 0,
        lasts_ns => lasts_ns,
    }
}
