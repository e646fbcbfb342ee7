//! What of a mission is odd and yet can be run: told once before a run, with its place and a remedy.
//!
//! A rule that can never fire, that asserts its own premise, that keeps itself going without end, or
//! that stands twice, and an action that no rule runs. What is the same on several crafts is told once.
//! Not here: what is refused (`validate`, `mission`, `reach`).

use super::draft::Entries;
use super::error::{Finding, Place, place};
use super::names::NameTable;
use super::reach::Reached;
use shared_types::ids::{ActionId, CraftId, RuleId};
use shared_types::knowledge::{BoardNetwork, BoardView, Literal};
use std::collections::{BTreeMap, BTreeSet};

/// What is odd about a rule or an action.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Oddity {
    NeverFires,
    AssertsItsPremise(Literal),
    NeverEnds,
    StandsTwice,
    NeverRuns,
}

/// The places of one oddity: entry of the scenario, the first craft and its id there, further crafts.
type Found = BTreeMap<(usize, Oddity), (CraftId, u32, usize)>;

/// One finding for each odd rule or action of `boards`, whose rules and actions come from `entries`.
pub(super) fn flags(
    reached: &Reached,
    boards: &[BoardNetwork],
    entries: &[Entries],
    names: &NameTable,
) -> Vec<Finding> {
    let (mut rules, mut actions) = (Found::new(), Found::new());
    for ((craft, board), entries) in (0..).map(CraftId).zip(boards).zip(entries) {
        let view = board.view();
        let mut is_queued = vec![false; view.action_count() as usize];
        let mut seen = BTreeSet::new();
        for rule in (0..view.rule_count()).map(RuleId) {
            view.queues
                .row(rule.index())
                .iter()
                .for_each(|&action| is_queued[action as usize] = true);
            let is_again = !seen.insert(sorted_rows(&view, rule));
            let again = is_again.then_some(Oddity::StandsTwice);
            for oddity in oddities(reached, &view, craft, rule).chain(again) {
                note(&mut rules, (entries.rules[rule.index()], oddity), craft, rule.0);
            }
        }
        let idle = (0..).zip(is_queued).filter(|(_, is_queued)| !is_queued);
        for (action, _) in idle {
            note(
                &mut actions,
                (entries.actions[action as usize], Oddity::NeverRuns),
                craft,
                action,
            );
        }
    }
    let told = |place: Place, oddity, (craft, id, others)| {
        let who = crafts(names, craft, others);
        let what = match oddity {
            Oddity::NeverRuns => names.action(craft, ActionId(id)),
            _ => names.rule(craft, RuleId(id)),
        };
        let (message, remedy) = match oddity {
            Oddity::NeverFires => (
                format!("the rule `{what}` of {who} can never fire"),
                "no chain leads to all its premises; assert them or remove it".to_owned(),
            ),
            Oddity::AssertsItsPremise(literal) => {
                let fact = names.fact(craft, literal.fact());
                let sign = if literal == Literal::holds(literal.fact()) { "" } else { "!" };
                (
                    format!("the rule `{what}` of {who} triggers itself by `{sign}{fact}`"),
                    format!("`{sign}{fact}` holds already when it fires; take it out of `then`"),
                )
            }
            Oddity::NeverEnds => (
                format!("the rule `{what}` of {who} repeats and may fire in every turn"),
                "nothing that it does ends its premises; de-assert one, or drop `repeat`"
                    .to_owned(),
            ),
            Oddity::StandsTwice => {
                (format!("the rule `{what}` of {who} stands twice"), "remove one".to_owned())
            }
            Oddity::NeverRuns => (
                format!("no rule of {who} runs the action `{what}`"),
                "name it in the `run` of a rule, or remove it".to_owned(),
            ),
        };
        Finding::at(place, message).help(remedy)
    };
    let of_rules = rules
        .into_iter()
        .map(|((entry, oddity), found)| told(place!["rule", entry], oddity, found));
    let of_actions = actions
        .into_iter()
        .map(|((entry, oddity), found)| told(place!["action", entry], oddity, found));
    of_rules.chain(of_actions).collect()
}

fn note(found: &mut Found, key: (usize, Oddity), craft: CraftId, id: u32) {
    found.entry(key).and_modify(|(_, _, others)| *others += 1).or_insert((craft, id, 0));
}

/// `a`, or `a` and how many others.
fn crafts(names: &NameTable, first: CraftId, others: usize) -> String {
    let name = names.craft(first);
    match others {
        0 => format!("`{name}`"),
        1 => format!("`{name}` and another craft"),
        _ => format!("`{name}` and {others} others"),
    }
}

/// What a rule reads, writes and runs, each in order: equal where two rules say the same.
fn sorted_rows(board: &BoardView<'_>, rule: RuleId) -> [Vec<u32>; 3] {
    [board.premises, board.outputs, board.queues].map(|table| {
        let mut row = table.row(rule.index()).to_vec();
        row.sort_unstable();
        row
    })
}

fn oddities(
    reached: &Reached,
    board: &BoardView<'_>,
    craft: CraftId,
    rule: RuleId,
) -> impl Iterator<Item = Oddity> {
    let premises = board.premises.row(rule.index());
    let actions = board.queues.row(rule.index()).iter();
    let outputs = || {
        let by_actions = actions.clone().flat_map(|&one| board.action_outputs.row(one as usize));
        board.outputs.row(rule.index()).iter().chain(by_actions)
    };
    let repeats = board.repeating_rules.binary_search(&rule.0).is_ok();
    let ends = outputs().any(|&output| premises.contains(&(output ^ 1)));
    let asserted = outputs().find(|output| premises.contains(output));
    [
        (!reached.can_fire(craft, rule)).then_some(Oddity::NeverFires),
        asserted.map(|&output| Oddity::AssertsItsPremise(Literal(output))),
        (repeats && !ends).then_some(Oddity::NeverEnds),
    ]
    .into_iter()
    .flatten()
}
