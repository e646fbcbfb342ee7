//! Cells of open mode made up for tests.

use super::{provenance, traffic};
use crate::outcome::Outcome;
use crate::results::baseline::{Baseline, RawHops};
use crate::results::event::Event;
use crate::results::host::HostCheck;
use crate::results::load::{
    CapacityRecord, LoadHistograms, LoadRecord, LoadRecovery, Probe, Saturation,
};
use crate::results::record::{Cell, Counts, Label, Overhead};
use crate::results::statistics::{Distribution, as_float, histogram_of, merged};
use crate::results::store::{Place, Store};
use crate::results::summary::Summary;
use hdrhistogram::Histogram;
use shared_types::rng::{Purpose, Stream};
use shared_types::transport::link::LinkCounts;
use shared_types::wire::{Losses, Stage, StrategyKind};
use std::collections::BTreeMap;
use std::path::Path;

/// Slices of an interval of the samples.
const SLICES: u64 = 5;

/// Length of one, ns.
const SLICE_NS: u64 = 100_000_000;

/// The labels of the sample loads.
pub(crate) const LOADED: [Label; 5] = [
    Label::first(StrategyKind::Null),
    Label::first(StrategyKind::Boundary),
    Label { strategy: StrategyKind::Boundary, again: 1 },
    Label::first(StrategyKind::Full),
    Label::first(StrategyKind::CentralBatched),
];

/// What recovery did in every cell of `full`, and in no other.
pub(crate) const RECOVERY: LoadRecovery = LoadRecovery {
    deaths: 2,
    records_missed: 31,
    repeats: 57,
    given_up: 3,
    learnt: 11,
    states_missed: 1,
    links: LinkCounts { lost: 41, cut_off: 7, doubled: 2, delayed: 19, overtaken: 4 },
    dropped: 5,
};

/// A cell of `needed` needed applications; every time is `factor` times that of the first strategy.
pub(crate) fn load(
    cell: Cell,
    again: u32,
    name: &str,
    needed: u64,
    factor: f64,
) -> (LoadRecord, LoadHistograms) {
    let is_null = cell.strategy == StrategyKind::Null;
    let scale = |time_ns: u64| super::scaled(time_ns, factor);
    let applied = if is_null { 0 } else { needed };
    let slice = |slice: u64| {
        let numbers = (0..applied).filter(|number| number % SLICES == slice);
        histogram_of(numbers.map(|number| scale(20_000 + 7919 * number % 10_000)))
    };
    let knowledge: Vec<Histogram<u64>> = (0..SLICES).map(slice).collect();
    let stage = |base: u64| histogram_of((0..needed).map(|number| scale(base + number % 100)));
    let mut stages = BTreeMap::from([(Stage::Schedule, stage(500))]);
    if !is_null {
        stages.extend([
            (Stage::Publish, stage(700)),
            (Stage::WakeSameCore, stage(7_000)),
            (Stage::WakeOtherCore, stage(27_000)),
            (Stage::Apply, stage(200)),
            // Strategies that pass nothing on: one hop, or two through the centre.
            (Stage::BY_HOPS[usize::from(cell.strategy.has_centre())], merged(&knowledge)),
            (Stage::RecordsPerSample, histogram_of((0..needed).map(|number| 1 + number % 2))),
        ]);
    }
    let staleness = histogram_of((0..40).map(|number| scale(10_000 + number)));
    let said = |histogram: &Histogram<u64>| Distribution::of(histogram);
    let mut distributions: BTreeMap<Stage, Distribution> =
        stages.iter().map(|(&stage, events)| (stage, said(events))).collect();
    if !is_null {
        distributions.insert(Stage::Knowledge, said(&merged(&knowledge)));
    }
    let share = |share: f64| BTreeMap::from([("wake".to_owned(), share)]);
    let counts = Counts { replication: traffic(applied, 1), ..Counts::default() };
    let record = LoadRecord {
        cell,
        again,
        place: again,
        load: name.to_owned(),
        offered_per_s: as_float(2 * needed),
        duration_ns: SLICES * SLICE_NS,
        asks_every_ns: cell.strategy.has_centre().then_some(3_000_000),
        warm_up_ns: 200_000_000,
        writes: needed,
        unplayed: 0,
        needed,
        applied_by_end: applied,
        applied_after_end: 0,
        censored: 0,
        saturated: None,
        counts,
        expected: (!cell.strategy.has_centre()).then_some(counts),
        overhead: Overhead::default(),
        losses: Losses::default(),
        recovery: (cell.strategy == StrategyKind::Full).then_some(RECOVERY),
        stages: distributions,
        shares: BTreeMap::from([("p50".to_owned(), share(61.5)), ("p99".to_owned(), share(82.5))]),
        second_half_ratio: (!is_null).then_some(1.01),
        reads: 400,
        stale_reads: if is_null { 100 } else { 40 },
        staleness: Some(said(&staleness)),
        fleet_cpu_ns: scale(needed * if is_null { 5_000 } else { 25_000 }),
        orchestrator_cpu_ns: 30_000,
        orchestrator_sleeps: 1,
        run_delay_ns: 1_000_000,
        sleeps: 5_000,
        proportional_bytes: u64::from(cell.size) * (3 << 20),
        processes: cell.size + u32::from(cell.strategy.has_centre()),
        sharers: 1.0,
        boundary_fraction: 0.9,
        simulated: None,
    };
    let histograms =
        LoadHistograms { slice_ns: SLICE_NS, knowledge, stages, staleness: Some(staleness) };
    (record, histograms)
}

