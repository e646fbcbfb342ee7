//! Over which crafts a change travels to one that shares it, found by walking up from both ends.

use shared_types::ids::CraftId;
use shared_types::knowledge::TopologyView;
use shared_types::wire::StrategyKind;

/// The crafts from `source` to `sharer`, both included, under a strategy that serves sharers.
///
/// # Panics
/// If the strategy does not serve sharers one by one.
pub(super) fn route(
    strategy: StrategyKind,
    topology: &TopologyView<'_>,
    source: CraftId,
    sharer: CraftId,
) -> Vec<CraftId> {
    match strategy {
        StrategyKind::Boundary => vec![source, sharer],
        StrategyKind::Hierarchy => tree_path(topology.parent, source, sharer),
        StrategyKind::Hybrid
            if topology.group[source.index()] == topology.group[sharer.index()] =>
        {
            vec![source, sharer]
        }
        StrategyKind::Hybrid => tree_path(topology.leader_parent, source, sharer),
        _ => unreachable!("invariant: {strategy} does not route by sharer"),
    }
}

/// The path between two crafts in the tree of `parent`: up to the first common ancestor, down again.
fn tree_path(parent: &[u32], from: CraftId, to: CraftId) -> Vec<CraftId> {
    let mut up = way_to_root(parent, from);
    let mut down = way_to_root(parent, to);
    let mut meeting = None;
    while !up.is_empty() && up.last() == down.last() {
        meeting = up.pop();
        down.pop();
    }
    up.into_iter().chain(meeting).chain(down.into_iter().rev()).collect()
}

/// `craft` and all above it, the root last.
fn way_to_root(parent: &[u32], craft: CraftId) -> Vec<CraftId> {
    let above = |&craft: &CraftId| {
        let parent = CraftId(parent[craft.index()]);
        (parent != CraftId::NONE).then_some(parent)
    };
    std::iter::successors(Some(craft), above).collect()
}
