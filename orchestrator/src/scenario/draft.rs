//! A board of a mission while its names are being resolved.

use super::error::Place;
use super::names::BoardNames;
use shared_types::ids::{ActionId, CraftId, FactId};
use shared_types::knowledge::{BoardNetwork, Csr, Literal};
use shared_types::scenario::{ActionEntry, RuleEntry};
use std::collections::{BTreeMap, BTreeSet};

/// One fact that several crafts share.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Shared {
    /// Each craft, with the fact as its board numbers it; ascending by craft.
    pub(super) sharers: Vec<(CraftId, FactId)>,
    /// The `[[boundary]]` that says so.
    pub(super) place: Place,
}

/// What can ever become of a fact on a board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Reach {
    /// It holds at the start, or some output asserts it.
    pub(super) can_hold: bool,
    /// Some output de-asserts it.
    pub(super) can_be_absent: bool,
    /// It holds at the start.
    pub(super) is_initial: bool,
}

impl Reach {
    /// What either allows.
    pub(super) const fn or(self, other: Self) -> Self {
        Self {
            can_hold: self.can_hold || other.can_hold,
            can_be_absent: self.can_be_absent || other.can_be_absent,
            is_initial: self.is_initial || other.is_initial,
        }
    }
}

/// One board: names, what can become of its facts, its rules and actions.
#[derive(Clone, Debug, Default)]
pub(super) struct BoardDraft {
    fact_ids: BTreeMap<String, FactId>,
    fact_reach: Vec<Reach>,
    shared_by: BTreeMap<FactId, usize>,
    action_ids: BTreeMap<String, ActionId>,
    names: BoardNames,
    rules: Vec<RuleDraft>,
    actions: Vec<ActionDraft>,
    finals: BTreeSet<u32>,
}

#[derive(Clone, Debug)]
struct RuleDraft {
    /// Its place among the scenario's rules.
    entry: usize,
    premises: Vec<Literal>,
    outputs: Vec<Literal>,
    queued: Vec<ActionId>,
    repeats: bool,
    cost: Option<f64>,
}

#[derive(Clone, Debug)]
struct ActionDraft {
    /// Its place among the scenario's actions.
    entry: usize,
    outputs: Vec<Literal>,
    repeats: bool,
    cost: Option<f64>,
    /// `None` if it is certain.
    likelihood: Option<f64>,
    /// Turns.
    duration: u32,
}

/// Which entries of the scenario the rules and actions of a board come from, by id.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Entries {
    pub(super) rules: Vec<usize>,
    pub(super) actions: Vec<usize>,
}

impl BoardDraft {
    /// The fact `name`, which comes to be if it is not there yet.
    pub(super) fn fact(&mut self, name: &str) -> FactId {
        if let Some(&fact) = self.fact_ids.get(name) {
            return fact;
        }
        let fact = FactId::from_index(self.names.facts.len());
        self.fact_ids.insert(name.to_owned(), fact);
        self.names.facts.push(name.to_owned());
        self.fact_reach.push(Reach::default());
        fact
    }

    pub(super) fn known_fact(&self, name: &str) -> Option<FactId> {
        self.fact_ids.get(name).copied()
    }

    pub(super) fn fact_name(&self, fact: FactId) -> &str {
        &self.names.facts[fact.index()]
    }

    pub(super) fn fact_names(&self) -> Vec<&str> {
        self.names.facts.iter().map(String::as_str).collect()
    }

    pub(super) fn reach(&self, fact: FactId) -> Reach {
        self.fact_reach[fact.index()]
    }

    pub(super) fn widen(&mut self, fact: FactId, reach: Reach) {
        let own = &mut self.fact_reach[fact.index()];
        *own = own.or(reach);
    }

    pub(super) fn start_with(&mut self, fact: FactId) {
        self.widen(fact, Reach { can_hold: true, is_initial: true, can_be_absent: false });
    }

    pub(super) fn starts_with(&self, fact: FactId) -> bool {
        self.reach(fact).is_initial
    }

    pub(super) fn end_with(&mut self, fact: FactId) {
        self.finals.insert(fact.0);
    }

    /// Notes that `fact` is the shared fact number `shared`; an error holds the number under which it
    /// is shared already.
    pub(super) fn share(&mut self, fact: FactId, shared: usize) -> Result<(), usize> {
        match self.shared_by.insert(fact, shared) {
            Some(before) => Err(before),
            None => Ok(()),
        }
    }

    pub(super) fn action(&self, name: &str) -> Option<ActionId> {
        self.action_ids.get(name).copied()
    }

    pub(super) fn action_names(&self) -> Vec<&str> {
        self.names.actions.iter().map(String::as_str).collect()
    }

