//! `boundary`: changes of boundary facts go to each peer that shares one of them, one unicast a peer.

use super::{Context, Plans, Strategy};
use shared_types::ids::{CraftId, FactId};
use shared_types::knowledge::Change;
use shared_types::transport::Peers;
use std::collections::BTreeSet;

/// One unicast to each sharing peer.
#[derive(Clone, Copy, Debug, Default)]
pub struct Boundary;

impl Strategy for Boundary {
    fn plan(&mut self, context: &Context<'_>, changes: &[Change], plans: &mut Plans) {
        let hops = changes.iter().enumerate().flat_map(|(index, change)| {
            context.sharers(context.craft, change).map(move |sharer| (sharer, index))
        });
        plans.send_by_hop(changes, hops);
        plans.owed = CraftId::from_index(plans.requests.len()).0;
    }

    fn peers(&self, context: &Context<'_>) -> Peers {
        let unicast = sharing_peers(context).into_iter().collect();
        Peers { unicast, ..Peers::default() }
    }
}

/// Every craft that shares a boundary fact with the planning one.
pub(super) fn sharing_peers(context: &Context<'_>) -> BTreeSet<CraftId> {
    let board = context.fleet.board(context.craft);
    (0..board.fact_count)
        .flat_map(|fact| board.targets(FactId(fact)))
        .map(|target| target.craft)
        .filter(|&craft| craft != context.craft)
        .collect()
}
