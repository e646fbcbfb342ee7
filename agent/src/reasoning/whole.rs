//! All boards of a fleet as one network, for plans that cross boards.
//!
//! Facts, rules and actions of the crafts follow each other; behind the rules of all crafts stands one
//! rule for each way that a fact takes to a linked fact of another board, once for a value that holds and
//! once for one that is absent. What a fleet does by replication is a step of a plan like any other, so a
//! plan says what has to be told to whom. Not here: what that costs, which depends on the strategy.

use shared_types::ids::{ActionId, CraftId, FactId, RuleId};
use shared_types::knowledge::{BoardNetwork, CsrView, FleetView, Literal, Target};

/// What a rule of the whole network stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// A rule of a craft.
    Rule(CraftId, RuleId),
    /// A fact of a craft is told to another.
    Told {
        /// Whose fact.
        from: (CraftId, FactId),
        /// As the other board numbers it.
        to: Target,
    },
}

/// A fleet's boards as one.
#[derive(Clone, Debug)]
pub struct Whole {
    network: BoardNetwork,
    /// By craft, and one more: where its facts, rules and actions begin.
    facts: Vec<u32>,
    rules: Vec<u32>,
    actions: Vec<u32>,
    /// By link, two rules each.
    links: Vec<((CraftId, FactId), Target)>,
}

impl Whole {
    /// The boards of `fleet`; all final facts of all boards are final.
    #[must_use]
    pub fn of(fleet: &FleetView<'_>) -> Self {
        let starts = |count: &dyn Fn(usize) -> u32| -> Vec<u32> {
            let mut sum = 0;
            let ends = (0..fleet.boards.len()).map(|craft| {
                sum += count(craft);
                sum
            });
            std::iter::once(0).chain(ends).collect()
        };
        let mut whole = Self {
            facts: starts(&|craft| fleet.boards[craft].fact_count),
            rules: starts(&|craft| fleet.boards[craft].rule_count()),
            actions: starts(&|craft| fleet.boards[craft].action_count()),
            network: BoardNetwork::default(),
            links: Vec::new(),
        };
        for (board, craft) in fleet.boards.iter().zip(0..) {
            whole.add(board, CraftId(craft));
        }
        let facts = *whole.facts.last().expect("invariant: one entry more than crafts");
        whole.network.fact_count = facts;
        for index in 0..whole.links.len() {
            let ((craft, fact), target) = whole.links[index];
            let (from, to) = (whole.fact(craft, fact), whole.fact(target.craft, target.fact));
            for literal in [Literal::holds, Literal::is_absent] {
                whole.network.premises.push_row([literal(from).0]);
                whole.network.outputs.push_row([literal(to).0]);
                whole.network.queues.push_row([]);
            }
        }
        (0..facts).for_each(|_| whole.network.links.finish_row());
        whole.network.index_readers();
        whole
    }

    /// The network; its facts are linked to no other board.
    #[must_use]
    pub const fn network(&self) -> &BoardNetwork {
        &self.network
    }

    /// The number of a craft's fact.
    #[must_use]
    pub fn fact(&self, craft: CraftId, fact: FactId) -> FactId {
        FactId(self.facts[craft.index()] + fact.0)
    }

    /// Whose fact that is, and which.
    #[must_use]
    pub fn fact_of(&self, fact: FactId) -> (CraftId, FactId) {
        let (craft, number) = place(&self.facts, fact.0);
        (craft, FactId(number))
    }

    /// Whose action that is, and which.
    #[must_use]
    pub fn action_of(&self, action: u32) -> (CraftId, ActionId) {
        let (craft, number) = place(&self.actions, action);
        (craft, ActionId(number))
    }

    /// What `rule` stands for.
    #[must_use]
    pub fn rule_of(&self, rule: u32) -> Origin {
        let own = *self.rules.last().expect("invariant: one entry more than crafts");
        if rule >= own {
            let (from, to) = self.links[((rule - own) / 2) as usize];
            return Origin::Told { from, to };
        }
        let (craft, number) = place(&self.rules, rule);
        Origin::Rule(craft, RuleId(number))
    }

