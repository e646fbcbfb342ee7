//! Why a fact holds or does not, and why a rule or action did not run, in a trial of a finished run.
//!
//! A trial follows from its scenario and seed, so it is replayed by the oracle and nothing needs to be
//! stored; that it is the same trial is seen from the digest of its path, which the run recorded. Not
//! here: reading the run (`commands::explain`) and how an answer looks (`report::explain`).

mod because;
mod lacking;
mod subject;

#[cfg(test)]
mod tests;

pub use subject::{Subject, SubjectError, Thing, find};

use crate::report::explain::{Explanation, Lack, Step};
use crate::scenario::{NameTable, ResolvedScenario, compile};
use agent::lockstep::Outcome;
use agent::oracle::{Cause, History, Replay, Turnout};
use shared_types::ids::{ActionId, CraftId, FactId, Firing, FiringTarget, RuleId, Turn};
use shared_types::knowledge::{FleetNetwork, FleetView, Literal, Value};
use shared_types::wire::{EpochSpec, StrategyKind};

/// A replayed trial and everything that became of its facts.
#[derive(Debug)]
pub struct Trial<'a> {
    names: &'a NameTable,
    fleet: FleetView<'a>,
    spec: EpochSpec,
    replay: Replay,
    history: History,
}

impl<'a> Trial<'a> {
    /// Draws or copies the networks of `trial` into `network` and replays it. `strategy` says by which
    /// crafts changes went.
    #[must_use]
    pub fn of(
        scenario: &'a ResolvedScenario,
        strategy: StrategyKind,
        trial: u32,
        network: &'a mut FleetNetwork,
    ) -> Self {
        compile(scenario, scenario.scenario().run.seed, trial, network);
        let fleet = network.view();
        let spec = scenario.epoch_spec(strategy, trial);
        let replay = Replay::of(&fleet, &spec);
        let history = History::of(&replay, &fleet, &spec);
        Self { names: scenario.names(), fleet, spec, replay, history }
    }

    /// Digest of what was fired, as runs record it.
    #[must_use]
    pub fn path_digest(&self) -> u64 {
        self.replay.path_digest()
    }

    /// A final fact that holds at the end, the first by craft: what is explained where nothing is asked.
    #[must_use]
    pub fn final_fact(&self) -> Option<Subject> {
        let after = Turn(self.replay.turns);
        let finals = (0..)
            .map(CraftId)
            .zip(&self.fleet.boards)
            .flat_map(|(craft, board)| board.finals.iter().map(move |&fact| (craft, FactId(fact))));
        let mut asserted =
            finals.filter(|&(craft, fact)| self.value(craft, fact, after) == Value::Asserted);
        asserted.next().map(|(craft, fact)| Subject { craft, thing: Thing::Fact(fact) })
    }

    /// What `name` (`CRAFT.NAME`) means in this trial.
    ///
    /// # Errors
    /// If there is no such craft, or nothing of that name on its board.
    pub fn subject(&self, name: &str) -> Result<Subject, SubjectError> {
        subject::find(name, self.names, &self.fleet)
    }

    /// The answer to why `subject` is as it is at the end.
    #[must_use]
    pub fn explain(&self, subject: Subject) -> Explanation {
        let Subject { craft, thing } = subject;
        let mut explanation = Explanation {
            subject: self.name_of(subject),
            seed: self.spec.seed,
            trial: self.spec.trial,
            turns: self.replay.turns,
            end: match self.replay.outcome {
                Outcome::Finished => "finished",
                Outcome::Dropped => "dropped",
                Outcome::Stalled => "stalled",
            },
            strategy: self.spec.strategy.name(),
            ..Explanation::default()
        };
        match thing {
            Thing::Fact(fact) => self.explain_fact(craft, fact, &mut explanation),
            Thing::Rule(rule) => self.explain_rule(craft, rule, &mut explanation),
            Thing::Action(action) => self.explain_action(craft, action, &mut explanation),
        }
        explanation
    }

    fn explain_fact(&self, craft: CraftId, fact: FactId, explanation: &mut Explanation) {
        explanation.kind = "fact";
        let entries = self.history.entries(craft, fact);
        let Some(last) = entries.last() else {
            explanation.verdict = "is unknown: nothing asserted it".to_owned();
            explanation.lacks = vec![self.lack(craft, Literal::holds(fact))];
            return;
        };
        // A value that is written again stays since it was first taken.
        let since = entries.iter().rposition(|entry| entry.state.value != last.state.value);
        let first = &entries[since.map_or(0, |place| place + 1)];
        let word = match last.state.value {
            Value::Asserted => "holds",
            Value::Absent => "is known not to hold",
            Value::Unknown => "is unknown",
        };
        explanation.verdict = match first.cause {
            Cause::Initial => format!("{word}, from the start"),
            _ => format!("{word}, since turn {}", first.turn.0),
        };
        let chain = because::chain_of(self, craft, fact, first);
        (explanation.steps, explanation.rests_on) = chain;
        if last.state.value == Value::Absent {
            explanation.lacks = vec![self.lack(craft, Literal::holds(fact))];
        }
    }

