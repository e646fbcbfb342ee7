//! Records made up for tests: arithmetic instead of a fleet, different in every field.

mod loads;

pub(crate) use loads::{LOADED, RECOVERY, capacity, leave_loads, load};

use super::event::Event;
use super::host::HostCheck;
use super::provenance::{Host, Provenance, Versions};
use super::record::{
    Cell, Counts, CraftFacts, Digest, Label, Overhead, ProcessCost, TimingRecord, TrialEnd,
    TrialFacts, TrialRecord, TrialTiming,
};
use super::statistics::{Distribution, as_float, histogram_of, second_half_ratio};
use super::store::{Place, Store};
use crate::outcome::Outcome;
use shared_types::rng::{Purpose, Stream};
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
            id: Some(Digest(0x1d)),
        },
        plan: [("the scenario".to_owned(), Digest(0x5c))].into(),
        resumed: Vec::new(),
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
                    reasoning: None,
                })
                .collect(),
            overhead: Overhead { control: traffic(2 * crafts * turns, 1), ..Overhead::default() },
            losses: Losses::default(),
            links: None,
        },
    }
}

/// A timing cell of `turns` turns, slower for later strategies.
pub(crate) fn timing(
    size: u32,
    strategy: StrategyKind,
    turns: u64,
) -> (TimingRecord, Vec<Vec<u64>>) {
    let base = 20_000 + 5_000 * strategy as u64 + 1_000 * u64::from(size);
    let times: Vec<u64> = (0..turns).map(|turn| base + 7919 * turn % 10_000).collect();
    let epochs = times.chunks(200).map(<[u64]>::to_vec).collect();
    let record = TimingRecord {
        cell: Cell { block: 0, size, strategy },
        again: 0,
        place: 0,
        epochs: 5,
        turns,
        warm_up_turns: 300,
        warm_up_ns: 200_000_000,
        second_half_ratio: second_half_ratio(&times),
        turn_time: Distribution::of(&histogram_of(times.iter().copied())),
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
    (record, epochs)
}

/// Leaves a complete run of `sizes` in `directory`, ten trials and 1,000 timed turns a cell.
pub(crate) fn leave_run(directory: &Path, sizes: &[u32]) -> super::summary::Summary {
    let scenario = "[run]\nseed = 7\n";
    let mut store = Store::create(Place::Exactly(directory), &provenance(), scenario)
        .expect("the disk takes it");
    for &size in sizes {
        let order = vec!["null".to_owned()];
        store
            .event(Event::FleetStarted { block: 0, size, processes: size + 1, order })
            .expect("the disk takes it");
        store
            .event(Event::FleetReady { block: 0, size, ready_ns: 90_000_000 })
            .expect("the disk takes it");
        for strategy in STRATEGIES {
            for number in 0..10 {
                store.append_trial(&trial(size, strategy, number)).expect("the disk takes it");
            }
            let (record, epochs) = timing(size, strategy, 1000);
            store.append_timing(&record, &epochs).expect("the disk takes it");
        }
    }
    store.finish(Outcome::Success).expect("the disk takes it")
}

/// Leaves the turn times of `blocks` blocks in `directory`, drawn by number `run`: blocks differ by up
/// to 40 %, a strategy from itself by up to 2 %, and `full` takes `slowdown` times as long as `boundary`.
pub(crate) fn leave_blocks(
    directory: &Path,
    run: u32,
    blocks: u32,
    slowdown: f64,
) -> super::summary::Summary {
    let mut store =
        Store::create(Place::Exactly(directory), &provenance(), "").expect("the disk takes it");
    let stream = |number| Stream::new(u64::from(run), 0, Purpose::Test, number);
    let (mut draws, mut draws_of_controls) = (stream(77), stream(78));
    for block in 0..blocks {
        let fleet_factor = 1.0 + 0.4 * draws.unit();
        let check = HostCheck { measured_ns: 1, ..HostCheck::default() };
        store.event(Event::HostChecked { block, size: 3, check }).expect("the disk takes it");
        for (strategy, again, factor) in [
            (StrategyKind::Null, 0, 0.5),
            (StrategyKind::Boundary, 0, 1.0),
            (StrategyKind::Boundary, 1, 1.0),
            (StrategyKind::Boundary, 2, 1.0),
            (StrategyKind::Boundary, 3, 1.0),
            (StrategyKind::Boundary, Label::SLOWED, slowdown),
            (StrategyKind::Full, 0, slowdown),
        ] {
            let draws = if again > 1 { &mut draws_of_controls } else { &mut draws };
            let factor = factor * fleet_factor * (1.0 + 0.02 * draws.unit());
            let (mut record, mut epochs) = timing(3, StrategyKind::Null, 1000);
            for time in epochs.iter_mut().flatten() {
                *time = scaled(*time, factor);
            }
            let all = histogram_of(epochs.iter().flatten().copied());
            record.turn_time = Distribution::of(&all);
            record.fleet_cpu_ns = scaled(record.fleet_cpu_ns, factor);
            record.cell = Cell { block, size: 3, strategy };
            record.again = again;
            store.append_timing(&record, &epochs).expect("the disk takes it");
        }
    }
    store.finish(Outcome::Success).expect("the disk takes it")
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "times of tests are small and positive"
)]
fn scaled(time_ns: u64, factor: f64) -> u64 {
    (as_float(time_ns) * factor) as u64
}
