//! All boards of a fleet as one network in which every firing is a step of its own.
//!
//! Beside each craft's facts there is one fact for each of its actions: that it is queued. A rule asserts
//! the facts that it writes and those of the actions that it queues; an action rests on being queued. Behind
//! the firings of all crafts stands one rule for each way that a fact takes to a linked fact of another
//! board, once for a value that holds and once for one that is absent. [`crate::reasoning::whole`] keeps rules
//! and their actions together instead, as a plan for people does.

use crate::reasoning::Producers;
use crate::reasoning::best_path::{Combine, Costs};
use shared_types::ids::{ActionId, CraftId, FactId, Firing};
use shared_types::knowledge::{BoardNetwork, BoardView, FleetView, Literal};

/// What telling another craft a fact costs a plan; rules and actions cost 1 each by default.
pub const TELLING_COST: f64 = 1.0;

/// A fleet's boards as one network of firings.
#[derive(Clone, Debug)]
pub struct FleetGraph {
    network: BoardNetwork,
    costs: Costs,
    /// By craft, and one more: where its facts, queued actions and firings begin.
    facts: Vec<u32>,
    queued: Vec<u32>,
    firings: Vec<u32>,
}

impl FleetGraph {
    /// The boards of `fleet`; all final facts of all boards are final.
    ///
    /// # Panics
    /// Never: networks hold costs above 0 only.
    #[must_use]
    pub fn of(fleet: &FleetView<'_>) -> Self {
        let starts = |first: u32, count: &dyn Fn(&BoardView<'_>) -> u32| -> Vec<u32> {
            let mut sum = first;
            let ends = fleet.boards.iter().map(|board| {
                sum += count(board);
                sum
            });
            std::iter::once(first).chain(ends).collect()
        };
        let facts = starts(0, &|board| board.fact_count);
        let queued = starts(*facts.last().unwrap_or(&0), &|board| board.action_count());
        let firings = starts(0, &|board| board.rule_count() + board.action_count());
        let fact_count = *queued.last().unwrap_or(&0);
        let mut graph = Self {
            network: BoardNetwork { fact_count, ..BoardNetwork::default() },
            costs: Costs::uniform(&BoardNetwork::default().view(), Combine::Sum),
            facts,
            queued,
            firings,
        };
        let mut costs = Vec::new();
        for (craft, board) in (0..).map(CraftId).zip(&fleet.boards) {
            graph.add_firings(craft, board, &mut costs);
        }
        for (craft, board) in (0..).map(CraftId).zip(&fleet.boards) {
            graph.add_links(craft, board, &mut costs);
        }
        (0..fact_count).for_each(|_| graph.network.links.finish_row());
        graph.network.index_readers();
        graph.costs = Costs::new(&graph.network.view(), Combine::Sum, costs, Vec::new())
            .expect("invariant: networks hold costs above 0 only");
        graph
    }

    /// The network; its facts are linked to no other board.
    #[must_use]
    pub const fn network(&self) -> &BoardNetwork {
        &self.network
    }

    /// What its rules cost.
    #[must_use]
    pub const fn costs(&self) -> &Costs {
        &self.costs
    }

    /// The number of a craft's fact.
    #[must_use]
    pub fn fact(&self, craft: CraftId, fact: FactId) -> FactId {
        FactId(self.facts[craft.index()] + fact.0)
    }

    /// The fact that an action of a craft is queued.
    #[must_use]
    pub fn queued(&self, craft: CraftId, action: ActionId) -> FactId {
        FactId(self.queued[craft.index()] + action.0)
    }

    /// The rule that stands for a craft's firing.
    #[must_use]
    pub fn rule(&self, craft: CraftId, firing: Firing) -> u32 {
        self.firings[craft.index()] + firing.0
    }

    /// The firing of `craft` that a rule stands for; `None` if it is another craft's, or tells a fact.
    #[must_use]
    pub fn firing_of(&self, craft: CraftId, rule: u32) -> Option<Firing> {
        let own = self.firings[craft.index()]..self.firings[craft.index() + 1];
        own.contains(&rule).then(|| Firing(rule - own.start))
    }

    /// By firing of `craft` whether it can ever serve a final fact of any board: whether it writes
    /// something that leads there, whatever holds now.
    #[must_use]
    pub fn serving(&self, craft: CraftId) -> Vec<bool> {
        let view = self.network.view();
        let producers = Producers::of(&view);
        let mut is_wanted = vec![false; 2 * view.fact_count as usize];
        let mut serves = vec![false; view.premises.row_count()];
        let mut work: Vec<u32> =
            view.finals.iter().map(|&fact| Literal::holds(FactId(fact)).0).collect();
        while let Some(literal) = work.pop() {
            if std::mem::replace(&mut is_wanted[literal as usize], true) {
                continue;
            }
            for &rule in producers.rules(literal) {
                if !std::mem::replace(&mut serves[rule as usize], true) {
                    work.extend(view.premises.row(rule as usize));
                }
            }
        }
        let own = self.firings[craft.index()] as usize..self.firings[craft.index() + 1] as usize;
        serves[own].to_vec()
    }

    fn add_firings(&mut self, craft: CraftId, board: &BoardView<'_>, costs: &mut Vec<f64>) {
        let first = self.facts[craft.index()];
        let own = |packed: &u32| packed + 2 * first;
        for rule in 0..board.rule_count() {
            let queues = board.queues.row(rule as usize).iter();
            let queued =
                queues.map(|&action| Literal::holds(self.queued(craft, ActionId(action))).0);
            let queued: Vec<u32> = queued.collect();
            let outputs = board.outputs.row(rule as usize).iter().map(own);
            self.network.premises.push_row(board.premises.row(rule as usize).iter().map(own));
            self.network.outputs.push_row(outputs.chain(queued));
            self.network.queues.finish_row();
            costs.push(board.rule_cost(rule));
        }
        for action in 0..board.action_count() {
            let is_queued = Literal::holds(self.queued(craft, ActionId(action))).0;
            self.network.premises.push_row([is_queued]);
            self.network
                .outputs
                .push_row(board.action_outputs.row(action as usize).iter().map(own));
            self.network.queues.finish_row();
            costs.push(board.action_cost(action));
        }
        self.network.initial.extend(board.initial.iter().map(|&fact| fact + first));
        self.network.finals.extend(board.finals.iter().map(|&fact| fact + first));
    }

    fn add_links(&mut self, craft: CraftId, board: &BoardView<'_>, costs: &mut Vec<f64>) {
        for fact in (0..board.fact_count).map(FactId) {
            for target in board.targets(fact) {
                let (from, to) = (self.fact(craft, fact), self.fact(target.craft, target.fact));
                for literal in [Literal::holds, Literal::is_absent] {
                    self.network.premises.push_row([literal(from).0]);
                    self.network.outputs.push_row([literal(to).0]);
                    self.network.queues.finish_row();
                    costs.push(TELLING_COST);
                }
            }
        }
    }
}
