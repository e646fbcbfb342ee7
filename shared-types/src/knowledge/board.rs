//! The immutable network of one board: rules, actions, initial and final facts, and the links of its
//! facts to facts of other boards.

use super::csr::{Csr, CsrView, numbers, words};
use super::fact::Value;
use crate::ids::{CraftId, FactId, Firing, FiringTarget};
use rkyv::{Archive, Deserialize, Serialize};

/// A premise: a fact that must be asserted or, negated, known not to hold. Packed as
/// `fact << 1 | is_negated`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Literal(pub u32);

impl Literal {
    /// The premise that `fact` is asserted.
    #[must_use]
    pub const fn holds(fact: FactId) -> Self {
        Self(fact.0 << 1)
    }

    /// The premise that `fact` is de-asserted or known absent.
    #[must_use]
    pub const fn is_absent(fact: FactId) -> Self {
        Self(fact.0 << 1 | 1)
    }

    /// The fact that is read.
    #[inline]
    #[must_use]
    pub const fn fact(self) -> FactId {
        FactId(self.0 >> 1)
    }

    /// Whether a fact of `value` satisfies the premise. Unknown satisfies neither form.
    #[inline]
    #[must_use]
    pub const fn is_met_by(self, value: Value) -> bool {
        value as u8 == self.wanted() as u8
    }

    /// The value that satisfies the premise; as an [`Assignment`], the value that is written.
    #[inline]
    #[must_use]
    pub const fn wanted(self) -> Value {
        if self.0 & 1 == 0 { Value::Asserted } else { Value::Absent }
    }
}

/// An output: a fact that a firing asserts or, negated, de-asserts. Packed like a [`Literal`].
pub type Assignment = Literal;

/// The rules, actions and facts of one board, as flat arrays (in ids of this board).
#[derive(Clone, Debug, Default, PartialEq, Eq, Archive, Serialize, Deserialize)]
pub struct BoardNetwork {
    /// How many facts the board has.
    pub fact_count: u32,
    /// Per rule its premises ([`Literal`]); repeats count twice.
    pub premises: Csr,
    /// Per rule the facts it writes ([`Assignment`]).
    pub outputs: Csr,
    /// Per rule the actions it queues.
    pub queues: Csr,
    /// Per action the facts it writes ([`Assignment`]).
    pub action_outputs: Csr,
    /// Per fact the rules that read it, as `rule << 1 | is_negated`; the reverse of `premises`.
    pub readers: Csr,
    /// Per fact the linked facts of other boards, two numbers a target: craft, fact.
    pub links: Csr,
    /// Rules that may fire again (ids, ascending).
    pub repeating_rules: Vec<u32>,
    /// Actions that may run again (ids, ascending).
    pub repeating_actions: Vec<u32>,
    /// Facts asserted at the start (ids, ascending).
    pub initial: Vec<u32>,
    /// Final facts (ids, ascending).
    pub finals: Vec<u32>,
    /// Per rule what running it costs, as the bits of an `f64` above 0; empty where each costs 1.
    pub rule_costs: Vec<u64>,
    /// Per action the same.
    pub action_costs: Vec<u64>,
    /// Per action the turns that it takes, at least 1; empty where each takes one.
    pub action_durations: Vec<u32>,
    /// Per action how likely it is to bring about what it presumes, as the bits of an `f64` above 0 and at
    /// most 1; empty where each is certain.
    pub action_likelihoods: Vec<u64>,
}

impl BoardNetwork {
    /// Computes [`Self::readers`] from the premises, in the memory that the table has.
    pub fn index_readers(&mut self) {
        let premises = self.premises.view();
        let named = premises.items().iter().map(|&packed| Literal(packed).fact().0);
        let pairs = premises.rows().zip(0_u32..).flat_map(|(row, rule)| {
            row.iter().map(move |&packed| (Literal(packed).fact().0, rule << 1 | (packed & 1)))
        });
        self.readers.refill(self.fact_count as usize, named, pairs);
    }

    /// Removes everything and keeps the memory, for the next trial's network.
    pub fn clear(&mut self) {
        self.fact_count = 0;
        for table in [
            &mut self.premises,
            &mut self.outputs,
            &mut self.queues,
            &mut self.action_outputs,
            &mut self.readers,
            &mut self.links,
        ] {
            table.clear();
        }
        for list in [
            &mut self.repeating_rules,
            &mut self.repeating_actions,
            &mut self.initial,
            &mut self.finals,
            &mut self.action_durations,
        ] {
            list.clear();
        }
        self.rule_costs.clear();
        self.action_costs.clear();
        self.action_likelihoods.clear();
    }

