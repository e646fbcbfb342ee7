//! The exact least costs of literals, cheapest first (Knuth 1977).
//!
//! A literal is final when it is the cheapest that is left; a rule is looked at again only when one of
//! its premises becomes final, and fires in the calculation when all are. Costs never decrease along an
//! edge, so what is final stays so. O(E + V log V) for E entries of all lists and V literals, but for
//! the queue, in which a literal may wait several times.

use super::costs::{Combine, Costs};
use super::plan::Plan;
use super::queue::{Entry, Queue};
use crate::reasoning::Kept;
use shared_types::knowledge::{BoardView, Literal};

/// How a literal is made to hold at its cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Via {
    /// It holds already.
    Known,
    /// A rule writes it.
    Rule(u32),
    /// An action writes it that a rule queues.
    Action {
        /// The rule.
        rule: u32,
        /// The action.
        action: u32,
    },
}

impl Via {
    /// The rule that must run, if any.
    #[must_use]
    pub const fn rule(self) -> Option<u32> {
        match self {
            Self::Known => None,
            Self::Rule(rule) | Self::Action { rule, .. } => Some(rule),
        }
    }
}

/// Why a search ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stopped {
    /// The goal's cost is final.
    AtGoal,
    /// Every literal that can be made to hold is final, the goal not among them.
    Unreachable,
    /// No goal was given: everything that can be made to hold is final.
    Exhausted,
}

/// A search and its memory, which is used again.
#[derive(Clone, Debug, Default)]
pub struct Solver {
    cost: Vec<f64>,
    via: Vec<Via>,
    is_final: Vec<bool>,
    /// By rule: premises that are not final, and the cost of those that are.
    unmet: Vec<u32>,
    gathered: Vec<f64>,
    queue: Queue,
}

impl Solver {
    /// Finds the least costs from `known`, which cost nothing, through what is `kept`; stops when that
    /// of `goal` is final.
    pub fn solve(
        &mut self,
        board: &BoardView<'_>,
        costs: &Costs,
        kept: Option<&Kept>,
        known: impl IntoIterator<Item = Literal>,
        goal: Option<Literal>,
    ) -> Stopped {
        self.reset(board);
        for rule in 0..board.rule_count() {
            if self.unmet[rule as usize] == 0 && is_kept(kept, rule) {
                self.fire(board, costs, kept, rule);
            }
        }
        for literal in known {
            self.relax(literal.0, 0.0, Via::Known);
        }
        while let Some(Entry { literal, .. }) = self.queue.pop() {
            let at = literal as usize;
            if std::mem::replace(&mut self.is_final[at], true) {
                continue;
            }
            if goal.is_some_and(|goal| goal.0 == literal) {
                return Stopped::AtGoal;
            }
            let cost = self.cost[at];
            for &packed in board.readers.row(at >> 1) {
                let rule = packed >> 1;
                if packed & 1 != literal & 1 || !is_kept(kept, rule) {
                    continue;
                }
                let gathered = &mut self.gathered[rule as usize];
                *gathered = match costs.combine() {
                    Combine::Sum => *gathered + cost,
                    Combine::Max => gathered.max(cost),
                };
                self.unmet[rule as usize] -= 1;
                if self.unmet[rule as usize] == 0 {
                    self.fire(board, costs, kept, rule);
                }
            }
        }
        if goal.is_some() { Stopped::Unreachable } else { Stopped::Exhausted }
    }

    /// The least cost of `literal`: infinite if it cannot be made to hold, and an upper bound if the
    /// search stopped at a cheaper goal.
    #[must_use]
    pub fn cost(&self, literal: Literal) -> f64 {
        self.cost[literal.0 as usize]
    }

    /// How `literal` is made to hold at that cost; `None` if it cannot be.
    #[must_use]
    pub fn via(&self, literal: Literal) -> Option<Via> {
        let at = literal.0 as usize;
        (self.cost[at] < f64::INFINITY).then(|| self.via[at])
    }

    /// The plan for `goal`, which must be final; `None` if it cannot be made to hold.
    #[must_use]
    pub fn plan(&self, board: &BoardView<'_>, costs: &Costs, goal: Literal) -> Option<Plan> {
        self.is_final[goal.0 as usize].then(|| {
            Plan::towards(goal, board, costs, |literal| (self.cost(literal), self.via(literal)))
        })?
    }

    fn reset(&mut self, board: &BoardView<'_>) {
        let literals = 2 * board.fact_count as usize;
        self.cost.clear();
        self.cost.resize(literals, f64::INFINITY);
        self.via.clear();
        self.via.resize(literals, Via::Known);
        self.is_final.clear();
        self.is_final.resize(literals, false);
        self.unmet.clear();
        let lengths = board.premises.rows().map(|row| u32::try_from(row.len()).unwrap_or(u32::MAX));
        self.unmet.extend(lengths);
        self.gathered.clear();
        self.gathered.resize(self.unmet.len(), 0.0);
        self.queue.clear();
    }

    /// All premises of `rule` are final: what it writes costs what they do and its own.
    fn fire(&mut self, board: &BoardView<'_>, costs: &Costs, kept: Option<&Kept>, rule: u32) {
        let at = rule as usize;
        let cost = self.gathered[at] + costs.rule(rule);
        for &output in board.outputs.row(at) {
            self.relax(output, cost, Via::Rule(rule));
        }
        for &action in board.queues.row(at) {
            if kept.is_none_or(|kept| kept.actions[action as usize]) {
                let cost = cost + costs.action(action);
                for &output in board.action_outputs.row(action as usize) {
                    self.relax(output, cost, Via::Action { rule, action });
                }
            }
        }
    }

    #[inline]
    fn relax(&mut self, literal: u32, cost: f64, via: Via) {
        let at = literal as usize;
        if cost < self.cost[at] {
            self.cost[at] = cost;
            self.via[at] = via;
            self.queue.push(Entry { cost, literal });
        }
    }
}

fn is_kept(kept: Option<&Kept>, rule: u32) -> bool {
    kept.is_none_or(|kept| kept.rules[rule as usize])
}