    /// How many rules are the crafts' own; those behind them tell facts.
    #[must_use]
    pub fn own_rules(&self) -> u32 {
        *self.rules.last().expect("invariant: one entry more than crafts")
    }

    fn add(&mut self, board: &shared_types::knowledge::BoardView<'_>, craft: CraftId) {
        let (fact, action) = (self.facts[craft.index()], self.actions[craft.index()]);
        let literals =
            |row: &[u32]| -> Vec<u32> { row.iter().map(|&packed| packed + 2 * fact).collect() };
        let network = &mut self.network;
        let copy = |table: CsrView<'_>, into: &mut shared_types::knowledge::Csr| {
            table.rows().for_each(|row| into.push_row(literals(row)));
        };
        copy(board.premises, &mut network.premises);
        copy(board.outputs, &mut network.outputs);
        copy(board.action_outputs, &mut network.action_outputs);
        for row in board.queues.rows() {
            network.queues.push_row(row.iter().map(|&queued| queued + action));
        }
        network.initial.extend(board.initial.iter().map(|&one| one + fact));
        network.finals.extend(board.finals.iter().map(|&one| one + fact));
        for own in (0..board.fact_count).map(FactId) {
            self.links.extend(board.targets(own).map(|target| ((craft, own), target)));
        }
    }
}

/// The part of `starts` that `number` lies in, and its number there.
fn place(starts: &[u32], number: u32) -> (CraftId, u32) {
    let craft = starts.partition_point(|&start| start <= number) - 1;
    (CraftId::from_index(craft), number - starts[craft])
}

#[cfg(test)]
mod tests {
    use super::{Origin, Whole};
    use crate::reasoning::best_path::{Combine, Costs, Solver, Stopped};
    use shared_types::ids::{CraftId, FactId, RuleId};
    use shared_types::knowledge::{BoardNetwork, Csr, FleetNetwork, Literal, Target, Topology};

    /// Craft 0 makes fact 1 from fact 0 and shares it as fact 0 of craft 1, which makes its fact 1.
    fn fleet() -> FleetNetwork {
        let holds = |fact| Literal::holds(FactId(fact)).0;
        let board = |links: &[(u32, u32)]| {
            let mut board = BoardNetwork { fact_count: 2, ..BoardNetwork::default() };
            board.premises.push_row([holds(0)]);
            board.outputs.push_row([]);
            board.queues.push_row([0]);
            board.action_outputs.push_row([holds(1)]);
            board.links = Csr::from_pairs(2, links);
            board.index_readers();
            board
        };
        let mut boards = vec![board(&[(1, 1), (1, 0)]), board(&[])];
        boards[0].initial = vec![0];
        boards[1].finals = vec![1];
        let topology = Topology::binary(2);
        FleetNetwork { boards, topology, ..FleetNetwork::default() }
    }

    #[test]
    fn a_plan_crosses_boards_by_telling() {
        let network = fleet();
        let whole = Whole::of(&network.view());
        let view = whole.network().view();
        assert!(view.is_valid(1));
        let goal = Literal::holds(FactId(view.finals[0]));
        assert_eq!(whole.fact_of(goal.fact()), (CraftId(1), FactId(1)));
        let costs = Costs::uniform(&view, Combine::Sum);
        let mut solver = Solver::default();
        let known = view.initial.iter().map(|&fact| Literal::holds(FactId(fact)));
        assert_eq!(solver.solve(&view, &costs, None, known, Some(goal)), Stopped::AtGoal);
        let plan = solver.plan(&view, &costs, goal).unwrap();
        let steps: Vec<Origin> = plan.steps.iter().map(|step| whole.rule_of(step.rule)).collect();
        let told = Origin::Told {
            from: (CraftId(0), FactId(1)),
            to: Target { craft: CraftId(1), fact: FactId(0) },
        };
        let own = |craft| Origin::Rule(CraftId(craft), RuleId(0));
        assert_eq!(steps, [own(0), told, own(1)]);
        assert_eq!(whole.action_of(plan.steps[2].actions[0]).0, CraftId(1));
    }
}
