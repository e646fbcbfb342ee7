//! Plays a trace in open mode on the virtual clock.
//!
//! Records are made at the very time at which they are due, samples arrive as the network decides, and
//! what an inbox could not take is tried again after every step. Not here: CPU time, which a virtual
//! clock does not see.

use super::{Simulation, SimulationError};
use crate::craft::dispatch::dispatch_stamped;
use shared_types::ids::{CraftId, FactId};
use shared_types::knowledge::{FactState, FleetView};
use shared_types::time::Nanos;
use shared_types::trace::TraceRecord;
use shared_types::transport::Endpoint;
use shared_types::transport::link::LinkCounts;
use shared_types::wire::{EpochSpec, TrialReport};
use std::collections::{BTreeMap, BTreeSet};

/// What a simulated trial of open mode yields.
#[derive(Clone, Debug)]
pub struct SimulatedOpen {
    /// One report per process, the centre last; times are of the virtual clock.
    pub reports: Vec<TrialReport>,
    /// Virtual time that passed, ns.
    pub duration_ns: u64,
    /// What the links did.
    pub links: LinkCounts,
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
        if !spec.strategy.plays_traces() {
            return Err(SimulationError::NotOpen(spec.strategy));
        }
        assert!(spec.open.is_some(), "invariant: the caller plays open mode");
        assert_eq!(trace.len(), fleet.boards.len(), "invariant: each craft has a part of a trace");
        let processes = trace.len() + usize::from(spec.strategy.has_centre());
        let parts = || trace.iter().map(Vec::as_slice).chain([&[][..]]).take(processes);
        self.network.reseed(spec.seed, spec.trial);
        let started = self.network.now();
        let mut due = Due::default();
        let mut waiting = BTreeSet::new();
        let pairs = self.crafts.iter_mut().zip(&mut self.endpoints);
        for (index, ((craft, endpoint), part)) in pairs.zip(parts()).enumerate() {
            craft.begin_epoch(spec, fleet);
            craft.go(started, part);
            endpoint.open_ports(&craft.peers(fleet))?;
            endpoint.take_losses();
            due.set(index, craft.next_due(part));
        }
        let parts: Vec<&[TraceRecord]> = parts().collect();
        loop {
            let arrival = self.network.next_due();
            let at_work = match due.first() {
                Some((at, index)) if arrival.is_none_or(|arrival| at <= arrival) => {
                    self.network.advance_to(at);
                    self.crafts[index].play_due(at, parts[index], fleet, &mut self.out);
                    Some(index)
                }
                _ => match self.network.deliver_next() {
                    Some(receiver) => {
                        self.take_open(receiver.index(), fleet)?;
                        Some(receiver.index())
                    }
                    None if waiting.is_empty() => break,
                    None => None,
                },
            };
            if let Some(index) = at_work {
                self.publish_open(index, &mut waiting)?;
                due.set(index, self.crafts[index].next_due(parts[index]));
            }
            let mut still = BTreeSet::new();
            for index in std::mem::take(&mut waiting) {
                if self.endpoints[index].flush()? > 0 {
                    still.insert(index);
                }
            }
            waiting = still;
        }
        let duration_ns = self.network.now().since(started);
        let links = self.network.link_counts();
        Ok(SimulatedOpen { reports: self.reports(processes), duration_ns, links })
    }

    /// What a fact is on the board of `craft` after [`Self::play_open`].
    #[must_use]
    pub fn fact(&self, craft: CraftId, fact: FactId) -> Option<FactState> {
        self.crafts[craft.index()].open_board().map(|board| board.state(fact))
    }

    fn take_open(&mut self, index: usize, fleet: &FleetView<'_>) -> Result<(), SimulationError> {
        let now = self.network.now();
        let (craft, out) = (&mut self.crafts[index], &mut self.out);
        craft.arrive(now);
        self.endpoints[index].drain(&mut |_, header, payload| {
            if let (Some(class), Some(kind)) = (header.class(), header.kind()) {
                // A refusal is counted by the craft and changes nothing.
                let _refusal = craft.receive(class, kind, header, payload, fleet, out);
            }
        })?;
        craft.stamp_applied(now);
        Ok(())
    }

    fn publish_open(
        &mut self,
        index: usize,
        waiting: &mut BTreeSet<usize>,
    ) -> Result<(), SimulationError> {
        let (network, craft) = (&self.network, &mut self.crafts[index]);
        let mut clock = || network.now();
        dispatch_stamped(&mut self.endpoints[index], &mut clock, &mut self.out, craft)?;
        if self.endpoints[index].flush()? > 0 {
            waiting.insert(index);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
