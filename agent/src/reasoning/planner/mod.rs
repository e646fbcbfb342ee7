//! The way to a final fact that one craft takes, as far as it knows.
//!
//! A craft knows its own board. Of the others it knows how they stood before the first turn: what they
//! have done since reaches it through the facts that it shares with them, and only so. The costs of all
//! facts of the fleet under that knowledge are kept right by [`Repair`] as facts change; the way is read off
//! them when it is asked for. Of ways that cost the same the first one in the order of rules counts, so
//! that whoever knows the same plans the same.

pub mod graph;

use crate::reasoning::best_path::{Plan, Repair};
use graph::FleetGraph;
use shared_types::ids::{ActionId, CraftId, FactId, Firing, FiringTarget};
use shared_types::knowledge::{BoardView, FleetView, Literal, Value};

/// Costs beyond this are out of reach: sums are told apart below it to a thousandth, the least cost.
pub const PLAN_COST_MAX: f64 = 1e12;

/// Why a plan is as it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Standing {
    /// There is a way to this final fact at this cost.
    Underway {
        /// Whose fact.
        craft: CraftId,
        /// Which, as its board numbers it.
        fact: FactId,
        /// What is left to be done costs so much; a step that several others need counts once for each.
        cost: f64,
    },
    /// From what the craft knows nothing leads to a final fact that does not hold already.
    Unreachable,
}

/// The plans of one craft.
#[derive(Clone, Debug)]
pub struct Planner {
    craft: CraftId,
    graph: FleetGraph,
    repair: Repair,
    /// By own firing: whether it can serve a final fact.
    serves: Vec<bool>,
    /// By craft: where its final facts begin among those of all.
    finals: Vec<(CraftId, FactId)>,
    /// Own firings of the plan, ascending.
    steps: Vec<Firing>,
    plan: Option<Plan>,
    standing: Standing,
    is_stale: bool,
    /// Plans made, and costs of facts that changes have changed.
    plans: u64,
    touched: u64,
}

impl Planner {
    /// The planner of `craft` before the first turn.
    ///
    /// # Panics
    /// Never: networks hold costs above 0 only.
    #[must_use]
    pub fn new(craft: CraftId, fleet: &FleetView<'_>) -> Self {
        let graph = FleetGraph::of(fleet);
        let known = graph.network().initial.iter().map(|&fact| Literal::holds(FactId(fact)));
        let view = graph.network().view();
        let repair = Repair::within(PLAN_COST_MAX, &view, graph.costs().clone(), known)
            .expect("invariant: networks hold costs above 0 only");
        let boards = (0..).map(CraftId).zip(&fleet.boards);
        Self {
            craft,
            serves: graph.serving(craft),
            finals: boards
                .flat_map(|(craft, board)| {
                    board.finals.iter().map(move |&fact| (craft, FactId(fact)))
                })
                .collect(),
            graph,
            repair,
            steps: Vec::new(),
            plan: None,
            standing: Standing::Unreachable,
            is_stale: true,
            plans: 0,
            touched: 0,
        }
    }

    /// The craft's own fact is `value` from now on.
    pub fn note(&mut self, fact: FactId, value: Value) {
        let fact = self.graph.fact(self.craft, fact);
        self.set(Literal::holds(fact), value == Value::Asserted);
        self.set(Literal::is_absent(fact), value == Value::Absent);
    }

    /// The craft fired: its actions are queued or done, and what may not be repeated is spent. What it
    /// wrote is for [`Self::note`].
    ///
    /// # Panics
    /// Never: an infinite cost is one.
    pub fn note_fired(&mut self, board: &BoardView<'_>, firing: Firing) {
        let repeats = match firing.target(board.rule_count()) {
            None => return,
            Some(FiringTarget::Rule(rule)) => {
                for &action in board.queues.row(rule.index()) {
                    let queued = self.graph.queued(self.craft, ActionId(action));
                    self.set(Literal::holds(queued), true);
                }
                board.repeating_rules.binary_search(&rule.0).is_ok()
            }
            Some(FiringTarget::Action(action)) => {
                self.set(Literal::holds(self.graph.queued(self.craft, action)), false);
                board.repeating_actions.binary_search(&action.0).is_ok()
            }
        };
        if !repeats {
            let rule = self.graph.rule(self.craft, firing);
            let view = self.graph.network().view();
            self.repair
                .set_rule_cost(&view, rule, f64::INFINITY)
                .expect("invariant: infinity is above 0");
            self.count();
        }
    }

    /// The craft's own part of the cheapest way to a final fact that does not hold yet, ascending.
    pub fn steps(&mut self) -> &[Firing] {
        if std::mem::take(&mut self.is_stale) {
            self.plan_anew();
        }
        &self.steps
    }

    /// Whether a firing of the craft can ever serve a final fact of any board.
    #[must_use]
    pub fn serves(&self, firing: Firing) -> bool {
        self.serves[firing.0 as usize]
    }

    /// Why the last plan is as it is.
    #[must_use]
    pub const fn standing(&self) -> Standing {
        self.standing
    }

    /// The last plan, in numbers of [`Self::graph`]; `None` if nothing leads anywhere.
    #[must_use]
    pub const fn plan(&self) -> Option<&Plan> {
        self.plan.as_ref()
    }

    /// What the numbers of a plan stand for.
    #[must_use]
    pub const fn graph(&self) -> &FleetGraph {
        &self.graph
    }

    /// Plans made so far, and costs of facts that changes have changed.
    #[must_use]
    pub const fn work(&self) -> [u64; 2] {
        [self.plans, self.touched]
    }

    fn set(&mut self, literal: Literal, is_known: bool) {
        let view = self.graph.network().view();
        if self.repair.set_known(&view, literal, is_known) {
            self.count();
        }
    }

    fn count(&mut self) {
        self.touched += self.repair.touched() as u64;
        self.is_stale = true;
    }

    fn plan_anew(&mut self) {
        self.plans += 1;
        self.steps.clear();
        let mut best = (f64::INFINITY, None);
        for &(craft, fact) in &self.finals {
            let cost = self.repair.cost(Literal::holds(self.graph.fact(craft, fact)));
            if cost > 0.0 && cost < best.0 {
                best = (cost, Some((craft, fact)));
            }
        }
        let Some((craft, fact)) = best.1 else {
            (self.plan, self.standing) = (None, Standing::Unreachable);
            return;
        };
        let goal = Literal::holds(self.graph.fact(craft, fact));
        self.plan = self.repair.plan(&self.graph.network().view(), goal);
        self.standing = Standing::Underway { craft, fact, cost: best.0 };
        let steps = self.plan.iter().flat_map(|plan| &plan.steps);
        let own = steps.filter_map(|step| self.graph.firing_of(self.craft, step.rule));
        self.steps.extend(own);
        self.steps.sort_unstable();
    }
}
