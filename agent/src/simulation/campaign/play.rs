//! Plays one case: the events of its faults, the due times of its crafts, and arrivals, by time.

use super::arrival::take_in;
use super::events::Event;
use super::judge;
use super::laws::{Laws, Violation};
use super::scene::{FACTS, TRACE_NS};
use super::weather::{Seen, Weather};
use super::{Case, Played, Stage, Witness};
use crate::craft::dispatch::dispatch_stamped;
use crate::craft::{Craft, Outbox};
use shared_types::ids::{CraftId, FactId};
use shared_types::knowledge::{FactState, FleetView, Value};
use shared_types::time::Nanos;
use shared_types::trace::TraceRecord;
use shared_types::transport::memory::{MemoryEndpoint, MemoryNetwork, MemoryOptions};
use shared_types::transport::{Endpoint, SendError};
use shared_types::wire::{Class, Counters, EpochSpec, Losses, OpenSpec, RecoverySpec};
use std::cell::RefCell;
use std::collections::BTreeSet;
use std::rc::Rc;

/// Longest random time under way, ns.
const JITTER_NS: u32 = 20_000;

/// Patience of the processes, ns.
const PATIENCE_NS: u64 = 500_000;

/// A fleet that is not quiet by then is restless, ns.
const REST_NS: u64 = 20_000_000_000;

/// One process of the fleet.
pub(super) struct Process<E> {
    /// `None` while it is gone.
    pub(super) endpoint: Option<E>,
    pub(super) life: u32,
    pub(super) is_paused: bool,
    /// Whether it ever ended.
    pub(super) was_killed: bool,
    /// Whether something is in its outbox.
    pub(super) waits: bool,
    pub(super) losses: Losses,
}

impl<E> Process<E> {
    /// A process in its first life.
    pub(super) fn new(endpoint: E) -> Self {
        Self {
            endpoint: Some(endpoint),
            life: 0,
            is_paused: false,
            was_killed: false,
            waits: false,
            losses: Losses::default(),
        }
    }
}

pub(super) struct Theatre<'a, E> {
    pub(super) case: &'a Case,
    pub(super) fleet: FleetView<'a>,
    pub(super) spec: EpochSpec,
    pub(super) network: MemoryNetwork,
    wrap: &'a dyn Fn(MemoryEndpoint) -> E,
    pub(super) crafts: &'a mut [Craft],
    pub(super) processes: Vec<Process<E>>,
    pub(super) events: BTreeSet<(Nanos, u64, Event)>,
    pub(super) event_number: u64,
    pub(super) lives: u32,
    pub(super) laws: Laws,
    out: Outbox,
    witness: Option<Witness<'a>>,
    pub(super) played: Played,
    pub(super) seen: Rc<RefCell<Seen>>,
}

/// Plays `case` and holds it against the laws.
pub(super) fn play<'a, E: Endpoint>(
    case: &'a Case,
    stage: &'a mut Stage,
    witness: Option<Witness<'a>>,
    wrap: &'a dyn Fn(MemoryEndpoint) -> E,
) -> Result<Played, Violation> {
    let count = case.scene.trace.len() + usize::from(case.strategy.has_centre());
    let crafts = CraftId::from_index(count).0;
    let options =
        MemoryOptions { seed: case.seed, jitter_ns: JITTER_NS, ..MemoryOptions::default() };
    let network = MemoryNetwork::new(crafts, options);
    let seen = Rc::new(RefCell::new(Seen::default()));
    network.set_link(Weather::new(case, Rc::clone(&seen)));
    let mut theatre = Theatre {
        case,
        fleet: case.scene.network.view(),
        spec: spec(case),
        network,
        wrap,
        crafts: stage.crafts(count),
        processes: Vec::new(),
        events: BTreeSet::new(),
        event_number: 0,
        lives: 0,
        laws: Laws::of(count, FACTS),
        out: Outbox::default(),
        witness,
        played: Played::default(),
        seen,
    };
    theatre.set_up()?;
    theatre.run()?;
    judge::judge(&mut theatre)
}

