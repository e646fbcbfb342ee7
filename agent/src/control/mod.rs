//! What a craft fires among what it could fire.
//!
//! Under `random` a candidate is drawn. Under `naive` the queued action of the lowest number comes first,
//! else the rule behind the one that ran last, round and round. Under `best-path` a candidate on the
//! cheapest known way to a final fact comes first ([`Planner`]), of several that of the lowest number;
//! where none of them lies on it, the naive order chooses among those that can serve a final fact at all. A
//! craft is idle only when nothing of use can be fired, so crafts that plan differently for want of
//! knowledge never wait for each other. Not here: what a firing does (`blackboard`).

pub mod acting;
#[cfg(test)]
mod tests;

use crate::blackboard::Blackboard;
use crate::reasoning::planner::Planner;
use acting::Effect;
use shared_types::ids::{CraftId, FactId, Firing};
use shared_types::knowledge::{BoardView, Change, FleetView, Value};
use shared_types::reasoning::Policy;
use shared_types::rng::Stream;

/// The control of one craft.
#[derive(Clone, Debug, Default)]
pub struct Control {
    policy: Policy,
    /// The rule behind the one that ran last.
    next_rule: u32,
    planner: Option<Box<Planner>>,
}

impl Control {
    /// Starts a trial of `craft` under `policy`.
    pub fn reset(&mut self, policy: Policy, craft: CraftId, fleet: &FleetView<'_>) {
        self.policy = policy;
        self.next_rule = 0;
        self.planner = (policy == Policy::BestPath).then(|| Box::new(Planner::new(craft, fleet)));
    }

    /// What to fire now; only a random policy draws.
    pub fn choose(
        &mut self,
        state: &Blackboard,
        board: &BoardView<'_>,
        draws: &mut Stream,
    ) -> Firing {
        match (self.policy, &mut self.planner) {
            (_, Some(planner)) => {
                let on_the_way = planner.steps().iter().find(|&&step| state.is_candidate(step));
                on_the_way.copied().unwrap_or_else(|| {
                    in_order(state, board, self.next_rule, |firing| planner.serves(firing))
                })
            }
            (Policy::Random, None) => match state.candidate_count() {
                0 => Firing::IDLE,
                count => state.candidate(draws.below(count)),
            },
            _ => in_order(state, board, self.next_rule, |_| true),
        }
    }

    /// The craft fired with this effect, and wrote `changes`. An action in vain that may be tried again
    /// leaves everything as it was; any other is spent, and a plan that rested on it is made anew.
    pub fn note_fired(
        &mut self,
        board: &BoardView<'_>,
        (firing, effect): (Firing, Effect),
        changes: &[Change],
    ) {
        if firing.0 < board.rule_count() {
            self.next_rule = firing.0 + 1;
        }
        let is_left = match effect {
            Effect::Done => false,
            Effect::Underway => true,
            Effect::InVain => board.repeats(firing),
        };
        if let Some(planner) = self.planner.as_mut().filter(|_| !is_left) {
            planner.note_fired(board, firing);
            changes.iter().for_each(|change| planner.note(change.fact, change.value));
        }
    }

    /// The craft took over what another wrote.
    pub fn note_merged(&mut self, fact: FactId, value: Value) {
        if let Some(planner) = &mut self.planner {
            planner.note(fact, value);
        }
    }

    /// The planner, under `best-path`.
    #[must_use]
    pub fn planner(&self) -> Option<&Planner> {
        self.planner.as_deref()
    }
}

/// The first candidate in the naive order that `serves`.
fn in_order(
    state: &Blackboard,
    board: &BoardView<'_>,
    next_rule: u32,
    serves: impl Fn(Firing) -> bool,
) -> Firing {
    let rules = board.rule_count();
    let first = |from: u32, until: u32| {
        let mut from = from;
        while let Some(firing) = state.next_candidate(from).filter(|firing| firing.0 < until) {
            if serves(firing) {
                return Some(firing);
            }
            from = firing.0 + 1;
        }
        None
    };
    first(rules, rules + board.action_count())
        .or_else(|| first(next_rule, rules))
        .or_else(|| first(0, next_rule.min(rules)))
        .unwrap_or(Firing::IDLE)
}
