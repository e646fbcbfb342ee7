//! The model's distributions against closed forms, and the published means against the model.

use super::sample;
use crate::report::published::{Published, Verdict};
use crate::report::ranges::{Column, Sample};
use shared_types::scenario::GeneratedNetwork;
use shared_types::wire::StrategyKind::{Boundary, Full, Hierarchy, Limited};
use std::sync::LazyLock;

const SEED: u64 = 2016;

fn published_sample(crafts: u32, trials: u32) -> Sample {
    sample(&GeneratedNetwork::default(), crafts, SEED, trials)
}

fn check_near(name: &str, crafts: u32, found: f64, wanted: f64, share: f64) {
    let error = found / wanted - 1.0;
    assert!(error.abs() < share, "N = {crafts}: {name} {found:.4}, not {wanted:.4} ({error:+.3})");
}

/// E[T], proposed/full and hierarchy/proposed within `share` of the closed forms.
fn check_closed_forms(sample: &Sample, share: f64) {
    let crafts = sample.crafts;
    let value = |column| sample.range(column, SEED).value;
    let (turns, distance) = match crafts {
        2 => (5.26, 1.0),
        3 => (3.69, 1.333),
        5 => (2.44, 1.800),
        _ => (1.54, 2.822),
    };
    check_near("turns", crafts, value(Column::Turns), turns, share);
    let linked = 1.0 - (1.0 - 0.2593_f64).powi(i32::try_from(crafts).unwrap() - 1);
    check_near("proposed/full", crafts, value(Column::Ratio(Boundary, Full)), linked, share);
    let far = value(Column::Ratio(Hierarchy, Boundary));
    check_near("hierarchy/proposed", crafts, far, distance, share);
    let limited = value(Column::Ratio(Limited, Boundary));
    check_near("limited/proposed", crafts, limited, f64::from(crafts - 1), 1e-9);
    let mean_full = value(Column::Requests(Full));
    check_near("full", crafts, mean_full, value(Column::Turns) * f64::from(crafts), 1e-9);
}

/// Set to anything, it makes the tests play ten thousand trials of each size, which is best done with
/// `--release`.
const LONG: &str = "SLATESWARM_LONG_TESTS";

/// The published experiment in every size; both tests below look at it.
static SAMPLES: LazyLock<Vec<Sample>> = LazyLock::new(|| {
    let is_long = std::env::var_os(LONG).is_some();
    // Fewer trials where a trial costs more. With under 2000, the range of ten crafts is too rough:
    // the published ratio of proposed to full lies 0.002 above its lower end.
    [(2, 6000), (3, 4000), (5, 2000), (10, 2000)]
        .map(|(crafts, trials)| published_sample(crafts, if is_long { 10_000 } else { trials }))
        .to_vec()
});

#[test]
fn distributions_equal_the_closed_forms() {
    for sample in SAMPLES.iter() {
        check_closed_forms(sample, 0.05);
    }
}

#[test]
fn published_means_lie_in_the_range_of_ten_trials() {
    let published = Published::embedded();
    for sample in SAMPLES.iter() {
        for column in Column::ALL {
            let wanted = if column.is_source_inconsistent(sample.crafts) {
                Verdict::SourceInconsistent
            } else {
                Verdict::Reproduced
            };
            let found = sample.verdict(column, &published, SEED);
            let range = sample.range(column, SEED);
            assert_eq!(found, Some(wanted), "N = {}, {column:?}: {range:?}", sample.crafts);
        }
    }
}

#[test]
fn the_source_read_literally_is_rejected_by_its_own_tables() {
    // 300 links per board in all: proposed/full does not grow with the fleet.
    let parameters = GeneratedNetwork {
        linking: shared_types::scenario::LinkingModel::PerBoard,
        ..GeneratedNetwork::default()
    };
    let sample = sample(&parameters, 10, SEED, 400);
    let column = Column::Ratio(Boundary, Full);
    let verdict = sample.verdict(column, &Published::embedded(), SEED);
    assert_eq!(verdict, Some(Verdict::NotReproduced));
}

#[test]
fn same_seed_gives_the_same_ranges() {
    let [one, two] = [0, 1].map(|_| published_sample(3, 50));
    assert_eq!(one, two);
    assert_eq!(one.range(Column::Turns, 1), two.range(Column::Turns, 1));
    assert_ne!(one.range(Column::Turns, 1), two.range(Column::Turns, 2));
}
