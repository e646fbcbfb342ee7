//! The networks of a whole fleet and its topology, as one archive.

use super::board::{ArchivedBoardNetwork, BoardNetwork, BoardView, Target};
use super::csr::{numbers, words};
use crate::ids::{CraftId, Firing};
use crate::trace::{TraceRecord, from_words};
use rkyv::{Archive, Deserialize, Serialize};

/// How crafts are arranged: the tree of the hierarchy and the groups of the hybrid strategy.
#[derive(Clone, Debug, Default, PartialEq, Eq, Archive, Serialize, Deserialize)]
pub struct Topology {
    /// Per craft its tree parent; [`CraftId::NONE`] for the root. Exactly one root.
    pub parent: Vec<u32>,
    /// Per craft its depth in the tree, 0 for the root.
    pub depth: Vec<u32>,
    /// Per craft its group; empty where no groups are stated.
    pub group: Vec<u32>,
    /// Per craft its parent in the tree of group leaders; empty where no groups are stated. A member
    /// hangs below its leader, a leader below the leader of its tree parent's group.
    pub leader_parent: Vec<u32>,
    /// Per craft its depth in the tree of group leaders; empty where no groups are stated.
    pub leader_depth: Vec<u32>,
}

/// Why parents do not form one tree.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NetworkError {
    /// Walking up from this craft never reaches a root.
    #[error("the tree has a cycle through craft {0}")]
    Cycle(CraftId),
    /// More or fewer roots than one.
    #[error("the tree has {0} roots instead of one")]
    Roots(usize),
    /// A parent that is not a craft.
    #[error("the parent of craft {0} does not exist")]
    UnknownParent(CraftId),
    /// An id in a board's network names nothing.
    #[error("the network of craft {0} names something that does not exist")]
    DanglingId(CraftId),
    /// The archive's bytes are not an archive of this version.
    #[error("the network archive is damaged: {0}")]
    Damaged(String),
}

impl Topology {
    /// The topology of `parent` (per craft, [`CraftId::NONE`] for the root) and `group` (per craft,
    /// or empty).
    ///
    /// # Errors
    /// If the parents do not form one tree over all crafts.
    ///
    /// # Panics
    /// If groups are given for some crafts only.
    pub fn new(parent: Vec<u32>, group: Vec<u32>) -> Result<Self, NetworkError> {
        let depth = depths(&parent)?;
        let (leader_parent, leader_depth) = if group.is_empty() {
            (Vec::new(), Vec::new())
        } else {
            assert_eq!(group.len(), parent.len(), "invariant: every craft has a group or none has");
            let leader_parent = leader_tree(&parent, &depth, &group);
            let leader_depth = depths(&leader_parent)?;
            (leader_parent, leader_depth)
        };
        Ok(Self { parent, depth, group, leader_parent, leader_depth })
    }

    /// The published experiment's tree: `parent(v) = (v - 1) / 2`, no groups.
    ///
    /// # Panics
    /// Never for a fleet within the limits.
    #[must_use]
    pub fn binary(craft_count: u32) -> Self {
        let parent = (0..craft_count)
            .map(|craft| if craft == 0 { CraftId::NONE.0 } else { (craft - 1) / 2 })
            .collect();
        Self::new(parent, Vec::new()).expect("invariant: halving reaches the root")
    }
}

/// Depth of every craft below the root.
fn depths(parent: &[u32]) -> Result<Vec<u32>, NetworkError> {
    let roots = parent.iter().filter(|&&above| above == CraftId::NONE.0).count();
    let mut depth = vec![u32::MAX; parent.len()];
    let mut path = Vec::new();
    for craft in 0..parent.len() {
        let mut here = craft;
        path.clear();
        let base = loop {
            if depth[here] != u32::MAX {
                break depth[here];
            }
            if path.len() > parent.len() {
                return Err(NetworkError::Cycle(CraftId::from_index(craft)));
            }
            path.push(here);
            match parent[here] {
                above if above == CraftId::NONE.0 => break u32::MAX,
                above if (above as usize) < parent.len() => here = above as usize,
                _ => return Err(NetworkError::UnknownParent(CraftId::from_index(here))),
            }
        };
        for (&below, step) in path.iter().rev().zip(1_u32..) {
            depth[below] = base.wrapping_add(step);
        }
    }
    if roots == 1 { Ok(depth) } else { Err(NetworkError::Roots(roots)) }
}

