//! What a rule lacks, and who could bring it about.

use super::Trial;
use crate::report::explain::{Lack, Maker};
use agent::oracle::Cause;
use shared_types::ids::{ActionId, CraftId, FactId, Firing, RuleId, Turn};
use shared_types::knowledge::{Literal, Value};

/// Premises of a maker that are named; more are counted.
const NAMED_MAX: usize = 3;

/// `literal`, which `craft` lacks at the end, and who could bring it about.
pub(super) fn lack(trial: &Trial<'_>, craft: CraftId, literal: Literal) -> Lack {
    let mut makers = makers_on(trial, craft, literal);
    for (other, board) in (0..).map(CraftId).zip(&trial.fleet.boards) {
        for fact in (0..board.fact_count).map(FactId) {
            if board.target_on(fact, craft) == Some(literal.fact()) {
                makers.extend(makers_on(trial, other, Literal(fact.0 << 1 | (literal.0 & 1))));
            }
        }
    }
    let who = trial.names.craft(craft);
    Lack {
        what: format!("{who}: {}", trial.literal_name(craft, literal)),
        state: state(trial, craft, literal.fact()),
        makers,
    }
}

/// That no rule queued `action`, and which could.
pub(super) fn lack_of_queuing(trial: &Trial<'_>, craft: CraftId, action: ActionId) -> Lack {
    let board = trial.fleet.board(craft);
    let rules = (0..board.rule_count()).map(RuleId);
    let queues = rules.filter(|rule| board.queues.row(rule.index()).contains(&action.0));
    Lack {
        what: format!("a rule that runs {}", trial.names.action(craft, action)),
        state: "none fired".to_owned(),
        makers: queues.map(|rule| rule_maker(trial, craft, rule)).collect(),
    }
}

/// The rules and actions of `craft` that write `literal`.
fn makers_on(trial: &Trial<'_>, craft: CraftId, literal: Literal) -> Vec<Maker> {
    let board = trial.fleet.board(craft);
    let rules = (0..board.rule_count())
        .map(RuleId)
        .filter(|rule| board.outputs.row(rule.index()).contains(&literal.0));
    let actions = (0..board.action_count())
        .map(ActionId)
        .filter(|action| board.action_outputs.row(action.index()).contains(&literal.0));
    let rules = rules.map(|rule| rule_maker(trial, craft, rule));
    rules.chain(actions.map(|action| action_maker(trial, craft, action))).collect()
}

fn rule_maker(trial: &Trial<'_>, craft: CraftId, rule: RuleId) -> Maker {
    let maker = |standing: String| Maker {
        craft: trial.names.craft(craft).to_owned(),
        what: trial.names.rule(craft, rule).into_owned(),
        standing,
    };
    if let Some(place) = trial.last_run(craft, Firing::of_rule(rule)) {
        return maker(format!("fired in turn {}", trial.replay.firings[place].turn.0));
    }
    let after = Turn(trial.replay.turns);
    let premises = trial.fleet.board(craft).premises.row(rule.index()).iter();
    let unmet: Vec<String> = premises
        .map(|&premise| Literal(premise))
        .filter(|premise| !premise.is_met_by(trial.value(craft, premise.fact(), after)))
        .map(|premise| trial.literal_name(craft, premise))
        .collect();
    let named = unmet.iter().take(NAMED_MAX).map(String::as_str).collect::<Vec<_>>().join(", ");
    maker(match unmet.len() {
        0 => "could fire".to_owned(),
        count if count > NAMED_MAX => format!("lacks {named} and {} more", count - NAMED_MAX),
        _ => format!("lacks {named}"),
    })
}

fn action_maker(trial: &Trial<'_>, craft: CraftId, action: ActionId) -> Maker {
    let rules = trial.fleet.board(craft).rule_count();
    let run = trial.last_run(craft, Firing::of_action(action, rules));
    let queued = trial.queued_by(craft, action, trial.replay.firings.len());
    let turn = |place: usize| trial.replay.firings[place].turn.0;
    let standing = match (run, queued) {
        (Some(place), _) => trial.run_of_action(place),
        (None, Some(place)) => format!("queued in turn {}, not run", turn(place)),
        (None, None) => "never queued".to_owned(),
    };
    Maker {
        craft: trial.names.craft(craft).to_owned(),
        what: trial.names.action(craft, action).into_owned(),
        standing,
    }
}

/// What a fact is at the end, and since when.
fn state(trial: &Trial<'_>, craft: CraftId, fact: FactId) -> String {
    let entries = trial.history.entries(craft, fact);
    let Some(last) = entries.last() else { return "unknown".to_owned() };
    let word = match last.state.value {
        Value::Unknown => "unknown",
        Value::Asserted => "asserted",
        Value::Absent => "known not to hold",
    };
    match last.cause {
        Cause::Initial => format!("{word} from the start"),
        Cause::Fired { .. } => format!("{word} since turn {}", last.turn.0),
        Cause::Told { from: (from, _), .. } => {
            format!("{word} since turn {}, told by {}", last.turn.0, trial.names.craft(from))
        }
    }
}
