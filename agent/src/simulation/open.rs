//! Plays a trace in open mode on the virtual clock.
//!
//! Records are made at the very time at which they are due, samples arrive as the network decides, and
//! what an inbox could not take is tried again after every step. Not here: CPU time, which a virtual
//! clock does not see, and the central strategies, which play no traces yet.

use super::{Simulation, SimulationError};
use crate::craft::dispatch::dispatch_stamped;
use shared_types::ids::{CraftId, FactId};
use shared_types::knowledge::{FactState, FleetView};
use shared_types::trace::TraceRecord;
use shared_types::transport::Endpoint;
use shared_types::wire::{EpochSpec, TrialReport};
use std::cmp::Reverse;
use std::collections::{BTreeSet, BinaryHeap};

/// What a simulated trial of open mode yields.
#[derive(Clone, Debug)]
pub struct SimulatedOpen {
    /// One report per craft; times are of the virtual clock.
    pub reports: Vec<TrialReport>,
    /// Virtual time that passed, ns.
    pub duration_ns: u64,
}

impl Simulation {
    /// Plays the trace `trace` (per craft its records) until nothing is due or under way.
    ///
    /// # Errors
    /// If the strategy is a central one, or the network refuses a sample.
    ///
    /// # Panics
    /// If the trace is one of another fleet, or `spec` is not one of open mode.
    pub fn play_open(
        &mut self,
        spec: &EpochSpec,
        fleet: &FleetView<'_>,
        trace: &[Vec<TraceRecord>],
    ) -> Result<SimulatedOpen, SimulationError> {
        if spec.strategy.has_centre() {
            return Err(SimulationError::NotOpen(spec.strategy));
        }
        let crafts = fleet.boards.len();
        assert!(spec.open.is_some(), "invariant: the caller plays open mode");
        assert_eq!(trace.len(), crafts, "invariant: a trace has a part for each craft");
        self.network.reseed(spec.seed, spec.trial);
        let started = self.network.now();
        let mut due = BinaryHeap::new();
        let mut waiting = BTreeSet::new();
        let pairs = self.crafts.iter_mut().zip(&mut self.endpoints);
        for (index, ((craft, endpoint), records)) in pairs.zip(trace).enumerate() {
            craft.begin_epoch(spec, fleet);
            craft.go(started, records);
            endpoint.open_ports(&craft.peers(fleet))?;
            endpoint.take_losses();
            due.extend(craft.next_due(records).map(|at| Reverse((at, index))));
        }
        loop {
            let arrival = self.network.next_due();
            match due.peek() {
                Some(&Reverse((at, index))) if arrival.is_none_or(|arrival| at <= arrival) => {
                    due.pop();
                    self.network.advance_to(at);
                    let out = &mut self.out;
                    self.crafts[index].play_due(at, &trace[index], fleet, out);
                    let next = self.crafts[index].next_due(&trace[index]);
                    due.extend(next.map(|at| Reverse((at, index))));
                    self.publish_open(index, &mut waiting)?;
                }
                _ => match self.network.deliver_next() {
                    Some(receiver) => self.take_open(receiver.index(), fleet, &mut waiting)?,
                    None if waiting.is_empty() => break,
                    None => {}
                },
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
        Ok(SimulatedOpen { reports: self.reports(crafts), duration_ns })
    }

    /// What a fact is on the board of `craft` after [`Self::play_open`].
    #[must_use]
    pub fn fact(&self, craft: CraftId, fact: FactId) -> Option<FactState> {
        self.crafts[craft.index()].open_board().map(|board| board.state(fact))
    }

    fn take_open(
        &mut self,
        index: usize,
        fleet: &FleetView<'_>,
        waiting: &mut BTreeSet<usize>,
    ) -> Result<(), SimulationError> {
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
        self.publish_open(index, waiting)
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
