//! What a hop costs: from the call that sends to the return of the call that receives, by the way that a
//! sample took.

use super::loads::Shown;
use super::rows_of_loads::RowsOfLoads;
use crate::report::svg::axis::Axis;
use crate::report::svg::look::{Mark, Shape};
use crate::report::svg::number::Unit;
use crate::report::svg::picture::Picture;
use crate::report::svg::rows::{Row, Spot};
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
    let frame = RowsOfLoads {
        name: "hops",
        title: "Delay of hops",
        about: "What a sample takes to wake its receiver, for one hop on the same core and across cores, \
                and along a path of several; by their number: see time to knowledge by hops.",
        note: "Marker: median; bars: p90 and p99, left out where fewer than ten samples lie beyond. n is \
               the number of samples. Work of relays between hops is not in the sum.",
        legend: Vec::new(),
        rows,
        axis,
    };
    frame.pictures(summary)
}

fn axis(rows: &[Row]) -> Option<Axis> {
    let values = rows.iter().flat_map(|row| row.spots.iter().map(|spot| spot.x));
    let bounds = Bounds::around(Spread::Log, values)?;
    Some(Axis::measured("send called to receive returned, log scale", bounds, Unit::Time))
}

/// A row for each way that a strategy's samples took.
fn rows(line: &Shown<'_>) -> Vec<Row> {
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
    ways.collect()
}
