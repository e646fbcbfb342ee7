//! `hybrid`: direct inside a group, between groups along the tree of group leaders.
//!
//! What the origin sends inside its own group goes straight to the sharers, so a leader that relays
//! for the origin's group passes nothing on inside that group.

use super::hierarchy::neighbours;
use super::{Context, Plans, Strategy};
use shared_types::ids::CraftId;
use shared_types::knowledge::{Change, Topology, TopologyView};
use shared_types::transport::Peers;
use std::collections::BTreeSet;

/// Direct inside groups, over leaders between them.
#[derive(Clone, Debug, Default)]
pub struct Hybrid {
    /// Tree and groups without those that are gone, while somebody is.
    detour: Option<Topology>,
}

impl Hybrid {
    fn topology<'a>(&'a self, context: &Context<'a>) -> TopologyView<'a> {
        self.detour.as_ref().map_or(context.fleet.topology, Topology::view)
    }
}

impl Strategy for Hybrid {
    fn plan(&mut self, context: &Context<'_>, changes: &[Change], plans: &mut Plans) {
        let topology = self.topology(context);
        plans.send_towards_sharers(context, context.craft, changes, |sharer| {
            Some(if topology.are_grouped(context.craft, sharer) {
                sharer
            } else {
                topology.next_hop_over_leaders(context.craft, sharer)
            })
        });
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
        let topology = self.topology(context);
        if topology.next_hop_over_leaders(context.craft, origin) != source {
            // Told directly by a member of the own group, whose leader passes it on.
            return;
        }
        plans.send_towards_sharers(context, origin, changes, |sharer| {
            if topology.are_grouped(origin, sharer) {
                return None;
            }
            let hop = topology.next_hop_over_leaders(context.craft, sharer);
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
        let topology = context.fleet.topology;
        let own_group = topology.group[context.craft.index()];
        let members = topology
            .group
            .iter()
            .enumerate()
            .filter(|&(_, &group)| group == own_group)
            .map(|(craft, _)| CraftId::from_index(craft));
        let unicast: BTreeSet<CraftId> = members
            .chain(neighbours(topology.leader_parent, context.craft))
            .filter(|&craft| craft != context.craft)
            .collect();
        Peers { unicast: unicast.into_iter().collect(), ..Peers::default() }
    }
}
