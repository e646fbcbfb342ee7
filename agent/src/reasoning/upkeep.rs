//! Keeps a craft's board small between turns: pruning and maintenance at the scenario's intervals.
//!
//! Changes are noted as they happen and followed when a pruning or a slice is due, which the shell
//! runs after what the turn sends has left. A board that lies in shared memory cannot shrink; what
//! is found is told instead: how much of it the mission can still need, and what need not be collected. A
//! trial's course is the same with and without. Time is counted in turns. Not here: the closures
//! (`prune::sound`), the statuses (`maintenance`), and clocks: who calls brings one.

use super::maintenance::{Item, Maintenance, Settings};
use super::planner::Planner;
use super::prune::sound::Sound;
use shared_types::ids::{CraftId, FactId, Firing, FiringTarget, Turn};
use shared_types::knowledge::{BoardView, Literal, Value};
use shared_types::reasoning::{Reasoning, ReasoningReport};
use shared_types::time::Nanos;

/// Slices of maintenance in which every item is looked at once, where the budget allows it.
const SLICES_PER_PERIOD: u32 = 4;

/// Periods for which stale values are kept.
const STALE_PERIODS: u64 = 10;

/// Items that are kept at hand beside the board.
const ANCILLARY_ITEMS_MAX: usize = 1024;

/// The upkeep of one board.
#[derive(Clone, Debug, Default)]
pub struct Upkeep {
    reasoning: Reasoning,
    maintenance: Option<Box<Maintenance>>,
    /// Changes that were not followed yet, with the turn in which they were noted.
    noted: Vec<(FactId, Value, Turn)>,
    turn: Turn,
    is_pruning_due: bool,
    is_slice_due: bool,
    report: ReasoningReport,
}

impl Upkeep {
    /// Starts a trial on `board`.
    pub fn reset(&mut self, reasoning: Reasoning, board: &BoardView<'_>) {
        let has_upkeep = reasoning.has_upkeep();
        *self = Self { reasoning, ..Self::default() };
        if !has_upkeep {
            return;
        }
        let known = board.initial.iter().map(|&fact| Literal::holds(FactId(fact)));
        let goals = board.finals.iter().map(|&fact| Literal::holds(FactId(fact)));
        let turns = reasoning.maintain_every_turns.max(1);
        let period = u64::from(SLICES_PER_PERIOD) * u64::from(turns);
        let settings = Settings {
            period_ns: period,
            cycles_per_period: SLICES_PER_PERIOD,
            stale_kept_ns: STALE_PERIODS * period,
            ancillary_items_max: ANCILLARY_ITEMS_MAX,
        };
        let sound = Sound::new(board, known, goals);
        let mut maintenance = Maintenance::new(board, settings, sound);
        // Where nothing is planned everything of use is likely to be used.
        maintenance.set_needed(all_items(board));
        self.maintenance = Some(Box::new(maintenance));
        self.report.items = [board.fact_count, board.rule_count(), board.action_count()];
    }

    /// A fact of the board is `value` from now on.
    pub fn note(&mut self, fact: FactId, value: Value) {
        if self.maintenance.is_some() {
            self.noted.push((fact, value, self.turn));
        }
    }

    /// A turn was opened: what is due in it is due now.
    pub const fn open_turn(&mut self, turn: Turn) {
        let Reasoning { prune_every_turns, maintain_every_turns, .. } = self.reasoning;
        self.turn = turn;
        self.is_pruning_due |= is_due(turn, prune_every_turns);
        self.is_slice_due |= is_due(turn, maintain_every_turns);
    }

    /// Whether anything is due.
    #[must_use]
    pub const fn is_due(&self) -> bool {
        self.is_pruning_due || self.is_slice_due
    }

