//! What a user asks about: `CRAFT.NAME`, a fact, rule or action of a craft.

use crate::scenario::{NameTable, nearest};
use shared_types::ids::{ActionId, CraftId, FactId, RuleId};
use shared_types::knowledge::FleetView;

/// What is asked about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Subject {
    /// On whose board.
    pub craft: CraftId,
    /// What there.
    pub thing: Thing,
}

/// Something on a board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Thing {
    /// A fact.
    Fact(FactId),
    /// A rule.
    Rule(RuleId),
    /// An action.
    Action(ActionId),
}

/// Why a name means nothing.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SubjectError {
    /// No dot.
    #[error("`{0}` names no craft and fact, rule or action: write `CRAFT.NAME`, as in `{1}.NAME`")]
    NoCraft(String, String),
    /// No such craft.
    #[error("there is no craft `{0}`; the crafts are {1}")]
    UnknownCraft(String, String),
    /// Nothing of that name.
    #[error("`{0}` has no fact, rule or action `{1}`; {2}")]
    Unknown(String, String, String),
}

/// What `name` (`CRAFT.NAME`) means on the boards of `fleet`.
///
/// # Errors
/// If there is no such craft, or nothing of that name on its board.
pub fn find(name: &str, names: &NameTable, fleet: &FleetView<'_>) -> Result<Subject, SubjectError> {
    let crafts: Vec<CraftId> = (0..fleet.craft_count()).map(CraftId).collect();
    let first = names.craft(CraftId(0)).to_owned();
    let split = name.find(['.', ':']).map(|at| (&name[..at], name[at + 1..].trim()));
    let (who, what) = split.ok_or_else(|| SubjectError::NoCraft(name.to_owned(), first))?;
    let craft = names.craft_id(who).ok_or_else(|| {
        let known: Vec<&str> = crafts.iter().take(10).map(|&craft| names.craft(craft)).collect();
        SubjectError::UnknownCraft(who.to_owned(), known.join(", "))
    })?;
    let board = fleet.board(craft);
    let facts = (0..board.fact_count).map(FactId);
    let rules = (0..board.rule_count()).map(RuleId);
    let actions = (0..board.action_count()).map(ActionId);
    let mut fact = facts.clone().filter(|&fact| names.fact(craft, fact) == what);
    let mut rule = rules.clone().filter(|&rule| names.rule(craft, rule) == what);
    let mut action = actions.clone().filter(|&action| names.action(craft, action) == what);
    let thing = fact
        .next()
        .map(Thing::Fact)
        .or_else(|| rule.next().map(Thing::Rule))
        .or_else(|| action.next().map(Thing::Action));
    thing.map(|thing| Subject { craft, thing }).ok_or_else(|| {
        let mut known: Vec<String> =
            facts.map(|fact| names.fact(craft, fact).into_owned()).collect();
        known.extend(rules.map(|rule| names.rule(craft, rule).into_owned()));
        known.extend(actions.map(|action| names.action(craft, action).into_owned()));
        let near = nearest(what, known.iter().map(String::as_str));
        let remedy = near.map_or_else(
            || "`slateswarm show` prints the mission".to_owned(),
            |near| format!("did you mean `{near}`?"),
        );
        SubjectError::Unknown(who.to_owned(), what.to_owned(), remedy)
    })
}
