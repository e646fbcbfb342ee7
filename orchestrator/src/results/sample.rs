//! Records made up for tests: arithmetic instead of a fleet, different in every field.

use super::event::Event;
use super::provenance::{Host, Provenance, Versions};
use super::record::{
    Cell, Counts, CraftFacts, Digest, Overhead, ProcessCost, TimingRecord, TrialEnd, TrialFacts,
    TrialRecord, TrialTiming,
};
use super::statistics::{Distribution, second_half_ratio, time_histogram};
use super::store::{Place, Store};
use crate::outcome::Outcome;
use hdrhistogram::Histogram;
use shared_types::transport::WakeMode;
use shared_types::wire::{Losses, StrategyKind, Traffic};
use std::path::Path;

/// The strategies of the sample runs.
pub(crate) const STRATEGIES: [StrategyKind; 7] = [
    StrategyKind::Null,
    StrategyKind::Full,
    StrategyKind::Boundary,
    StrategyKind::Limited,
    StrategyKind::Hierarchy,
    StrategyKind::Central,
    StrategyKind::CentralBatched,
];

/// A provenance as a small machine would have it.
pub(crate) fn provenance() -> Provenance {
    Provenance {
        scenario: "paper".into(),
        command: vec!["compare".into()],
        seed: 7,
        date: "2026-11-22T15:04:05Z".into(),
        is_simulated: false,
        processes_max: 11,
        cores_used: 2,
        processes_per_core: 5.5,
        wake: WakeMode::Adaptive,
        versions: Versions {
            slateswarm: "0.1.0".into(),
            commit: "0123456789ab".into(),
            executable: "00000000deadbeef".into(),
            profile: "release".into(),
            iceoryx2: "0.10.0".into(),
            wire_format: 1,
        },
        host: Host {
            kernel: "Linux 6.8.0".into(),
            cpu_model: "A processor".into(),
            cores_online: 2,
            clock_source: "tsc".into(),
            governor: None,
            load_average: Some([0.5, 0.25, 0.125]),
            memory_bytes: Some(8 << 30),
        },
    }
}

fn traffic(requests: u64, receivers: u64) -> Traffic {
    Traffic {
        requests,
        transmissions: requests,
        deliveries: requests * receivers,
        bytes_sent: requests * 100,
        bytes_received: requests * receivers * 100,
    }
}

/// Requests of a trial of `firings` firings of which `boundary` change a boundary fact.
fn requests(strategy: StrategyKind, size: u64, firings: u64, boundary: u64) -> u64 {
    let turns = firings / size;
    match strategy {
        StrategyKind::Null => 0,
        StrategyKind::Full => firings,
        StrategyKind::Boundary => boundary,
        StrategyKind::Limited => (size - 1) * boundary,
        StrategyKind::Hierarchy | StrategyKind::Hybrid => boundary + boundary / 2,
        StrategyKind::Central | StrategyKind::Pipelined => size * (102 * turns + 2),
        StrategyKind::CentralBatched => size * (2 * turns + 2),
    }
}

/// A lossless trial.
pub(crate) fn trial(size: u32, strategy: StrategyKind, trial: u32) -> TrialRecord {
    let (crafts, turns) = (u64::from(size), u64::from(trial % 4 + 1));
    let (firings, boundary) = (crafts * turns, turns + u64::from(trial % 2));
    let receivers = if strategy == StrategyKind::Full { crafts - 1 } else { 1 };
    let sent = requests(strategy, crafts, firings, boundary);
    let reply = if strategy.has_centre() { traffic(sent, 1) } else { Traffic::default() };
    let counts = Counts { replication: traffic(sent, receivers), reply };
    let named = |craft: u32| CraftFacts {
        craft,
        name: format!("craft-{craft}"),
        firings: turns,
        board_digest: Digest(u64::from(craft) + 1),
        ..CraftFacts::default()
    };
    let mut of_crafts: Vec<CraftFacts> = (0..size).map(named).collect();
    // The first craft does all the talking; sums are what the tests look at.
    of_crafts[0].expected = counts;
    of_crafts[0].measured = counts;
    TrialRecord {
        deterministic: TrialFacts {
            cell: Cell { block: 0, size, strategy },
            trial,
            end: TrialEnd::Finished,
            turns: trial % 4 + 1,
            firings,
            boundary_firings: boundary,
            idle_turns: 0,
            final_fact: None,
            expected: counts,
            measured: counts,
            expected_hops: sent,
            hops: sent,
            conflicts: 0,
            path_digest: Digest(0xfeed_0000_0000_0000 + u64::from(trial)),
            board_digest: Digest(u64::from(trial) + 3),
            replica_digest: Digest(0),
            crafts: of_crafts,
        },
        timing: TrialTiming {
            epoch: trial,
            duration_ns: 1_234_567,
            turn_times_ns: (0..turns).map(|turn| 40_000 + turn).collect(),
            orchestrator_cpu_ns: 55_000,
            processes: (0..size)
                .map(|craft| ProcessCost {
                    craft,
                    name: format!("craft-{craft}"),
                    cpu_ns: 10_000 + u64::from(craft),
                    resident_bytes: 9 << 20,
                })
                .collect(),
            overhead: Overhead { control: traffic(2 * crafts * turns, 1), ..Overhead::default() },
            losses: Losses::default(),
        },
    }
}

/// A timing cell of `turns` turns, slower for later strategies.
pub(crate) fn timing(
    size: u32,
    strategy: StrategyKind,
    turns: u64,
) -> (TimingRecord, Histogram<u64>) {
    let base = 20_000 + 5_000 * strategy as u64 + 1_000 * u64::from(size);
    let times: Vec<u64> = (0..turns).map(|turn| base + 7919 * turn % 10_000).collect();
    let mut histogram = time_histogram();
    times.iter().for_each(|&time| histogram.saturating_record(time));
    let record = TimingRecord {
        cell: Cell { block: 0, size, strategy },
        epochs: 5,
        turns,
        warm_up_turns: 300,
        warm_up_ns: 200_000_000,
        second_half_ratio: second_half_ratio(&times),
        turn_time: Distribution::of(&histogram),
        fleet_cpu_ns: turns * base,
        orchestrator_cpu_ns: turns * 9_000,
        processes: size + u32::from(strategy.has_centre()),
        resident_bytes: u64::from(size) * (9 << 20),
        resident_bytes_max: 9 << 20,
        ready_ns: 90_000_000,
        counts: Counts::default(),
        overhead: Overhead { control: traffic(turns * 20, 1), ..Overhead::default() },
        losses: Losses::default(),
    };
    (record, histogram)
}

/// Leaves a complete run of `sizes` in `directory`, ten trials and 1,000 timed turns a cell.
pub(crate) fn leave_run(directory: &Path, sizes: &[u32]) -> super::summary::Summary {
    let scenario = "[run]\nseed = 7\n";
    let mut store = Store::create(Place::Exactly(directory), &provenance(), scenario).unwrap();
    for &size in sizes {
        store.event(Event::FleetStarted { block: 0, size, processes: size + 1 }).unwrap();
        store.event(Event::FleetReady { block: 0, size, ready_ns: 90_000_000 }).unwrap();
        for strategy in STRATEGIES {
            for number in 0..10 {
                store.append_trial(&trial(size, strategy, number)).unwrap();
            }
            let (record, histogram) = timing(size, strategy, 1000);
            store.append_timing(&record, &histogram).unwrap();
        }
    }
    store.finish(Outcome::Success).unwrap()
}
