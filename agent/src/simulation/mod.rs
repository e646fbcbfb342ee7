//! Many crafts in one process, over the memory network and its virtual clock.
//!
//! The same core and the same referee as in a real fleet; what differs is who carries the samples.
//! The order in which commands and samples arrive is drawn from the seed, so that a dependence on
//! arrival order shows as a difference between seeds of delivery. Not here: counts of processes, CPU
//! time, memory (they are 0 in a simulated report).

pub mod campaign;
mod open;
#[cfg(test)]
mod tests;

pub use open::{Befalls, Conditions, ProcessFault, SimulatedOpen};

use crate::craft::dispatch::dispatch;
use crate::craft::{Craft, Outbox};
use crate::lockstep::{LedgerError, Outcome, Referee};
use crate::replication::Strategy;
use shared_types::ids::{CraftId, Firing, Turn};
use shared_types::knowledge::FleetView;
use shared_types::rng::{Purpose, Stream};
use shared_types::transport::link::LinkCounts;
use shared_types::transport::memory::{MemoryEndpoint, MemoryNetwork, MemoryOptions};
use shared_types::transport::{Endpoint, SendError};
use shared_types::wire::{EpochSpec, StrategyKind, TrialReport, TurnCommand};

/// What a simulated trial yields.
#[derive(Clone, Debug)]
pub struct SimulatedTrial {
    /// How it ended.
    pub outcome: Outcome,
    /// Turns run.
    pub turns: u32,
    /// Digest over (turn, craft, firing).
    pub path_digest: u64,
    /// What was fired, by turn and craft.
    pub path: Vec<(Turn, CraftId, Firing)>,
    /// One report per process, the centre last.
    pub reports: Vec<TrialReport>,
    /// Virtual time that passed, ns.
    pub duration_ns: u64,
    /// What the links did.
    pub links: LinkCounts,
}