    /// Reads the network in place.
    #[must_use]
    pub fn view(&self) -> BoardView<'_> {
        BoardView {
            fact_count: self.fact_count,
            premises: self.premises.view(),
            outputs: self.outputs.view(),
            queues: self.queues.view(),
            action_outputs: self.action_outputs.view(),
            readers: self.readers.view(),
            links: self.links.view(),
            repeating_rules: &self.repeating_rules,
            repeating_actions: &self.repeating_actions,
            initial: &self.initial,
            finals: &self.finals,
            rule_costs: &self.rule_costs,
            action_costs: &self.action_costs,
            action_durations: &self.action_durations,
            action_likelihoods: &self.action_likelihoods,
        }
    }
}

impl ArchivedBoardNetwork {
    /// Reads the archived network in place.
    #[must_use]
    pub fn view(&self) -> BoardView<'_> {
        BoardView {
            fact_count: self.fact_count.to_native(),
            premises: self.premises.view(),
            outputs: self.outputs.view(),
            queues: self.queues.view(),
            action_outputs: self.action_outputs.view(),
            readers: self.readers.view(),
            links: self.links.view(),
            repeating_rules: numbers(&self.repeating_rules),
            repeating_actions: numbers(&self.repeating_actions),
            initial: numbers(&self.initial),
            finals: numbers(&self.finals),
            rule_costs: words(&self.rule_costs),
            action_costs: words(&self.action_costs),
            action_durations: numbers(&self.action_durations),
            action_likelihoods: words(&self.action_likelihoods),
        }
    }
}

/// A linked fact: `fact` on the board of `craft`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Target {
    /// The board's craft.
    pub craft: CraftId,
    /// The fact, as that board numbers it.
    pub fact: FactId,
}

/// One board's network, read in place. Fields as in [`BoardNetwork`].
#[derive(Clone, Copy, Debug)]
#[expect(missing_docs, reason = "documented at BoardNetwork")]
pub struct BoardView<'a> {
    pub fact_count: u32,
    pub premises: CsrView<'a>,
    pub outputs: CsrView<'a>,
    pub queues: CsrView<'a>,
    pub action_outputs: CsrView<'a>,
    pub readers: CsrView<'a>,
    pub links: CsrView<'a>,
    pub repeating_rules: &'a [u32],
    pub repeating_actions: &'a [u32],
    pub initial: &'a [u32],
    pub finals: &'a [u32],
    pub rule_costs: &'a [u64],
    pub action_costs: &'a [u64],
    pub action_durations: &'a [u32],
    pub action_likelihoods: &'a [u64],
}

impl<'a> BoardView<'a> {
    /// How many rules the board has.
    #[inline]
    #[must_use]
    pub fn rule_count(&self) -> u32 {
        crate::ids::RuleId::from_index(self.premises.row_count()).0
    }

    /// How many actions the board has.
    #[inline]
    #[must_use]
    pub fn action_count(&self) -> u32 {
        crate::ids::ActionId::from_index(self.action_outputs.row_count()).0
    }

