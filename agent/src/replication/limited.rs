//! `limited`: changes of boundary facts go to every other craft by unicasts, starting after oneself.

use super::{Context, Plans, Recipient, Strategy};
use shared_types::ids::FactId;
use shared_types::knowledge::{BoardView, Change};
use shared_types::transport::Peers;

/// A unicast to each other craft.
#[derive(Clone, Copy, Debug, Default)]
pub struct Limited;

impl Strategy for Limited {
    fn plan(&mut self, context: &Context<'_>, changes: &[Change], plans: &mut Plans) {
        let board = context.fleet.board(context.craft);
        let shared = changes.iter().filter(|change| board.is_boundary(change.fact)).copied();
        plans.send_all(context.others().map(Recipient::One), shared);
        if !plans.requests.is_empty() {
            plans.owed = context.fleet.craft_count() - 1;
        }
    }

    fn replicates(&self, board: &BoardView<'_>, fact: FactId) -> bool {
        board.is_boundary(fact)
    }

    fn peers(&self, context: &Context<'_>) -> Peers {
        let mut unicast: Vec<_> = context.others().collect();
        unicast.sort_unstable();
        Peers { unicast, ..Peers::default() }
    }
}
