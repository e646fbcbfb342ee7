//! Plays a trace in open mode on the virtual clock.
//!
//! Records are made at the very time at which they are due, samples arrive as the network decides, and
//! what an inbox could not take is tried again after every step. Processes end, stop and come back at the
//! times that are stated. Not here: CPU time, which a virtual clock does not see.

mod faults;

pub use faults::{Befalls, ProcessFault};

use super::{Simulation, SimulationError};
use crate::craft::dispatch::dispatch_stamped;
use crate::craft::{Craft, Outbox};
use faults::Event;
use shared_types::ids::{CraftId, FactId, Incarnation};
use shared_types::knowledge::{FactState, FleetView};
use shared_types::time::Nanos;
use shared_types::trace::TraceRecord;
use shared_types::transport::Endpoint;
use shared_types::transport::link::LinkCounts;
use shared_types::transport::memory::{MemoryEndpoint, MemoryNetwork};
use shared_types::wire::{EpochSpec, TrialReport};
use std::collections::{BTreeMap, BTreeSet};

/// What a simulated trial of open mode yields.
#[derive(Clone, Debug)]
pub struct SimulatedOpen {
    /// One report per process, the centre last; times are of the virtual clock.
    pub reports: Vec<TrialReport>,
    /// Whether nothing was due or under way any more; else the fleet was given up.
    pub is_quiet: bool,
    /// Who ended, and in which life; a later life of each played on.
    pub dead: Vec<(CraftId, Incarnation)>,
    /// Virtual time that passed, ns.
    pub duration_ns: u64,
    /// What the links did.
    pub links: LinkCounts,
}

/// What a fleet meets while it plays a trace, beside its links.
#[derive(Clone, Debug, Default)]
pub struct Conditions {
    /// What befalls processes. Deaths are for epochs that recover.
    pub faults: Vec<ProcessFault>,
    /// How long after the end of the interval the fleet may be restless before it is given up, ns;
    /// `None` for as long as it takes.
    pub rest_ns: Option<u64>,
}

/// When each process has something to do without a message.
#[derive(Debug, Default)]
struct Due {
    by_time: BTreeSet<(Nanos, usize)>,
    of_process: BTreeMap<usize, Nanos>,
}

impl Due {
    fn first(&self) -> Option<(Nanos, usize)> {
        self.by_time.first().copied()
    }

    fn set(&mut self, process: usize, at: Option<Nanos>) {
        let before = match at {
            Some(at) => self.of_process.insert(process, at),
            None => self.of_process.remove(&process),
        };
        if let Some(before) = before {
            self.by_time.remove(&(before, process));
        }
        self.by_time.extend(at.map(|at| (at, process)));
    }
}

/// One process of the fleet.
#[derive(Debug)]
struct Process {
    /// `None` while it is gone.
    endpoint: Option<MemoryEndpoint>,
    is_stopped: bool,
}

/// An interval under way.
struct Playing<'a> {
    spec: &'a EpochSpec,
    fleet: &'a FleetView<'a>,
    /// By process, the records that it plays; none for the centre.
    parts: Vec<&'a [TraceRecord]>,
    network: MemoryNetwork,
    crafts: &'a mut [Craft],
    lives: &'a mut [u32],
    out: &'a mut Outbox,
    processes: Vec<Process>,
    started: Nanos,
    due: Due,
    /// Who has something in its outbox.
    waiting: BTreeSet<usize>,
    events: BTreeSet<(Nanos, usize, Event)>,
    dead: Vec<(CraftId, Incarnation)>,
}

impl Simulation {
    /// Plays the trace `trace` (per craft its records) until nothing is due or under way.
    ///
    /// # Errors
    /// If the strategy plays no traces, or the network refuses a sample.
    ///
    /// # Panics
    /// If the trace is one of another fleet, or `spec` is not one of open mode.
    pub fn play_open(
        &mut self,
        spec: &EpochSpec,
        fleet: &FleetView<'_>,
        trace: &[Vec<TraceRecord>],
    ) -> Result<SimulatedOpen, SimulationError> {
        self.play_open_under(spec, fleet, trace, &Conditions::default())
    }

    /// The same under `conditions`.
    ///
    /// # Errors
    /// As [`Self::play_open`].
    ///
    /// # Panics
    /// As [`Self::play_open`], and if somebody ends in an epoch that does not recover.
    pub fn play_open_under(
        &mut self,
        spec: &EpochSpec,
        fleet: &FleetView<'_>,
        trace: &[Vec<TraceRecord>],
        conditions: &Conditions,
    ) -> Result<SimulatedOpen, SimulationError> {
        if !spec.strategy.plays_traces() {
            return Err(SimulationError::NotOpen(spec.strategy));
        }
        let open = spec.open.expect("invariant: the caller plays open mode");
        assert_eq!(trace.len(), fleet.boards.len(), "invariant: each craft has a part of a trace");
        assert!(
            spec.recovery.is_some() || conditions.faults.iter().all(|fault| !fault.is_death()),
            "invariant: deaths are for epochs that recover"
        );
        let count = trace.len() + usize::from(spec.strategy.has_centre());
        self.network.reseed(spec.seed, spec.trial);
        let started = self.network.now();
        let endpoints = std::mem::take(&mut self.endpoints).into_iter();
        let mut playing = Playing {
            spec,
            fleet,
            parts: trace.iter().map(Vec::as_slice).chain([&[][..]]).take(count).collect(),
            network: self.network.clone(),
            crafts: &mut self.crafts,
            lives: &mut self.lives,
            out: &mut self.out,
            processes: endpoints
                .map(|endpoint| Process { endpoint: Some(endpoint), is_stopped: false })
                .collect(),
            started,
            due: Due::default(),
            waiting: BTreeSet::new(),
            events: faults::events(&conditions.faults, started),
            dead: Vec::new(),
        };
        let given_up =
            conditions.rest_ns.map(|rest_ns| started.plus(open.duration_ns).plus(rest_ns));
        let played = playing.begin().and_then(|()| playing.run(given_up));
        let Playing { processes, dead, .. } = playing;
        let restored = (0..).map(CraftId).zip(processes).map(|(id, process)| {
            process.endpoint.unwrap_or_else(|| self.network.endpoint(id, self.lives[id.index()]))
        });
        self.endpoints = restored.collect();
        let is_quiet = played?;
        let duration_ns = self.network.now().since(started);
        let links = self.network.link_counts();
        Ok(SimulatedOpen { reports: self.reports(count), is_quiet, dead, duration_ns, links })
    }

