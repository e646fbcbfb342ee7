//! Who writes what: the reverse of a network's outputs, built once a network.

use shared_types::knowledge::{BoardView, Csr, CsrView};

/// The rules and actions that write a literal, and the rules that queue an action.
#[derive(Clone, Debug)]
pub struct Producers {
    rules: Csr,
    actions: Csr,
    queuing: Csr,
}

impl Producers {
    /// Those of `board`.
    #[must_use]
    pub fn of(board: &BoardView<'_>) -> Self {
        let literals = 2 * board.fact_count as usize;
        Self {
            rules: reversed(board.outputs, literals),
            actions: reversed(board.action_outputs, literals),
            queuing: reversed(board.queues, board.action_outputs.row_count()),
        }
    }

    /// The rules that write `literal` themselves; one that writes it twice comes twice.
    #[inline]
    #[must_use]
    pub fn rules(&self, literal: u32) -> &[u32] {
        self.rules.view().row(literal as usize)
    }

    /// The actions that write `literal`.
    #[inline]
    #[must_use]
    pub fn actions(&self, literal: u32) -> &[u32] {
        self.actions.view().row(literal as usize)
    }

    /// The rules that queue `action`.
    #[inline]
    #[must_use]
    pub fn queuing(&self, action: u32) -> &[u32] {
        self.queuing.view().row(action as usize)
    }

    /// The rules that write `literal`, themselves or through an action; some may come twice.
    pub fn of_literal(&self, literal: u32) -> impl Iterator<Item = u32> {
        let through_actions =
            self.actions(literal).iter().flat_map(|&action| self.queuing(action).iter().copied());
        self.rules(literal).iter().copied().chain(through_actions)
    }
}

/// The rows of `table` by the items that they hold.
fn reversed(table: CsrView<'_>, items: usize) -> Csr {
    let rows = table.rows().zip(0_u32..);
    let pairs = rows.flat_map(|(row, index)| row.iter().map(move |&item| (item, index)));
    let mut reverse = Csr::default();
    reverse.refill(items, table.items().iter().copied(), pairs);
    reverse
}
