//! The exact least costs of literals, cheapest first (Knuth 1977).
//!
//! A literal is final when it is the cheapest that is left; a rule is looked at again only when one of
//! its premises becomes final, and fires in the calculation when all are. Costs never decrease along an
//! edge, so what is final stays so. O(E) for E entries of all lists, but for the queue, in which a literal
//! may wait several times.

use super::costs::{Combine, Costs};
use super::plan::Plan;
use super::queue::{Entry, RisingQueue};
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

/// No rule, or no action.
const NONE: u32 = u32::MAX;

/// What is known of a literal: one place in memory, however much of it is asked for.
#[derive(Clone, Copy, Debug)]
struct Reached {
    /// The least cost found so far.
    cost: f64,
    /// How it is made to hold at that cost: [`Via`] without its tag.
    rule: u32,
    action: u32,
}

impl Reached {
    const NOT_YET: Self = Self { cost: f64::INFINITY, rule: NONE, action: NONE };

    const fn via(self) -> Via {
        match (self.rule, self.action) {
            (NONE, _) => Via::Known,
            (rule, NONE) => Via::Rule(rule),
            (rule, action) => Via::Action { rule, action },
        }
    }
}

/// What a rule waits for.
#[derive(Clone, Copy, Debug)]
struct Waiting {
    /// The cost of the premises that are final.
    gathered: f64,
    /// How many are not.
    unmet: u32,
}

/// A search and its memory, which is used again.
#[derive(Clone, Debug, Default)]
pub struct Solver {
    /// By literal.
    reached: Vec<Reached>,
    /// By rule.
    waiting: Vec<Waiting>,
    /// Literals that cost nothing, and so need not stand in line.
    free: Vec<u32>,
    queue: RisingQueue,
    /// Up to this cost everything is final.
    horizon: f64,
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
        let search = Search { board, costs, kept };
        self.reset(board);
        for rule in 0..board.rule_count() {
            if self.waiting[rule as usize].unmet == 0 && is_kept(kept, rule) {
                self.fire(&search, rule);
            }
        }
        let mut free = std::mem::take(&mut self.free);
        free.clear();
        for literal in known {
            let reached = &mut self.reached[literal.0 as usize];
            if reached.cost > 0.0 {
                *reached = Reached { cost: 0.0, ..Reached::NOT_YET };
                free.push(literal.0);
            }
        }
        let stopped = self.spread(&search, &free, goal);
        self.free = free;
        stopped
    }

    /// Makes literals final, cheapest first: those that are `free`, then as they stand in line.
    fn spread(&mut self, search: &Search<'_, '_>, free: &[u32], goal: Option<Literal>) -> Stopped {
        self.horizon = 0.0;
        let is_goal = |literal: u32| goal.is_some_and(|goal| goal.0 == literal);
        for &literal in free {
            if is_goal(literal) {
                return Stopped::AtGoal;
            }
            self.settle(search, literal, 0.0);
        }
        while let Some(Entry { cost, literal }) = self.queue.pop() {
            if cost > self.reached[literal as usize].cost {
                // A cheaper entry stood for it.
                continue;
            }
            self.horizon = cost;
            if is_goal(literal) {
                return Stopped::AtGoal;
            }
            self.settle(search, literal, cost);
        }
        self.horizon = f64::MAX;
        if goal.is_some() { Stopped::Unreachable } else { Stopped::Exhausted }
    }

    /// `literal` is final: rules that waited for nothing else fire.
    fn settle(&mut self, search: &Search<'_, '_>, literal: u32, cost: f64) {
        for &packed in search.board.readers.row(literal as usize >> 1) {
            let rule = packed >> 1;
            if packed & 1 != literal & 1 || !is_kept(search.kept, rule) {
                continue;
            }
            let waiting = &mut self.waiting[rule as usize];
            waiting.gathered = match search.costs.combine() {
                Combine::Sum => waiting.gathered + cost,
                Combine::Max => waiting.gathered.max(cost),
            };
            waiting.unmet -= 1;
            if waiting.unmet == 0 {
                self.fire(search, rule);
            }
        }
    }

    /// The least cost of `literal`: infinite if it cannot be made to hold, and an upper bound if the
    /// search stopped at a cheaper goal.
    #[must_use]
    pub fn cost(&self, literal: Literal) -> f64 {
        self.reached[literal.0 as usize].cost
    }

    /// How `literal` is made to hold at that cost; `None` if it cannot be.
    #[must_use]
    pub fn via(&self, literal: Literal) -> Option<Via> {
        let reached = self.reached[literal.0 as usize];
        (reached.cost < f64::INFINITY).then(|| reached.via())
    }

    /// The plan for `goal`, which must be final; `None` if it cannot be made to hold.
    #[must_use]
    pub fn plan(&self, board: &BoardView<'_>, costs: &Costs, goal: Literal) -> Option<Plan> {
        (self.cost(goal) <= self.horizon).then(|| {
            Plan::towards(goal, board, costs, |literal| (self.cost(literal), self.via(literal)))
        })?
    }

    fn reset(&mut self, board: &BoardView<'_>) {
        self.reached.clear();
        self.reached.resize(2 * board.fact_count as usize, Reached::NOT_YET);
        self.waiting.clear();
        self.waiting.extend(board.premises.lengths().map(|unmet| Waiting { gathered: 0.0, unmet }));
        self.queue.clear();
    }

    /// All premises of `rule` are final: what it writes costs what they do and its own.
    fn fire(&mut self, search: &Search<'_, '_>, rule: u32) {
        let (board, at) = (search.board, rule as usize);
        let cost = self.waiting[at].gathered + search.costs.rule(rule);
        for &output in board.outputs.row(at) {
            self.relax(output, Reached { cost, rule, action: NONE });
        }
        for &action in board.queues.row(at) {
            if search.kept.is_none_or(|kept| kept.actions[action as usize]) {
                let cost = cost + search.costs.action(action);
                for &output in board.action_outputs.row(action as usize) {
                    self.relax(output, Reached { cost, rule, action });
                }
            }
        }
    }

    #[inline]
    fn relax(&mut self, literal: u32, found: Reached) {
        let reached = &mut self.reached[literal as usize];
        if found.cost < reached.cost {
            *reached = found;
            self.queue.push(Entry { cost: found.cost, literal });
        }
    }
}

/// What a search goes through.
struct Search<'a, 'b> {
    board: &'a BoardView<'b>,
    costs: &'a Costs,
    kept: Option<&'a Kept>,
}

fn is_kept(kept: Option<&Kept>, rule: u32) -> bool {
    kept.is_none_or(|kept| kept.rules[rule as usize])
}
