//! One board as plainly as it can be kept: the state of every fact, what has run, what is queued.
//! Nothing is indexed; whoever asks for candidates gets all rules and actions looked at.

use shared_types::ids::{CraftId, FactId, Firing, FiringTarget};
use shared_types::knowledge::{BoardView, Change, FactState, Literal, Value, Version};

/// The state of one board.
#[derive(Clone, Debug)]
pub(super) struct PlainBoard {
    /// Per fact what is held.
    pub(super) states: Vec<FactState>,
    /// Per rule, then per action, whether it has run and may not run again.
    is_spent: Vec<bool>,
    /// Per rule, then per action, whether it may run again.
    repeats: Vec<bool>,
    /// Per action whether it is queued.
    is_queued: Vec<bool>,
}

impl PlainBoard {
    /// The board before the first turn.
    pub(super) fn new(network: &BoardView<'_>) -> Self {
        let (rules, actions) = (network.rule_count() as usize, network.action_count() as usize);
        let mut states = vec![FactState::default(); network.fact_count as usize];
        for &fact in network.initial {
            states[fact as usize].value = Value::Asserted;
        }
        let mut repeats = vec![false; rules + actions];
        for &rule in network.repeating_rules {
            repeats[rule as usize] = true;
        }
        for &action in network.repeating_actions {
            repeats[rules + action as usize] = true;
        }
        Self {
            states,
            is_spent: vec![false; rules + actions],
            repeats,
            is_queued: vec![false; actions],
        }
    }

    /// Per action whether it is queued.
    pub(super) fn queued(&self) -> &[bool] {
        &self.is_queued
    }

    /// Whether a rule or action has run and may not run again.
    pub(super) fn is_spent(&self, firing: Firing) -> bool {
        self.is_spent[firing.0 as usize]
    }

    /// What could run now, in id order, rules before actions: rules that have not run, or repeat,
    /// whose premises all hold; actions that are queued and have not run, or repeat.
    pub(super) fn list_candidates(&self, network: &BoardView<'_>, candidates: &mut Vec<u32>) {
        candidates.clear();
        let rules = network.rule_count();
        for rule in 0..rules {
            let premises = network.premises.row(rule as usize);
            let holds = |&premise: &u32| {
                let premise = Literal(premise);
                premise.is_met_by(self.states[premise.fact().index()].value)
            };
            if !self.is_spent[rule as usize] && premises.iter().all(holds) {
                candidates.push(rule);
            }
        }
        for action in 0..network.action_count() {
            if self.is_queued[action as usize] && !self.is_spent[(rules + action) as usize] {
                candidates.push(rules + action);
            }
        }
    }

    /// Runs `firing` for `craft`, appends what it changed to `changes` (each fact once, with its last
    /// version) and says whether it newly asserted a final fact of this board.
    pub(super) fn fire(
        &mut self,
        network: &BoardView<'_>,
        craft: CraftId,
        firing: Firing,
        changes: &mut Vec<Change>,
    ) -> bool {
        let outputs = match firing.target(network.rule_count()) {
            None => return false,
            Some(FiringTarget::Rule(rule)) => {
                for &action in network.queues.row(rule.index()) {
                    self.is_queued[action as usize] = true;
                }
                network.outputs.row(rule.index())
            }
            Some(FiringTarget::Action(action)) => {
                self.is_queued[action.index()] = false;
                network.action_outputs.row(action.index())
            }
        };
        self.is_spent[firing.0 as usize] = !self.repeats[firing.0 as usize];

        let first = changes.len();
        let mut reaches_final = false;
        for &output in outputs {
            let change = self.write(craft, Literal(output).fact(), Literal(output).wanted());
            reaches_final |=
                change.altered && change.value == Value::Asserted && network.is_final(change.fact);
            match changes[first..].iter_mut().find(|earlier| earlier.fact == change.fact) {
                Some(earlier) => {
                    *earlier = Change { altered: earlier.altered || change.altered, ..change };
                }
                None => changes.push(change),
            }
        }
        reaches_final
    }

    /// Runs an action in vain: as if it had run, without its outputs, but one that repeats stays queued.
    pub(super) fn run_in_vain(&mut self, network: &BoardView<'_>, action: Firing) {
        if !self.repeats[action.0 as usize] {
            self.is_queued[(action.0 - network.rule_count()) as usize] = false;
            self.is_spent[action.0 as usize] = true;
        }
    }

    /// Writes one fact: a new version of it, by `craft`.
    fn write(&mut self, craft: CraftId, fact: FactId, value: Value) -> Change {
        let state = &mut self.states[fact.index()];
        let version = Version { count: state.version.count + 1, writer: craft };
        let altered = state.value != value;
        *state = FactState { value, version };
        Change { fact, value, version, altered }
    }

    /// Takes over `told` if its version is the larger one, and says whether the two conflict: written
    /// equally often, by different crafts.
    pub(super) fn merge(&mut self, fact: FactId, told: FactState) -> bool {
        let held = &mut self.states[fact.index()];
        let (held_version, told_version) = (held.version, told.version);
        if (told_version.count, told_version.writer) > (held_version.count, held_version.writer) {
            *held = told;
        }
        told_version.count == held_version.count && told_version.writer != held_version.writer
    }

    /// Whether a final fact of this board is asserted.
    pub(super) fn holds_a_final(&self, network: &BoardView<'_>) -> bool {
        network.finals.iter().any(|&fact| self.states[fact as usize].value == Value::Asserted)
    }
}