    /// Adds the scenario's action `entry`, its action number `index`.
    pub(super) fn add_action(&mut self, entry: &ActionEntry, index: usize, outputs: Vec<Literal>) {
        let action = ActionId::from_index(self.names.actions.len());
        self.action_ids.insert(entry.name.clone(), action);
        self.names.actions.push(entry.name.clone());
        self.note_outputs(&outputs);
        // What it costs until it succeeds, on average.
        let expected = |likelihood: f64| entry.cost.unwrap_or(1.0) / likelihood;
        let cost = entry.likelihood.map_or(entry.cost, |likelihood| Some(expected(likelihood)));
        let repeats = entry.repeat;
        // What is certain is what no likelihood is stated of.
        let likelihood = entry.likelihood.filter(|&likelihood| likelihood < 1.0);
        let duration = entry.duration.unwrap_or(1);
        let action = ActionDraft { entry: index, outputs, repeats, cost, likelihood, duration };
        self.actions.push(action);
    }

    /// Whether a rule of the name `name` is there.
    pub(super) fn has_rule(&self, name: &str) -> bool {
        self.names.rules.iter().any(|known| known == name)
    }

    /// Adds the scenario's rule `entry`, its rule number `index`; its premises follow by
    /// [`Self::set_premises`].
    pub(super) fn add_rule(
        &mut self,
        entry: &RuleEntry,
        index: usize,
        outputs: Vec<Literal>,
        queued: Vec<ActionId>,
    ) {
        self.note_outputs(&outputs);
        self.names.rules.push(entry.name.clone().unwrap_or_else(|| rule_text(entry)));
        let (premises, repeats, cost) = (Vec::new(), entry.repeat, entry.cost);
        self.rules.push(RuleDraft { entry: index, premises, outputs, queued, repeats, cost });
    }

    /// Where rules and actions stand in the scenario.
    pub(super) fn entries(&self) -> Entries {
        Entries {
            rules: self.rules.iter().map(|rule| rule.entry).collect(),
            actions: self.actions.iter().map(|action| action.entry).collect(),
        }
    }

    pub(super) fn set_premises(&mut self, rule: usize, premises: Vec<Literal>) {
        self.rules[rule].premises = premises;
    }

    fn note_outputs(&mut self, outputs: &[Literal]) {
        for output in outputs {
            let is_negated = *output == Literal::is_absent(output.fact());
            let reach =
                Reach { can_hold: !is_negated, can_be_absent: is_negated, is_initial: false };
            self.widen(output.fact(), reach);
        }
    }

    /// The board's network; `links` holds per linked fact the pairs (craft, fact) it reaches.
    pub(super) fn network(&self, links: &[(u32, u32)]) -> BoardNetwork {
        let mut network = BoardNetwork {
            fact_count: FactId::from_index(self.names.facts.len()).0,
            links: Csr::from_pairs(self.names.facts.len(), links),
            rule_costs: cost_bits(self.rules.iter().map(|rule| rule.cost)),
            action_costs: cost_bits(self.actions.iter().map(|action| action.cost)),
            action_durations: self.durations(),
            action_likelihoods: cost_bits(self.actions.iter().map(|action| action.likelihood)),
            finals: self.finals.iter().copied().collect(),
            ..BoardNetwork::default()
        };
        for (rule, number) in self.rules.iter().zip(0..) {
            network.premises.push_row(rule.premises.iter().map(|premise| premise.0));
            network.outputs.push_row(rule.outputs.iter().map(|output| output.0));
            network.queues.push_row(rule.queued.iter().map(|action| action.0));
            if rule.repeats {
                network.repeating_rules.push(number);
            }
        }
        for (action, number) in self.actions.iter().zip(0..) {
            network.action_outputs.push_row(action.outputs.iter().map(|output| output.0));
            if action.repeats {
                network.repeating_actions.push(number);
            }
        }
        let initial = (0..).zip(&self.fact_reach).filter(|(_, reach)| reach.is_initial);
        network.initial.extend(initial.map(|(fact, _): (u32, _)| fact));
        network.index_readers();
        network
    }

    /// Turns of every action; none where each takes one.
    fn durations(&self) -> Vec<u32> {
        let all = self.actions.iter().map(|action| action.duration);
        if all.clone().all(|turns| turns == 1) { Vec::new() } else { all.collect() }
    }

    /// The names, by id.
    pub(super) fn into_names(self) -> BoardNames {
        self.names
    }
}

/// Costs or likelihoods as a network holds them: none where all are the default, 1.
fn cost_bits(costs: impl Iterator<Item = Option<f64>> + Clone) -> Vec<u64> {
    if costs.clone().all(|cost| cost.is_none()) {
        return Vec::new();
    }
    costs.map(|cost| cost.unwrap_or(1.0).to_bits()).collect()
}

/// What a rule without a name is called: `if a and !b then c, run d`.
fn rule_text(entry: &RuleEntry) -> String {
    let mut text = format!("if {}", entry.r#if.join(" and "));
    if !entry.then.is_empty() {
        text.push_str(" then ");
        text.push_str(&entry.then.join(", "));
    }
    if !entry.run.is_empty() {
        text.push_str(" run ");
        text.push_str(&entry.run.join(", "));
    }
    text
}
