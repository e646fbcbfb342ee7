//! Identities of the counts, and laws of the boards, on random fleets.

use super::fleets::{Shape, any_shape, crafts, mission_spec, single_link_fleet, symmetric_fleet};
use crate::oracle::{Expected, History, Replay, Turnout};
use proptest::prelude::{ProptestConfig, any, prop_assert, prop_assert_eq, proptest};
use shared_types::ids::{CraftId, FactId, Turn};
use shared_types::knowledge::{FactState, FleetNetwork, FleetView, Value};
use shared_types::wire::{EpochSpec, StrategyKind};
use std::collections::BTreeSet;

fn spec(shape: Shape) -> EpochSpec {
    EpochSpec { seed: shape.seed, own_firing_only: true, turns_max: 30, ..mission_spec() }
}

fn replayed(network: &FleetNetwork, spec: &EpochSpec) -> (Replay, Vec<Expected>) {
    let fleet = network.view();
    let replay = Replay::of(&fleet, spec);
    let expected = StrategyKind::ALL.map(|kind| replay.expected(&fleet, spec, kind)).to_vec();
    (replay, expected)
}

fn of(expected: &[Expected], strategy: StrategyKind) -> &Expected {
    &expected[strategy as usize]
}

/// F, P and, per firing with a boundary change, the distinct sharers.
fn sharers(replay: &Replay, fleet: &FleetView<'_>) -> Vec<(CraftId, BTreeSet<CraftId>)> {
    replay
        .firings
        .iter()
        .map(|fired| {
            let board = fleet.board(fired.craft);
            let targets =
                replay.changes(fired).iter().flat_map(|change| board.targets(change.fact));
            (fired.craft, targets.map(|target| target.craft).collect())
        })
        .collect()
}

