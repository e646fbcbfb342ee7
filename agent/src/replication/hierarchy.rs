//! `hierarchy`: changes of boundary facts travel hop by hop along the tree, over the edges of the
//! subtree that spans the source and the sharers; relays do not apply what they pass on.

use super::{Context, Plans, Strategy};
use shared_types::ids::CraftId;
use shared_types::knowledge::{Change, Topology};
use shared_types::transport::Peers;

/// Hop by hop along the tree.
#[derive(Clone, Debug, Default)]
pub struct Hierarchy {
    /// The tree without those that are gone, while somebody is.
    detour: Option<Topology>,
}

impl Strategy for Hierarchy {
    fn plan(&mut self, context: &Context<'_>, changes: &[Change], plans: &mut Plans) {
        // No hop leads back to the planning craft, so the first leg is a relay from itself.
        self.plan_relay(context, context.craft, context.craft, changes, plans);
        plans.owe_sharers(context, changes);
    }

    fn plan_relay(
        &mut self,
        context: &Context<'_>,
        origin: CraftId,
        source: CraftId,
        changes: &[Change],
        plans: &mut Plans,
    ) {
        let topology = self.detour.as_ref().map_or(context.fleet.topology, Topology::view);
        plans.send_towards_sharers(context, origin, changes, |sharer| {
            let hop = topology.next_hop(context.craft, sharer);
            (hop != source).then_some(hop)
        });
    }

    fn reroute(&mut self, topology: Option<Topology>) {
        self.detour = topology;
    }

    fn relays(&self) -> bool {
        true
    }

    fn peers(&self, context: &Context<'_>) -> Peers {
        Peers {
            unicast: neighbours(context.fleet.topology.parent, context.craft),
            ..Peers::default()
        }
    }
}

/// Parent and children of `craft`, ascending.
pub(super) fn neighbours(parent: &[u32], craft: CraftId) -> Vec<CraftId> {
    let mut neighbours: Vec<CraftId> = parent
        .iter()
        .enumerate()
        .filter(|&(_, &above)| above == craft.0)
        .map(|(below, _)| CraftId::from_index(below))
        .collect();
    if parent[craft.index()] != CraftId::NONE.0 {
        neighbours.push(CraftId(parent[craft.index()]));
    }
    neighbours.sort_unstable();
    neighbours
}
