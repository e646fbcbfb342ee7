//! What happens at times of its own: processes end, pause and come back, and others hear of it.

use super::fault::{Fault, What};
use super::laws::Violation;
use super::play::{Theatre, part};
use shared_types::ids::CraftId;
use shared_types::time::Nanos;
use shared_types::transport::Endpoint;
use shared_types::wire::MembershipChange;

/// How long others do not know that a process is gone or back, ns.
const NOTICE_NS: u64 = 300_000;

/// Something that happens at a time of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Event {
    Kill {
        craft: u32,
        returns_at: Option<Nanos>,
    },
    Return(u32),
    Pause(u32),
    Resume(u32),
    /// The fleet hears that `craft` is gone or back.
    Notice {
        craft: u32,
        incarnation: u32,
        is_up: bool,
    },
}

impl<E: Endpoint> Theatre<'_, E> {
    /// Puts what befalls processes among the events; the links see to the rest.
    pub(super) fn schedule_faults(&mut self) {
        let ends = |fault: &Fault| {
            (fault.lasts_ns != Fault::FOR_EVER).then(|| Nanos(fault.at_ns).plus(fault.lasts_ns))
        };
        for fault in &self.case.faults {
            let begins = Nanos(fault.at_ns);
            match fault.what {
                What::Kill(craft) => {
                    let returns_at = ends(fault);
                    self.schedule(begins, Event::Kill { craft: craft.0, returns_at });
                }
                What::Pause(craft) => {
                    self.schedule(begins, Event::Pause(craft.0));
                    self.schedule(begins.plus(fault.lasts_ns), Event::Resume(craft.0));
                }
                _ => {}
            }
        }
    }

    fn schedule(&mut self, at: Nanos, event: Event) {
        self.event_number += 1;
        self.events.insert((at, self.event_number, event));
    }

    /// Lets the next event happen; says which process did a step in it.
    pub(super) fn happen(&mut self) -> Result<Option<usize>, Violation> {
        let Some((at, _, event)) = self.events.pop_first() else { return Ok(None) };
        self.tell(at, |_| format!("{event:?}"));
        match event {
            Event::Kill { craft, returns_at } => {
                let index = craft as usize;
                if let Some(mut endpoint) = self.processes[index].endpoint.take() {
                    self.processes[index].losses += endpoint.take_losses();
                    self.count(index);
                    self.processes[index].was_killed = true;
                    self.processes[index].is_paused = false;
                    self.played.kills += 1;
                    let incarnation = self.processes[index].life;
                    let gone = Event::Notice { craft, incarnation, is_up: false };
                    self.schedule(at.plus(NOTICE_NS), gone);
                    if let Some(returns_at) = returns_at {
                        self.schedule(returns_at, Event::Return(craft));
                    }
                }
                Ok(None)
            }
            Event::Return(craft) => self.bring_back(at, craft).map(Some),
            Event::Pause(craft) => {
                self.processes[craft as usize].is_paused = true;
                Ok(None)
            }
            Event::Resume(craft) => {
                self.processes[craft as usize].is_paused = false;
                if self.runs(craft as usize) {
                    self.receive(craft as usize)?;
                }
                Ok(Some(craft as usize))
            }
            Event::Notice { craft, incarnation, is_up } => {
                let is_up = u32::from(is_up);
                let change = MembershipChange { craft, incarnation, is_up, reserved: 0 };
                for index in (0..self.processes.len()).filter(|&index| index != craft as usize) {
                    // A process that is paused reads of it when it goes on; here it knows at once.
                    if self.processes[index].endpoint.is_some() {
                        self.crafts[index].arrive(at);
                        self.crafts[index].member_changed(at, &change, &self.fleet);
                    }
                }
                Ok(None)
            }
        }
    }

    fn bring_back(&mut self, at: Nanos, craft: u32) -> Result<usize, Violation> {
        let index = craft as usize;
        if self.processes[index].endpoint.is_some() {
            return Ok(index);
        }
        self.lives += 1;
        let life = self.lives;
        self.laws.begin_life(CraftId(craft));
        let endpoint = self.open(index, life)?;
        // Who begins is told who is not there.
        for (other, process) in self.processes.iter().enumerate() {
            if process.endpoint.is_none() && other != index {
                let craft = CraftId::from_index(other).0;
                let incarnation = process.life;
                let change = MembershipChange { craft, incarnation, is_up: 0, reserved: 0 };
                self.crafts[index].member_changed(at, &change, &self.fleet);
            }
        }
        self.processes[index].endpoint = Some(endpoint);
        self.processes[index].life = life;
        self.crafts[index].join(at, Nanos(0), part(self.case, index));
        let back = Event::Notice { craft, incarnation: life, is_up: true };
        self.schedule(at.plus(NOTICE_NS), back);
        Ok(index)
    }
}