/// The edges from `source` to all of `sharers`, walked hop by hop.
fn edges(
    source: CraftId,
    sharers: &BTreeSet<CraftId>,
    next_hop: impl Fn(CraftId, CraftId) -> CraftId,
) -> BTreeSet<(CraftId, CraftId)> {
    let mut edges = BTreeSet::new();
    for &sharer in sharers {
        let mut here = source;
        while here != sharer {
            let next = next_hop(here, sharer);
            edges.insert((here, next));
            here = next;
        }
    }
    edges
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn requests_follow_the_table(shape in any_shape(), symmetric in proptest::bool::ANY) {
        let network = if symmetric { symmetric_fleet(shape) } else { single_link_fleet(shape) };
        let fleet = network.view();
        let (replay, expected) = replayed(&network, &spec(shape));
        let sharers = sharers(&replay, &fleet);
        let (n, t, f) = (u64::from(shape.crafts), u64::from(replay.turns), sharers.len() as u64);
        let p = sharers.iter().filter(|(_, sharers)| !sharers.is_empty()).count() as u64;
        let finals = 2;

        prop_assert_eq!(of(&expected, StrategyKind::Null).requests(), 0);
        // An action that goes on or was in vain changes nothing, and nothing is not sent.
        let over = replay.firings.iter().filter(|fired| fired.turnout == Turnout::Done);
        prop_assert_eq!(of(&expected, StrategyKind::Full).requests(), over.count() as u64);
        prop_assert_eq!(of(&expected, StrategyKind::Limited).requests(), (n - 1) * p);
        let boundary = sharers.iter().map(|(_, sharers)| sharers.len() as u64).sum::<u64>();
        prop_assert_eq!(of(&expected, StrategyKind::Boundary).requests(), boundary);
        let along_tree = sharers.iter().map(|(source, sharers)| {
            edges(*source, sharers, |here, there| fleet.topology.next_hop(here, there)).len() as u64
        });
        prop_assert_eq!(of(&expected, StrategyKind::Hierarchy).requests(), along_tree.sum::<u64>());
        let over_leaders = sharers.iter().map(|(source, sharers)| {
            let next = |here, there| {
                if fleet.topology.are_grouped(*source, there) {
                    there
                } else {
                    fleet.topology.next_hop_over_leaders(here, there)
                }
            };
            edges(*source, sharers, next).len() as u64
        });
        prop_assert_eq!(of(&expected, StrategyKind::Hybrid).requests(), over_leaders.sum::<u64>());
        let central = n * (t * (finals + 1) + 2) + f;
        prop_assert_eq!(of(&expected, StrategyKind::Central).requests(), central);
        prop_assert_eq!(of(&expected, StrategyKind::Pipelined).requests(), central);
        let batched = n * (t + 2) + f;
        prop_assert_eq!(of(&expected, StrategyKind::CentralBatched).requests(), batched);
        if f == n * t {
            prop_assert_eq!(central, n * (t * (finals + 2) + 2));
        }
    }

    #[test]
    fn with_one_link_and_one_output_boundary_never_costs_more_than_full(shape in any_shape()) {
        let shape = Shape { outputs_max: 1, ..shape };
        let network = single_link_fleet(shape);
        let (replay, expected) = replayed(&network, &spec(shape));
        let p = expected[0].processes.iter().map(|craft| craft.boundary_firings).sum::<u64>();
        prop_assert_eq!(of(&expected, StrategyKind::Boundary).requests(), p);
        prop_assert!(p <= of(&expected, StrategyKind::Full).requests());
        let fleet = network.view();
        let distances = sharers(&replay, &fleet).into_iter().filter_map(|(source, sharers)| {
            let sharer = *sharers.first()?;
            let (mut here, mut distance) = (source, 0);
            while here != sharer {
                here = fleet.topology.next_hop(here, sharer);
                distance += 1;
            }
            Some(distance)
        });
        prop_assert_eq!(of(&expected, StrategyKind::Hierarchy).requests(), distances.sum::<u64>());
    }

    #[test]
    fn every_sample_sent_is_received(shape in any_shape()) {
        let network = symmetric_fleet(shape);
        let (_, expected) = replayed(&network, &spec(shape));
        for expected in &expected {
            let copies = if expected.strategy == StrategyKind::Full { shape.crafts - 1 } else { 1 };
            let mut sent = [0; 2];
            let mut received = [0; 2];
            for process in &expected.processes {
                for traffic in [process.replication, process.reply] {
                    sent[0] += traffic.transmissions * u64::from(copies);
                    sent[1] += traffic.bytes_sent * u64::from(copies);
                    received[0] += traffic.deliveries;
                    received[1] += traffic.bytes_received;
                }
            }
            prop_assert_eq!(sent, received);
            let processes = (0..expected.processes.len()).map(CraftId::from_index);
            let pairs = processes.clone().flat_map(|from| {
                processes.clone().map(move |to| expected.deliveries.between(from, to))
            });
            prop_assert_eq!(pairs.sum::<u64>(), received[0]);
        }
    }

    #[test]
    fn hops_are_owed_deliveries_where_all_is_direct(shape in any_shape()) {
        let network = symmetric_fleet(shape);
        let (_, expected) = replayed(&network, &spec(shape));
        for strategy in [StrategyKind::Full, StrategyKind::Boundary, StrategyKind::Limited] {
            let expected = of(&expected, strategy);
            let hops = expected.processes.iter().map(|process| process.hops).sum::<u64>();
            prop_assert_eq!(hops, expected.owed.iter().map(|&owed| u64::from(owed)).sum::<u64>());
        }
    }

    #[test]
    fn when_quiet_what_a_firing_output_is_asserted_where_its_link_leads(shape in any_shape()) {
        let shape = Shape { negates: false, ..shape };
        let network = single_link_fleet(shape);
        let fleet = network.view();
        let (replay, _) = replayed(&network, &spec(shape));
        for fired in &replay.firings {
            for change in replay.changes(fired) {
                for target in fleet.board(fired.craft).targets(change.fact) {
                    let state = replay.boards[target.craft.index()][target.fact.index()];
                    prop_assert_eq!(state.value, Value::Asserted);
                }
            }
        }
    }

    #[test]
    fn when_quiet_all_boards_agree_on_symmetric_boundary_facts(shape in any_shape()) {
        let network = symmetric_fleet(shape);
        let fleet = network.view();
        let (replay, _) = replayed(&network, &spec(shape));
        for craft in crafts(&network) {
            for fact in (0..fleet.board(craft).fact_count).map(FactId) {
                for target in fleet.board(craft).targets(fact) {
                    prop_assert_eq!(
                        replay.boards[craft.index()][fact.index()],
                        replay.boards[target.craft.index()][target.fact.index()]
                    );
                }
            }
        }
    }

    #[test]
    fn the_history_of_a_trial_ends_with_its_boards(shape in any_shape(), altered in any::<bool>()) {
        let network = symmetric_fleet(shape);
        let fleet = network.view();
        let spec = EpochSpec { sends_altered_only: altered, ..spec(shape) };
        let replay = Replay::of(&fleet, &spec);
        let history = History::of(&replay, &fleet, &spec);
        let after = Turn(replay.turns);
        for craft in crafts(&network) {
            for fact in (0..fleet.board(craft).fact_count).map(FactId) {
                let state = replay.boards[craft.index()][fact.index()];
                let last = history.entries(craft, fact).last();
                prop_assert_eq!(last.map_or(FactState::default(), |entry| entry.state), state);
                prop_assert_eq!(history.value_before(craft, fact, after), state.value);
            }
        }
    }

    #[test]
    fn no_rule_or_action_runs_twice_unless_it_repeats(shape in any_shape()) {
        let network = symmetric_fleet(Shape { repeats: false, ..shape });
        let (replay, _) = replayed(&network, &spec(shape));
        let runs = || replay.firings.iter().filter(|fired| fired.turnout != Turnout::Underway);
        let fired: BTreeSet<_> = runs().map(|fired| (fired.craft, fired.firing)).collect();
        prop_assert_eq!(fired.len(), runs().count());
    }
}
