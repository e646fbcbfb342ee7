//! What a craft fires, as plainly as it can be said; the laws are those of [`Policy`].
//!
//! `best-path`: the least cost of every fact of every board, by looks at all rules, actions and links until
//! nothing changes, from what the craft knows: its own board, and of the others how they stood before the
//! first turn. The way is the first producer, in the order of rules, then actions, then links, whose cost
//! is the fact's. Nothing is kept from one turn to the next.

use super::board::PlainBoard;
use shared_types::ids::{ActionId, CraftId, FactId, Firing};
use shared_types::knowledge::{FleetView, Literal, Value};
use shared_types::reasoning::Policy;
use std::collections::BTreeSet;

/// What telling a fact costs.
const TELLING: f64 = 1.0;

/// What costs more is out of reach.
const MOST: f64 = 1e12;

/// What the choice of one craft depends on besides the boards.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LastRule {
    next: u32,
}

impl LastRule {
    /// The craft fired.
    pub(super) const fn note(&mut self, firing: Firing, rule_count: u32) {
        if firing.0 < rule_count {
            self.next = firing.0 + 1;
        }
    }
}

/// What `craft` fires of its `candidates` (ascending); `None` if it is idle. Not for `random`.
pub(super) fn choose(
    fleet: &FleetView<'_>,
    craft: CraftId,
    board: &PlainBoard,
    candidates: &[u32],
    policy: Policy,
    last: LastRule,
) -> Option<Firing> {
    let rules = fleet.board(craft).rule_count();
    let in_order = |may: &dyn Fn(u32) -> bool| {
        let fit = || candidates.iter().copied().filter(|&one| may(one));
        fit()
            .find(|&one| one >= rules)
            .or_else(|| fit().find(|&one| one >= last.next && one < rules))
            .or_else(|| fit().find(|&one| one < last.next))
            .map(Firing)
    };
    if policy == Policy::Naive {
        return in_order(&|_| true);
    }
    let way = Costs::of(fleet, craft, board).own_steps();
    let on_the_way = candidates.iter().find(|candidate| way.contains(candidate));
    let serves = Serving::of(fleet);
    on_the_way.map(|&one| Firing(one)).or_else(|| in_order(&|one| serves.firing(fleet, craft, one)))
}

/// Least costs of everything on all boards, as one craft knows them.
struct Costs<'a> {
    fleet: &'a FleetView<'a>,
    craft: CraftId,
    own: &'a PlainBoard,
    /// Per craft, by literal and by action that is queued.
    literals: Vec<Vec<f64>>,
    queued: Vec<Vec<f64>>,
}

impl<'a> Costs<'a> {
    fn of(fleet: &'a FleetView<'a>, craft: CraftId, own: &'a PlainBoard) -> Self {
        let mut literals: Vec<Vec<f64>> = fleet
            .boards
            .iter()
            .map(|board| vec![f64::INFINITY; 2 * board.fact_count as usize])
            .collect();
        let mut queued: Vec<Vec<f64>> = fleet
            .boards
            .iter()
            .map(|board| vec![f64::INFINITY; board.action_count() as usize])
            .collect();
        for (index, board) in fleet.boards.iter().enumerate() {
            for &fact in board.initial {
                literals[index][Literal::holds(FactId(fact)).0 as usize] = 0.0;
            }
        }
        let known = &mut literals[craft.index()];
        known.fill(f64::INFINITY);
        for (fact, state) in (0..).map(FactId).zip(&own.states) {
            match state.value {
                Value::Asserted => known[Literal::holds(fact).0 as usize] = 0.0,
                Value::Absent => known[Literal::is_absent(fact).0 as usize] = 0.0,
                Value::Unknown => {}
            }
        }
        for (action, is_queued) in own.queued().iter().enumerate() {
            if *is_queued {
                queued[craft.index()][action] = 0.0;
            }
        }
        let mut costs = Self { fleet, craft, own, literals, queued };
        while costs.sweep() {}
        costs
    }