    fn explain_rule(&self, craft: CraftId, rule: RuleId, explanation: &mut Explanation) {
        explanation.kind = "rule";
        let firing = Firing::of_rule(rule);
        if let Some(place) = self.last_run(craft, firing) {
            let turn = self.replay.firings[place].turn;
            explanation.verdict = format!("fired in turn {}", turn.0);
            (explanation.steps, explanation.rests_on) = because::chain_to(self, place);
            return;
        }
        let premises = self.fleet.board(craft).premises.row(rule.index());
        let after = Turn(self.replay.turns);
        let is_met = |&premise: &u32, turn: Turn| {
            let premise = Literal(premise);
            premise.is_met_by(self.value(craft, premise.fact(), turn))
        };
        let ready: Vec<u32> = (0..self.replay.turns)
            .filter(|&turn| premises.iter().all(|premise| is_met(premise, Turn(turn))))
            .collect();
        let unmet = premises.iter().filter(|premise| !is_met(premise, after));
        explanation.lacks = unmet.map(|&premise| self.lack(craft, Literal(premise))).collect();
        explanation.verdict = match (ready.first(), ready.last()) {
            (Some(first), Some(last)) => format!(
                "has not fired: it could have in {} turns ({first} to {last}), and the policy \
                 `{}` chose others",
                ready.len(),
                self.spec.reasoning.policy.name()
            ),
            _ if explanation.lacks.is_empty() => {
                "has not fired: its last premise was met in the last turn".to_owned()
            }
            _ => format!(
                "has not fired: {} of {} premises are not met",
                explanation.lacks.len(),
                premises.len()
            ),
        };
    }

    fn explain_action(&self, craft: CraftId, action: ActionId, explanation: &mut Explanation) {
        explanation.kind = "action";
        let board = self.fleet.board(craft);
        let firing = Firing::of_action(action, board.rule_count());
        if let Some(place) = self.last_run(craft, firing) {
            explanation.verdict = self.run_of_action(place);
            (explanation.steps, explanation.rests_on) = because::chain_to(self, place);
        } else if let Some(place) = self.queued_by(craft, action, self.replay.firings.len()) {
            let turn = self.replay.firings[place].turn;
            explanation.verdict =
                format!("has not run: it is queued since turn {}, and others ran first", turn.0);
            (explanation.steps, explanation.rests_on) = because::chain_to(self, place);
        } else {
            explanation.verdict = "has not run: no rule that runs it fired".to_owned();
            explanation.lacks = vec![self.lack_of_queuing(craft, action)];
        }
    }

    /// What the firing of an action at `place` came to.
    fn run_of_action(&self, place: usize) -> String {
        let fired = &self.replay.firings[place];
        let what = match fired.turnout {
            Turnout::Done => "ran in turn",
            Turnout::Underway => "was not over in turn",
            Turnout::InVain => "ran in vain in turn",
        };
        format!("{what} {}", fired.turn.0)
    }

    fn lack(&self, craft: CraftId, literal: Literal) -> Lack {
        lacking::lack(self, craft, literal)
    }

    fn lack_of_queuing(&self, craft: CraftId, action: ActionId) -> Lack {
        lacking::lack_of_queuing(self, craft, action)
    }

    /// The value of a fact when `turn` opened.
    fn value(&self, craft: CraftId, fact: FactId, turn: Turn) -> Value {
        self.history.value_before(craft, fact, turn)
    }

    /// Place of the last run of `firing`.
    fn last_run(&self, craft: CraftId, firing: Firing) -> Option<usize> {
        let is_it = |place: &usize| {
            let fired = &self.replay.firings[*place];
            fired.craft == craft && fired.firing == firing
        };
        (0..self.replay.firings.len()).rev().find(is_it)
    }

    /// Place of the firing before `place` by which `craft` queued `action`.
    fn queued_by(&self, craft: CraftId, action: ActionId, place: usize) -> Option<usize> {
        let board = self.fleet.board(craft);
        (0..place).rev().find(|&earlier| {
            let fired = &self.replay.firings[earlier];
            fired.craft == craft
                && matches!(fired.firing.target(board.rule_count()), Some(FiringTarget::Rule(rule))
                    if board.queues.row(rule.index()).contains(&action.0))
        })
    }

    fn name_of(&self, Subject { craft, thing }: Subject) -> String {
        let what = match thing {
            Thing::Fact(fact) => self.names.fact(craft, fact),
            Thing::Rule(rule) => self.names.rule(craft, rule),
            Thing::Action(action) => self.names.action(craft, action),
        };
        format!("{}: {what}", self.names.craft(craft))
    }

    /// A fact and, where it is one of absence, the sign of that.
    fn literal_name(&self, craft: CraftId, literal: Literal) -> String {
        let sign = if literal == Literal::holds(literal.fact()) { "" } else { "!" };
        format!("{sign}{}", self.names.fact(craft, literal.fact()))
    }
}

/// Steps in the order in which they happened, and what held from the start.
type Chain = (Vec<Step>, Vec<String>);