    /// Does what is due. `clock` is read around each part.
    pub fn run(
        &mut self,
        craft: CraftId,
        board: &BoardView<'_>,
        planner: Option<&Planner>,
        clock: &mut impl FnMut() -> Nanos,
    ) {
        let (prunes, maintains) = (self.is_pruning_due, self.is_slice_due);
        let Some(maintenance) = self.maintenance.as_mut().filter(|_| prunes || maintains) else {
            return;
        };
        (self.is_pruning_due, self.is_slice_due) = (false, false);
        let started = clock();
        self.report.changes_followed += self.noted.len() as u64;
        for (fact, value, turn) in self.noted.drain(..) {
            let literal = match value {
                Value::Asserted => Some(Literal::holds(fact)),
                Value::Absent => Some(Literal::is_absent(fact)),
                Value::Unknown => None,
            };
            maintenance.note_write(board, fact, literal, Nanos(u64::from(turn.0)));
        }
        if prunes {
            let kept = maintenance.sound().kept(board).counts();
            self.report.kept = kept.map(|count| u32::try_from(count).unwrap_or(u32::MAX));
            self.report.prunings += 1;
        }
        let pruned = clock();
        self.report.prune_ns += pruned.since(started);
        if maintains {
            if let Some(planner) = planner {
                maintenance.set_needed(items_of(craft, board, planner));
            }
            let budget = self.reasoning.maintain_items as usize;
            let share = maintenance.share().min(budget);
            let slice = maintenance.slice(board, Nanos(u64::from(self.turn.0)), share);
            let report = &mut self.report;
            for (sum, count) in report.statuses.iter_mut().zip(slice.statuses) {
                *sum += u64::from(count);
            }
            report.moved += u64::from(slice.moved);
            report.slices += 1;
            report.do_not_collect = count(maintenance.do_not_collect());
            report.available = count(maintenance.available());
            let slice_ns = clock().since(pruned);
            report.maintain_ns += slice_ns;
            report.slice_ns_max = report.slice_ns_max.max(slice_ns);
        }
    }

    /// What was done, and what it cost.
    #[must_use]
    pub const fn report(&self) -> &ReasoningReport {
        &self.report
    }
}

const fn is_due(turn: Turn, every: u32) -> bool {
    every > 0 && turn.0.is_multiple_of(every)
}

fn count(items: impl Iterator) -> u32 {
    u32::try_from(items.count()).unwrap_or(u32::MAX)
}

fn all_items(board: &BoardView<'_>) -> impl Iterator<Item = Item> {
    (0..board.fact_count)
        .map(Item::Fact)
        .chain((0..board.rule_count()).map(Item::Rule))
        .chain((0..board.action_count()).map(Item::Action))
}

/// What of the craft's board its plan needs: final facts, the steps, and what they read and write.
fn items_of(craft: CraftId, board: &BoardView<'_>, planner: &Planner) -> Vec<Item> {
    let mut items: Vec<Item> = board.finals.iter().map(|&fact| Item::Fact(fact)).collect();
    let steps = planner.plan().into_iter().flat_map(|plan| &plan.steps);
    let own = steps.filter_map(|step| planner.graph().firing_of(craft, step.rule));
    let facts = |row: &[u32], items: &mut Vec<Item>| {
        items.extend(row.iter().map(|&packed| Item::Fact(Literal(packed).fact().0)));
    };
    for target in own.filter_map(|firing: Firing| firing.target(board.rule_count())) {
        match target {
            FiringTarget::Rule(rule) => {
                items.push(Item::Rule(rule.0));
                facts(board.premises.row(rule.index()), &mut items);
                facts(board.outputs.row(rule.index()), &mut items);
            }
            FiringTarget::Action(action) => {
                items.push(Item::Action(action.0));
                facts(board.action_outputs.row(action.index()), &mut items);
            }
        }
    }
    items
}

#[cfg(test)]
mod tests {
    use super::{Reasoning, Upkeep};
    use crate::reasoning::sample::{Shape, board};
    use shared_types::rng::{Purpose, Stream};

    #[test]
    fn maintenance_may_be_as_rare_as_a_scenario_can_say() {
        let shape = Shape { facts: 4, rules: 2, actions: 1, associations: 3, is_negating: false };
        let network = board(shape, &mut Stream::new(1, 0, Purpose::Test, 0));
        let reasoning = Reasoning { maintain_every_turns: u32::MAX, ..Reasoning::default() };
        let mut upkeep = Upkeep::default();
        upkeep.reset(reasoning, &network.view());
        assert_eq!(upkeep.report.items[0], 4);
        assert!(!upkeep.is_due());
    }
}
