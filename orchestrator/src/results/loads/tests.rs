//! Figures and comparisons of open mode, from records made up.

use super::LoadFigures;
use crate::outcome::Outcome;
use crate::results::inference::Verdict;
use crate::results::load::{LoadHistograms, LoadRecord, Saturation};
use crate::results::load_pairs::LoadMetric;
use crate::results::record::{Cell, Label};
use crate::results::recovered;
use crate::results::sample::{RECOVERY, leave_loads, load, provenance};
use crate::results::statistics::{Distribution, as_float, histogram_of};
use crate::results::store::{Place, Store};
use crate::results::summary::Summary;
use shared_types::wire::{Stage, StrategyKind};

/// A run of the cells that `change` makes of `common` loads over three blocks.
fn run_of(change: impl Fn(&mut LoadRecord, &mut LoadHistograms)) -> Summary {
    let place = tempfile::tempdir().unwrap();
    let mut store = Store::create(Place::Exactly(place.path()), &provenance(), "").unwrap();
    for block in 0..3 {
        for strategy in [StrategyKind::Null, StrategyKind::Boundary, StrategyKind::Full] {
            let cell = Cell { block, size: 10, strategy };
            let (mut record, mut histograms) = load(cell, 0, "common", 2000, 1.0);
            change(&mut record, &mut histograms);
            store.append_load(&record, &histograms).unwrap();
        }
    }
    store.finish(Outcome::Success).unwrap()
}

fn row(summary: &Summary, strategy: StrategyKind) -> &LoadFigures {
    summary.timing.loads.iter().find(|row| row.strategy == strategy && row.again == 0).unwrap()
}

#[test]
fn every_figure_has_n_unit_load_and_an_interval_from_three_blocks_on() {
    let place = tempfile::tempdir().unwrap();
    let summary = leave_loads(place.path(), 3, 3, 2000, 1.2);
    let figures = &row(&summary, StrategyKind::Boundary).figures;
    for (metric, unit, n) in [
        ("knowledge-p50", "ns", 6000),
        ("knowledge-p99", "ns", 6000),
        ("schedule-p50", "ns", 6000),
        ("wake-same-core-p50", "ns", 6000),
        ("cpu-per-application", "ns", 6000),
        ("cpu-per-application-over-null", "ns", 6000),
        ("requests-per-application", "request", 6000),
        ("transmissions-per-application", "sample", 6000),
        ("bytes-per-application", "byte", 6000),
        ("records-per-sample-p50", "record", 6000),
        ("staleness-p50", "ns", 120),
    ] {
        let figure = figures.get(metric).unwrap_or_else(|| panic!("{metric}"));
        let (value, low, high) = (figure.value.unwrap(), figure.low.unwrap(), figure.high.unwrap());
        assert!(low <= value && value <= high, "{metric}: {low} {value} {high}");
        assert_eq!((figure.unit, figure.n, figure.load.as_deref()), (unit, n, Some("common")));
        assert!(!figure.label.is_empty());
    }
    let value = |metric: &str| figures.value(metric);
    assert_eq!(value("knowledge-p99.9"), None, "6000 events do not carry it");
    assert_eq!(value("stale-reads-share"), Some(10.0));
    assert_eq!(value("offered-rate"), Some(4000.0));
    // A fifth of the cost is the floor's; blocks move both alike.
    let excess =
        value("cpu-per-application-over-null").unwrap() / value("cpu-per-application").unwrap();
    assert!((0.78..0.82).contains(&excess), "{excess}");
    let of_two = leave_loads(&place.path().join("two"), 3, 2, 2000, 1.2);
    let figure = row(&of_two, StrategyKind::Boundary).figures.get("knowledge-p50").unwrap();
    assert!(figure.value.is_some() && figure.low.is_none(), "two blocks have no interval");
}

#[test]
fn what_recovery_did_is_summed_over_the_blocks_that_recover() {
    let summary = run_of(|record, _| {
        if record.cell.block == 2 {
            record.recovery = None;
        }
    });
    let full = &row(&summary, StrategyKind::Full).figures;
    for (metric, value, unit, _) in recovered::values(&RECOVERY) {
        let figure = full.get(metric).unwrap_or_else(|| panic!("{metric}"));
        assert_eq!(figure.value, Some(2.0 * as_float(value)), "{metric}");
        assert_eq!((figure.unit, figure.n, figure.load.as_deref()), (unit, 2, Some("common")));
        let boundary = &row(&summary, StrategyKind::Boundary).figures;
        assert!(boundary.get(metric).is_none(), "what does not recover says nothing of it");
    }
}

