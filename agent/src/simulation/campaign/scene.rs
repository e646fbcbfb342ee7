//! The fleets of campaigns: small, so that thousands fit a second, and different for every seed.

use shared_types::ids::{CraftId, FactId};
use shared_types::knowledge::{BoardNetwork, Csr, FleetNetwork, Topology};
use shared_types::rng::{Purpose, Stream};
use shared_types::trace::TraceRecord;

/// Facts of every board; the first [`SHARED`] are shared, with the same id on every board.
pub(super) const FACTS: u32 = 6;

/// Facts, rules and actions of every board of lockstep.
pub(super) const MISSION_FACTS: u32 = 10;
const RULES: u32 = 8;
const ACTIONS: u32 = 3;

/// Facts that are shared.
pub(super) const SHARED: u32 = 4;

/// Records are due before this, ns.
pub(super) const TRACE_NS: u32 = 20_000_000;

/// A fleet and what it does.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Boards, for a trace without rules; a tree, groups.
    pub network: FleetNetwork,
    /// Per craft what it writes when; nothing in lockstep.
    pub trace: Vec<Vec<TraceRecord>>,
    /// By shared fact the crafts that share it, ascending.
    pub sharers: Vec<Vec<u32>>,
}

impl Scene {
    /// The scene that `seed` draws: three to five crafts, each shared fact with two or more sharers.
    #[must_use]
    pub fn of(seed: u64) -> Self {
        let mut stream = Stream::new(seed, 0, Purpose::Test, 0);
        let Shared { crafts, links, sharers } = Shared::draw(&mut stream);
        let boards = links.iter().map(|links| {
            let links = Csr::from_pairs(FACTS as usize, links);
            let mut board = BoardNetwork { fact_count: FACTS, links, ..BoardNetwork::default() };
            board.index_readers();
            board
        });
        let network = fleet_of(boards.collect());
        let trace = (0..crafts)
            .map(|_| {
                let mut part: Vec<TraceRecord> = (0..stream.between(4, 12))
                    .map(|_| {
                        let at_ns = u64::from(stream.below(TRACE_NS));
                        let fact = FactId(stream.below(FACTS));
                        TraceRecord::write(at_ns, fact, stream.below(2) == 0)
                    })
                    .collect();
                part.sort_unstable();
                // One write at a time, so that every version is seen on its writer's board.
                part.dedup_by_key(|record| record.at_ns);
                part
            })
            .collect();
        Self { network, trace, sharers }
    }

    /// The scene of lockstep that `seed` draws: boards with rules and actions in place of a trace.
    #[must_use]
    pub fn mission(seed: u64) -> Self {
        let mut stream = Stream::new(seed, 0, Purpose::Test, 1);
        let Shared { links, sharers, .. } = Shared::draw(&mut stream);
        let boards = links.iter().map(|links| reasoning_board(&mut stream, links)).collect();
        Self { network: fleet_of(boards), trace: Vec::new(), sharers }
    }

    /// Crafts of the fleet, the centre not counted.
    #[must_use]
    pub fn crafts(&self) -> u32 {
        CraftId::from_index(self.network.boards.len()).0
    }
}

/// Who shares what.
struct Shared {
    crafts: u32,
    /// Per craft the pairs of [`Csr::from_pairs`].
    links: Vec<Vec<(u32, u32)>>,
    sharers: Vec<Vec<u32>>,
}

impl Shared {
    /// Three to five crafts, each shared fact with two or more of them.
    fn draw(stream: &mut Stream) -> Self {
        let crafts = stream.between(3, 5);
        let mut links = vec![Vec::<(u32, u32)>::new(); crafts as usize];
        let sharers = (0..SHARED)
            .map(|fact| {
                let mut sharers: Vec<u32> = (0..crafts).collect();
                stream.shuffle(&mut sharers);
                sharers.truncate(stream.between(2, crafts) as usize);
                sharers.sort_unstable();
                for &from in &sharers {
                    let others = sharers.iter().filter(|&&to| to != from);
                    links[from as usize].extend(others.flat_map(|&to| [(fact, to), (fact, fact)]));
                }
                sharers
            })
            .collect();
        Self { crafts, links, sharers }
    }
}

/// A fleet of `boards` in a tree of halves and groups of two.
fn fleet_of(boards: Vec<BoardNetwork>) -> FleetNetwork {
    let crafts = CraftId::from_index(boards.len()).0;
    let parent = (0..crafts).map(|craft| craft.checked_sub(1).map_or(u32::MAX, |below| below / 2));
    let group = (0..crafts).map(|craft| craft / 2).collect();
    let topology = Topology::new(parent.collect(), group);
    let topology = topology.expect("invariant: halving makes a tree");
    FleetNetwork { boards, topology, script: Vec::new(), trace: Vec::new() }
}

/// A board whose rules and actions write shared facts again and again.
fn reasoning_board(stream: &mut Stream, links: &[(u32, u32)]) -> BoardNetwork {
    let mut board = BoardNetwork { fact_count: MISSION_FACTS, ..BoardNetwork::default() };
    let row = |stream: &mut Stream, most: u32, bound: u32| -> Vec<u32> {
        (0..stream.between(1, most)).map(|_| stream.below(bound)).collect()
    };
    for rule in 0..RULES {
        board.premises.push_row(row(stream, 2, MISSION_FACTS * 2));
        board.outputs.push_row(row(stream, 3, MISSION_FACTS * 2));
        board.queues.push_row(row(stream, 2, ACTIONS));
        if stream.below(3) == 0 {
            board.repeating_rules.push(rule);
        }
    }
    for _ in 0..ACTIONS {
        board.action_outputs.push_row(row(stream, 2, MISSION_FACTS * 2));
    }
    board.initial = (SHARED..MISSION_FACTS - 2).collect();
    board.links = Csr::from_pairs(MISSION_FACTS as usize, links);
    board.index_readers();
    board
}
