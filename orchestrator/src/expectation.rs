//! What the model expects of the published experiment: trials generated and replayed by the oracle,
//! without fleets, and their counts.
//!
//! Not here: what the counts say of a published mean (`report::ranges`).

use crate::report::published::PublishedRow;
use crate::report::ranges::{Sample, TrialCounts};
use crate::scenario::generate::generate;
use agent::lockstep::Outcome;
use agent::oracle::Replay;
use shared_types::knowledge::FleetNetwork;
use shared_types::limits::PUBLISHED_TURNS_MAX;
use shared_types::scenario::GeneratedNetwork;
use shared_types::wire::{DELTA_BYTES, EpochSpec, StrategyKind};

/// Generates and replays trials `0..trials` of `seed`.
#[must_use]
pub fn sample(parameters: &GeneratedNetwork, crafts: u32, seed: u64, trials: u32) -> Sample {
    let mut network = FleetNetwork::default();
    let mut counted = Sample { crafts, trials: Vec::new(), dropped: 0 };
    for trial in 0..trials {
        generate(parameters, crafts, seed, trial, &mut network);
        let (fleet, spec) = (network.view(), published_spec(seed, trial));
        let replay = Replay::of(&fleet, &spec);
        if replay.outcome != Outcome::Finished {
            counted.dropped += 1;
            continue;
        }
        let requests = |strategy| replay.expected(&fleet, &spec, strategy).requests();
        counted.trials.push(TrialCounts {
            turns: u64::from(replay.turns),
            requests: PublishedRow {
                label: trial,
                proposed: requests(StrategyKind::Boundary),
                full: requests(StrategyKind::Full),
                limited: requests(StrategyKind::Limited),
                central: requests(StrategyKind::Central),
                hierarchy: requests(StrategyKind::Hierarchy),
            },
        });
    }
    counted
}

/// The published experiment's epoch: a final fact counts when a firing newly asserts it on its own
/// board, all outputs are changes, 200 turns.
fn published_spec(seed: u64, trial: u32) -> EpochSpec {
    EpochSpec {
        epoch: 0,
        network: 0,
        seed,
        trial,
        strategy: StrategyKind::Null,
        own_firing_only: true,
        ignores_finals: false,
        sends_altered_only: false,
        record_bytes: u32::try_from(DELTA_BYTES).expect("invariant: a record is small"),
        turns_max: PUBLISHED_TURNS_MAX,
        reasoning: shared_types::reasoning::Reasoning::default(),
        recovery: None,
        link: None,
        open: None,
    }
}

#[cfg(test)]
mod tests;
