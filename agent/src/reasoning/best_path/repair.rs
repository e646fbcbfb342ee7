//! Least costs that follow changes (Ramalingam and Reps 1996).
//!
//! Every literal has a cost and, beside it, what its producers say that it should be. While the two
//! agree everywhere the costs are the least. A change makes some disagree; those are taken cheapest
//! first, where one that is too dear is lowered at once and one that is too cheap is first made
//! infinite, so that nothing can lean on itself. Work is proportional to what changes and what that
//! touches. Every rule must cost more than nothing; with a rule that costs nothing two literals could
//! hold each other up, so such costs are refused here and solved afresh instead.

use super::costs::{CostError, Costs};
use super::plan::Plan;
use super::queue::{Entry, Heap};
use super::solver::Via;
use crate::reasoning::Producers;
use shared_types::knowledge::{BoardView, Literal};

/// Costs of one board's literals, kept right.
#[derive(Clone, Debug)]
pub struct Repair {
    producers: Producers,
    costs: Costs,
    is_known: Vec<bool>,
    cost: Vec<f64>,
    /// What the producers say, and which of them.
    said: Vec<(f64, Via)>,
    queue: Heap,
    /// Literals whose cost was changed by the last change.
    touched: usize,
    /// What costs more is out of reach.
    limit: f64,
}

impl Repair {
    /// The costs of `board` when `known` holds.
    ///
    /// # Errors
    /// If a rule costs nothing.
    pub fn new(
        board: &BoardView<'_>,
        costs: Costs,
        known: impl IntoIterator<Item = Literal>,
    ) -> Result<Self, CostError> {
        Self::within(f64::INFINITY, board, costs, known)
    }

    /// The same, where what costs more than `limit` counts as out of reach: with sums that double from
    /// step to step costs grow beyond what numbers tell apart, and what cannot be told apart cannot be
    /// put in order.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn within(
        limit: f64,
        board: &BoardView<'_>,
        costs: Costs,
        known: impl IntoIterator<Item = Literal>,
    ) -> Result<Self, CostError> {
        let free = (0..board.rule_count()).find(|&rule| costs.rule(rule) <= 0.0);
        if let Some(rule) = free {
            return Err(CostError::Value { what: "rule", index: rule as usize });
        }
        let literals = 2 * board.fact_count as usize;
        let mut repair = Self {
            producers: Producers::of(board),
            costs,
            is_known: vec![false; literals],
            cost: vec![f64::INFINITY; literals],
            said: vec![(f64::INFINITY, Via::Known); literals],
            queue: Heap::new(),
            touched: 0,
            limit,
        };
        for literal in known {
            repair.is_known[literal.0 as usize] = true;
            repair.ask(board, literal.0);
        }
        for rule in 0..board.rule_count() {
            if board.premises.row(rule as usize).is_empty() {
                repair.ask_about(board, rule);
            }
        }
        repair.settle(board);
        Ok(repair)
    }

    /// From now on `literal` holds, or does not hold by itself; returns whether that is new.
    pub fn set_known(&mut self, board: &BoardView<'_>, literal: Literal, is_known: bool) -> bool {
        let before = std::mem::replace(&mut self.is_known[literal.0 as usize], is_known);
        if before != is_known {
            self.ask(board, literal.0);
            self.settle(board);
        }
        before != is_known
    }

    /// From now on `rule` costs `cost`.
    ///
    /// # Errors
    /// If that is nothing, negative or no number; nothing changes then.
    pub fn set_rule_cost(
        &mut self,
        board: &BoardView<'_>,
        rule: u32,
        cost: f64,
    ) -> Result<(), CostError> {
        if cost <= 0.0 {
            return Err(CostError::Value { what: "rule", index: rule as usize });
        }
        self.costs.set_rule(rule, cost)?;
        self.ask_about(board, rule);
        self.settle(board);
        Ok(())
    }

    /// The least cost of `literal`; infinite if it cannot be made to hold.
    #[must_use]
    pub fn cost(&self, literal: Literal) -> f64 {
        self.cost[literal.0 as usize]
    }

    /// Literals whose cost the last change changed, repeats counted.
    #[must_use]
    pub const fn touched(&self) -> usize {
        self.touched
    }

    /// The plan for `goal`; `None` if it cannot be made to hold.
    #[must_use]
    pub fn plan(&self, board: &BoardView<'_>, goal: Literal) -> Option<Plan> {
        Plan::towards(goal, board, &self.costs, |literal| {
            let cost = self.cost(literal);
            let via = (cost < f64::INFINITY).then(|| self.said[literal.0 as usize].1);
            (cost, via)
        })
    }

    /// Makes costs and what is said agree everywhere.
    fn settle(&mut self, board: &BoardView<'_>) {
        self.touched = 0;
        while let Some(Entry { cost: key, literal }) = self.queue.pop() {
            let at = literal as usize;
            let (cost, said) = (self.cost[at], self.said[at].0);
            if cost == said || f64::min(cost, said) != key {
                // Settled meanwhile, or another entry stands for it.
                continue;
            }
            self.touched += 1;
            if said < cost {
                self.cost[at] = said;
            } else {
                self.cost[at] = f64::INFINITY;
                self.ask(board, literal);
            }
            for &packed in board.readers.row(at >> 1) {
                if packed & 1 == literal & 1 {
                    self.ask_about(board, packed >> 1);
                }
            }
        }
    }

    /// Asks the producers of everything that `rule` writes.
    fn ask_about(&mut self, board: &BoardView<'_>, rule: u32) {
        for &output in board.outputs.row(rule as usize) {
            self.ask(board, output);
        }
        for &action in board.queues.row(rule as usize) {
            for &output in board.action_outputs.row(action as usize) {
                self.ask(board, output);
            }
        }
    }

    /// What the producers of `literal` say now; where that disagrees with its cost it is put in line.
    fn ask(&mut self, board: &BoardView<'_>, literal: u32) {
        let at = literal as usize;
        let said = self.cheapest(board, literal);
        self.said[at] = said;
        if said.0 != self.cost[at] {
            self.queue.push(Entry { cost: f64::min(said.0, self.cost[at]), literal });
        }
    }

    fn cheapest(&self, board: &BoardView<'_>, literal: u32) -> (f64, Via) {
        if self.is_known[literal as usize] {
            return (0.0, Via::Known);
        }
        let of_rule = |rule: u32| {
            let premises = board.premises.row(rule as usize);
            self.costs.of_rule(rule, premises, |premise| self.cost[premise as usize])
        };
        let mut best = (f64::INFINITY, Via::Known);
        for &rule in self.producers.rules(literal) {
            let cost = of_rule(rule);
            if cost < best.0 {
                best = (cost, Via::Rule(rule));
            }
        }
        for &action in self.producers.actions(literal) {
            for &rule in self.producers.queuing(action) {
                let cost = of_rule(rule) + self.costs.action(action);
                if cost < best.0 {
                    best = (cost, Via::Action { rule, action });
                }
            }
        }
        if best.0 > self.limit { (f64::INFINITY, Via::Known) } else { best }
    }
}