fn spec(case: &Case) -> EpochSpec {
    EpochSpec {
        epoch: 0,
        network: 0,
        seed: case.seed,
        trial: 0,
        strategy: case.strategy,
        own_firing_only: true,
        ignores_finals: true,
        sends_altered_only: false,
        record_bytes: 16,
        turns_max: 1,
        open: Some(OpenSpec {
            duration_ns: u64::from(TRACE_NS) + 10_000_000,
            slice_ns: u64::from(TRACE_NS) + 10_000_000,
            asks_every_ns: 1_000_000,
            stamps_stages: false,
        }),
        reasoning: shared_types::reasoning::Reasoning::default(),
        recovery: Some(RecoverySpec::patient(PATIENCE_NS)),
        link: None,
    }
}

impl<E: Endpoint> Theatre<'_, E> {
    fn set_up(&mut self) -> Result<(), Violation> {
        for index in 0..self.crafts.len() {
            let endpoint = self.open(index, 0)?;
            let trace = part(self.case, index);
            self.crafts[index].go(Nanos(0), trace);
            self.processes.push(Process::new(endpoint));
        }
        self.schedule_faults();
        Ok(())
    }

    /// Begins life `life` of a process in the epoch.
    pub(super) fn open(&mut self, index: usize, life: u32) -> Result<E, Violation> {
        let id = CraftId::from_index(index);
        let craft = &mut self.crafts[index];
        if life > 0 {
            craft.begin_life(life);
        }
        craft.begin_epoch(&self.spec, &self.fleet);
        let mut endpoint = (self.wrap)(self.network.endpoint(id, life));
        endpoint.open_ports(&craft.peers(&self.fleet)).map_err(failed)?;
        Ok(endpoint)
    }

    fn run(&mut self) -> Result<(), Violation> {
        loop {
            let event = self.events.first().map(|&(at, ..)| at);
            let arrival = self.network.next_due();
            let due = self.next_due();
            let at_work = due.map(|(at, _)| at);
            let Some(next) = [event, arrival, at_work].into_iter().flatten().min() else {
                return Ok(());
            };
            if next.0 > REST_NS {
                return Err(Violation::Restless);
            }
            self.network.advance_to(next);
            let touched = if event.is_some_and(|at| at <= next) {
                self.happen()?
            } else if let Some((_, index)) = due.filter(|&(at, _)| at <= next) {
                self.act(index)?;
                Some(index)
            } else {
                let receiver = self.network.deliver_next();
                let index = receiver.map(CraftId::index).filter(|&index| self.runs(index));
                if let Some(index) = index {
                    self.receive(index)?;
                }
                index
            };
            if let Some(index) = touched {
                self.look(index)?;
            }
            self.flush()?;
        }
    }

    pub(super) fn runs(&self, index: usize) -> bool {
        let process = &self.processes[index];
        process.endpoint.is_some() && !process.is_paused
    }

    /// The process that is due first, and when.
    fn next_due(&self) -> Option<(Nanos, usize)> {
        let now = self.network.now();
        let running = (0..self.crafts.len()).filter(|&index| self.runs(index));
        let due = running.filter_map(|index| {
            let at = self.crafts[index].next_due(part(self.case, index))?;
            Some((at.max(now), index))
        });
        due.min()
    }

    fn act(&mut self, index: usize) -> Result<(), Violation> {
        let now = self.network.now();
        let trace = part(self.case, index);
        self.crafts[index].arrive(now);
        self.crafts[index].play_due(now, trace, &self.fleet, &mut self.out);
        self.publish(index)
    }

    pub(super) fn receive(&mut self, index: usize) -> Result<(), Violation> {
        let now = self.network.now();
        let Self { crafts, processes, fleet, laws, out, .. } = self;
        let craft = &mut crafts[index];
        craft.arrive(now);
        let Some(endpoint) = &mut processes[index].endpoint else { return Ok(()) };
        let is_witnessed = self.witness.is_some();
        let (lines, verdict) = take_in(endpoint, craft, fleet, laws, out, is_witnessed);
        craft.stamp_applied(now);
        for line in lines {
            self.tell(now, |_| line);
        }
        verdict?;
        self.publish(index)
    }

    fn publish(&mut self, index: usize) -> Result<(), Violation> {
        let Self { network, crafts, processes, out, .. } = self;
        let process = &mut processes[index];
        let Some(endpoint) = &mut process.endpoint else { return Ok(()) };
        let mut clock = || network.now();
        dispatch_stamped(endpoint, &mut clock, out, &mut crafts[index]).map_err(failed)?;
        process.waits = endpoint.flush().map_err(failed)? > 0;
        Ok(())
    }

    /// Tries again what waits in outboxes.
    fn flush(&mut self) -> Result<(), Violation> {
        for index in 0..self.processes.len() {
            if self.processes[index].waits && self.runs(index) {
                let process = &mut self.processes[index];
                if let Some(endpoint) = &mut process.endpoint {
                    process.waits = endpoint.flush().map_err(failed)? > 0;
                }
            }
        }
        Ok(())
    }

    /// Holds the board of a process against the laws of a step.
    fn look(&mut self, index: usize) -> Result<(), Violation> {
        self.played.steps += 1;
        if let Some(header) = self.seen.borrow().over_budget {
            let (source_craft, number) = (CraftId(header.source), header.sequence);
            return Err(Violation::OverBudget { source_craft, number });
        }
        if self.processes[index].endpoint.is_none() {
            return Ok(());
        }
        let craft = CraftId::from_index(index);
        for fact in (0..FACTS).map(FactId) {
            let Some(state) = self.state(craft, fact) else { return Ok(()) };
            if state.version.writer == craft {
                self.laws.write(craft, fact, state)?;
            }
            if state.version.count > 0 {
                self.laws.look(craft, fact, state)?;
            }
        }
        self.tell(self.network.now(), |theatre| theatre.board_line(craft));
        Ok(())
    }

    fn board_line(&self, craft: CraftId) -> String {
        board_line(craft, (0..FACTS).map(FactId).filter_map(|fact| self.state(craft, fact)))
    }

    pub(super) fn state(&self, craft: CraftId, fact: FactId) -> Option<FactState> {
        self.crafts[craft.index()].open_board().map(|board| board.state(fact))
    }

    pub(super) fn tell(&mut self, at: Nanos, what: impl FnOnce(&Self) -> String) {
        if let Some(witness) = self.witness.take() {
            witness(at, what(self));
            self.witness = Some(witness);
        }
    }

    /// Adds what process `index` counted in the life that it ends.
    pub(super) fn count(&mut self, index: usize) {
        self.played.count(&self.crafts[index].counters());
    }
}

impl Played {
    /// Adds what a process counted.
    pub(super) fn count(&mut self, counters: &Counters) {
        self.recovered += counters.recovered;
        for class in [Class::Replication, Class::Reply] {
            self.first_sent += counters.traffic[class as usize];
        }
        for class in [Class::Repair, Class::Ack] {
            self.on_top += counters.traffic[class as usize];
        }
    }
}

/// What `craft` holds, in a line.
pub(super) fn board_line(craft: CraftId, facts: impl Iterator<Item = FactState>) -> String {
    let facts = facts.map(|FactState { value, version }| {
        let sign = match value {
            Value::Unknown => '?',
            Value::Asserted => '+',
            Value::Absent => '-',
        };
        format!("{sign}{}@{}", version.count, version.writer)
    });
    format!("{craft} holds {}", facts.collect::<Vec<_>>().join(" "))
}

/// The part of the trace that process `index` plays; none for the centre.
pub(super) fn part(case: &Case, index: usize) -> &[TraceRecord] {
    case.scene.trace.get(index).map_or(&[], Vec::as_slice)
}

pub(super) fn failed(error: SendError) -> Violation {
    Violation::Network(error.to_string())
}