/// Parents in the tree of group leaders. A leader is its group's member nearest the root, the lowest
/// id on a tie; its tree parent therefore lies in another group, nearer the root.
fn leader_tree(parent: &[u32], depth: &[u32], group: &[u32]) -> Vec<u32> {
    let mut leaders = std::collections::BTreeMap::<u32, usize>::new();
    for craft in 0..parent.len() {
        let leader = leaders.entry(group[craft]).or_insert(craft);
        if depth[craft] < depth[*leader] {
            *leader = craft;
        }
    }
    let leader_of = |craft: usize| CraftId::from_index(leaders[&group[craft]]).0;
    (0..parent.len())
        .map(|craft| {
            if leader_of(craft) as usize != craft {
                leader_of(craft)
            } else if parent[craft] == CraftId::NONE.0 {
                CraftId::NONE.0
            } else {
                leader_of(parent[craft] as usize)
            }
        })
        .collect()
}

/// Everything immutable that a trial needs: every craft's board and the topology.
#[derive(Clone, Debug, Default, PartialEq, Eq, Archive, Serialize, Deserialize)]
pub struct FleetNetwork {
    /// One network per craft.
    pub boards: Vec<BoardNetwork>,
    /// Tree and groups.
    pub topology: Topology,
    /// Per craft the firing of every turn that the independent replay computed; only filled for the
    /// strategy `null`, which replays it.
    pub script: Vec<Vec<u32>>,
    /// Per craft its part of the trace of open mode, two words a record (see [`crate::trace`]); empty
    /// in lockstep.
    pub trace: Vec<Vec<u64>>,
}

impl FleetNetwork {
    /// Reads the network in place.
    #[must_use]
    pub fn view(&self) -> FleetView<'_> {
        FleetView {
            boards: self.boards.iter().map(BoardNetwork::view).collect(),
            topology: self.topology.view(),
            script: self.script.iter().map(Vec::as_slice).collect(),
            trace: self.trace.iter().map(|words| from_words(words)).collect(),
        }
    }

    /// The network as an archive: what travels through shared memory.
    ///
    /// # Panics
    /// Never: writing to memory cannot fail.
    #[must_use]
    pub fn to_archive(&self) -> rkyv::util::AlignedVec {
        rkyv::to_bytes::<rkyv::rancor::Error>(self).expect("invariant: memory takes every archive")
    }
}

/// A fleet's networks, read in place from the builder's memory or from an archive.
#[derive(Clone, Debug)]
pub struct FleetView<'a> {
    /// One network per craft.
    pub boards: Vec<BoardView<'a>>,
    /// Tree and groups.
    pub topology: TopologyView<'a>,
    /// As [`FleetNetwork::script`].
    pub script: Vec<&'a [u32]>,
    /// As [`FleetNetwork::trace`], by craft.
    pub trace: Vec<&'a [TraceRecord]>,
}

impl<'a> FleetView<'a> {
    /// Checks an archive once (layout by bytecheck, then every id) and reads it in place from then on.
    ///
    /// # Errors
    /// If the bytes are not an archive, or the network names something that does not exist.
    pub fn from_archive(bytes: &'a [u8]) -> Result<Self, NetworkError> {
        let archived = rkyv::access::<ArchivedFleetNetwork, rkyv::rancor::Error>(bytes)
            .map_err(|error| NetworkError::Damaged(error.to_string()))?;
        let topology = &archived.topology;
        if archived.trace.iter().any(|words| !words.len().is_multiple_of(2)) {
            return Err(NetworkError::Damaged("half a record of a trace".to_owned()));
        }
        let view = Self {
            boards: archived.boards.iter().map(ArchivedBoardNetwork::view).collect(),
            topology: TopologyView {
                parent: numbers(&topology.parent),
                depth: numbers(&topology.depth),
                group: numbers(&topology.group),
                leader_parent: numbers(&topology.leader_parent),
                leader_depth: numbers(&topology.leader_depth),
            },
            script: archived.script.iter().map(|firings| numbers(firings)).collect(),
            trace: archived.trace.iter().map(|part| from_words(words(part))).collect(),
        };
        view.validate()?;
        Ok(view)
    }