    /// What a fact is on the board of `craft` after [`Self::play_open`].
    #[must_use]
    pub fn fact(&self, craft: CraftId, fact: FactId) -> Option<FactState> {
        self.crafts[craft.index()].open_board().map(|board| board.state(fact))
    }
}

impl Playing<'_> {
    fn begin(&mut self) -> Result<(), SimulationError> {
        for (index, part) in self.parts.iter().enumerate() {
            let craft = &mut self.crafts[index];
            craft.begin_epoch(self.spec, self.fleet);
            craft.go(self.started, part);
            if let Some(endpoint) = &mut self.processes[index].endpoint {
                endpoint.open_ports(&craft.peers(self.fleet))?;
                endpoint.take_losses();
            }
            self.due.set(index, craft.next_due(part));
        }
        Ok(())
    }

    /// Plays until nothing is left, which it says, or until `given_up`.
    fn run(&mut self, given_up: Option<Nanos>) -> Result<bool, SimulationError> {
        loop {
            let event = self.events.first().map(|&(at, ..)| at);
            let arrival = self.network.next_due();
            let due = self.due.first();
            let times = [event, due.map(|(at, _)| at), arrival];
            let Some(next) = times.into_iter().flatten().min() else {
                if self.waiting.is_empty() {
                    return Ok(true);
                }
                let waited = self.waiting.len();
                self.flush()?;
                if self.network.next_due().is_none() && self.waiting.len() == waited {
                    return Ok(false);
                }
                continue;
            };
            if given_up.is_some_and(|given_up| next > given_up) {
                return Ok(false);
            }
            self.network.advance_to(next);
            if event == Some(next) {
                self.happen()?;
            } else if let Some((_, index)) = due.filter(|&(at, _)| at == next) {
                let now = self.network.now();
                self.crafts[index].arrive(now);
                self.crafts[index].play_due(now, self.parts[index], self.fleet, self.out);
                self.publish(index)?;
            } else if let Some(receiver) = self.network.deliver_next() {
                self.take(receiver.index())?;
            }
            self.flush()?;
        }
    }

    /// Whether process `index` does anything now.
    fn runs(&self, index: usize) -> bool {
        let process = &self.processes[index];
        process.endpoint.is_some() && !process.is_stopped
    }

    /// Lets process `index` take what it has been sent, if it runs.
    fn take(&mut self, index: usize) -> Result<(), SimulationError> {
        if !self.runs(index) {
            return Ok(());
        }
        let now = self.network.now();
        let (craft, out, fleet) = (&mut self.crafts[index], &mut *self.out, self.fleet);
        let Some(endpoint) = &mut self.processes[index].endpoint else { return Ok(()) };
        craft.arrive(now);
        endpoint.drain(&mut |_, header, payload| {
            if let (Some(class), Some(kind)) = (header.class(), header.kind()) {
                // A refusal is counted by the craft and changes nothing.
                let _refusal = craft.receive(class, kind, header, payload, fleet, out);
            }
        })?;
        craft.stamp_applied(now);
        self.publish(index)
    }

    /// Publishes what the step of process `index` planned, and notes when it is due next.
    fn publish(&mut self, index: usize) -> Result<(), SimulationError> {
        let (network, craft) = (&self.network, &mut self.crafts[index]);
        let Some(endpoint) = &mut self.processes[index].endpoint else { return Ok(()) };
        let mut clock = || network.now();
        dispatch_stamped(endpoint, &mut clock, self.out, craft)?;
        if endpoint.flush()? > 0 {
            self.waiting.insert(index);
        }
        self.note_due(index);
        Ok(())
    }

    fn note_due(&mut self, index: usize) {
        let at = self.crafts[index].next_due(self.parts[index]).filter(|_| self.runs(index));
        self.due.set(index, at);
    }

    /// Tries again what waits in outboxes.
    fn flush(&mut self) -> Result<(), SimulationError> {
        for index in std::mem::take(&mut self.waiting) {
            let is_left = match &mut self.processes[index] {
                Process { endpoint: Some(endpoint), is_stopped: false } => endpoint.flush()? > 0,
                process => process.endpoint.is_some(),
            };
            if is_left {
                self.waiting.insert(index);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