/// Why a trial could not be played to its end.
#[derive(Debug, thiserror::Error)]
pub enum SimulationError {
    /// Nothing is under way any more and the turn is not balanced.
    #[error("trial {trial} stands still: {standing}")]
    Unbalanced {
        /// The trial.
        trial: u32,
        /// Turns opened until then.
        turns: u32,
        /// The ledger in words.
        standing: String,
        /// What every process counted until then.
        reports: Vec<TrialReport>,
    },
    /// A trace was given to a strategy that plays none.
    #[error(
        "`{0}` plays no traces: in open mode every request to the centre awaits its reply; take \
         `central` or `central-batched`"
    )]
    NotOpen(StrategyKind),
    /// A craft reported what does not fit.
    #[error(transparent)]
    Ledger(#[from] LedgerError),
    /// The memory network refused a sample.
    #[error(transparent)]
    Transport(#[from] SendError),
}

/// A fleet in one process. Plays one trial after the other and keeps its memory between them.
#[derive(Debug)]
pub struct Simulation {
    network: MemoryNetwork,
    endpoints: Vec<MemoryEndpoint>,
    crafts: Vec<Craft>,
    /// Which life each process is in.
    lives: Vec<u32>,
    out: Outbox,
    order: Vec<usize>,
}

impl Simulation {
    /// A fleet of `crafts` crafts and a centre.
    #[must_use]
    pub fn new(crafts: u32, options: MemoryOptions) -> Self {
        let network = MemoryNetwork::new(crafts + 1, options);
        let ids = || (0..=crafts).map(CraftId);
        Self {
            endpoints: ids().map(|craft| network.endpoint(craft, 0)).collect(),
            crafts: ids().map(Craft::new).collect(),
            lives: ids().map(|_| 0).collect(),
            network,
            out: Outbox::default(),
            order: Vec::new(),
        }
    }

    /// The network between the crafts, for faults and for looking at it.
    #[must_use]
    pub const fn network(&self) -> &MemoryNetwork {
        &self.network
    }

    /// Plays one trial.
    ///
    /// # Errors
    /// If the ledger cannot be balanced or the network refuses a sample.
    pub fn play(
        &mut self,
        spec: &EpochSpec,
        fleet: &FleetView<'_>,
    ) -> Result<SimulatedTrial, SimulationError> {
        self.play_with(spec, fleet, |_| None)
    }

    /// Plays one trial in which some crafts replicate with another strategy than the spec says: how
    /// tests plant mutants.
    ///
    /// # Errors
    /// As [`Self::play`].
    pub fn play_with(
        &mut self,
        spec: &EpochSpec,
        fleet: &FleetView<'_>,
        mut mutant: impl FnMut(CraftId) -> Option<Box<dyn Strategy>>,
    ) -> Result<SimulatedTrial, SimulationError> {
        let processes = fleet.boards.len() + usize::from(spec.strategy.has_centre());
        self.network.reseed(spec.seed, spec.trial);
        let started = self.network.now();
        let pairs = self.crafts.iter_mut().zip(&mut self.endpoints).take(processes);
        for (id, (craft, endpoint)) in (0..).map(CraftId).zip(pairs) {
            craft.begin_epoch(spec, fleet);
            if let Some(strategy) = mutant(id) {
                craft.plant(strategy);
            }
            endpoint.open_ports(&craft.peers(fleet))?;
            endpoint.take_losses();
        }
        let mut referee = Referee::new(spec, fleet.craft_count());
        let mut draws = Stream::new(spec.seed, spec.trial, Purpose::Delivery, 0);
        let mut command = referee.start();
        let mut finished = 0;
        'trial: loop {
            finished += self.command(&command, processes, fleet, &mut referee, &mut draws)?;
            command = loop {
                finished += self.deliver(fleet, &mut referee)?;
                self.settle(processes, &mut referee)?;
                match referee.advance() {
                    Some(next) => break next,
                    None if referee.outcome().is_some() && finished == processes => break 'trial,
                    None => {}
                }
                // Whatever the turn waits for was lost: time passes until somebody asks for it.
                let Some(repaired) = self.repair(processes, fleet, &mut referee)? else {
                    return Err(SimulationError::Unbalanced {
                        trial: spec.trial,
                        turns: referee.turns_opened(),
                        standing: referee.standing(),
                        reports: self.reports(processes),
                    });
                };
                finished += repaired;
            };
        }
        Ok(SimulatedTrial {
            outcome: referee.outcome().expect("invariant: the loop ends with the trial"),
            turns: referee.turns(),
            path_digest: referee.path_digest(),
            path: referee.path().to_vec(),
            reports: self.reports(processes),
            duration_ns: self.network.now().since(started),
            links: self.network.link_counts(),
        })
    }

    /// Gives a command to every process, in an order drawn from the seed; returns how many have
    /// finished their part of the epoch.
    fn command(
        &mut self,
        command: &TurnCommand,
        processes: usize,
        fleet: &FleetView<'_>,
        referee: &mut Referee,
        draws: &mut Stream,
    ) -> Result<usize, SimulationError> {
        let mut order = std::mem::take(&mut self.order);
        order.clear();
        order.extend(0..processes);
        draws.shuffle(&mut order);
        let mut finished = 0;
        for &index in &order {
            let now = self.network.now();
            self.crafts[index].arrive(now);
            self.crafts[index].command(now, command, fleet, &mut self.out);
            finished += self.publish(index, referee)?;
            self.crafts[index].upkeep(fleet, &mut || now);
        }
        self.order = order;
        Ok(finished)
    }

    /// Delivers until nothing is under way.
    fn deliver(
        &mut self,
        fleet: &FleetView<'_>,
        referee: &mut Referee,
    ) -> Result<usize, SimulationError> {
        let mut finished = 0;
        while let Some(receiver) = self.next_receiver()? {
            let index = receiver.index();
            let (craft, out) = (&mut self.crafts[index], &mut self.out);
            craft.arrive(self.network.now());
            self.endpoints[index].drain(&mut |_, header, payload| {
                if let (Some(class), Some(kind)) = (header.class(), header.kind()) {
                    // A refusal is counted by the craft and changes nothing.
                    let _refusal = craft.receive(class, kind, header, payload, fleet, out);
                }
            })?;
            finished += self.publish(index, referee)?;
        }
        Ok(finished)
    }

    /// Delivers the next sample; what a full inbox could not take is sent once nothing else is under way.
    fn next_receiver(&mut self) -> Result<Option<CraftId>, SendError> {
        let receiver = self.network.deliver_next();
        if receiver.is_some() || self.network.is_quiet() {
            return Ok(receiver);
        }
        for endpoint in &mut self.endpoints {
            endpoint.flush()?;
        }
        Ok(self.network.deliver_next())
    }

    /// Lets time pass to the first process that asks again, and has it ask; `None` if nobody will.
    fn repair(
        &mut self,
        processes: usize,
        fleet: &FleetView<'_>,
        referee: &mut Referee,
    ) -> Result<Option<usize>, SimulationError> {
        let crafts = self.crafts.iter().take(processes).enumerate();
        let due = crafts.filter_map(|(index, craft)| Some((craft.next_recovery()?, index))).min();
        let Some((at, index)) = due else { return Ok(None) };
        self.network.advance_to(at);
        let now = self.network.now();
        self.crafts[index].arrive(now);
        self.crafts[index].tend(now, fleet, &mut self.out);
        self.publish(index, referee).map(Some)
    }

    /// Puts what the processes hold back into the ledger: nothing is under way any more.
    fn settle(&mut self, processes: usize, referee: &mut Referee) -> Result<(), LedgerError> {
        for (index, craft) in self.crafts.iter_mut().take(processes).enumerate() {
            craft.settle(&mut self.out);
            for report in self.out.reports.drain(..) {
                referee.record(CraftId::from_index(index), &report)?;
            }
        }
        Ok(())
    }

    /// Publishes what the step of process `index` planned and puts its reports into the ledger.
    fn publish(&mut self, index: usize, referee: &mut Referee) -> Result<usize, SimulationError> {
        let craft = &mut self.crafts[index];
        let now = self.network.now();
        dispatch(&mut self.endpoints[index], now, &mut self.out, craft)?;
        for report in self.out.reports.drain(..) {
            referee.record(CraftId::from_index(index), &report)?;
        }
        Ok(usize::from(std::mem::take(&mut self.out.is_finished)))
    }

    fn reports(&mut self, processes: usize) -> Vec<TrialReport> {
        let pairs = self.crafts.iter_mut().zip(&mut self.endpoints).take(processes);
        pairs
            .map(|(craft, endpoint)| {
                craft.counting_mut().counters.losses += endpoint.take_losses();
                craft.report()
            })
            .collect()
    }
}