    /// Checks every id of every board, and that the trees are what the parents make of them.
    ///
    /// # Errors
    /// Names the craft whose network, or whose place in the tree, is wrong.
    pub fn validate(&self) -> Result<(), NetworkError> {
        let craft_count = self.boards.len();
        for (craft, board) in self.boards.iter().enumerate() {
            let targets_exist = || {
                (0..board.fact_count).all(|fact| {
                    board.targets(crate::ids::FactId(fact)).all(|Target { craft: peer, fact }| {
                        let board = self.boards.get(peer.index());
                        peer.index() != craft && board.is_some_and(|peer| fact.0 < peer.fact_count)
                    })
                })
            };
            let trace_exists = || {
                let trace = self.trace.get(craft).copied().unwrap_or_default();
                trace.iter().all(|record| record.fact().0 < board.fact_count)
            };
            let script_exists = || {
                let script = self.script.get(craft).copied().unwrap_or_default();
                let items = board.rule_count() + board.action_count();
                script.iter().all(|&firing| firing < items || Firing(firing).is_idle())
            };
            let is_valid = board.is_valid(craft_count);
            if !is_valid || !targets_exist() || !trace_exists() || !script_exists() {
                return Err(NetworkError::DanglingId(CraftId::from_index(craft)));
            }
        }
        if self.topology.parent.len() != craft_count {
            return Err(NetworkError::Roots(0));
        }
        self.topology.validate()
    }

    /// The board of `craft`.
    #[inline]
    #[must_use]
    pub fn board(&self, craft: CraftId) -> &BoardView<'a> {
        &self.boards[craft.index()]
    }

    /// The part of the trace that `craft` plays; empty in lockstep and for the centre.
    #[inline]
    #[must_use]
    pub fn trace_of(&self, craft: CraftId) -> &'a [TraceRecord] {
        self.trace.get(craft.index()).copied().unwrap_or_default()
    }

    /// How many crafts the fleet has, the centre not counted.
    #[inline]
    #[must_use]
    pub fn craft_count(&self) -> u32 {
        CraftId::from_index(self.boards.len()).0
    }
}

/// Tree and groups, read in place. Fields as in [`Topology`].
#[derive(Clone, Copy, Debug)]
#[expect(missing_docs, reason = "documented at Topology")]
pub struct TopologyView<'a> {
    pub parent: &'a [u32],
    pub depth: &'a [u32],
    pub group: &'a [u32],
    pub leader_parent: &'a [u32],
    pub leader_depth: &'a [u32],
}

impl TopologyView<'_> {
    /// Whether depths and leaders are those of the tree.
    fn validate(&self) -> Result<(), NetworkError> {
        let Self { parent, depth, group, leader_parent, leader_depth } = *self;
        let differs = || NetworkError::Damaged("its topology contradicts itself".to_owned());
        if !group.is_empty() && group.len() != parent.len() {
            return Err(differs());
        }
        let meant = Topology::new(parent.to_vec(), group.to_vec())?;
        let is_meant = meant.depth == depth
            && meant.leader_parent == leader_parent
            && meant.leader_depth == leader_depth;
        if is_meant { Ok(()) } else { Err(differs()) }
    }

    /// The neighbour of `here` on the tree path to `there`.
    ///
    /// # Panics
    /// If the two are the same craft.
    #[inline]
    #[must_use]
    pub fn next_hop(&self, here: CraftId, there: CraftId) -> CraftId {
        next_hop(self.parent, self.depth, here, there)
    }

    /// The neighbour of `here` on the path to `there` in the tree of group leaders, in which members
    /// hang below their leader.
    ///
    /// # Panics
    /// If the two are the same craft, or no groups are stated.
    #[inline]
    #[must_use]
    pub fn next_hop_over_leaders(&self, here: CraftId, there: CraftId) -> CraftId {
        next_hop(self.leader_parent, self.leader_depth, here, there)
    }

    /// Whether two crafts are in one group.
    ///
    /// # Panics
    /// If no groups are stated.
    #[inline]
    #[must_use]
    pub fn are_grouped(&self, one: CraftId, other: CraftId) -> bool {
        self.group[one.index()] == self.group[other.index()]
    }
}

/// The neighbour of `here` on the path to `there` in the tree of `parent`.
fn next_hop(parent: &[u32], depth: &[u32], here: CraftId, there: CraftId) -> CraftId {
    assert_ne!(here, there, "invariant: nobody sends to itself");
    let (mut at, own_depth) = (there.index(), depth[here.index()]);
    while depth[at] > own_depth + 1 {
        at = parent[at] as usize;
    }
    if depth[at] == own_depth + 1 && parent[at] == here.0 {
        CraftId::from_index(at)
    } else {
        CraftId(parent[here.index()])
    }
}
