//! The generator against a plain reading of the specification, and its statistics.

use super::generate;
use proptest::prelude::{ProptestConfig, Strategy, prop_assert, prop_assert_eq, proptest};
use shared_types::ids::{CraftId, FactId};
use shared_types::knowledge::{BoardNetwork, Csr, FleetNetwork, FleetView, Target};
use shared_types::rng::{Purpose, Stream};
use shared_types::scenario::{GeneratedNetwork, LinkingModel};

fn generated(parameters: &GeneratedNetwork, crafts: u32, seed: u64, trial: u32) -> FleetNetwork {
    let mut network = FleetNetwork::default();
    generate(parameters, crafts, seed, trial, &mut network);
    network
}

/// The link drawing, word by word: every link of every pair, one random order, each written into
/// both facts' single slot.
fn literal_slots(crafts: u32, facts: u32, seed: u64, trial: u32) -> Vec<Vec<Option<Target>>> {
    let mut stream = Stream::new(seed, trial, Purpose::Links, 0);
    let mut links = Vec::new();
    for i in 0..crafts {
        for j in i + 1..crafts {
            for _ in 0..300 {
                let x = stream.below(facts);
                let y = stream.below(facts);
                links.push((i, x, j, y));
            }
        }
    }
    for last in (1..links.len()).rev() {
        let bound = u32::try_from(last + 1).unwrap();
        links.swap(last, stream.below(bound) as usize);
    }
    let mut slots = vec![vec![None; facts as usize]; crafts as usize];
    for (i, x, j, y) in links {
        slots[i as usize][x as usize] = Some(Target { craft: CraftId(j), fact: FactId(y) });
        slots[j as usize][y as usize] = Some(Target { craft: CraftId(i), fact: FactId(x) });
    }
    slots
}

#[test]
fn links_equal_a_literal_drawing() {
    let parameters = GeneratedNetwork::default();
    for (crafts, trial) in [(1, 0), (2, 0), (3, 1), (5, 2), (10, 3)] {
        let network = generated(&parameters, crafts, 7, trial);
        let view = network.view();
        for (board, slots) in view.boards.iter().zip(literal_slots(crafts, 1000, 7, trial)) {
            for (fact, slot) in slots.into_iter().enumerate() {
                assert_eq!(board.targets(FactId::from_index(fact)).next(), slot);
                assert!(board.targets(FactId::from_index(fact)).len() <= 1);
            }
        }
    }
}

/// What is drawn of a board, in the order in which the pinned digests were taken.
#[derive(rkyv::Archive, rkyv::Serialize)]
struct Drawn {
    fact_count: u32,
    tables: [Csr; 6],
    lists: [Vec<u32>; 4],
}

impl From<BoardNetwork> for Drawn {
    fn from(board: BoardNetwork) -> Self {
        Self {
            fact_count: board.fact_count,
            tables: [
                board.premises,
                board.outputs,
                board.queues,
                board.action_outputs,
                board.readers,
                board.links,
            ],
            lists: [board.repeating_rules, board.repeating_actions, board.initial, board.finals],
        }
    }
}

/// Drawn once; a change here would change every published count.
#[test]
fn networks_are_drawn_as_they_always_were() {
    let models = [LinkingModel::DirectedSlotsPerPair, LinkingModel::PerBoard, LinkingModel::Sparse];
    for (crafts, pinned) in [
        (5, [4_309_574_907_871_521_311, 14_996_060_402_504_291_761, 4_309_574_907_871_521_311]),
        (9, [9_108_111_810_588_777_979, 650_082_710_191_105_487, 2_689_328_531_309_071_550]),
    ] {
        let digests = models.map(|linking| {
            let parameters = GeneratedNetwork { linking, ..GeneratedNetwork::default() };
            let boards = generated(&parameters, crafts, 7, 1).boards;
            let boards: Vec<Drawn> = boards.into_iter().map(Drawn::from).collect();
            let archive = rkyv::to_bytes::<rkyv::rancor::Error>(&boards).unwrap();
            xxhash_rust::xxh3::xxh3_64(&archive)
        });
        assert_eq!(digests, pinned, "{crafts} crafts");
    }
}

#[test]
fn a_published_board_has_the_published_sizes() {
    let network = generated(&GeneratedNetwork::default(), 2, 3, 0);
    for board in &network.boards {
        let view = board.view();
        assert_eq!(view.fact_count, 1000);
        assert_eq!((view.rule_count(), view.action_count()), (1000, 1000));
        assert_eq!((view.finals.len(), view.initial.len()), (100, 400));
        assert!(view.initial.iter().all(|&fact| !view.is_final(FactId(fact))));
        for rule in 0..1000 {
            assert!((1..=3).contains(&view.premises.row(rule).len()));
            assert_eq!((view.outputs.row(rule).len(), view.queues.row(rule).len()), (1, 1));
            assert_eq!(view.action_outputs.row(rule).len(), 1);
        }
        assert!(view.premises.item_count().abs_diff(2000) < 130, "five standard deviations");
    }
    assert_ne!(network.boards[0].premises, network.boards[1].premises);
}

