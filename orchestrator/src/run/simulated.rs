//! The simulator as what plays a run: trials and intervals of open mode on a virtual clock.
//!
//! Trials of a block are played by one fleet, one after the other. Every interval has a fresh fleet, whose
//! clock begins at 0: what is played before it changes nothing in it. Not here: the simulator (the agent).

use super::backend::{Backend, PlayError, Played, PlayedOpen};
use super::inflict::{Infliction, When};
use super::open_play::grace_ns;
use crate::launch::craft_process::HowEnded;
use crate::supervision::restart::{RestartPolicy, Restarts};
use crate::supervision::signals::Signals;
use crate::supervision::watch::CraftEnded;
use agent::simulation::{Befalls, Conditions, ProcessFault, Simulation};
use rustix::process::Signal;
use shared_types::ids::{CraftId, Incarnation};
use shared_types::knowledge::FleetNetwork;
use shared_types::time::Nanos;
use shared_types::trace::TraceRecord;
use shared_types::transport::clock;
use shared_types::transport::link::StatedLink;
use shared_types::transport::memory::MemoryOptions;
use shared_types::wire::{EpochSpec, LinkSpec};

/// How many times as long as a real fleet a simulated one may be restless: nobody waits for virtual time, and
/// over links that lose three of four samples whoever asks in vain asks less and less often.
const GRACE_FACTOR: u64 = 20;

/// A simulated fleet that ends when it is asked to.
#[derive(Debug)]
pub(super) struct SimulatedFleet<'a> {
    crafts: u32,
    seed: u64,
    links: Option<LinkSpec>,
    /// How crafts that die are followed by successors.
    restart: Option<RestartPolicy>,
    /// What befalls processes in the next interval.
    faults: Vec<Infliction>,
    /// What plays trials.
    simulation: Simulation,
    /// Who may ask for an end.
    signals: &'a mut Signals,
    /// When the run must be over.
    run_ends: Option<Nanos>,
}

impl<'a> SimulatedFleet<'a> {
    /// A fleet of so many crafts of this seed, with these links.
    #[must_use]
    pub(super) fn new(
        (crafts, seed): (u32, u64),
        links: Option<LinkSpec>,
        restart: Option<RestartPolicy>,
        signals: &'a mut Signals,
        run_ends: Option<Nanos>,
    ) -> Self {
        let simulation = fresh(crafts, seed, links.as_ref());
        let faults = Vec::new();
        Self { crafts, seed, links, restart, faults, simulation, signals, run_ends }
    }

    /// Whether the run must end.
    fn look_around(&mut self) -> Result<(), PlayError> {
        match self.signals.poll() {
            Ok(Some(request)) => return Err(PlayError::Stopped(request)),
            Ok(None) => {}
            Err(error) => return Err(PlayError::Failed(error.to_string())),
        }
        if self.run_ends.is_some_and(|ends| clock::now() >= ends) {
            return Err(PlayError::TimeLimit);
        }
        Ok(())
    }

    /// What befalls processes in an interval of its own. The budget of restarts is each interval's, and the
    /// interval is lost with whoever is not restarted.
    fn befalling(&self) -> Result<Vec<ProcessFault>, PlayError> {
        let mut restarts = self.restart.map(Restarts::new);
        let mut stated: Vec<(u64, &Infliction)> = self
            .faults
            .iter()
            .filter_map(|fault| match fault.at {
                When::After(at_ns) => Some((at_ns, fault)),
                When::Turn(_) => None,
            })
            .collect();
        stated.sort_by_key(|&(at_ns, fault)| (at_ns, fault.craft));
        let mut faults = Vec::new();
        for (at_ns, &Infliction { craft, stopped_ns, .. }) in stated {
            let what = match stopped_ns {
                Some(for_ns) => Befalls::Stop { for_ns },
                None => {
                    let pause = restarts.as_mut().and_then(|all| all.take(craft, Nanos(at_ns)));
                    let lost = || PlayError::Lost(vec![killed(craft, Incarnation(0))]);
                    Befalls::Kill { pause_ns: pause.ok_or_else(lost)? }
                }
            };
            faults.push(ProcessFault { craft, at_ns, what });
        }
        Ok(faults)
    }
}

fn fresh(crafts: u32, seed: u64, links: Option<&LinkSpec>) -> Simulation {
    let simulation = Simulation::new(crafts, MemoryOptions { seed, ..MemoryOptions::default() });
    if let Some(links) = links {
        simulation.network().set_link(StatedLink::new(links.clone(), seed));
    }
    simulation
}

/// A simulated process was ended on purpose.
fn killed(craft: CraftId, incarnation: Incarnation) -> CraftEnded {
    CraftEnded {
        craft,
        incarnation,
        how: HowEnded::Killed(Signal::KILL.as_raw()),
        said: String::new(),
    }
}

impl Backend for SimulatedFleet<'_> {
    fn play(&mut self, spec: &EpochSpec, network: &FleetNetwork) -> Result<Played, PlayError> {
        self.look_around()?;
        Ok(self.simulation.play(spec, &network.view())?.into())
    }

    fn play_open(
        &mut self,
        spec: &EpochSpec,
        network: &FleetNetwork,
    ) -> Result<PlayedOpen, PlayError> {
        self.look_around()?;
        let fleet = network.view();
        let trace: Vec<Vec<TraceRecord>> = fleet.trace.iter().map(|part| part.to_vec()).collect();
        let rest_ns = Some(grace_ns(spec).saturating_mul(GRACE_FACTOR));
        let conditions = Conditions { faults: self.befalling()?, rest_ns };
        let mut simulation = fresh(self.crafts, self.seed, self.links.as_ref());
        let played = simulation.play_open_under(spec, &fleet, &trace, &conditions)?;
        Ok(PlayedOpen {
            reports: played.reports,
            is_quiet: played.is_quiet,
            dead: played.dead.into_iter().map(|(craft, life)| killed(craft, life)).collect(),
            links: played.links,
            virtual_ns: Some(played.duration_ns),
            ..PlayedOpen::default()
        })
    }

    fn inflict(&mut self, faults: Vec<Infliction>) {
        self.faults = faults;
    }

    fn ready_ns(&self) -> Option<u64> {
        None
    }
}
