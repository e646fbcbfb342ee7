//! The pruner as the text of chapter V describes it (Straub 2016). Its counts are not those of the
//! published tables; it is there to show that.
//!
//! Repeated until nothing changes: facts go that no rule reads, or that are not asserted and that
//! nothing asserts, out of every list as well; rules go that read such a fact or whose lists are empty;
//! actions go that no rule queues. Worklists over what each removal touches: linear in the network. The
//! loops are in [`super::reference`].

use crate::reasoning::Kept;
use shared_types::knowledge::{BoardView, Csr, CsrView, Literal};

/// Prunes `board`; facts in `board.initial` count as asserted.
#[must_use]
pub fn prune(board: &BoardView<'_>) -> Kept {
    let mut pruner = Pruner::new(board);
    for fact in 0..board.fact_count {
        pruner.check_fact(fact);
    }
    for rule in 0..board.rule_count() {
        pruner.check_rule(rule);
    }
    for action in 0..board.action_count() {
        pruner.check_action(action);
    }
    while let Some(gone) = pruner.gone.pop() {
        pruner.follow(gone);
    }
    pruner.kept
}

/// What was removed and still has to be followed up.
enum Gone {
    Fact(u32),
    Rule(u32),
    Action(u32),
}

struct Pruner<'a> {
    board: &'a BoardView<'a>,
    kept: Kept,
    is_initial: Vec<bool>,
    /// By fact, the rules that assert it.
    asserting_rules: Csr,
    /// By fact, how many places in rules that are left read it, and how many assert it.
    reads: Vec<u32>,
    asserts: Vec<u32>,
    /// By rule, entries left in its two lists.
    triggers: Vec<u32>,
    /// By action, places in rules that are left that queue it.
    queued: Vec<u32>,
    gone: Vec<Gone>,
}

impl<'a> Pruner<'a> {
    fn new(board: &'a BoardView<'a>) -> Self {
        let facts = board.fact_count as usize;
        let mut is_initial = vec![false; facts];
        board.initial.iter().for_each(|&fact| is_initial[fact as usize] = true);
        let mut reads = vec![0; facts];
        count_facts(board.premises, &mut reads);
        let mut asserts = vec![0; facts];
        count_facts(board.outputs, &mut asserts);
        count_facts(board.action_outputs, &mut asserts);
        let mut queued = vec![0; board.action_outputs.row_count()];
        board.queues.items().iter().for_each(|&action| queued[action as usize] += 1);
        let rows = board.outputs.rows().zip(board.queues.rows());
        let length = |row: &[u32]| u32::try_from(row.len()).unwrap_or(u32::MAX);
        Self {
            kept: Kept::everything(board),
            is_initial,
            asserting_rules: by_fact(board.outputs, facts),
            reads,
            asserts,
            triggers: rows.map(|(outputs, queues)| length(outputs) + length(queues)).collect(),
            queued,
            gone: Vec::new(),
            board,
        }
    }

    fn check_fact(&mut self, fact: u32) {
        let at = fact as usize;
        let is_needed = self.reads[at] > 0 && (self.is_initial[at] || self.asserts[at] > 0);
        if !is_needed && std::mem::take(&mut self.kept.facts[at]) {
            self.gone.push(Gone::Fact(fact));
        }
    }

    fn check_rule(&mut self, rule: u32) {
        if self.triggers[rule as usize] == 0 {
            self.remove_rule(rule);
        }
    }

    fn remove_rule(&mut self, rule: u32) {
        if std::mem::take(&mut self.kept.rules[rule as usize]) {
            self.gone.push(Gone::Rule(rule));
        }
    }

    fn check_action(&mut self, action: u32) {
        let at = action as usize;
        if self.queued[at] == 0 && std::mem::take(&mut self.kept.actions[at]) {
            self.gone.push(Gone::Action(action));
        }
    }

    fn follow(&mut self, gone: Gone) {
        let board = self.board;
        match gone {
            Gone::Fact(fact) => {
                for &packed in board.readers.row(fact as usize) {
                    self.remove_rule(packed >> 1);
                }
                let rules: Vec<u32> = self.asserting_rules.view().row(fact as usize).to_vec();
                for rule in rules {
                    self.triggers[rule as usize] -= 1;
                    self.check_rule(rule);
                }
            }
            Gone::Rule(rule) => {
                for &packed in board.premises.row(rule as usize) {
                    let fact = Literal(packed).fact();
                    self.reads[fact.index()] -= 1;
                    self.check_fact(fact.0);
                }
                for &packed in board.outputs.row(rule as usize) {
                    let fact = Literal(packed).fact();
                    self.asserts[fact.index()] -= 1;
                    self.check_fact(fact.0);
                }
                for &action in board.queues.row(rule as usize) {
                    self.queued[action as usize] -= 1;
                    self.check_action(action);
                }
            }
            Gone::Action(action) => {
                for &packed in board.action_outputs.row(action as usize) {
                    let fact = Literal(packed).fact();
                    self.asserts[fact.index()] -= 1;
                    self.check_fact(fact.0);
                }
            }
        }
    }
}

fn count_facts(table: CsrView<'_>, counts: &mut [u32]) {
    for &packed in table.items() {
        counts[Literal(packed).fact().index()] += 1;
    }
}

/// The rows of `table` by the facts that they name, repeats kept.
fn by_fact(table: CsrView<'_>, facts: usize) -> Csr {
    let rows = table.rows().zip(0_u32..);
    let pairs: Vec<(u32, u32)> = rows
        .flat_map(|(row, index)| row.iter().map(move |&packed| (Literal(packed).fact().0, index)))
        .collect();
    Csr::from_pairs(facts, &pairs)
}
