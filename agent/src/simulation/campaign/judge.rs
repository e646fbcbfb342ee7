//! Holds a fleet that has come to rest against the laws: boards, numbers, what was given up.

use super::Played;
use super::laws::{Laws, Violation};
use super::play::{Process, Theatre};
use crate::craft::Craft;
use shared_types::ids::{CraftId, FactId};
use shared_types::knowledge::Value;
use shared_types::limits::RING_SAMPLES;
use shared_types::trace::TraceRecord;
use shared_types::transport::{Destination, Endpoint};
use shared_types::wire::{Class, StrategyKind};

/// Judges the fleet of `theatre`, which has played to its end.
pub(super) fn judge<E: Endpoint>(theatre: &mut Theatre<'_, E>) -> Result<Played, Violation> {
    theatre.judge()
}

impl<E: Endpoint> Theatre<'_, E> {
    fn judge(&mut self) -> Result<Played, Violation> {
        for index in 0..self.processes.len() {
            if self.processes[index].endpoint.is_some() {
                self.count(index);
                self.judge_process(CraftId::from_index(index))?;
            }
        }
        self.judge_numbers()?;
        self.judge_boards()?;
        self.played.lost = self.seen.borrow().lost;
        self.played.duration_ns = self.network.now().0;
        Ok(self.played)
    }

    fn judge_process(&self, craft: CraftId) -> Result<(), Violation> {
        if !self.crafts[craft.index()].is_caught_up() {
            return Err(Violation::NotCaughtUp { craft });
        }
        let nobody_died = self.processes.iter().all(|process| !process.was_killed);
        // Beyond the ring a sample cannot be repeated.
        let sent = |craft: &Craft| {
            let [replication, reply] = [Class::Replication, Class::Reply]
                .map(|class| craft.counters().traffic[class as usize].transmissions);
            replication + reply
        };
        let is_kept = self.crafts.iter().all(|craft| sent(craft) <= RING_SAMPLES as u64);
        let recovered = self.crafts[craft.index()].counters().recovered;
        let count = recovered.given_up + recovered.unconfirmed + recovered.states_missed;
        if nobody_died && is_kept && count > 0 {
            return Err(Violation::GivenUp { craft, count });
        }
        Ok(())
    }

    fn judge_numbers(&mut self) -> Result<(), Violation> {
        judge_numbers(&mut self.processes, &self.laws, self.spec.strategy)
    }

    /// All living boards that share a fact hold the same of it, and what the trace says where one craft
    /// that never died writes it alone.
    fn judge_boards(&self) -> Result<(), Violation> {
        for (fact, sharers) in (0..).map(FactId).zip(&self.case.scene.sharers) {
            let lives = |craft: &CraftId| self.processes[craft.index()].endpoint.is_some();
            let living: Vec<CraftId> = sharers.iter().copied().map(CraftId).filter(lives).collect();
            let states =
                || living.iter().filter_map(|&craft| Some((craft, self.state(craft, fact)?)));
            let Some((craft, one)) = states().next() else { continue };
            if let Some((peer, other)) = states().find(|&(_, other)| other != one) {
                return Err(Violation::Disagree { fact, craft, one, peer, other });
            }
            let mut last = None;
            for &writer in sharers {
                let writes = self.case.scene.trace[writer as usize]
                    .iter()
                    .rfind(|record| record.fact() == fact)
                    .and_then(TraceRecord::holds);
                if let Some(holds) = writes {
                    let is_only = last.is_none();
                    last = Some((writer, holds)).filter(|_| is_only);
                    if !is_only {
                        break;
                    }
                }
            }
            let Some((writer, holds)) = last else { continue };
            let wanted = if holds { Value::Asserted } else { Value::Absent };
            if !self.processes[writer as usize].was_killed && one.value != wanted {
                return Err(Violation::NotAsTraced { fact, craft, held: one.value, wanted });
            }
        }
        Ok(())
    }
}

/// Between two processes of one life each, what was sent was handed over or is counted as lost.
pub(super) fn judge_numbers<E: Endpoint>(
    processes: &mut [Process<E>],
    laws: &Laws,
    strategy: StrategyKind,
) -> Result<(), Violation> {
    let lived = |process: &Process<E>| process.endpoint.is_some() && !process.was_killed;
    let count = processes.len();
    let whole: Vec<bool> = processes.iter().map(lived).collect();
    for receiver in (0..count).filter(|&index| whole[index]) {
        let craft = CraftId::from_index(receiver);
        let (mut sent, mut got) = (0, 0);
        for sender in (0..count).filter(|&index| index != receiver && whole[index]) {
            let source_craft = CraftId::from_index(sender);
            let Some(endpoint) = &processes[sender].endpoint else { continue };
            sent += endpoint.next_number(Destination::Craft(craft));
            if strategy == StrategyKind::Full {
                sent += endpoint.next_number(Destination::Multicast);
            }
            got += laws.handed(craft, source_craft);
        }
        let process = &mut processes[receiver];
        if let Some(endpoint) = &mut process.endpoint {
            process.losses += endpoint.take_losses();
        }
        let counted = process.losses.gaps;
        // Of those that died, gaps may be counted as well.
        if sent > got + counted || got > sent {
            let source_craft = CraftId::NONE;
            return Err(Violation::Unaccounted { craft, source_craft, sent, got, counted });
        }
    }
    Ok(())
}
