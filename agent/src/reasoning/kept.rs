//! Which facts, rules and actions of a network are still in it.

use shared_types::knowledge::BoardView;

/// One flag for each fact, rule and action: whether it is kept. A network itself is never rewritten;
/// whoever reads it looks here first.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Kept {
    /// By fact.
    pub facts: Vec<bool>,
    /// By rule.
    pub rules: Vec<bool>,
    /// By action.
    pub actions: Vec<bool>,
}

impl Kept {
    /// Everything of `board`.
    #[must_use]
    pub fn everything(board: &BoardView<'_>) -> Self {
        let mut kept = Self::default();
        kept.reset(board, true);
        kept
    }

    /// Sets every flag to `is_kept`, in the memory that is there.
    pub fn reset(&mut self, board: &BoardView<'_>, is_kept: bool) {
        let sizes = [
            (&mut self.facts, board.fact_count as usize),
            (&mut self.rules, board.premises.row_count()),
            (&mut self.actions, board.action_outputs.row_count()),
        ];
        for (flags, size) in sizes {
            flags.clear();
            flags.resize(size, is_kept);
        }
    }

    /// How many facts, rules and actions are kept.
    #[must_use]
    pub fn counts(&self) -> [usize; 3] {
        [&self.facts, &self.rules, &self.actions]
            .map(|flags| flags.iter().filter(|&&is_kept| is_kept).count())
    }
}
