//! `boundary`: changes of boundary facts go to each peer that shares one of them, one unicast a peer.

use super::{Context, Plans, Strategy};
use shared_types::ids::{CraftId, FactId};
use shared_types::knowledge::Change;
use shared_types::transport::Peers;

/// One unicast to each sharing peer.
#[derive(Clone, Copy, Debug, Default)]
pub struct Boundary;

impl Strategy for Boundary {
    fn plan(&mut self, context: &Context<'_>, changes: &[Change], plans: &mut Plans) {
        plans.send_towards_sharers(context, context.craft, changes, Some);
        plans.owed = CraftId::from_index(plans.requests.len()).0;
    }

    fn peers(&self, context: &Context<'_>) -> Peers {
        let board = context.fleet.board(context.craft);
        let mut is_sharing = vec![false; context.fleet.boards.len()];
        for target in (0..board.fact_count).flat_map(|fact| board.targets(FactId(fact))) {
            is_sharing[target.craft.index()] = true;
        }
        is_sharing[context.craft.index()] = false;
        let sharing = is_sharing.iter().enumerate().filter(|&(_, &is_sharing)| is_sharing);
        let unicast = sharing.map(|(craft, _)| CraftId::from_index(craft)).collect();
        Peers { unicast, ..Peers::default() }
    }
}