    /// Whether the craft knows that a firing cannot happen any more.
    fn is_gone(&self, craft: CraftId, firing: u32) -> bool {
        craft == self.craft && self.own.is_spent(Firing(firing))
    }

    fn of_rule(&self, craft: CraftId, rule: u32) -> f64 {
        let board = self.fleet.board(craft);
        if self.is_gone(craft, rule) {
            return f64::INFINITY;
        }
        let premises = board.premises.row(rule as usize).iter();
        premises.fold(board.rule_cost(rule), |sum, &premise| {
            sum + self.literals[craft.index()][premise as usize]
        })
    }

    fn of_action(&self, craft: CraftId, action: u32) -> f64 {
        let board = self.fleet.board(craft);
        if self.is_gone(craft, board.rule_count() + action) {
            return f64::INFINITY;
        }
        board.action_cost(action) + self.queued[craft.index()][action as usize]
    }

    /// One look at every rule, action and link; says whether anything became cheaper.
    fn sweep(&mut self) -> bool {
        let fleet = self.fleet;
        let mut is_changed = false;
        let mut lower = |place: &mut f64, cost: f64| {
            if cost <= MOST && cost < *place {
                *place = cost;
                is_changed = true;
            }
        };
        for (craft, board) in (0..).map(CraftId).zip(&fleet.boards) {
            for rule in 0..board.rule_count() {
                let cost = self.of_rule(craft, rule);
                for &output in board.outputs.row(rule as usize) {
                    lower(&mut self.literals[craft.index()][output as usize], cost);
                }
                for &action in board.queues.row(rule as usize) {
                    lower(&mut self.queued[craft.index()][action as usize], cost);
                }
            }
            for action in 0..board.action_count() {
                let cost = self.of_action(craft, action);
                for &output in board.action_outputs.row(action as usize) {
                    lower(&mut self.literals[craft.index()][output as usize], cost);
                }
            }
            for fact in (0..board.fact_count).map(FactId) {
                for target in board.targets(fact) {
                    for sign in [0, 1] {
                        let told = self.literals[craft.index()][(fact.0 << 1 | sign) as usize];
                        let place = (target.fact.0 << 1 | sign) as usize;
                        lower(&mut self.literals[target.craft.index()][place], TELLING + told);
                    }
                }
            }
        }
        is_changed
    }

    /// Own firings on the cheapest way to a final fact that does not hold yet.
    fn own_steps(&self) -> BTreeSet<u32> {
        let mut best: (f64, Option<(CraftId, Literal)>) = (f64::INFINITY, None);
        for (craft, board) in (0..).map(CraftId).zip(&self.fleet.boards) {
            for &fact in board.finals {
                let literal = Literal::holds(FactId(fact));
                let cost = self.literals[craft.index()][literal.0 as usize];
                if cost > 0.0 && cost < best.0 {
                    best = (cost, Some((craft, literal)));
                }
            }
        }
        let mut steps = BTreeSet::new();
        let mut seen = BTreeSet::new();
        let mut left: Vec<(CraftId, Literal)> = best.1.into_iter().collect();
        while let Some((craft, literal)) = left.pop() {
            if seen.insert((craft, literal)) {
                self.follow(craft, literal, &mut steps, &mut left);
            }
        }
        steps
    }

    /// Notes how `literal` is brought about, and what that needs.
    fn follow(
        &self,
        craft: CraftId,
        literal: Literal,
        steps: &mut BTreeSet<u32>,
        left: &mut Vec<(CraftId, Literal)>,
    ) {
        let cost = self.literals[craft.index()][literal.0 as usize];
        if cost == 0.0 {
            return;
        }
        let board = self.fleet.board(craft);
        let writes = |row: &[u32]| row.contains(&literal.0);
        let rule = (0..board.rule_count()).find(|&rule| {
            writes(board.outputs.row(rule as usize)) && self.of_rule(craft, rule) == cost
        });
        if let Some(rule) = rule {
            return self.use_rule(craft, rule, steps, left);
        }
        let action = (0..board.action_count()).find(|&action| {
            writes(board.action_outputs.row(action as usize))
                && self.of_action(craft, action) == cost
        });
        if let Some(action) = action {
            return self.use_action(craft, action, steps, left);
        }
        for (from, board) in (0..).map(CraftId).zip(&self.fleet.boards) {
            for fact in (0..board.fact_count).map(FactId) {
                let leads_here = board
                    .targets(fact)
                    .any(|target| target.craft == craft && target.fact == literal.fact());
                let told = Literal(fact.0 << 1 | (literal.0 & 1));
                let cost_there = self.literals[from.index()][told.0 as usize];
                if leads_here && TELLING + cost_there == cost {
                    return left.push((from, told));
                }
            }
        }
    }

