//! What a mission can come to: which rules can ever fire, which facts can ever hold.
//!
//! Starting from what holds at the start, every premise that can be met counts down the rules that
//! read it; a rule without an unmet premise can fire, and what it and its actions output can be met in
//! turn, on every board that shares it. Each premise is met once, so the work is linear. This is more
//! than can happen in one trial (a fact that is de-asserted still counts as one that can hold), hence
//! what is not reached here is never reached.

use super::error::{Finding, Place, place};
use super::names::NameTable;
use shared_types::ids::{CraftId, FactId, RuleId};
use shared_types::knowledge::{BoardNetwork, BoardView, Literal};
use shared_types::scenario::Scenario;

/// What can be met and fire, per craft.
#[derive(Clone, Debug)]
pub(super) struct Reached {
    /// Per literal, packed, whether it can be met.
    met: Vec<Vec<bool>>,
    /// Per rule how many of its premises can never be met.
    unmet: Vec<Vec<usize>>,
}

impl Reached {
    /// What `boards` can come to.
    pub(super) fn of(boards: &[BoardNetwork]) -> Self {
        let views: Vec<BoardView<'_>> = boards.iter().map(BoardNetwork::view).collect();
        let premise_counts = |board: &BoardView<'_>| {
            (0..board.premises.row_count()).map(|rule| board.premises.row(rule).len()).collect()
        };
        let mut reached = Self {
            met: views.iter().map(|board| vec![false; 2 * board.fact_count as usize]).collect(),
            unmet: views.iter().map(premise_counts).collect(),
        };
        let mut agenda: Vec<(usize, Literal)> = Vec::new();
        for (craft, board) in views.iter().enumerate() {
            let initial = board.initial.iter().map(|&fact| Literal::holds(FactId(fact)));
            agenda.extend(initial.map(|literal| (craft, literal)));
        }
        while let Some((craft, literal)) = agenda.pop() {
            if !std::mem::replace(&mut reached.met[craft][literal.0 as usize], true) {
                reached.count_down(&views, craft, literal, &mut agenda);
            }
        }
        reached
    }

    /// Notes that `literal` can be met; what fires for it goes on the agenda.
    fn count_down(
        &mut self,
        views: &[BoardView<'_>],
        craft: usize,
        literal: Literal,
        agenda: &mut Vec<(usize, Literal)>,
    ) {
        let board = &views[craft];
        for &reader in board.readers.row(literal.fact().index()) {
            if reader & 1 != literal.0 & 1 {
                continue;
            }
            let rule = (reader >> 1) as usize;
            self.unmet[craft][rule] -= 1;
            if self.unmet[craft][rule] > 0 {
                continue;
            }
            let queued = board.queues.row(rule).iter();
            let by_actions = queued.flat_map(|&action| board.action_outputs.row(action as usize));
            for &output in board.outputs.row(rule).iter().chain(by_actions) {
                let output = Literal(output);
                agenda.push((craft, output));
                agenda.extend(board.targets(output.fact()).map(|target| {
                    (target.craft.index(), Literal(target.fact.0 << 1 | (output.0 & 1)))
                }));
            }
        }
    }

    /// Refuses a mission in which nothing ever fires or that cannot reach a final fact it declares.
    pub(super) fn check(
        &self,
        scenario: &Scenario,
        boards: &[BoardNetwork],
        names: &NameTable,
    ) -> Result<(), Finding> {
        if self.unmet.iter().flatten().all(|&unmet| unmet > 0) {
            return Err(Finding::at(place!["rule"], "no rule can ever fire").help(
                "nothing that the rules rest on holds at the start; say what does with `initial`",
            ));
        }
        for (craft, board) in boards.iter().enumerate() {
            let is_unmet =
                |fact: &&u32| !self.met[craft][Literal::holds(FactId(**fact)).0 as usize];
            if let Some(&fact) = board.finals.iter().find(is_unmet) {
                let craft_id = CraftId::from_index(craft);
                let name = names.fact(craft_id, FactId(fact));
                let stated = &scenario.craft[craft].r#final;
                let position = stated.iter().position(|text| *text == name).unwrap_or_default();
                let place: Place = place!["craft", craft, "final", position];
                return Err(Finding::at(
                    place,
                    format!("`{name}` can never be reached on `{}`", names.craft(craft_id)),
                )
                .help("no chain of rules and actions leads there from what holds at the start")
                .label("out of reach"));
            }
        }
        Ok(())
    }

    /// Whether all premises of a rule can be met.
    pub(super) fn can_fire(&self, craft: CraftId, rule: RuleId) -> bool {
        self.unmet[craft.index()][rule.index()] == 0
    }
}
