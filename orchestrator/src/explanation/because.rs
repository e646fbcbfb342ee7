//! The chain of firings and tellings that led to a value.

use super::{Chain, Trial};
use crate::report::explain::Step;
use agent::oracle::{Cause, Entry, relays};
use shared_types::ids::{CraftId, FactId, FiringTarget};
use shared_types::knowledge::{Literal, Value};
use std::collections::{BTreeMap, BTreeSet};

/// Why `fact` of `craft` took the value of `entry`.
pub(super) fn chain_of(trial: &Trial<'_>, craft: CraftId, fact: FactId, entry: &Entry) -> Chain {
    let mut because = Because::of(trial);
    because.follow(craft, fact, entry);
    because.finish()
}

/// Why the firing at `place` of the replay could run.
pub(super) fn chain_to(trial: &Trial<'_>, place: usize) -> Chain {
    let mut because = Because::of(trial);
    because.fire(place, None);
    because.finish()
}

/// A chain on the way.
struct Because<'t, 'a> {
    trial: &'t Trial<'a>,
    /// Firings by place, with the facts that are needed of them and what they queue.
    fired: BTreeMap<usize, BTreeSet<String>>,
    /// Tellings: firing, from, to, with the facts told.
    told: BTreeMap<(usize, CraftId, CraftId), BTreeSet<String>>,
    initial: BTreeSet<String>,
    /// Firings whose premises are still to be followed.
    work: Vec<usize>,
}

impl<'t, 'a> Because<'t, 'a> {
    const fn of(trial: &'t Trial<'a>) -> Self {
        Self {
            trial,
            fired: BTreeMap::new(),
            told: BTreeMap::new(),
            initial: BTreeSet::new(),
            work: Vec::new(),
        }
    }

    /// Notes how `fact` of `craft` came by the value of `entry`.
    fn follow(&mut self, craft: CraftId, fact: FactId, entry: &Entry) {
        let is_absent = entry.state.value == Value::Absent;
        let literal = Literal(fact.0 << 1 | u32::from(is_absent));
        let name = self.trial.literal_name(craft, literal);
        match entry.cause {
            Cause::Initial => {
                let who = self.trial.names.craft(craft);
                self.initial.insert(format!("{who}: {name}"));
            }
            Cause::Fired { firing } => self.fire(firing, Some(name)),
            Cause::Told { from: (from, there), firing } => {
                let literal = Literal(there.0 << 1 | u32::from(is_absent));
                let told = self.trial.literal_name(from, literal);
                let shown =
                    if told == name { name } else { format!("{told} (its name there: {name})") };
                self.told.entry((firing, from, craft)).or_default().insert(shown);
                self.fire(firing, Some(told));
            }
        }
    }

    /// Notes that the firing at `place` is needed, for the fact or action `wrote`.
    fn fire(&mut self, place: usize, wrote: Option<String>) {
        let is_new = !self.fired.contains_key(&place);
        self.fired.entry(place).or_default().extend(wrote);
        if is_new {
            self.work.push(place);
        }
    }

    /// Follows everything to the start.
    fn finish(mut self) -> Chain {
        while let Some(place) = self.work.pop() {
            let fired = &self.trial.replay.firings[place];
            let (craft, turn) = (fired.craft, fired.turn);
            let board = self.trial.fleet.board(craft);
            match fired.firing.target(board.rule_count()) {
                Some(FiringTarget::Rule(rule)) => {
                    for &premise in board.premises.row(rule.index()) {
                        let fact = Literal(premise).fact();
                        if let Some(entry) = self.trial.history.before(craft, fact, turn) {
                            self.follow(craft, fact, entry);
                        }
                    }
                }
                Some(FiringTarget::Action(action)) => {
                    let name = self.trial.names.action(craft, action).into_owned();
                    if let Some(queuing) = self.trial.queued_by(craft, action, place) {
                        self.fire(queuing, Some(format!("queues {name}")));
                    }
                }
                None => {}
            }
        }
        (self.steps(), self.initial.into_iter().collect())
    }

    fn steps(&self) -> Vec<Step> {
        let names = self.trial.names;
        let mut steps = Vec::new();
        for (&place, writes) in &self.fired {
            let fired = &self.trial.replay.firings[place];
            let rules = self.trial.fleet.board(fired.craft).rule_count();
            steps.push(Step {
                turn: fired.turn.0,
                craft: names.craft(fired.craft).to_owned(),
                does: if fired.firing.0 < rules { "fires" } else { "runs" },
                what: names.firing(fired.craft, fired.firing, rules).into_owned(),
                gives: writes.iter().cloned().collect(),
                to: None,
                through: Vec::new(),
            });
        }
        for (&(place, from, to), facts) in &self.told {
            let through = relays(self.trial.spec.strategy, &self.trial.fleet, from, to);
            steps.push(Step {
                turn: self.trial.replay.firings[place].turn.0,
                craft: names.craft(from).to_owned(),
                does: "tells",
                what: facts.iter().map(String::as_str).collect::<Vec<_>>().join(", "),
                gives: Vec::new(),
                to: Some(names.craft(to).to_owned()),
                through: through.iter().map(|&craft| names.craft(craft).to_owned()).collect(),
            });
        }
        // Within a turn everybody fires before anything is known elsewhere.
        steps.sort_by_key(|step| (step.turn, step.to.is_some()));
        steps
    }
}
