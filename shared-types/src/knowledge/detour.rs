//! The tree without those of its crafts that are gone.
//!
//! Who hung below a craft that is gone hangs below the nearest ancestor that lives; if the root is gone,
//! the living child of it with the lowest id (or the lowest living craft, if it has none) takes its
//! place. Crafts that are gone become leaves below the root: nothing is passed on through them, and
//! whoever comes back finds the tree that the scenario states. Groups stay; a group that lost its leader
//! gets the next one by the rule that chose the first.

use super::{Topology, TopologyView};
use crate::ids::CraftId;

impl Topology {
    /// The topology of `whole` without the crafts for which `is_gone` holds; `None` if nobody is left.
    ///
    /// # Panics
    /// Never: cutting leaves out of a tree leaves a tree.
    #[must_use]
    pub fn without(whole: &TopologyView<'_>, is_gone: impl Fn(CraftId) -> bool) -> Option<Self> {
        let crafts = || (0..whole.parent.len()).map(CraftId::from_index);
        let above = |craft: CraftId| CraftId(whole.parent[craft.index()]);
        let lives = |craft: &CraftId| !is_gone(*craft);
        let living_ancestor = |craft: CraftId| {
            let mut at = above(craft);
            while at != CraftId::NONE && is_gone(at) {
                at = above(at);
            }
            at
        };
        // Those that have no living ancestor: the root, or what it leaves behind.
        let orphans =
            || crafts().filter(lives).filter(|&craft| living_ancestor(craft) == CraftId::NONE);
        let nearest = orphans().map(|craft| whole.depth[craft.index()]).min()?;
        let root = orphans().find(|craft| whole.depth[craft.index()] == nearest)?;
        let parent = crafts()
            .map(|craft| match living_ancestor(craft) {
                _ if craft == root => CraftId::NONE.0,
                _ if is_gone(craft) => root.0,
                ancestor if ancestor == CraftId::NONE => root.0,
                ancestor => ancestor.0,
            })
            .collect();
        // Whoever is gone is in a group of its own, so that it leads nobody.
        let apart = CraftId::from_index(whole.parent.len()).0;
        let group = whole.group.iter().zip(crafts());
        let group =
            group.map(|(&group, craft)| if is_gone(craft) { apart + craft.0 } else { group });
        let topology = Self::new(parent, group.collect());
        Some(topology.expect("invariant: every craft hangs below one that lives"))
    }

    /// Reads the topology in place.
    #[must_use]
    pub fn view(&self) -> TopologyView<'_> {
        TopologyView {
            parent: &self.parent,
            depth: &self.depth,
            group: &self.group,
            leader_parent: &self.leader_parent,
            leader_depth: &self.leader_depth,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{CraftId, Topology};

    const ROOT: u32 = CraftId::NONE.0;

    /// Parents after the crafts `gone` are gone from the binary tree of seven.
    fn parents_without(gone: &[u32]) -> Vec<u32> {
        let whole = Topology::binary(7);
        let cut = Topology::without(&whole.view(), |craft| gone.contains(&craft.0));
        cut.expect("somebody lives").parent
    }

    #[test]
    fn children_adopt_the_grandparent() {
        assert_eq!(parents_without(&[]), [ROOT, 0, 0, 1, 1, 2, 2]);
        assert_eq!(parents_without(&[1]), [ROOT, 0, 0, 0, 0, 2, 2]);
        assert_eq!(parents_without(&[2, 5]), [ROOT, 0, 0, 1, 1, 0, 0]);
    }

    #[test]
    fn the_root_is_followed_by_its_first_living_child() {
        assert_eq!(parents_without(&[0]), [1, ROOT, 1, 1, 1, 2, 2]);
        assert_eq!(parents_without(&[0, 1]), [2, 2, ROOT, 2, 2, 2, 2]);
        assert_eq!(parents_without(&[0, 1, 2]), [3, 3, 3, ROOT, 3, 3, 3]);
    }

    #[test]
    fn nobody_left_has_no_tree_and_groups_find_another_leader() {
        let whole = Topology::binary(3);
        assert_eq!(Topology::without(&whole.view(), |_| true), None);
        let grouped = Topology::new(vec![ROOT, 0, 0, 1], vec![0, 0, 1, 0]).expect("a tree");
        let cut = Topology::without(&grouped.view(), |craft| craft.0 == 0).expect("some live");
        assert_eq!(cut.leader_parent[3], 1, "the next member nearest the root leads");
        assert_eq!(cut.leader_parent[2], 1);
    }
}
