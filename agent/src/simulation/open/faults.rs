//! What befalls processes of a simulated interval: they end, stop and come back, and others hear of it.
//!
//! As in a real interval nobody gives anything up: others are told who is gone and play on, a later life
//! joins, asks for what it missed and plays from then on (docs/decisions/0018).

use super::{Playing, SimulationError};
use shared_types::ids::{CraftId, Incarnation};
use shared_types::time::Nanos;
use shared_types::transport::Endpoint;
use shared_types::wire::MembershipChange;
use std::collections::BTreeSet;

/// How long others do not know that a process is gone or back, ns of the virtual clock.
const NOTICE_NS: u64 = 300_000;

/// Something that befalls one process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProcessFault {
    /// Whom; the centre is craft N.
    pub craft: CraftId,
    /// When, ns from the start of the interval.
    pub at_ns: u64,
    /// What.
    pub what: Befalls,
}

/// What befalls a process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Befalls {
    /// It ends without a word. Once that is known, and this pause is over, its next life begins.
    Kill {
        /// The pause, ns.
        pause_ns: u64,
    },
    /// It does nothing for so long, and its inboxes fill.
    Stop {
        /// How long, ns.
        for_ns: u64,
    },
}

impl ProcessFault {
    /// Whether the process ends.
    #[must_use]
    pub const fn is_death(&self) -> bool {
        matches!(self.what, Befalls::Kill { .. })
    }
}

/// Something that happens at a time of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Event {
    Kill {
        craft: CraftId,
        pause_ns: u64,
    },
    Return(CraftId),
    Stop {
        craft: CraftId,
        for_ns: u64,
    },
    Continue {
        craft: CraftId,
        life: u32,
    },
    /// The fleet hears that a life of `craft` has ended or begun.
    Notice {
        craft: CraftId,
        incarnation: u32,
        is_up: bool,
    },
}

/// The first events of `faults` in an interval that begins at `started`.
pub(super) fn events(faults: &[ProcessFault], started: Nanos) -> BTreeSet<(Nanos, usize, Event)> {
    let first = |(number, fault): (usize, &ProcessFault)| {
        let craft = fault.craft;
        let event = match fault.what {
            Befalls::Kill { pause_ns } => Event::Kill { craft, pause_ns },
            Befalls::Stop { for_ns } => Event::Stop { craft, for_ns },
        };
        (started.plus(fault.at_ns), number, event)
    };
    faults.iter().enumerate().map(first).collect()
}

impl Playing<'_> {
    fn schedule(&mut self, at: Nanos, event: Event) {
        let number = self.events.iter().map(|&(_, number, _)| number + 1).max().unwrap_or(0);
        self.events.insert((at, number, event));
    }

    /// Lets the next event happen.
    pub(super) fn happen(&mut self) -> Result<(), SimulationError> {
        let Some((at, _, event)) = self.events.pop_first() else { return Ok(()) };
        match event {
            Event::Kill { craft, pause_ns } => self.end(at, craft, pause_ns),
            Event::Return(craft) => return self.bring_back(at, craft),
            Event::Stop { craft, for_ns } => {
                let index = craft.index();
                if self.runs(index) {
                    self.processes[index].is_stopped = true;
                    let life = self.lives[index];
                    self.schedule(at.plus(for_ns), Event::Continue { craft, life });
                    self.note_due(index);
                }
            }
            Event::Continue { craft, life } => {
                let index = craft.index();
                if self.lives[index] == life && self.processes[index].is_stopped {
                    self.processes[index].is_stopped = false;
                    self.take(index)?;
                    self.note_due(index);
                }
            }
            Event::Notice { craft, incarnation, is_up } => {
                let change = MembershipChange {
                    craft: craft.0,
                    incarnation,
                    is_up: u32::from(is_up),
                    reserved: 0,
                };
                for index in (0..self.parts.len()).filter(|&index| index != craft.index()) {
                    if self.processes[index].endpoint.is_some() {
                        self.crafts[index].arrive(at);
                        self.crafts[index].member_changed(at, &change, self.fleet);
                        self.note_due(index);
                    }
                }
            }
        }
        Ok(())
    }

    fn end(&mut self, at: Nanos, craft: CraftId, pause_ns: u64) {
        let index = craft.index();
        // Whoever is gone already comes back as planned then.
        if self.processes[index].endpoint.take().is_none() {
            return;
        }
        self.processes[index].is_stopped = false;
        self.waiting.remove(&index);
        self.note_due(index);
        let incarnation = self.lives[index];
        self.dead.push((craft, Incarnation(incarnation)));
        let known = at.plus(NOTICE_NS);
        self.schedule(known, Event::Notice { craft, incarnation, is_up: false });
        self.schedule(known.plus(pause_ns), Event::Return(craft));
    }

    fn bring_back(&mut self, at: Nanos, craft: CraftId) -> Result<(), SimulationError> {
        let index = craft.index();
        let life = self.lives.iter().max().map_or(1, |latest| latest + 1);
        self.lives[index] = life;
        let own = &mut self.crafts[index];
        own.begin_life(life);
        own.begin_epoch(self.spec, self.fleet);
        let mut endpoint = self.network.endpoint(craft, life);
        endpoint.open_ports(&own.peers(self.fleet))?;
        // Who begins is told who is not there.
        for (other, process) in self.processes.iter().enumerate().take(self.parts.len()) {
            if process.endpoint.is_none() && other != index {
                let gone = CraftId::from_index(other).0;
                let incarnation = self.lives[other];
                let change = MembershipChange { craft: gone, incarnation, is_up: 0, reserved: 0 };
                own.member_changed(at, &change, self.fleet);
            }
        }
        own.join(at, self.started, self.parts[index]);
        self.processes[index].endpoint = Some(endpoint);
        self.note_due(index);
        let back = Event::Notice { craft, incarnation: life, is_up: true };
        self.schedule(at.plus(NOTICE_NS), back);
        Ok(())
    }
}
