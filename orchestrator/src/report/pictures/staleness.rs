//! How old what a read saw was, and how many reads missed a write, against the rate of writes.

use super::loads::{loads, shown, sizes, warnings};
use super::sizes::range_of_n;
use crate::report::svg::axis::Axis;
use crate::report::svg::lines::{LineChart, Point, Series};
use crate::report::svg::look::Mark;
use crate::report::svg::number::Unit;
use crate::report::svg::picture::{Panel, Picture};
use crate::report::svg::scale::{Bounds, Spread};
use crate::results::summary::Summary;
use shared_types::wire::StrategyKind;
use std::collections::BTreeMap;

/// Metric, heading, title of the left axis, unit and spread of each panel.
const PANELS: [(&str, &str, &str, Unit, Spread); 3] = [
    (
        "stale-reads-share",
        "reads that missed a write",
        "share of all reads",
        Unit::Percent,
        Spread::Linear,
    ),
    (
        "staleness-p50",
        "age of what they missed, median",
        "median, log scale",
        Unit::Time,
        Spread::Log,
    ),
    ("staleness-p99", "age of what they missed, p99", "p99, log scale", Unit::Time, Spread::Log),
];

/// Height of a panel's frame.
const HEIGHT: f64 = 240.0;

/// One picture a fleet size whose traces read.
#[must_use]
pub fn staleness(summary: &Summary) -> Vec<Picture> {
    let reads = |size: u32| {
        let rows = summary.timing.loads.iter().filter(move |row| row.size == size);
        let figures = rows.filter_map(|row| row.figures.get("stale-reads-share"));
        figures.map(|figure| figure.n).filter(|&n| n > 0)
    };
    let measured = sizes(summary).into_iter().filter(|&size| reads(size).next().is_some());
    measured.map(|size| of_size(summary, size, &range_of_n(reads(size)))).collect()
}

fn of_size(summary: &Summary, size: u32, n: &str) -> Picture {
    let mut notes = vec![format!(
        "{n} reads a point. The age runs from the intended time of the oldest write that the read did not \
         see. Under load, saturated cells included."
    )];
    notes.extend(warnings(summary, size));
    Picture {
        name: format!("staleness-{size}"),
        title: format!("Stale reads against the rate of writes, {size} crafts"),
        about:
            "A read is stale if a write of the fact was intended before it and is not seen by it."
                .to_owned(),
        legend: Vec::new(),
        panels: PANELS.into_iter().map(|panel| draw(summary, size, panel)).collect(),
        notes,
    }
}

fn draw(
    summary: &Summary,
    size: u32,
    (metric, title, y_title, unit, spread): (&str, &str, &str, Unit, Spread),
) -> Panel {
    let mut lines: BTreeMap<StrategyKind, Vec<Point>> = BTreeMap::new();
    for load in loads(summary, size) {
        for line in shown(summary, size, load) {
            let points = lines.entry(line.row.strategy).or_default();
            let figures = &line.row.figures;
            let figure = figures.get(metric);
            let place = figures.value("offered-rate").zip(figure.and_then(|figure| figure.value));
            points.extend(place.map(|(x, y)| Point {
                x,
                y,
                interval: figure.and_then(|figure| figure.low.zip(figure.high)),
                is_marked: true,
            }));
        }
    }
    let series: Vec<Series> = lines
        .into_iter()
        .map(|(strategy, mut points)| {
            points.sort_by(|one, other| one.x.total_cmp(&other.x));
            let lacking = if points.is_empty() { " (-)" } else { "" };
            let name = format!("{strategy}{lacking}");
            Series { mark: Mark::of(strategy), name, points, is_reference: false }
        })
        .collect();
    let heights = series.iter().flat_map(Series::heights);
    let points = series.iter().flat_map(|series| &series.points);
    let bounds = Bounds::around(Spread::Log, points.map(|point| point.x))
        .zip(Bounds::around(spread, heights));
    let Some((x, y)) = bounds else {
        return Panel::Nothing(format!("{title}: no value"));
    };
    Panel::Lines(LineChart {
        title: title.to_owned(),
        x: Axis::measured("writes offered to the fleet, log scale", x, Unit::PerSecond),
        y: Axis::measured(y_title, y, unit),
        series,
        dodge: 3.0,
        height: HEIGHT,
    })
}