    /// The facts of other boards that a change of `fact` reaches, at most one per craft, ascending
    /// by craft.
    #[inline]
    pub fn targets(&self, fact: FactId) -> impl ExactSizeIterator<Item = Target> + use<'a> {
        self.links
            .row(fact.index())
            .chunks_exact(2)
            .map(|pair| Target { craft: CraftId(pair[0]), fact: FactId(pair[1]) })
    }

    /// Whether a change of `fact` reaches another board.
    #[inline]
    #[must_use]
    pub fn is_boundary(&self, fact: FactId) -> bool {
        !self.links.row(fact.index()).is_empty()
    }

    /// The fact of `craft` that a change of `fact` reaches, if any.
    #[inline]
    #[must_use]
    pub fn target_on(&self, fact: FactId, craft: CraftId) -> Option<FactId> {
        self.targets(fact).find(|target| target.craft == craft).map(|target| target.fact)
    }

    /// Whether `fact` is final on this board.
    #[inline]
    #[must_use]
    pub fn is_final(&self, fact: FactId) -> bool {
        self.finals.binary_search(&fact.0).is_ok()
    }

    /// What running `rule` costs, its premises apart.
    #[inline]
    #[must_use]
    pub fn rule_cost(&self, rule: u32) -> f64 {
        self.rule_costs.get(rule as usize).map_or(1.0, |&bits| f64::from_bits(bits))
    }

    /// What running `action` costs.
    #[inline]
    #[must_use]
    pub fn action_cost(&self, action: u32) -> f64 {
        self.action_costs.get(action as usize).map_or(1.0, |&bits| f64::from_bits(bits))
    }

    /// Whether a firing may happen more than once in a trial.
    #[must_use]
    pub fn repeats(&self, firing: Firing) -> bool {
        match firing.target(self.rule_count()) {
            None => true,
            Some(FiringTarget::Rule(rule)) => self.repeating_rules.binary_search(&rule.0).is_ok(),
            Some(FiringTarget::Action(action)) => {
                self.repeating_actions.binary_search(&action.0).is_ok()
            }
        }
    }

    /// Turns that `action` takes.
    #[inline]
    #[must_use]
    pub fn action_duration(&self, action: u32) -> u32 {
        self.action_durations.get(action as usize).copied().unwrap_or(1)
    }

    /// How likely `action` is to bring about what it presumes.
    #[inline]
    #[must_use]
    pub fn action_likelihood(&self, action: u32) -> f64 {
        self.action_likelihoods.get(action as usize).map_or(1.0, |&bits| f64::from_bits(bits))
    }

    /// Whether the readers are the premises the other way round, of tables that are valid.
    fn reads_what_it_says(&self) -> bool {
        let mut told = vec![0_usize; self.fact_count as usize];
        let mut is_reader = |(rule, packed): (u32, u32)| {
            let fact = Literal(packed).fact().index();
            told[fact] += 1;
            self.readers.row(fact).get(told[fact] - 1) == Some(&(rule << 1 | (packed & 1)))
        };
        let rules = self.premises.rows().zip(0_u32..);
        let mut premises =
            rules.flat_map(|(row, rule)| row.iter().map(move |&packed| (rule, packed)));
        self.readers.item_count() == self.premises.item_count() && premises.all(&mut is_reader)
    }

    /// Whether every id in the network names something that exists, and every number is what it should be.
    #[must_use]
    pub fn is_valid(&self, craft_count: usize) -> bool {
        let facts = self.fact_count;
        let rules = self.premises.row_count();
        let actions = self.action_outputs.row_count();
        let literal_is_valid = |packed: u32| packed >> 1 < facts;
        let ascends_below = |ids: &[u32], bound: u32| {
            ids.windows(2).all(|pair| pair[0] < pair[1])
                && ids.last().is_none_or(|&last| last < bound)
        };
        self.premises.is_valid(rules, literal_is_valid)
            && self.outputs.is_valid(rules, literal_is_valid)
            && self.queues.is_valid(rules, |action| (action as usize) < actions)
            && self.action_outputs.is_valid(actions, literal_is_valid)
            && self.readers.is_valid(facts as usize, |rule| ((rule >> 1) as usize) < rules)
            && self.reads_what_it_says()
            && self.links.is_valid(facts as usize, |_| true)
            && (0..facts as usize).all(|fact| {
                let row = self.links.row(fact);
                row.len().is_multiple_of(2)
                    && row.chunks_exact(2).all(|pair| (pair[0] as usize) < craft_count)
            })
            && are_costs(self.rule_costs, rules)
            && are_costs(self.action_costs, actions)
            && are_costs(self.action_likelihoods, actions)
            && self.action_likelihoods.iter().all(|&bits| f64::from_bits(bits) <= 1.0)
            && (self.action_durations.is_empty() || self.action_durations.len() == actions)
            && self.action_durations.iter().all(|&turns| turns > 0)
            && ascends_below(self.repeating_rules, self.rule_count())
            && ascends_below(self.repeating_actions, self.action_count())
            && ascends_below(self.initial, facts)
            && ascends_below(self.finals, facts)
    }
}

/// Whether there is no cost, or one for each of `count`, finite and above 0.
fn are_costs(costs: &[u64], count: usize) -> bool {
    let is_cost = |&bits: &u64| f64::from_bits(bits).is_finite() && f64::from_bits(bits) > 0.0;
    costs.is_empty() || (costs.len() == count && costs.iter().all(is_cost))
}
