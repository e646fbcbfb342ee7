//! Time to knowledge against the number of hops that a change came over: one line a strategy.

use super::loads::{Shown, loads, no_values, shown, sizes, title, warnings};
use crate::report::svg::axis::Axis;
use crate::report::svg::lines::{LineChart, Point, Series};
use crate::report::svg::number::Unit;
use crate::report::svg::picture::{Panel, Picture};
use crate::report::svg::scale::{Bounds, Spread};
use crate::results::loads::HOPS;
use crate::results::statistics::Quantile;
use crate::results::summary::Summary;

/// What a panel shows, with its words.
const SHOWN: [(Quantile, &str); 2] = [(Quantile::P50, "median"), (Quantile::P99, "p99")];

/// Height of a panel's frame.
const HEIGHT: f64 = 240.0;
/// Pixels between strategies at the same number of hops.
const DODGE: f64 = 5.0;

/// One picture a fleet size in which some change came over more than one hop.
#[must_use]
pub fn by_hops(summary: &Summary) -> Vec<Picture> {
    let has_several = |size: &u32| {
        let rows = summary.timing.loads.iter().filter(|row| row.size == *size && row.again == 0);
        rows.flat_map(|row| row.by_hops()).any(|over| over.hops > 1)
    };
    sizes(summary).into_iter().filter(has_several).map(|size| of_size(summary, size)).collect()
}

fn of_size(summary: &Summary, size: u32) -> Picture {
    let (mut panels, mut counts) = (Vec::new(), Vec::new());
    for load in loads(summary, size) {
        let lines = shown(summary, size, load);
        let title = title(summary, size, load);
        panels.extend(SHOWN.map(|shown| panel(&title, &lines, shown)));
        counts.extend(lines.iter().filter_map(|line| events(line, load)));
    }
    let mut notes = vec![
        "Intended to applied at a board that shares the fact, by the hops that the change came over; under \
         a central strategy two, through the centre. Bars: 95 % interval over blocks. Changes never known \
         are in no point."
            .to_owned(),
        format!("Events: {}.", counts.join("; ")),
    ];
    notes.extend(warnings(summary, size));
    Picture {
        name: format!("knowledge-by-hops-{size}"),
        title: format!("Time to knowledge by hops, {size} crafts"),
        about: "How much later a change is known that is passed on more often.".to_owned(),
        legend: Vec::new(),
        panels,
        notes,
    }
}

/// `hierarchy at common n 5000, 3000 (1, 2 hops)`.
fn events(line: &Shown<'_>, load: &str) -> Option<String> {
    let (mut n, mut hops) = (Vec::new(), Vec::new());
    for over in line.row.by_hops() {
        n.push(over.n.to_string());
        hops.push(over.name);
    }
    let plural = if hops == ["1"] { "" } else { "s" };
    let what = || format!("{} at {load} n {}", line.row.strategy, n.join(", "));
    (!n.is_empty()).then(|| format!("{} ({} hop{plural})", what(), hops.join(", ")))
}

fn panel(title: &str, lines: &[Shown<'_>], (quantile, words): (Quantile, &str)) -> Panel {
    let title = format!("{title}: {words}");
    let series: Vec<Series> = lines
        .iter()
        .map(|line| {
            let points = line.row.by_hops().filter_map(|over| {
                let figure = over.figure(quantile)?;
                let interval = figure.low.zip(figure.high);
                Some(Point { x: f64::from(over.hops), y: figure.value?, interval, is_marked: true })
            });
            let points: Vec<Point> = points.collect();
            let is_lacking = points.is_empty() && line.row.saturated.is_none();
            let name = format!("{}{}", line.name, if is_lacking { " (-)" } else { "" });
            Series { mark: line.mark, name, points, is_reference: false }
        })
        .collect();
    let heights = series.iter().flat_map(Series::heights);
    let Some(y) = Bounds::around(Spread::Log, heights) else {
        return Panel::Nothing(no_values(&title, lines));
    };
    // The panels of a load have one axis, also where few events carry no 99th percentile.
    let hops = lines.iter().flat_map(|line| line.row.by_hops()).map(|over| f64::from(over.hops));
    let last = hops.fold(1.0, f64::max);
    let x = Bounds::between(Spread::Linear, 0.5, last + 0.5);
    let ticks = (1..).map(f64::from).zip(HOPS).take_while(|(hops, _)| *hops <= last);
    let ticks = ticks.map(|(hops, name)| (hops, name.to_owned())).collect();
    Panel::Lines(LineChart {
        title,
        x: Axis::named("hops from the writer", x, ticks),
        y: Axis::measured(format!("{words}, log scale"), y, Unit::Time),
        series,
        dodge: DODGE,
        height: HEIGHT,
    })
}
