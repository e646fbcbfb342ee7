//! Where time to knowledge goes: the shares of origin, wake and apply among the events from a quantile on.

use super::loads::Shown;
use super::rows_of_loads::RowsOfLoads;
use crate::report::svg::axis::Axis;
use crate::report::svg::legend::{Entry, Sign};
use crate::report::svg::number::Unit;
use crate::report::svg::picture::Picture;
use crate::report::svg::rows::{Part, Row};
use crate::report::svg::scale::{Bounds, Spread};
use crate::results::summary::Summary;

/// Parts in the order of time, with their style classes and what they are.
const PARTS: [(&str, &str, &str); 3] = [
    ("origin", "fill part-1", "origin: intended until sent"),
    ("wake", "fill part-2", "wake: sent until received"),
    ("apply", "fill part-3", "apply: received until visible"),
];

/// From which quantile of the total on events are looked at.
const QUANTILES: [&str; 3] = ["p50", "p99", "p99.9"];

/// One picture a fleet size.
#[must_use]
pub fn shares(summary: &Summary) -> Vec<Picture> {
    let frame = RowsOfLoads {
        name: "shares",
        title: "Where time to knowledge goes",
        about: "Median share of each part among the events at or above a quantile of the total.",
        note: "Each part is the median of its own share, mean of the blocks: parts of a bar need not sum \
               to 100 %.",
        legend: PARTS.map(|(_, class, name)| Entry::new(Sign::Fill(class), name)).to_vec(),
        rows,
        axis,
    };
    frame.pictures(summary)
}

fn axis(rows: &[Row]) -> Option<Axis> {
    if rows.iter().all(|row| row.parts.is_empty()) {
        return None;
    }
    // Medians of shares need not sum to a hundred; a little room beyond it.
    let bounds = Bounds::between(Spread::Linear, 0.0, 110.0);
    let ticks = [0.0, 20.0, 40.0, 60.0, 80.0, 100.0];
    let ticks = ticks.map(|value| (value, Unit::Percent.format(value))).to_vec();
    Some(Axis::named("median share of the time to knowledge", bounds, ticks))
}

/// A bar for each quantile; none above capacity.
fn rows(line: &Shown<'_>) -> Vec<Row> {
    if line.row.saturated.is_some() {
        return Vec::new();
    }
    let quantiles = QUANTILES.into_iter().filter_map(|quantile| {
        let mut parts = Vec::new();
        let (mut from, mut n) = (0.0, 0);
        for (part, class, _) in PARTS {
            let Some(figure) = line.row.figures.get(&format!("share-{quantile}-{part}")) else {
                continue;
            };
            let Some(share) = figure.value.filter(|share| share.is_finite() && *share > 0.0) else {
                continue;
            };
            let words = format!("{part} {share:.0}");
            parts.push(Part { from, to: from + share, class, words });
            (from, n) = (from + share, figure.n);
        }
        let remark = format!("n {n} blocks");
        let name = format!("from {quantile} on");
        (!parts.is_empty()).then(|| Row { name, parts, remark, ..Row::default() })
    });
    quantiles.collect()
}
