//! The state of one board: facts with versions, the rules' unmet premises, and the agenda.
//!
//! Matching counts: every rule keeps the number of its unmet premises, and a fact that changes its
//! value visits only the rules that read it. A rule whose count reaches zero is a candidate, and so
//! is an action that a rule queued. Not here: the network itself ([`BoardView`], shared and
//! immutable) and what others told ([`replica`]).

pub mod agenda;
pub mod grid;
pub mod replica;
#[cfg(test)]
mod tests;

use agenda::{Agenda, BitSet};
use shared_types::ids::{CraftId, FactId, Firing, FiringTarget};
use shared_types::knowledge::{Assignment, BoardView, Change, FactState, Value, Version};
use xxhash_rust::xxh3::Xxh3;

/// What a merge did with a delivered value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Merged {
    /// The delivery was newer and stands now.
    pub accepted: bool,
    /// Both had the same count of writes by different writers; the craft id decided.
    pub conflict: bool,
}

/// One board while it runs. Reset keeps the memory, so that a trial allocates nothing.
#[derive(Clone, Debug, Default)]
pub struct Blackboard {
    states: Vec<FactState>,
    unmet: Vec<u32>,
    agenda: Agenda,
    /// Rules and actions that may not become candidates again.
    is_spent: BitSet,
    /// Rules and actions that may fire more than once.
    repeats: BitSet,
    /// Final facts that the last firing newly asserted, if only for a moment.
    reached: Vec<FactId>,
    /// What the craft writes has at least this count: no earlier life of it gave out as much.
    count_floor: u32,
}

impl Blackboard {
    /// Puts the board into its state before the first turn: initial facts asserted with version
    /// (0, 0), nothing fired.
    pub fn reset(&mut self, board: &BoardView<'_>) {
        let rules = board.rule_count() as usize;
        let items = rules + board.action_count() as usize;
        self.count_floor = 0;
        self.states.clear();
        self.states.resize(board.fact_count as usize, FactState::default());
        self.agenda.reset(items);
        self.is_spent.reset(items);
        self.repeats.reset(items);
        for &rule in board.repeating_rules {
            self.repeats.insert(rule as usize);
        }
        for &action in board.repeating_actions {
            self.repeats.insert(rules + action as usize);
        }
        self.unmet.clear();
        for rule in 0..rules {
            let premises = board.premises.row(rule).len();
            self.unmet.push(u32::try_from(premises).expect("invariant: rows are below 2^32"));
            if premises == 0 {
                self.agenda.insert(rule);
            }
        }
        for &fact in board.initial {
            self.set(board, FactId(fact), Value::Asserted);
        }
    }

    /// From now on nothing is written with a count below `floor`.
    pub fn set_count_floor(&mut self, floor: u32) {
        self.count_floor = floor;
    }

    /// How many facts the board has.
    #[must_use]
    pub fn fact_count(&self) -> u32 {
        FactId::from_index(self.states.len()).0
    }

    /// Value and version of a fact.
    #[inline]
    #[must_use]
    pub fn state(&self, fact: FactId) -> FactState {
        self.states[fact.index()]
    }

