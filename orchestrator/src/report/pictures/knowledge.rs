//! Time to knowledge at every percentile that the events carry, one panel a load, one line a strategy.

use super::loads::{Shown, loads, no_values, shown, sizes, title, warnings};
use super::sizes::range_of_n;
use crate::report::svg::axis::Axis;
use crate::report::svg::lines::{LineChart, Point, Series};
use crate::report::svg::number::Unit;
use crate::report::svg::picture::{Panel, Picture};
use crate::report::svg::scale::{Bounds, Spread};
use crate::results::read::RunData;
use crate::results::statistics::{BEYOND_MIN, Quantile, as_float, merged};
use crate::results::summary::Summary;
use hdrhistogram::Histogram;

/// Percentiles that the axis names, by "one event in so many lies beyond".
const NAMED: [(f64, &str); 8] = [
    (1.0, "0"),
    (2.0, "50"),
    (10.0, "90"),
    (100.0, "99"),
    (1e3, "99.9"),
    (1e4, "99.99"),
    (1e5, "99.999"),
    (1e6, "99.9999"),
];

/// Points of a curve in which the number of events beyond is halved.
const POINTS_PER_HALVING: f64 = 4.0;
/// Height of a panel's frame.
const HEIGHT: f64 = 280.0;

/// One picture a fleet size.
#[must_use]
pub fn knowledge(run: &RunData, summary: &Summary) -> Vec<Picture> {
    sizes(summary).into_iter().map(|size| of_size(run, summary, size)).collect()
}

fn of_size(run: &RunData, summary: &Summary, size: u32) -> Picture {
    let panels = loads(summary, size).into_iter().map(|load| {
        let lines: Vec<(Shown<'_>, Option<Histogram<u64>>)> = shown(summary, size, load)
            .into_iter()
            .map(|line| {
                let histogram = histogram_of(run, &line);
                (line, histogram)
            })
            .collect();
        panel(&title(summary, size, load), &lines)
    });
    let n = range_of_n(loads(summary, size).into_iter().flat_map(|load| {
        let figures = |line: &Shown<'_>| line.row.figures.get("knowledge-p50").cloned();
        let shown = shown(summary, size, load);
        let carried = shown.iter().filter_map(figures).filter(|figure| figure.value.is_some());
        carried.map(|figure| figure.n).collect::<Vec<u64>>()
    }));
    let mut notes = vec![format!(
        "{n} events a line. A line ends where fewer than {BEYOND_MIN} events lie beyond. Bars: 95 % \
         interval over blocks and slices of the interval."
    )];
    notes.extend(warnings(summary, size));
    Picture {
        name: format!("knowledge-{size}"),
        title: format!("Time to knowledge, {size} crafts"),
        about: "From the intended time of a change to its application at a board that shares the fact: \
                the same events under every strategy."
            .to_owned(),
        legend: Vec::new(),
        panels: panels.collect(),
        notes,
    }
}

/// All blocks of a line together; `None` if a log was lost.
fn histogram_of(run: &RunData, line: &Shown<'_>) -> Option<Histogram<u64>> {
    let row = line.row;
    let key = (row.size, row.load.as_str(), row.strategy, row.again, row.asks_every_ns);
    let cells = run.loads.iter().filter(|cell| {
        let record = &cell.record;
        let (load, asks) = (record.load.as_str(), record.asks_every_ns);
        (record.cell.size, load, record.cell.strategy, record.again, asks) == key
    });
    let histograms: Option<Vec<&Histogram<u64>>> =
        cells.map(|cell| cell.knowledge.as_ref()).collect();
    histograms.filter(|all| !all.is_empty()).map(merged)
}

fn panel(title: &str, lines: &[(Shown<'_>, Option<Histogram<u64>>)]) -> Panel {
    let series: Vec<Series> = lines
        .iter()
        .map(|(line, histogram)| {
            let is_shown = line.row.saturated.is_none();
            let histogram = histogram.as_ref().filter(|_| is_shown);
            let points = histogram.map_or_else(Vec::new, |all| curve(all, line));
            let lacking = if points.is_empty() && is_shown { " (-)" } else { "" };
            let name = format!("{}{lacking}", line.name);
            Series { mark: line.mark, name, points, is_reference: false }
        })
        .collect();
    let heights = series.iter().flat_map(Series::heights);
    let Some(y) = Bounds::around(Spread::Log, heights) else {
        return Panel::Nothing(no_values(title, lines.iter().map(|(line, _)| line)));
    };
    let points = series.iter().flat_map(|series| &series.points);
    let end = points.map(|point| point.x).fold(10.0, f64::max);
    let ticks = NAMED.into_iter().filter(|&(beyond, _)| beyond <= end);
    let ticks = ticks.map(|(beyond, name)| (beyond, name.to_owned())).collect();
    let x = Bounds::between(Spread::Log, 1.0, end);
    Panel::Lines(LineChart {
        title: title.to_owned(),
        x: Axis::named("percentile of events", x, ticks),
        y: Axis::measured("time to knowledge, log scale", y, Unit::Time),
        series,
        dodge: 0.0,
        height: HEIGHT,
    })
}

/// The values of `all` from the smallest to the last percentile that may be shown, with markers and
/// intervals where the tables have a figure.
fn curve(all: &Histogram<u64>, line: &Shown<'_>) -> Vec<Point> {
    let last = as_float(all.len() / BEYOND_MIN);
    let mut beyond: Vec<f64> = (0_u32..)
        .map(|step| (f64::from(step) / POINTS_PER_HALVING).exp2())
        .take_while(|&beyond| beyond <= last)
        .collect();
    let figures: Vec<(f64, Option<(f64, f64)>)> = Quantile::ALL
        .into_iter()
        .filter_map(|quantile| {
            let figure = line.row.figures.get(&format!("knowledge-{}", quantile.name))?;
            figure.value?;
            Some((f64::from(quantile.one_beyond_in), figure.low.zip(figure.high)))
        })
        .collect();
    beyond.extend(figures.iter().map(|(at, _)| *at));
    beyond.push(last);
    beyond.retain(|&at| at >= 1.0 && at <= last);
    beyond.sort_by(f64::total_cmp);
    beyond.dedup();
    // A median needs twenty events; without it there is no line.
    if last < 2.0 {
        return Vec::new();
    }
    beyond
        .into_iter()
        .map(|at| {
            let figure = figures.iter().find(|(named, _)| (named - at).abs() < 1e-9);
            Point {
                x: at,
                y: as_float(all.value_at_quantile(1.0 - 1.0 / at)),
                interval: figure.and_then(|(_, interval)| *interval),
                is_marked: figure.is_some(),
            }
        })
        .collect()
}
