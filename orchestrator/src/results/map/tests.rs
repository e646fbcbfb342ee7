//! The map over made-up costs: what is chosen, what stays a tie, and where the lines lie.

use super::{Map, Observation};
use crate::results::inference::Verdict;
use crate::results::load::LoadRecord;
use crate::results::read::{LoadCell, RunData};
use crate::results::record::{Cell, Label};
use crate::results::sample::load;
use shared_types::wire::StrategyKind::{self, Boundary, Full, Null};

/// CPU of a fleet that sends nothing, ns.
const FLOOR_NS: u64 = 1_000_000;
/// CPU of sending and of receiving a sample, ns.
const SEND_NS: u64 = 900;
const RECEIVE_NS: u64 = 500;
/// Writes of a trace.
const WRITES: u64 = 1000;

/// What `strategy` costs at `size` and `k_beta`; blocks differ from each other, alike for all.
fn observation(size: u32, k_beta: f64, block: u32, label: Label) -> Observation {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few thousand")]
    let needed = (k_beta * 1000.0).round() as u64;
    let (transmissions, deliveries) = match label.strategy {
        Null => (0, 0),
        Full => (WRITES, WRITES * u64::from(size - 1)),
        _ => (needed, needed),
    };
    let cpu_ns = FLOOR_NS + transmissions * SEND_NS + deliveries * RECEIVE_NS;
    let wave = 1000 + u64::from(block * 37 % 11) + u64::from(label.again);
    Observation {
        size,
        k_beta,
        block,
        label,
        cpu_ns: cpu_ns * wave / 1000,
        needed,
        p99_ns: (label.strategy != Null).then_some(20_000 * wave / 1000),
        transmissions,
        deliveries,
        is_clean: true,
    }
}

fn observations(sizes: &[u32], k_betas: &[f64], blocks: u32) -> Vec<Observation> {
    let labels = [Null, Boundary, Full]
        .map(Label::first)
        .into_iter()
        .chain([Label { strategy: Boundary, again: 1 }]);
    let mut all = Vec::new();
    for &size in sizes {
        for &k_beta in k_betas {
            for block in 0..blocks {
                all.extend(labels.clone().map(|label| observation(size, k_beta, block, label)));
            }
        }
    }
    all
}

/// By CPU (best, whether it is named) and by count.
fn cell(map: &Map, size: u32, k_beta: f64) -> (StrategyKind, Option<StrategyKind>, StrategyKind) {
    let found =
        map.cells.iter().find(|cell| cell.size == size && cell.k_beta.total_cmp(&k_beta).is_eq());
    let cell = found.expect("the cell");
    let by_cpu = cell.by_cpu.expect("two strategies");
    (by_cpu.best, by_cpu.strategy, cell.by_count)
}

#[test]
fn count_and_cpu_change_places_where_their_lines_lie() {
    let k_betas = [0.5, 2.0, 3.5, 8.0];
    let map = Map::of(&observations(&[4, 10], &k_betas, 12), 7);
    assert_eq!((map.sizes.clone(), map.k_betas.clone()), (vec![4, 10], k_betas.to_vec()));
    // (900 + 9 * 500) / 1400 = 3.86 and (900 + 3 * 500) / 1400 = 1.71
    assert_eq!(cell(&map, 10, 0.5), (Boundary, Some(Boundary), Boundary));
    assert_eq!(
        cell(&map, 10, 2.0),
        (Boundary, Some(Boundary), Full),
        "counting picks the wrong one"
    );
    assert_eq!(cell(&map, 10, 3.5), (Boundary, Some(Boundary), Full));
    assert_eq!(cell(&map, 10, 8.0), (Full, Some(Full), Full));
    assert_eq!(cell(&map, 4, 2.0), (Full, Some(Full), Full));
    let predicted: Vec<u32> = map.predicted_cpu.iter().map(|&(size, _)| size).collect();
    assert_eq!(predicted, [4, 10], "each from the other");
    for (size, k_beta) in map.predicted_cpu {
        let meant = f64::from(900 + (size - 1) * 500) / 1400.0;
        assert!((k_beta / meant - 1.0).abs() < 0.05, "{size}: {k_beta}, meant {meant}");
    }
}

#[test]
fn what_does_not_stand_is_a_tie_with_its_reason() {
    let ties = |map: &Map, reason: Verdict| {
        let choices: Vec<_> =
            map.cells.iter().flat_map(|cell| [cell.by_cpu, cell.by_p99]).flatten().collect();
        assert!(!choices.is_empty());
        assert!(
            choices.iter().all(|one| one.strategy.is_none() && one.verdict == reason),
            "{choices:?}"
        );
    };
    ties(&Map::of(&observations(&[10], &[0.5], 3), 7), Verdict::TooFewBlocks);
    let mut noisy = observations(&[4, 10], &[0.5], 12);
    noisy.iter_mut().filter(|one| one.size == 10).for_each(|one| one.is_clean = false);
    let map = Map::of(&noisy, 7);
    let named = |cell: usize| map.cells[cell].by_cpu.expect("two strategies");
    assert_eq!((named(1).strategy, named(1).verdict), (None, Verdict::Noisy));
    assert_eq!(
        named(0).strategy,
        Some(Boundary),
        "a cell is not doubtful for its neighbour's noise"
    );
    let map = Map::of(&observations(&[10], &[0.5], 12), 7);
    let by_p99 = map.cells[0].by_p99.expect("both are known");
    assert_eq!((by_p99.strategy, by_p99.verdict), (None, Verdict::Tie), "equal but for the wave");
    assert!(by_p99.low <= by_p99.margin && by_p99.margin <= by_p99.high);
}

#[test]
fn a_cell_is_of_one_load_and_of_the_middle_asking_interval() {
    let cell = Cell { block: 0, size: 10, strategy: StrategyKind::CentralBatched };
    let mut run = RunData::default();
    for (name, needed) in [("common", 100), ("high", 500)] {
        for asks_every_ns in [10_000_000, 1_000_000, 3_000_000] {
            let (record, _) = load(cell, 0, name, needed, 1.0);
            let fleet_cpu_ns = asks_every_ns + needed;
            let record = LoadRecord { asks_every_ns: Some(asks_every_ns), fleet_cpu_ns, ..record };
            run.loads.push(LoadCell {
                record,
                knowledge: None,
                slices: Vec::new(),
                stages: std::collections::BTreeMap::new(),
                staleness: None,
            });
        }
    }
    for (name, cpu_ns) in [("common", 3_000_100), ("high", 3_000_500)] {
        let found: Vec<u64> =
            Observation::of_run(0.5, &run, name).iter().map(|one| one.cpu_ns).collect();
        assert_eq!(found, [cpu_ns], "{name}");
    }
    assert_eq!(Observation::of_run(0.5, &run, "none"), []);
}

#[test]
fn what_is_not_known_is_not_compared() {
    let mut saturated = observations(&[10], &[0.5], 12);
    for one in saturated.iter_mut().filter(|one| one.label.strategy == Full) {
        one.p99_ns = None;
    }
    let map = Map::of(&saturated, 7);
    assert!(map.cells[0].by_p99.is_none() && map.cells[0].by_cpu.is_some());
    saturated.retain(|one| one.label.strategy == Null);
    assert_eq!(Map::of(&saturated, 7), Map::default());
    let mut without_floor = observations(&[4, 10], &[0.5], 3);
    without_floor.retain(|one| one.label.strategy != Null);
    assert_eq!(Map::of(&without_floor, 7).predicted_cpu, []);
}
