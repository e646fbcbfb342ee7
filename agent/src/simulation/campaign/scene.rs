//! The fleets of campaigns: small, so that thousands fit a second, and different for every seed.

use shared_types::ids::FactId;
use shared_types::knowledge::{BoardNetwork, Csr, FleetNetwork, Topology};
use shared_types::rng::{Purpose, Stream};
use shared_types::trace::TraceRecord;

/// Facts of every board; the first [`SHARED`] are shared, with the same id on every board.
pub(super) const FACTS: u32 = 6;

/// Facts that are shared.
pub(super) const SHARED: u32 = 4;

/// Records are due before this, ns.
pub(super) const TRACE_NS: u32 = 20_000_000;

/// A fleet and what it writes.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Boards without rules, a tree, groups.
    pub network: FleetNetwork,
    /// Per craft what it writes when.
    pub trace: Vec<Vec<TraceRecord>>,
    /// By shared fact the crafts that share it, ascending.
    pub sharers: Vec<Vec<u32>>,
}

impl Scene {
    /// The scene that `seed` draws: three to five crafts, each shared fact with two or more sharers.
    ///
    /// # Panics
    /// Never: a chain of halves is a tree.
    #[must_use]
    pub fn of(seed: u64) -> Self {
        let mut stream = Stream::new(seed, 0, Purpose::Test, 0);
        let crafts = stream.between(3, 5);
        let mut links = vec![Vec::<(u32, u32)>::new(); crafts as usize];
        let sharers: Vec<Vec<u32>> = (0..SHARED)
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
        let boards = links.iter().map(|links| {
            let links = Csr::from_pairs(FACTS as usize, links);
            let mut board = BoardNetwork { fact_count: FACTS, links, ..BoardNetwork::default() };
            board.index_readers();
            board
        });
        let parent =
            (0..crafts).map(|craft| craft.checked_sub(1).map_or(u32::MAX, |below| below / 2));
        let group = (0..crafts).map(|craft| craft / 2).collect();
        let topology = Topology::new(parent.collect(), group);
        let network = FleetNetwork {
            boards: boards.collect(),
            topology: topology.expect("invariant: halving makes a tree"),
            script: Vec::new(),
            trace: Vec::new(),
        };
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

    /// Crafts of the fleet, the centre not counted.
    #[must_use]
    pub fn crafts(&self) -> u32 {
        u32::try_from(self.trace.len()).unwrap_or(u32::MAX)
    }
}