#[test]
fn a_cell_above_capacity_has_no_percentiles_and_is_compared_with_nothing() {
    let summary = run_of(|record, _| {
        if record.cell.strategy == StrategyKind::Full {
            record.saturated = Some(Saturation::Unapplied);
        }
    });
    let full = row(&summary, StrategyKind::Full);
    assert_eq!(full.saturated, Some(Saturation::Unapplied));
    for metric in ["knowledge-p50", "knowledge-max", "schedule-p50", "apply-p90"] {
        let figure = full.figures.get(metric).unwrap();
        assert_eq!((figure.value, figure.low), (None, None), "{metric}");
    }
    assert!(full.figures.value("cpu-per-application").is_some());
    assert_eq!(summary.timing.compared_loads, []);
    assert_eq!(summary.timing.orders, [], "one strategy alone has no order");
}

#[test]
fn nine_blocks_name_a_winner_by_every_metric_and_fewer_do_not() {
    let place = tempfile::tempdir().unwrap();
    let of = |blocks: u32| {
        let summary = leave_loads(&place.path().join(blocks.to_string()), 7, blocks, 1000, 1.2);
        let compared = summary.timing.compared_loads;
        compared.into_iter().filter(|pair| pair.strategy == StrategyKind::Full).collect::<Vec<_>>()
    };
    let nine = of(9);
    assert_eq!(nine.iter().map(|pair| pair.metric).collect::<Vec<_>>(), LoadMetric::ALL);
    for pair in &nine {
        assert_eq!(pair.comparison.verdict, Verdict::Winner, "{pair:?}");
        assert_eq!(pair.winner, Some(StrategyKind::Boundary));
        assert!((pair.comparison.ratio - 1.2).abs() < 0.02 && pair.comparison.floor.is_some());
    }
    assert!(of(8).iter().all(|pair| pair.comparison.verdict == Verdict::TooFewBlocks));
}

#[test]
fn a_late_schedule_names_no_winner_on_latency_and_still_one_on_cpu() {
    let place = tempfile::tempdir().unwrap();
    let mut store = Store::create(Place::Exactly(place.path()), &provenance(), "").unwrap();
    for block in 0..9 {
        let check = crate::results::host::HostCheck { measured_ns: 1, ..Default::default() };
        store.event(crate::results::event::Event::HostChecked { block, size: 10, check }).unwrap();
        for (strategy, again, factor) in [
            (StrategyKind::Boundary, 0, 1.0),
            (StrategyKind::Boundary, 1, 1.01),
            (StrategyKind::Full, 0, 1.5),
        ] {
            let (mut record, mut histograms) =
                load(Cell { block, size: 10, strategy }, again, "high", 1000, factor);
            let late = histogram_of((0..1000).map(|_| 19_000));
            record.stages.insert(Stage::Schedule, Distribution::of(&late));
            histograms.stages.insert(Stage::Schedule, late);
            store.append_load(&record, &histograms).unwrap();
        }
    }
    let summary = store.finish(Outcome::Success).unwrap();
    assert!(row(&summary, StrategyKind::Boundary).is_late);
    for pair in &summary.timing.compared_loads {
        let is_cpu = pair.metric == LoadMetric::CpuPerApplication;
        assert_eq!(pair.winner.is_some(), is_cpu, "{pair:?}");
        assert_eq!(pair.is_late, !is_cpu);
    }
}

/// Three blocks of `boundary`, twice stamped and once not; `unstamped` times as long without stamps.
fn stamped(unstamped: f64) -> Summary {
    let place = tempfile::tempdir().unwrap();
    let mut store = Store::create(Place::Exactly(place.path()), &provenance(), "").unwrap();
    for block in 0..3 {
        let cell = Cell { block, size: 10, strategy: StrategyKind::Boundary };
        for (again, factor) in [(0, 1.0), (1, 1.01), (Label::UNSTAMPED, unstamped)] {
            let (record, histograms) = load(cell, again, "high", 2000, factor);
            store.append_load(&record, &histograms).unwrap();
        }
    }
    store.finish(Outcome::Success).unwrap()
}