#[test]
fn memory_of_another_network_leaves_no_trace() {
    let parameters = GeneratedNetwork::default();
    let small = GeneratedNetwork { facts: 50, initial: 10, finals: 5, rules: 20, ..parameters };
    let mut reused = generated(&parameters, 5, 1, 0);
    reused.script = vec![vec![1]];
    generate(&small, 3, 1, 1, &mut reused);
    assert_eq!(reused, generated(&small, 3, 1, 1));
    generate(&parameters, 10, 1, 2, &mut reused);
    assert_eq!(reused, generated(&parameters, 10, 1, 2));
}

#[test]
fn another_trial_is_another_network_and_a_smaller_fleet_has_the_same_boards() {
    let parameters = GeneratedNetwork::default();
    let first = generated(&parameters, 3, 1, 0);
    assert_ne!(first.boards[0], generated(&parameters, 3, 1, 1).boards[0]);
    assert_ne!(first.boards[0], generated(&parameters, 3, 2, 0).boards[0]);
    assert_eq!(first.boards[1].premises, generated(&parameters, 2, 1, 0).boards[1].premises);
}

/// The share of filled slots whose target's slot does not lead back, over `trials` fleets.
fn one_way_share(crafts: u32, trials: u32) -> f64 {
    let (mut filled, mut one_way) = (0_u32, 0_u32);
    let mut network = FleetNetwork::default();
    for trial in 0..trials {
        generate(&GeneratedNetwork::default(), crafts, 11, trial, &mut network);
        let view = network.view();
        for (board, craft) in view.boards.iter().zip(0..) {
            for fact in (0..1000).map(FactId) {
                for target in board.targets(fact) {
                    let back = view.board(target.craft).targets(target.fact).next();
                    filled += 1;
                    one_way += u32::from(back != Some(Target { craft: CraftId(craft), fact }));
                }
            }
        }
    }
    f64::from(one_way) / f64::from(filled)
}

#[test]
fn overwriting_makes_the_known_share_of_slots_one_way() {
    // A trial's share scatters by 0.02 at most (measured over 400 trials); the mean of 60 by 0.003.
    for (crafts, expected) in [(2, 0.13), (3, 0.22), (5, 0.35), (10, 0.47)] {
        let share = one_way_share(crafts, 60);
        assert!((share - expected).abs() < 0.013, "N = {crafts}: {share:.4}, not {expected}");
    }
}

#[test]
fn a_fact_is_linked_to_a_given_peer_with_the_known_chance() {
    // With two crafts no other pair overwrites: q = 1 - 0.999^300 = 0.2593. The count of linked facts
    // of 200 fleets has a standard deviation of 0.0007.
    let mut linked = 0_u32;
    let mut network = FleetNetwork::default();
    for trial in 0..200 {
        generate(&GeneratedNetwork::default(), 2, 5, trial, &mut network);
        for board in &network.view().boards {
            linked += (0..1000).map(|fact| u32::from(board.is_boundary(FactId(fact)))).sum::<u32>();
        }
    }
    let share = f64::from(linked) / 400_000.0;
    assert!((share - 0.2593).abs() < 0.003, "{share:.4}");
}

#[test]
fn per_board_linking_does_not_grow_with_the_fleet() {
    let parameters =
        GeneratedNetwork { linking: LinkingModel::PerBoard, ..GeneratedNetwork::default() };
    for crafts in [2, 3, 10, 30] {
        let network = generated(&parameters, crafts, 1, 0);
        let linked: usize =
            network.view().boards.iter().map(|board| board.links.item_count()).sum();
        // 600 link ends a board on average: 1 - exp(-0.6) of 1000 facts, two numbers a link.
        let per_board = linked / 2 / crafts as usize;
        assert!(per_board.abs_diff(451) < 60, "N = {crafts}: {per_board}");
    }
}

#[test]
fn sparse_fleets_link_neighbours_only_and_tree_neighbours_always() {
    let parameters = GeneratedNetwork {
        facts: 100,
        initial: 40,
        finals: 10,
        rules: 50,
        actions: 50,
        linking: LinkingModel::Sparse,
        links: 30,
        ..GeneratedNetwork::default()
    };
    let crafts = 2000;
    let network = generated(&parameters, crafts, 1, 0);
    network.view().validate().unwrap();
    let pairs = super::sparse_pairs(crafts, 4);
    let mut degree = vec![0; crafts as usize];
    for &[first, second] in &pairs {
        degree[first as usize] += 1;
        degree[second as usize] += 1;
    }
    assert!(degree.iter().all(|&degree| (3..=4).contains(&degree)));
    assert!((1..crafts).all(|craft| pairs.binary_search(&[(craft - 1) / 2, craft]).is_ok()));
    for (board, craft) in network.view().boards.iter().zip(0..) {
        for target in (0..100).flat_map(|fact| board.targets(FactId(fact))) {
            let pair = [craft.min(target.craft.0), craft.max(target.craft.0)];
            assert!(pairs.binary_search(&pair).is_ok());
        }
    }
}

