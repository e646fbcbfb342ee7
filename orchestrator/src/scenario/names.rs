//! What dense ids are called, for reports and errors.

use super::fleet::Craft;
use shared_types::ids::{ActionId, CraftId, FactId, Firing, FiringTarget, RuleId};
use std::borrow::Cow;

/// Names of crafts and, for missions, of what stands on their boards. What has no name of its own,
/// as everything on a generated board, is called by its number.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct NameTable {
    crafts: Vec<String>,
    boards: Vec<BoardNames>,
}

/// Names on one board, by id.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct BoardNames {
    pub(super) facts: Vec<String>,
    pub(super) rules: Vec<String>,
    pub(super) actions: Vec<String>,
}

impl NameTable {
    /// The names of `crafts`, and per craft those of its board (of none for generated networks).
    pub(super) fn new(crafts: &[Craft], boards: Vec<BoardNames>) -> Self {
        Self { crafts: crafts.iter().map(|craft| craft.name.clone()).collect(), boards }
    }

    /// The craft's name; the one behind the last craft is the centre.
    #[must_use]
    pub fn craft(&self, craft: CraftId) -> &str {
        self.crafts.get(craft.index()).map_or("centre", String::as_str)
    }

    /// The craft of that name.
    #[must_use]
    pub fn craft_id(&self, name: &str) -> Option<CraftId> {
        self.crafts.iter().position(|known| known == name).map(CraftId::from_index)
    }

    /// The fact's name on the board of `craft`.
    #[must_use]
    pub fn fact(&self, craft: CraftId, fact: FactId) -> Cow<'_, str> {
        named(self.board(craft).and_then(|board| board.facts.get(fact.index())), "fact", fact.0)
    }

    /// The fact of that name on the board of `craft`.
    #[must_use]
    pub fn fact_id(&self, craft: CraftId, name: &str) -> Option<FactId> {
        let facts = &self.board(craft)?.facts;
        facts.iter().position(|known| known == name).map(FactId::from_index)
    }

    /// The rule's name on the board of `craft`.
    #[must_use]
    pub fn rule(&self, craft: CraftId, rule: RuleId) -> Cow<'_, str> {
        named(self.board(craft).and_then(|board| board.rules.get(rule.index())), "rule", rule.0)
    }

    /// The action's name on the board of `craft`.
    #[must_use]
    pub fn action(&self, craft: CraftId, action: ActionId) -> Cow<'_, str> {
        let name = self.board(craft).and_then(|board| board.actions.get(action.index()));
        named(name, "action", action.0)
    }

    /// What `firing` runs on the board of `craft`, which has `rule_count` rules.
    #[must_use]
    pub fn firing(&self, craft: CraftId, firing: Firing, rule_count: u32) -> Cow<'_, str> {
        match firing.target(rule_count) {
            Some(FiringTarget::Rule(rule)) => self.rule(craft, rule),
            Some(FiringTarget::Action(action)) => self.action(craft, action),
            None => Cow::Borrowed("idle"),
        }
    }

    fn board(&self, craft: CraftId) -> Option<&BoardNames> {
        self.boards.get(craft.index())
    }
}

fn named<'n>(name: Option<&'n String>, what: &str, number: u32) -> Cow<'n, str> {
    match name {
        Some(name) => Cow::Borrowed(name),
        None => Cow::Owned(format!("{what} {number}")),
    }
}
