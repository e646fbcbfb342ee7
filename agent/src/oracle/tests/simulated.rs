//! Simulated trials on random fleets, under every strategy, held against the replay.

use super::fleets::{Shape, any_shape, mission_spec, single_link_fleet, symmetric_fleet};
use crate::oracle::{Observed, Replay, compare};
use crate::simulation::Simulation;
use proptest::prelude::{ProptestConfig, prop_assert, prop_assert_eq, proptest};
use shared_types::knowledge::FleetNetwork;
use shared_types::reasoning::{Policy, Reasoning};
use shared_types::transport::memory::MemoryOptions;
use shared_types::wire::{EpochSpec, StrategyKind};

/// Plays the trial under `strategy` and says in words where it differs from the replay.
fn differences(network: &FleetNetwork, spec: &EpochSpec, strategy: StrategyKind) -> Vec<String> {
    let fleet = network.view();
    let replay = Replay::of(&fleet, spec);
    let expected = replay.expected(&fleet, spec, strategy);
    let mut spec = EpochSpec { strategy, ..spec.clone() };
    let mut network = network.clone();
    if strategy == StrategyKind::Null {
        network.script = replay.script();
        spec.turns_max = replay.turns;
        spec.ignores_finals = true;
    }
    let fleet = network.view();
    let played = Simulation::new(fleet.craft_count(), MemoryOptions::default())
        .play(&spec, &fleet)
        .expect("a lossless trial balances");
    let observed = Observed {
        trial: spec.trial,
        turns: played.turns,
        outcome: played.outcome,
        path_digest: played.path_digest,
        reports: &played.reports,
    };
    compare(&replay, &expected, &observed).iter().map(ToString::to_string).collect()
}

/// A policy, and slices of upkeep, which change nothing.
fn reasoning(options: u32) -> Reasoning {
    let policy = [Policy::Random, Policy::Naive, Policy::BestPath][(options / 8 % 3) as usize];
    let every = options / 24 % 3;
    Reasoning { policy, prune_every_turns: every, maintain_every_turns: every, maintain_items: 7 }
}

fn spec(shape: Shape, options: u32) -> EpochSpec {
    EpochSpec {
        seed: shape.seed,
        own_firing_only: options & 1 != 0,
        ignores_finals: options & 2 != 0,
        sends_altered_only: options & 4 != 0,
        turns_max: 12,
        reasoning: reasoning(options),
        ..mission_spec()
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(120))]

    #[test]
    fn missions_equal_the_replay_under_every_strategy(shape in any_shape(), options in 0_u32..72) {
        let network = symmetric_fleet(shape);
        for strategy in StrategyKind::ALL {
            let found = differences(&network, &spec(shape, options), strategy);
            prop_assert!(found.is_empty(), "{found:#?}");
        }
    }

    #[test]
    fn directed_links_equal_the_replay_under_every_strategy(
        shape in any_shape(), options in 0_u32..72,
    ) {
        let network = single_link_fleet(shape);
        for strategy in StrategyKind::ALL {
            let found = differences(&network, &spec(shape, options), strategy);
            prop_assert_eq!(found, Vec::<String>::new());
        }
    }
}
