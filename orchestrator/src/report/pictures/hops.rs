//! What a hop costs: from the call that sends to the return of the call that receives, by the way that a
//! sample took.

use super::loads::{Shown, loads, no_values, shown, sizes, title, warnings};
use crate::report::svg::axis::Axis;
use crate::report::svg::look::{Mark, Shape};
use crate::report::svg::number::Unit;
use crate::report::svg::picture::{Panel, Picture};
use crate::report::svg::rows::{Row, RowChart, Spot};
use crate::report::svg::scale::{Bounds, Spread};
use crate::results::summary::Summary;
use shared_types::wire::Stage;

/// The ways that samples take.
const WAYS: [(Stage, &str); 3] = [
    (Stage::WakeSameCore, "one hop, same core"),
    (Stage::WakeOtherCore, "one hop, other core"),
    (Stage::WakeRelayed, "several hops, their sum"),
];

/// The quantiles of a row: the first has the strategy's marker, the others a bar.
const QUANTILES: [&str; 3] = ["p50", "p90", "p99"];

/// One picture a fleet size.
#[must_use]
pub fn hops(summary: &Summary) -> Vec<Picture> {
    sizes(summary).into_iter().map(|size| of_size(summary, size)).collect()
}

fn of_size(summary: &Summary, size: u32) -> Picture {
    let panels = loads(summary, size).into_iter().map(|load| {
        let title = title(summary, size, load);
        let lines = shown(summary, size, load);
        let rows: Vec<Row> = lines.iter().flat_map(rows_of).collect();
        let values = rows.iter().flat_map(|row| row.spots.iter().map(|spot| spot.x));
        match Bounds::around(Spread::Log, values) {
            Some(bounds) => {
                let x = Axis::measured(
                    "send called to receive returned, log scale",
                    bounds,
                    Unit::Time,
                );
                Panel::Rows(RowChart { title, x, rows })
            }
            None => Panel::Nothing(no_values(&title, &lines)),
        }
    });
    let mut notes = vec![
        "Marker: median; bars: p90 and p99, left out where fewer than ten samples lie beyond. n is the \
         number of samples. Work of relays between hops is not in the sum."
            .to_owned(),
    ];
    notes.extend(warnings(summary, size));
    Picture {
        name: format!("hops-{size}"),
        title: format!("Delay of hops, {size} crafts"),
        about: "What a sample takes to wake its receiver, for one hop on the same core and across cores, \
                and along a path of several."
            .to_owned(),
        legend: Vec::new(),
        panels: panels.collect(),
        notes,
    }
}

/// A heading with the strategy's name, then a row for each way that its samples took.
fn rows_of(line: &Shown<'_>) -> Vec<Row> {
    let heading = Row { name: line.name.clone(), is_heading: true, ..Row::default() };
    let ways = WAYS.into_iter().filter_map(|(stage, name)| {
        let figure = |quantile| line.row.figures.get(&format!("{}-{quantile}", stage.name()));
        let n = figure(QUANTILES[0])?.n;
        let spots: Vec<Spot> = QUANTILES
            .into_iter()
            .enumerate()
            .filter_map(|(place, quantile)| {
                let mark =
                    if place == 0 { line.mark } else { Mark { shape: Shape::Bar, ..line.mark } };
                Some(Spot { x: figure(quantile)?.value?, mark, is_hollow: false })
            })
            .collect();
        let remark = if spots.is_empty() { format!("- (n {n})") } else { format!("n {n}") };
        Some(Row { name: name.to_owned(), spots, remark, ..Row::default() })
    });
    std::iter::once(heading).chain(ways).collect()
}