#[test]
fn sparse_pairs_of_tiny_fleets_are_all_pairs() {
    assert!(super::sparse_pairs(1, 4).is_empty());
    assert_eq!(super::sparse_pairs(2, 4), [[0, 1]]);
    assert_eq!(super::sparse_pairs(5, 4).len(), 10);
}

fn any_parameters() -> impl Strategy<Value = GeneratedNetwork> {
    let linking = [
        LinkingModel::DirectedSlotsPerPair,
        LinkingModel::PerBoard,
        LinkingModel::Sparse,
        LinkingModel::Shared,
    ];
    (1_u32..60, 0_u32..40, 1_u32..20, 0_usize..4, 0_u32..30, 1_u32..6, 0_u32..100).prop_map(
        move |(facts, rules, actions, model, links, degree, share)| GeneratedNetwork {
            facts,
            rules,
            actions,
            finals: facts * share / 200,
            initial: facts * share / 250,
            premises_min: 1,
            premises_max: 1 + degree / 2,
            linking: linking[model],
            links,
            degree,
            boundary_fraction: f64::from(share) / 99.0,
            sharers: 1,
        },
    )
}

/// A plain look at how facts are shared: per fact of the fleet the crafts that share it.
fn sharing(network: &FleetNetwork) -> Vec<Vec<Target>> {
    let view = network.view();
    let facts = view.boards.iter().zip((0..).map(CraftId)).flat_map(|(board, craft)| {
        (0..board.fact_count).map(move |fact| {
            let own = Target { craft, fact: FactId(fact) };
            let mut sharers: Vec<Target> = board.targets(own.fact).chain([own]).collect();
            sharers.sort_unstable();
            sharers
        })
    });
    facts.filter(|sharers| sharers.len() > 1).collect()
}

#[test]
fn shared_facts_are_symmetric_and_have_exactly_the_sharers_and_the_fraction_asked_for() {
    for (crafts, sharers, fraction) in
        [(2, 1, 0.5), (5, 1, 0.1), (5, 4, 1.0), (10, 3, 0.25), (10, 9, 0.03), (128, 7, 0.01)]
    {
        let parameters = GeneratedNetwork {
            facts: 200,
            initial: 80,
            finals: 10,
            linking: LinkingModel::Shared,
            boundary_fraction: fraction,
            sharers,
            ..GeneratedNetwork::default()
        };
        let network = generated(&parameters, crafts, 3, 0);
        network.view().validate().unwrap();
        let mut groups = sharing(&network);
        let ends = groups.len();
        groups.sort_unstable();
        // Every sharer sees the same sharers: each group is there once from each of its ends.
        for same in groups.chunk_by(|left, right| left == right) {
            assert_eq!(same[0].len(), sharers as usize + 1);
            assert_eq!(same.len(), same[0].len());
            let crafts: Vec<CraftId> = same[0].iter().map(|sharer| sharer.craft).collect();
            assert!(crafts.windows(2).all(|pair| pair[0] < pair[1]), "each craft once");
            let begins = |one: &Target| {
                network.boards[one.craft.index()].initial.binary_search(&one.fact.0).is_ok()
            };
            let first = begins(&same[0][0]);
            assert!(same[0].iter().all(|one| begins(one) == first), "equal at the start");
        }
        let asked = 200.0 * fraction;
        for board in &network.view().boards {
            let facts: u32 = (0..200).map(|fact| u32::from(board.is_boundary(FactId(fact)))).sum();
            assert!((f64::from(facts) - asked).abs() <= 1.0, "{facts}, not {asked}");
        }
        let missing = asked * f64::from(crafts) - f64::from(u32::try_from(ends).unwrap());
        assert!((0.0..=f64::from(sharers)).contains(&missing), "{missing} places are left");
    }
}

#[test]
fn which_facts_are_shared_moves_nothing_else_of_a_board() {
    let shared = |boundary_fraction, sharers| GeneratedNetwork {
        linking: LinkingModel::Shared,
        boundary_fraction,
        sharers,
        ..GeneratedNetwork::default()
    };
    let first = generated(&shared(0.1, 1), 4, 1, 0);
    let second = generated(&shared(0.7, 3), 4, 1, 0);
    assert_ne!(first.boards[0].links, second.boards[0].links);
    assert_eq!(first.boards[0].premises, second.boards[0].premises);
    assert_ne!(first, generated(&shared(0.1, 1), 4, 1, 1));
    assert_eq!(first, generated(&shared(0.1, 1), 4, 1, 0));
    assert!(sharing(&generated(&shared(0.0, 1), 4, 1, 0)).is_empty());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn every_network_is_valid_and_survives_its_archive(
        parameters in any_parameters(), crafts in 1_u32..8, seed in proptest::num::u64::ANY,
    ) {
        let is_alone = crafts == 1 && parameters.linking == LinkingModel::Shared;
        let network = generated(&parameters, crafts + u32::from(is_alone), seed, 0);
        prop_assert!(network.view().validate().is_ok());
        let archive = network.to_archive();
        let view = FleetView::from_archive(&archive);
        prop_assert!(view.is_ok());
        let copy = rkyv::from_bytes::<FleetNetwork, rkyv::rancor::Error>(&archive);
        prop_assert_eq!(copy.ok(), Some(network));
    }
}