    fn use_rule(
        &self,
        craft: CraftId,
        rule: u32,
        steps: &mut BTreeSet<u32>,
        left: &mut Vec<(CraftId, Literal)>,
    ) {
        if craft == self.craft {
            steps.insert(rule);
        }
        let premises = self.fleet.board(craft).premises.row(rule as usize).iter();
        left.extend(premises.map(|&premise| (craft, Literal(premise))));
    }

    fn use_action(
        &self,
        craft: CraftId,
        action: u32,
        steps: &mut BTreeSet<u32>,
        left: &mut Vec<(CraftId, Literal)>,
    ) {
        let board = self.fleet.board(craft);
        if craft == self.craft {
            steps.insert(board.rule_count() + action);
        }
        let cost = self.queued[craft.index()][action as usize];
        let queues = |rule: &u32| {
            board.queues.row(*rule as usize).contains(&action) && self.of_rule(craft, *rule) == cost
        };
        if cost > 0.0
            && let Some(rule) = (0..board.rule_count()).find(queues)
        {
            self.use_rule(craft, rule, steps, left);
        }
    }
}

/// What can ever serve a final fact.
struct Serving {
    /// Per craft, by literal, whether it is wanted.
    wanted: Vec<Vec<bool>>,
}

impl Serving {
    fn of(fleet: &FleetView<'_>) -> Self {
        let mut serving = Self {
            wanted: fleet
                .boards
                .iter()
                .map(|board| vec![false; 2 * board.fact_count as usize])
                .collect(),
        };
        for (index, board) in fleet.boards.iter().enumerate() {
            for &fact in board.finals {
                serving.wanted[index][Literal::holds(FactId(fact)).0 as usize] = true;
            }
        }
        while serving.sweep(fleet) {}
        serving
    }

    fn sweep(&mut self, fleet: &FleetView<'_>) -> bool {
        let mut is_changed = false;
        for (craft, board) in (0..).map(CraftId).zip(&fleet.boards) {
            for rule in 0..board.rule_count() {
                if self.firing(fleet, craft, rule) {
                    for &premise in board.premises.row(rule as usize) {
                        let wanted = &mut self.wanted[craft.index()][premise as usize];
                        is_changed |= !std::mem::replace(wanted, true);
                    }
                }
            }
            for fact in (0..board.fact_count).map(FactId) {
                for target in board.targets(fact) {
                    for sign in [0, 1] {
                        let there = (target.fact.0 << 1 | sign) as usize;
                        if self.wanted[target.craft.index()][there] {
                            let here = (fact.0 << 1 | sign) as usize;
                            let wanted = &mut self.wanted[craft.index()][here];
                            is_changed |= !std::mem::replace(wanted, true);
                        }
                    }
                }
            }
        }
        is_changed
    }

    /// Whether a firing writes something wanted, or queues an action that does.
    fn firing(&self, fleet: &FleetView<'_>, craft: CraftId, firing: u32) -> bool {
        let board = fleet.board(craft);
        let wanted = &self.wanted[craft.index()];
        let writes = |row: &[u32]| row.iter().any(|&output| wanted[output as usize]);
        let action = |action: u32| writes(board.action_outputs.row(ActionId(action).index()));
        match firing.checked_sub(board.rule_count()) {
            Some(number) => action(number),
            None => {
                let queues = board.queues.row(firing as usize);
                writes(board.outputs.row(firing as usize)) || queues.iter().any(|&one| action(one))
            }
        }
    }
}
