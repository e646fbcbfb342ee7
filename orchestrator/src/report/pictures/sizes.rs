//! Charts over fleet size: one line a strategy, a point a size, whiskers for intervals.

use crate::report::svg::axis::Axis;
use crate::report::svg::lines::{LineChart, Point, Series};
use crate::report::svg::look::Mark;
use crate::report::svg::number::Unit;
use crate::report::svg::scale::{Bounds, Spread};
use crate::results::figure::Figure;
use shared_types::wire::StrategyKind;
use std::collections::BTreeSet;

/// A value of one strategy at one fleet size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct At {
    pub(super) size: u32,
    pub(super) strategy: StrategyKind,
    pub(super) value: Option<f64>,
    pub(super) interval: Option<(f64, f64)>,
    /// What others said of the same.
    pub(super) is_reference: bool,
}

impl At {
    /// What `figure` says.
    pub(super) fn of(size: u32, strategy: StrategyKind, figure: &Figure) -> Self {
        let interval = figure.low.zip(figure.high);
        Self { size, strategy, value: figure.value, interval, is_reference: false }
    }
}

/// Pixels between strategies that have a value at the same size.
const DODGE: f64 = 4.0;
/// Height of the frame.
const HEIGHT: f64 = 330.0;

/// The chart of `values`, whose unit is that of the left axis; `None` if there is none above 0. A
/// strategy that lacks a size says so in its name.
pub(super) fn over_sizes(
    title: &str,
    y_title: &str,
    unit: Unit,
    values: &[At],
) -> Option<LineChart> {
    let shown = |at: &&At| at.value.is_some_and(|value| value > 0.0 && value.is_finite());
    let sizes: BTreeSet<u32> = values.iter().filter(shown).map(|at| at.size).collect();
    let heights = values.iter().filter(shown).flat_map(|at| {
        let ends = at.interval.map(|(low, high)| [low, high]);
        at.value.into_iter().chain(ends.into_iter().flatten())
    });
    let y = Bounds::around(Spread::Log, heights)?;
    let x = Bounds::around(Spread::Log, sizes.iter().map(|&size| f64::from(size)))?;
    let ticks = sizes.iter().map(|&size| (f64::from(size), size.to_string())).collect();
    let mut series = Vec::new();
    for is_reference in [false, true] {
        for strategy in StrategyKind::ALL {
            let of_strategy = |at: &&At| at.strategy == strategy && at.is_reference == is_reference;
            let own: Vec<&At> = values.iter().filter(of_strategy).collect();
            if own.iter().any(shown) {
                series.push(one_series(strategy, is_reference, &own, &sizes));
            }
        }
    }
    Some(LineChart {
        title: title.to_owned(),
        x: Axis::named("crafts", x, ticks),
        y: Axis::measured(y_title, y, unit),
        series,
        dodge: DODGE,
        height: HEIGHT,
    })
}

fn one_series(
    strategy: StrategyKind,
    is_reference: bool,
    own: &[&At],
    sizes: &BTreeSet<u32>,
) -> Series {
    let mut points: Vec<Point> = own
        .iter()
        .filter_map(|at| {
            let y = at.value.filter(|&value| value > 0.0)?;
            Some(Point { x: f64::from(at.size), y, interval: at.interval, is_marked: true })
        })
        .collect();
    points.sort_by(|one, other| one.x.total_cmp(&other.x));
    let has = |size: &u32| points.iter().any(|point| (point.x - f64::from(*size)).abs() < 0.5);
    let lacking: Vec<String> = sizes.iter().filter(|size| !has(size)).map(u32::to_string).collect();
    let name = if lacking.is_empty() {
        strategy.name().to_owned()
    } else {
        format!("{strategy} (- at {})", lacking.join(", "))
    };
    Series { mark: Mark::of(strategy), name, points, is_reference }
}

/// `n 10 to 40` or `n 10`; empty if there is none.
pub(super) fn range_of_n(values: impl IntoIterator<Item = u64>) -> String {
    let all: BTreeSet<u64> = values.into_iter().collect();
    match (all.first(), all.last()) {
        (Some(low), Some(high)) if low == high => format!("n {low}"),
        (Some(low), Some(high)) => format!("n {low} to {high}"),
        _ => String::new(),
    }
}