/// A search for capacity that found 80,000 writes a second.
pub(crate) fn capacity(cell: Cell) -> CapacityRecord {
    let probe = |offered_per_s: f64, saturated| Probe {
        offered_per_s,
        applied_per_s: offered_per_s * 0.9,
        applied_share: if saturated { 0.9 } else { 1.0 },
        lag_p99_ns: Some(20_000),
        fleet_cpu_ns: 900_000_000,
        saturated: saturated.then_some(Saturation::Unapplied),
    };
    CapacityRecord {
        cell,
        place: 0,
        asks_every_ns: None,
        burst: 1,
        probes: vec![probe(40_000.0, false), probe(160_000.0, true), probe(80_000.0, false)],
        borne: Some(2),
    }
}

/// Leaves `common` loads of `needed` needed applications over `blocks` blocks in `directory`, drawn by
/// number `run`: blocks differ by up to 40 %, a strategy from itself by up to 2 %, and `full` takes
/// `slowdown` times as long as `boundary`.
pub(crate) fn leave_loads(
    directory: &Path,
    run: u32,
    blocks: u32,
    needed: u64,
    slowdown: f64,
) -> Summary {
    let mut store =
        Store::create(Place::Exactly(directory), &provenance(), "").expect("the disk takes it");
    let stream = |number| Stream::new(u64::from(run), 0, Purpose::Test, number);
    let (mut draws, mut draws_of_hops) = (stream(78), stream(79));
    for block in 0..blocks {
        let fleet_factor = 1.0 + 0.4 * draws.unit();
        let check = HostCheck { measured_ns: 1, ..HostCheck::default() };
        store.event(Event::HostChecked { block, size: 10, check }).expect("the disk takes it");
        let hops = |draw: f64| {
            let p50_ns = super::scaled(20_000, fleet_factor * (1.0 + 0.02 * draw));
            RawHops { n: 2_000, p50_ns, p99_ns: 2 * p50_ns }
        };
        let baseline = Baseline {
            processors: [0, 1],
            bytes: 128,
            warm_up: 500,
            before: hops(draws_of_hops.unit()),
            after: hops(draws_of_hops.unit()),
        };
        let event = Event::BaselineMeasured { block, size: 10, baseline };
        store.event(event).expect("the disk takes it");
        for label in LOADED {
            let own = if label.strategy == StrategyKind::Full { slowdown } else { 1.0 };
            let factor = own * fleet_factor * (1.0 + 0.02 * draws.unit());
            let cell = Cell { block, size: 10, strategy: label.strategy };
            let (record, histograms) = load(cell, label.again, "common", needed, factor);
            store.append_load(&record, &histograms).expect("the disk takes it");
        }
        let cell = Cell { block, size: 10, strategy: StrategyKind::Boundary };
        store.append_capacity(&capacity(cell)).expect("the disk takes it");
    }
    store.finish(Outcome::Success).expect("the disk takes it")
}
