//! One trial of a case in lockstep: commands, arrivals and what recovery has due, by time.

use super::arrival::take_in;
use super::laws::Violation;
use super::play::{board_line, failed};
use super::scene::MISSION_FACTS;
use super::turns::Turns;
use crate::craft::dispatch::dispatch;
use crate::lockstep::Referee;
use shared_types::ids::{CraftId, FactId};
use shared_types::time::Nanos;
use shared_types::transport::Endpoint;
use shared_types::wire::{Class, EpochSpec, TrialReport, TurnCommand};

/// A turn that takes longer than this, ns, does not come to its end.
const TURN_NS: u64 = 2_000_000_000;

impl<E: Endpoint> Turns<'_, E> {
    /// Plays the trial `spec`; `false` if it was given up because a process ended.
    pub(super) fn play_trial(&mut self, spec: &EpochSpec) -> Result<bool, Violation> {
        self.tell(|_| format!("trial {} begins", spec.trial));
        for (craft, process) in self.crafts.iter_mut().zip(&mut self.processes) {
            craft.begin_epoch(spec, &self.fleet);
            let Some(endpoint) = &mut process.endpoint else { continue };
            endpoint.open_ports(&craft.peers(&self.fleet)).map_err(failed)?;
            process.losses += endpoint.take_losses();
        }
        self.laws.begin_epoch();
        let mut referee = Referee::new(spec, self.fleet.craft_count());
        let first = referee.start();
        let mut finished = self.order(&first, &mut referee)?;
        while referee.outcome().is_none() || finished < self.processes.len() {
            if let Some(command) = referee.advance() {
                finished += self.order(&command, &mut referee)?;
                continue;
            }
            let Some(more) = self.step(spec, &mut referee)? else {
                self.give_up()?;
                return Ok(false);
            };
            finished += more;
        }
        self.clear_ways()?;
        let reports = self.reports();
        self.judge_trial(spec, &referee, &reports)?;
        self.played.trials += 1;
        Ok(true)
    }

    /// A process has ended: what is under way is of no use any more.
    fn give_up(&mut self) -> Result<(), Violation> {
        self.clear_ways()?;
        let _ends_with_the_trial = self.reports();
        self.played.given_up += 1;
        Ok(())
    }

    /// Gives a command to everybody, in an order that is drawn; says how many have finished.
    fn order(&mut self, command: &TurnCommand, referee: &mut Referee) -> Result<usize, Violation> {
        self.tell(|_| format!("{command:?}"));
        let mut order: Vec<usize> = (0..self.processes.len()).collect();
        self.draws.shuffle(&mut order);
        let mut finished = 0;
        for index in order {
            self.orders[index] = Some(*command);
            if self.runs(index) {
                finished += self.obey(index, referee)?;
            }
        }
        Ok(finished)
    }

    /// Has process `index` carry out the command that it was given.
    fn obey(&mut self, index: usize, referee: &mut Referee) -> Result<usize, Violation> {
        let Some(command) = self.orders[index].take() else { return Ok(0) };
        let now = self.network.now();
        self.crafts[index].arrive(now);
        self.crafts[index].command(now, &command, &self.fleet, &mut self.out);
        self.publish(index, referee)
    }

    /// Lets happen what comes next; says how many have finished in it, `None` if a process ended.
    fn step(
        &mut self,
        spec: &EpochSpec,
        referee: &mut Referee,
    ) -> Result<Option<usize>, Violation> {
        let event = self.events.first().map(|&(at, ..)| at);
        let arrival = self.network.next_due();
        let recovery = self.next_recovery();
        let stands = |referee: &Referee| {
            let standing = referee.standing();
            Violation::StandsStill { trial: spec.trial, standing }
        };
        let times = [event, arrival, recovery.map(|(at, _)| at)];
        let Some(next) = times.into_iter().flatten().min() else { return Err(stands(referee)) };
        if next.since(self.network.now()) > TURN_NS {
            return Err(stands(referee));
        }
        if event.is_some_and(|at| at <= next) {
            let (resumed, has_ended) = self.happen()?;
            let Some(index) = resumed.filter(|_| !has_ended) else {
                return Ok((!has_ended).then_some(0));
            };
            if !self.runs(index) {
                return Ok(Some(0));
            }
            let finished = self.obey(index, referee)?;
            self.arrive(index)?;
            return Ok(Some(finished + self.publish(index, referee)?));
        }
        if let Some((at, index)) = recovery.filter(|&(at, _)| at <= next) {
            self.network.advance_to(at);
            let now = self.network.now();
            self.crafts[index].arrive(now);
            self.crafts[index].tend(now, &self.fleet, &mut self.out);
            return self.publish(index, referee).map(Some);
        }
        let receiver = self.network.deliver_next().map(CraftId::index);
        let Some(index) = receiver.filter(|&index| self.runs(index)) else { return Ok(Some(0)) };
        self.arrive(index)?;
        self.publish(index, referee).map(Some)
    }

    fn next_recovery(&self) -> Option<(Nanos, usize)> {
        let now = self.network.now();
        let running = (0..self.crafts.len()).filter(|&index| self.runs(index));
        running.filter_map(|it| Some((self.crafts[it].next_recovery()?.max(now), it))).min()
    }

    /// Hands process `index` everything that has arrived.
    pub(super) fn arrive(&mut self, index: usize) -> Result<(), Violation> {
        let (now, is_witnessed) = (self.network.now(), self.is_witnessed());
        let Self { crafts, processes, fleet, laws, out, .. } = self;
        let craft = &mut crafts[index];
        craft.arrive(now);
        let Some(endpoint) = &mut processes[index].endpoint else { return Ok(()) };
        let (lines, verdict) = take_in(endpoint, craft, fleet, laws, out, is_witnessed);
        for line in lines {
            self.tell(|_| line);
        }
        verdict
    }

    /// Sends what the step of process `index` planned, puts its reports into the ledger, and holds its
    /// board against the laws; says whether it has finished.
    fn publish(&mut self, index: usize, referee: &mut Referee) -> Result<usize, Violation> {
        let now = self.network.now();
        let Self { crafts, processes, out, .. } = self;
        let process = &mut processes[index];
        if let Some(endpoint) = &mut process.endpoint {
            dispatch(endpoint, now, out, &mut crafts[index]).map_err(failed)?;
            process.waits = endpoint.flush().map_err(failed)? > 0;
        }
        crafts[index].settle(out);
        for report in out.reports.drain(..) {
            referee.record(CraftId::from_index(index), &report)?;
        }
        let finished = usize::from(std::mem::take(&mut out.is_finished));
        self.look(index)?;
        Ok(finished)
    }

    fn look(&mut self, index: usize) -> Result<(), Violation> {
        self.played.steps += 1;
        if let Some(header) = self.seen.borrow().over_budget {
            let (source_craft, number) = (CraftId(header.source), header.sequence);
            return Err(Violation::OverBudget { source_craft, number });
        }
        let craft = CraftId::from_index(index);
        let Some(board) = self.crafts[index].board() else { return Ok(()) };
        for fact in (0..MISSION_FACTS).map(FactId) {
            let state = board.state(fact);
            if state.version.writer == craft && state.version.count > 0 {
                self.laws.write(craft, fact, state)?;
            }
            if state.version.count > 0 {
                self.laws.look(craft, fact, state)?;
            }
        }
        self.tell(|turns| {
            let board = turns.crafts[index].board();
            let facts = (0..MISSION_FACTS).map(FactId);
            board_line(craft, board.into_iter().flat_map(|it| facts.clone().map(|f| it.state(f))))
        });
        Ok(())
    }

    /// What every process counted in the trial.
    fn reports(&mut self) -> Vec<TrialReport> {
        let Self { crafts, processes, played, .. } = self;
        let pairs = crafts.iter_mut().zip(processes);
        pairs
            .map(|(craft, process)| {
                if let Some(endpoint) = &mut process.endpoint {
                    let losses = endpoint.take_losses();
                    process.losses += losses;
                    craft.counting_mut().counters.losses += losses;
                    played.count(&craft.counters());
                }
                craft.report()
            })
            .collect()
    }

    /// Holds a trial that came to its end against the same trial without faults: the same path, the same
    /// boards, the same samples of strategy and centre; and nothing is lost unless somebody died.
    fn judge_trial(
        &mut self,
        spec: &EpochSpec,
        referee: &Referee,
        reports: &[TrialReport],
    ) -> Result<(), Violation> {
        let trial = spec.trial;
        let plain = EpochSpec { recovery: None, ..spec.clone() };
        let faultless = self.reference.play(&plain, &self.fleet);
        let faultless = faultless.map_err(|error| Violation::Network(error.to_string()))?;
        let astray = |what: String| Err(Violation::WentAstray { trial, what });
        if referee.outcome() != Some(faultless.outcome) || referee.path() != faultless.path {
            return astray(format!("{} turns, {:?}", referee.turns(), referee.outcome()));
        }
        let is_whole = self.is_whole();
        for (report, other) in reports.iter().zip(&faultless.reports) {
            let craft = report.craft;
            if report.board_digests != other.board_digests {
                return astray(format!("the boards that {craft} holds differ"));
            }
            for class in [Class::Replication, Class::Reply] {
                let traffic = |report: &TrialReport| report.counters.traffic[class as usize];
                let (one, other) = (traffic(report), traffic(other));
                if one != other {
                    return astray(format!("{craft} counted {one:?} of {class:?}, not {other:?}"));
                }
            }
            let losses = report.counters.losses;
            if is_whole && losses.is_partial() {
                return astray(format!("{craft} lost something although nobody died: {losses:?}"));
            }
        }
        Ok(())
    }
}
