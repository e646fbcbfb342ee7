//! Small fleets for the tests: written out, or drawn at random.

use proptest::prelude::Strategy;
use shared_types::ids::{CraftId, FactId};
use shared_types::knowledge::{BoardNetwork, Csr, FleetNetwork, Literal, Topology};
use shared_types::rng::{Purpose, Stream};
use shared_types::wire::{EpochSpec, StrategyKind};
use std::collections::BTreeMap;

/// Bytes of a record in the tests; other than the header's size and than any count of records.
pub(super) const RECORD: u64 = 24;

/// The epoch of a mission: final facts count however they come.
pub(super) fn mission_spec() -> EpochSpec {
    EpochSpec {
        epoch: 0,
        network: 0,
        seed: 7,
        trial: 0,
        strategy: StrategyKind::Null,
        own_firing_only: false,
        ignores_finals: false,
        sends_altered_only: false,
        record_bytes: 24,
        turns_max: 50,
        reasoning: shared_types::reasoning::Reasoning::default(),
        recovery: None,
        link: None,
        open: None,
    }
}

/// The premise or output that `fact` holds.
pub(super) const fn yes(fact: u32) -> Literal {
    Literal::holds(FactId(fact))
}

/// The premise or output that `fact` does not hold.
pub(super) const fn no(fact: u32) -> Literal {
    Literal::is_absent(FactId(fact))
}

/// A board under construction.
#[derive(Default)]
pub(super) struct Board(pub(super) BoardNetwork);

impl Board {
    pub(super) fn new(facts: u32, initial: &[u32], finals: &[u32]) -> Self {
        let mut board = BoardNetwork { fact_count: facts, ..BoardNetwork::default() };
        board.initial = initial.to_vec();
        board.finals = finals.to_vec();
        Self(board)
    }

    pub(super) fn rule(mut self, premises: &[Literal], outputs: &[Literal], runs: &[u32]) -> Self {
        self.0.premises.push_row(premises.iter().map(|premise| premise.0));
        self.0.outputs.push_row(outputs.iter().map(|output| output.0));
        self.0.queues.push_row(runs.iter().copied());
        self
    }

    pub(super) fn action(mut self, outputs: &[Literal]) -> Self {
        self.0.action_outputs.push_row(outputs.iter().map(|output| output.0));
        self
    }

    pub(super) fn repeating(mut self, rules: &[u32], actions: &[u32]) -> Self {
        self.0.repeating_rules = rules.to_vec();
        self.0.repeating_actions = actions.to_vec();
        self
    }
}

/// A fleet of `boards` in the binary tree, with directed `links` (craft, fact, to craft, to fact).
pub(super) fn fleet(boards: Vec<Board>, links: &[[u32; 4]], group: &[u32]) -> FleetNetwork {
    let mut boards: Vec<BoardNetwork> = boards.into_iter().map(|board| board.0).collect();
    let mut targets = BTreeMap::<(u32, u32), BTreeMap<u32, u32>>::new();
    for &[craft, fact, to_craft, to_fact] in links {
        targets.entry((craft, fact)).or_default().insert(to_craft, to_fact);
    }
    for (craft, board) in (0..).zip(&mut boards) {
        board.links = Csr::default();
        for fact in 0..board.fact_count {
            let row = targets.get(&(craft, fact)).cloned().unwrap_or_default();
            board.links.push_row(row.into_iter().flat_map(|(craft, fact)| [craft, fact]));
        }
        board.index_readers();
    }
    let binary = Topology::binary(u32::try_from(boards.len()).unwrap());
    let topology = Topology::new(binary.parent, group.to_vec()).unwrap();
    let network = FleetNetwork { boards, topology, script: Vec::new(), trace: Vec::new() };
    network.view().validate().unwrap();
    network
}

/// Both directions of each of `links`.
pub(super) fn both_ways(links: &[[u32; 4]]) -> Vec<[u32; 4]> {
    links.iter().flat_map(|&[a, x, b, y]| [[a, x, b, y], [b, y, a, x]]).collect()
}

/// What random fleets differ in.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    pub(super) crafts: u32,
    pub(super) seed: u64,
    /// Most outputs of a rule or action.
    pub(super) outputs_max: u32,
    /// Whether rules may be negated and de-assert.
    pub(super) negates: bool,
    pub(super) repeats: bool,
    /// Whether actions may take turns and be in vain.
    pub(super) is_uncertain: bool,
}