#[test]
fn the_effect_of_stamps_is_seen_where_there_is_one() {
    let without = stamped(1.0).timing.stamp_effects;
    let metrics: Vec<LoadMetric> = without.iter().map(|effect| effect.metric).collect();
    assert_eq!(metrics, [LoadMetric::KnowledgeP50, LoadMetric::KnowledgeP99]);
    assert!(without.iter().all(|effect| effect.is_within == Some(true)), "{without:?}");
    let with = stamped(0.9).timing.stamp_effects;
    assert!(with.iter().all(|effect| effect.is_within == Some(false)), "{with:?}");
    assert!((with[0].comparison.ratio - 1.0 / 0.9).abs() < 0.02);
}

#[test]
fn one_saturated_block_of_three_is_told_and_hides_nothing() {
    let place = tempfile::tempdir().unwrap();
    let of = |saturated: u32| {
        let directory = place.path().join(saturated.to_string());
        let mut store = Store::create(Place::Exactly(&directory), &provenance(), "").unwrap();
        for block in 0..3 {
            let cell = Cell { block, size: 10, strategy: StrategyKind::Boundary };
            let (mut record, histograms) = load(cell, 0, "high", 2000, 1.0);
            record.saturated = (block < saturated).then_some(Saturation::Lag);
            store.append_load(&record, &histograms).unwrap();
        }
        store.finish(Outcome::Success).unwrap().timing.loads.remove(0)
    };
    let (one, two) = (of(1), of(2));
    assert_eq!((one.saturated, one.saturated_blocks), (None, 1));
    assert!(one.figures.value("knowledge-p50").is_some());
    assert_eq!((two.saturated, two.saturated_blocks), (Some(Saturation::Lag), 2));
    assert_eq!(two.figures.value("knowledge-p50"), None);
}

#[test]
fn of_a_central_strategy_the_middle_asking_interval_stands_for_it() {
    let place = tempfile::tempdir().unwrap();
    let mut store = Store::create(Place::Exactly(place.path()), &provenance(), "").unwrap();
    for strategy in [StrategyKind::Boundary, StrategyKind::Central, StrategyKind::CentralBatched] {
        for every_ms in [10, 1, 3] {
            let (mut record, histograms) =
                load(Cell { block: 0, size: 10, strategy }, 0, "common", 1000, 1.0);
            record.asks_every_ns = strategy.has_centre().then_some(every_ms * 1_000_000);
            store.append_load(&record, &histograms).unwrap();
        }
    }
    let summary = store.finish(Outcome::Success).unwrap();
    let compared: Vec<_> = summary
        .timing
        .loads
        .iter()
        .filter(|row| row.is_compared)
        .map(|row| (row.strategy, row.asks_every_ns))
        .collect();
    let central = (StrategyKind::CentralBatched, Some(3_000_000));
    assert_eq!(compared, [(StrategyKind::Boundary, None), central]);
    assert_eq!(summary.timing.loads.len(), 7, "each interval has a row of its own");
}

#[test]
fn orders_that_disagree_are_found() {
    let summary = run_of(|record, histograms| {
        if record.cell.strategy == StrategyKind::Full {
            record.counts.replication.transmissions /= 4;
            record.fleet_cpu_ns *= 2;
            for slice in &mut histograms.knowledge {
                let slower = slice.iter_recorded().map(|step| step.value_iterated_to() * 3);
                *slice = histogram_of(slower.collect::<Vec<_>>());
            }
        }
    });
    let orders = &summary.timing.orders[0];
    let (full, boundary) = (StrategyKind::Full, StrategyKind::Boundary);
    assert_eq!(orders.by_count, [full, boundary]);
    assert_eq!((&orders.by_cpu, &orders.by_p99), (&vec![boundary, full], &vec![boundary, full]));
    assert!(orders.disagree);
    let alike = run_of(|record, _| {
        if record.cell.strategy == StrategyKind::Full {
            record.counts.replication.transmissions *= 2;
            record.fleet_cpu_ns *= 2;
        }
    });
    assert_eq!(alike.timing.orders[0].by_count, [boundary, full]);
}

#[test]
fn what_needs_attention_is_marked() {
    let summary = run_of(|record, _| match record.cell.strategy {
        StrategyKind::Full => record.second_half_ratio = Some(1.2),
        StrategyKind::Boundary => record.orchestrator_cpu_ns = 600_000,
        _ => {}
    });
    let (full, boundary) =
        (row(&summary, StrategyKind::Full), row(&summary, StrategyKind::Boundary));
    assert_eq!((full.is_stationary, full.is_disturbed), (Some(false), false));
    assert_eq!((boundary.is_stationary, boundary.is_disturbed), (Some(true), true));
}