    /// Value and version of every fact that was written or delivered, by fact.
    pub fn written(&self) -> impl Iterator<Item = (FactId, FactState)> + use<'_> {
        let states = (0..).map(FactId).zip(self.states.iter().copied());
        states.filter(|(_, state)| state.version.count > 0)
    }

    /// How many rules and actions could fire now.
    #[inline]
    #[must_use]
    pub fn candidate_count(&self) -> u32 {
        self.agenda.len()
    }

    /// The candidate of rank `rank` in id order, rules before actions.
    ///
    /// # Panics
    /// If there are not that many.
    #[inline]
    #[must_use]
    pub fn candidate(&self, rank: u32) -> Firing {
        Firing(self.agenda.select(rank))
    }

    /// Whether a firing is a candidate.
    #[inline]
    #[must_use]
    pub fn is_candidate(&self, firing: Firing) -> bool {
        self.agenda.contains(firing.0 as usize)
    }

    /// The first candidate from `from` on, in id order.
    #[must_use]
    pub fn next_candidate(&self, from: u32) -> Option<Firing> {
        self.agenda.next(from as usize).map(Firing)
    }

    /// Whether a rule or action has run and may not run again.
    #[inline]
    #[must_use]
    pub fn is_spent(&self, firing: Firing) -> bool {
        self.is_spent.contains(firing.0 as usize)
    }

    /// Whether any final fact holds.
    #[must_use]
    pub fn has_final(&self, board: &BoardView<'_>) -> bool {
        board.finals.iter().any(|&fact| self.states[fact as usize].value == Value::Asserted)
    }

    /// Runs a firing: writes its facts, queues its actions, and puts what it changed into `changes`
    /// (cleared first; each fact once, with its last version). Returns whether it newly asserted a
    /// final fact; see [`Self::reached`].
    pub fn fire(
        &mut self,
        board: &BoardView<'_>,
        craft: CraftId,
        firing: Firing,
        changes: &mut Vec<Change>,
    ) -> bool {
        changes.clear();
        self.reached.clear();
        let rules = board.rule_count();
        let Some(target) = firing.target(rules) else { return false };
        let item = firing.0 as usize;
        let repeats = self.repeats.contains(item);
        if !repeats {
            self.is_spent.insert(item);
        }
        let outputs = match target {
            FiringTarget::Rule(rule) => {
                if !repeats {
                    self.agenda.remove(item);
                }
                for &action in board.queues.row(rule.index()) {
                    self.queue(rules, action);
                }
                board.outputs.row(rule.index())
            }
            FiringTarget::Action(action) => {
                self.agenda.remove(item);
                board.action_outputs.row(action.index())
            }
        };
        for &packed in outputs {
            let assignment = Assignment { 0: packed };
            let change = self.write(board, craft, assignment);
            let is_asserted = change.altered && change.value == Value::Asserted;
            if is_asserted && board.is_final(change.fact) {
                self.reached.push(change.fact);
            }
            match changes.iter_mut().find(|earlier| earlier.fact == change.fact) {
                Some(earlier) => {
                    *earlier = Change { altered: earlier.altered || change.altered, ..change };
                }
                None => changes.push(change),
            }
        }
        !self.reached.is_empty()
    }

    /// Runs an action in vain: it has run, and writes nothing; one that may repeat stays queued. Reaches
    /// no final fact.
    pub fn fail(&mut self, action: Firing) -> bool {
        let item = action.0 as usize;
        if !self.repeats.contains(item) {
            self.is_spent.insert(item);
            self.agenda.remove(item);
        }
        self.rest()
    }

    /// Runs nothing, and so reaches no final fact.
    pub fn rest(&mut self) -> bool {
        self.reached.clear();
        false
    }

    /// Final facts that the last firing newly asserted, also one that it then took back itself.
    #[must_use]
    pub fn reached(&self) -> &[FactId] {
        &self.reached
    }

    /// Takes over a delivered value if it is newer.
    pub fn merge(
        &mut self,
        board: &BoardView<'_>,
        fact: FactId,
        value: Value,
        version: Version,
    ) -> Merged {
        let held = self.states[fact.index()].version;
        let accepted = version > held;
        if accepted {
            self.states[fact.index()].version = version;
            self.set(board, fact, value);
        }
        Merged { accepted, conflict: version.count == held.count && version.writer != held.writer }
    }

    /// Digest over (value u8, count u32, writer u32; little-endian) of every fact in id order.
    #[must_use]
    pub fn digest(&self) -> u64 {
        let mut hasher = Xxh3::new();
        for state in &self.states {
            hasher.update(&state_bytes(state));
        }
        hasher.digest()
    }

    fn queue(&mut self, rules: u32, action: u32) {
        let item = (rules + action) as usize;
        if !self.is_spent.contains(item) {
            self.agenda.insert(item);
        }
    }

    /// Writes one fact as a firing of `craft` does.
    pub fn write(
        &mut self,
        board: &BoardView<'_>,
        craft: CraftId,
        assignment: Assignment,
    ) -> Change {
        let fact = assignment.fact();
        let before = self.states[fact.index()];
        let count = before.version.count.saturating_add(1).max(self.count_floor);
        let version = Version { count, writer: craft };
        let value = assignment.wanted();
        self.states[fact.index()].version = version;
        self.set(board, fact, value);
        Change { fact, value, version, altered: before.value != value }
    }

    /// Sets a value and updates the rules that read the fact.
    fn set(&mut self, board: &BoardView<'_>, fact: FactId, value: Value) {
        let before = std::mem::replace(&mut self.states[fact.index()].value, value);
        if before == value {
            return;
        }
        for &reader in board.readers.row(fact.index()) {
            let (rule, premise) = ((reader >> 1) as usize, Assignment { 0: reader & 1 });
            let unmet = &mut self.unmet[rule];
            if premise.is_met_by(value) {
                *unmet -= 1;
                if *unmet == 0 && !self.is_spent.contains(rule) {
                    self.agenda.insert(rule);
                }
            } else if premise.is_met_by(before) {
                if *unmet == 0 {
                    self.agenda.remove(rule);
                }
                *unmet += 1;
            }
        }
    }
}

/// A fact's state as the digests see it.
pub(crate) fn state_bytes(state: &FactState) -> [u8; 9] {
    let mut bytes = [0; 9];
    bytes[0] = state.value as u8;
    bytes[1..5].copy_from_slice(&state.version.count.to_le_bytes());
    bytes[5..9].copy_from_slice(&state.version.writer.0.to_le_bytes());
    bytes
}