pub(super) fn any_shape() -> impl Strategy<Value = Shape> {
    let flag = || proptest::bool::ANY;
    (1_u32..9, proptest::num::u64::ANY, 1_u32..4, flag(), flag(), flag()).prop_map(
        |(crafts, seed, outputs_max, negates, repeats, is_uncertain)| Shape {
            crafts,
            seed,
            outputs_max,
            negates,
            repeats,
            is_uncertain,
        },
    )
}

const FACTS: u32 = 24;
const RULES: u32 = 16;
const ACTIONS: u32 = 8;

/// A random fleet whose every fact has one slot, overwritten by later links: directed links.
pub(super) fn single_link_fleet(shape: Shape) -> FleetNetwork {
    let mut stream = Stream::new(shape.seed, 0, Purpose::Test, 0);
    let mut slots = BTreeMap::new();
    for _ in 0..shape.crafts * 12 {
        let ends = [0; 2].map(|_| (stream.below(shape.crafts), stream.below(FACTS)));
        if ends[0].0 != ends[1].0 {
            slots.insert(ends[0], ends[1]);
            slots.insert(ends[1], ends[0]);
        }
    }
    let links: Vec<[u32; 4]> = slots.into_iter().map(|((a, x), (b, y))| [a, x, b, y]).collect();
    random_fleet(shape, &mut stream, &links)
}

/// A random fleet whose boundary facts have one id on all their boards and any number of sharers.
pub(super) fn symmetric_fleet(shape: Shape) -> FleetNetwork {
    let mut stream = Stream::new(shape.seed, 0, Purpose::Test, 0);
    let mut links = Vec::new();
    for fact in 0..FACTS / 2 {
        let mut sharers: Vec<u32> = (0..shape.crafts).collect();
        stream.shuffle(&mut sharers);
        sharers.truncate(stream.below(shape.crafts + 1) as usize);
        for &first in &sharers {
            let others = sharers.iter().filter(|&&second| second != first);
            links.extend(others.map(|&second| [first, fact, second, fact]));
        }
    }
    random_fleet(shape, &mut stream, &links)
}

fn random_fleet(shape: Shape, stream: &mut Stream, links: &[[u32; 4]]) -> FleetNetwork {
    let initial: Vec<u32> = (0..FACTS).filter(|fact| fact % 3 == 0).collect();
    let boards = (0..shape.crafts).map(|_| {
        let mut board = Board::new(FACTS, &initial, &[FACTS - 2, FACTS - 1]);
        let literal = |stream: &mut Stream| {
            let fact = stream.below(FACTS);
            if shape.negates && stream.below(3) == 0 { no(fact) } else { yes(fact) }
        };
        for _ in 0..RULES {
            let draw = |count: u32, stream: &mut Stream| -> Vec<Literal> {
                (0..count).map(|_| literal(stream)).collect()
            };
            let premise_count = stream.between(1, 3);
            let premises = draw(premise_count, stream);
            let output_count = stream.between(1, shape.outputs_max);
            let outputs = draw(output_count, stream);
            board = board.rule(&premises, &outputs, &[stream.below(ACTIONS)]);
        }
        for _ in 0..ACTIONS {
            let output = literal(stream);
            board = board.action(&[output]);
        }
        if shape.is_uncertain {
            board.0.action_durations = (0..ACTIONS).map(|_| stream.between(1, 4)).collect();
            let likelihood = |stream: &mut Stream| 1.0 / f64::from(stream.between(1, 3));
            board.0.action_likelihoods =
                (0..ACTIONS).map(|_| likelihood(stream).to_bits()).collect();
        }
        if shape.repeats { board.repeating(&[0, 5, 6], &[1, 2]) } else { board }
    });
    let boards = boards.collect();
    let group: Vec<u32> = (0..shape.crafts).map(|_| stream.below(3)).collect();
    fleet(boards, links, &group)
}

/// Every craft of a fleet.
pub(super) fn crafts(network: &FleetNetwork) -> impl Iterator<Item = CraftId> + use<> {
    (0..network.boards.len()).map(CraftId::from_index)
}
