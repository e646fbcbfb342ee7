//! The map "Where counting messages picks the wrong strategy": fleet size against copies of a boundary
//! change per firing, colour for the strategy that costs least.
//!
//! One panel by CPU per needed application, one by p99 of time to knowledge at equal load. A cell has a
//! colour only where its winner stands (see [`crate::results::inference`]), and is hatched where the
//! transmission count names another strategy than that winner.

use crate::report::svg::heat::{HeatCell, HeatMap, Limit};
use crate::report::svg::legend::{Entry, Sign};
use crate::report::svg::look::Mark;
use crate::report::svg::number::Unit;
use crate::report::svg::picture::{Panel, Picture};
use crate::results::map::{Choice, Map, MapCell};
use crate::results::statistics::as_float;
use shared_types::wire::StrategyKind;
use std::collections::BTreeSet;

/// Name of the file.
const NAME: &str = "map";
/// What the map is about.
pub const TITLE: &str = "Where counting messages picks the wrong strategy";
/// Dashes of the line at which counts change places.
const COUNTS: &str = "7 4";

/// By what a cell chooses.
pub type Measure = fn(&MapCell) -> Option<Choice>;

/// Name, in a sentence and alone, and how to read each measure of a map.
pub const MEASURES: [(&str, Measure); 2] = [
    ("CPU per needed application", |cell| cell.by_cpu),
    ("p99 of time to knowledge, equal load", |cell| cell.by_p99),
];

/// Whether the count names another strategy than the winner that `choice` names.
#[must_use]
pub fn is_count_wrong(cell: &MapCell, choice: Option<Choice>) -> bool {
    choice.and_then(|choice| choice.strategy).is_some_and(|winner| winner != cell.by_count)
}

/// In how many cells the count is wrong, and how many have a winner.
#[must_use]
pub fn wrong_of(map: &Map, measure: Measure) -> (usize, usize) {
    let named = |cell: &&MapCell| measure(cell).is_some_and(|choice| choice.strategy.is_some());
    let wrong = map.cells.iter().filter(|cell| is_count_wrong(cell, measure(cell)));
    (wrong.count(), map.cells.iter().filter(named).count())
}

/// In one sentence, how often counting goes wrong.
#[must_use]
pub fn headline(map: &Map) -> String {
    let parts = MEASURES.map(|(name, measure)| {
        let (wrong, named) = wrong_of(map, measure);
        format!("in {wrong} of {named} cells with a winner by {name}")
    });
    format!("The transmission count names another strategy {}.", parts.join(", and "))
}

/// The picture.
#[must_use]
pub fn map(map: &Map) -> Picture {
    let panels: Vec<Panel> = MEASURES
        .into_iter()
        .enumerate()
        .map(|(place, (name, measure))| {
            if map.cells.iter().all(|cell| measure(cell).is_none()) {
                return Panel::Nothing(format!("{name}: no cell has two strategies to compare"));
            }
            let title = format!("{}. {name}", if place == 0 { 'a' } else { 'b' });
            Panel::Heat(panel(map, &title, measure, place == 0))
        })
        .collect();
    let mut notes = vec![
        "In each cell: the best strategy and the runner-up's value over its; below, that margin's 95 % \
         interval and n, the number of blocks. Grey: no winner stands (a tie, too few blocks or a noisy \
         host); the best by value alone is in brackets."
            .to_owned(),
    ];
    if map.predicted_cpu.is_empty() {
        notes.push("The costs of a sample do not follow from this run: no CPU line.".to_owned());
    } else {
        notes.push(
            "The CPU line of a size is where boundary and full cost the same by the cost of samples in \
             the fleets of the other sizes."
                .to_owned(),
        );
    }
    Picture {
        name: NAME.to_owned(),
        title: TITLE.to_owned(),
        about: headline(map),
        legend: legend(map),
        panels,
        notes,
    }
}

fn legend(map: &Map) -> Vec<Entry> {
    let choices = map.cells.iter().flat_map(|cell| [cell.by_cpu, cell.by_p99]).flatten();
    let shown: BTreeSet<StrategyKind> = choices.map(|choice| choice.best).collect();
    let mut entries: Vec<Entry> = StrategyKind::ALL
        .into_iter()
        .filter(|strategy| shown.contains(strategy))
        .map(|strategy| {
            let mark = Mark::of(strategy);
            Entry::new(Sign::Fill(fill_of(strategy)), format!("{} {strategy}", mark.letter))
        })
        .collect();
    entries.push(Entry::new(Sign::Fill("tie"), "no winner"));
    let hatching = Sign::Pattern(Picture::hatching_id(NAME));
    entries.push(Entry::new(hatching, "counts name another strategy"));
    entries.push(Entry::new(Sign::Limit(COUNTS), "counts change over (k beta = 1)"));
    if !map.predicted_cpu.is_empty() {
        entries.push(Entry::new(Sign::Limit(""), "CPU predicted to change over"));
    }
    entries
}

/// The class of a cell that `strategy` wins.
const fn fill_of(strategy: StrategyKind) -> &'static str {
    match strategy {
        StrategyKind::Null => "tint s-null",
        StrategyKind::Full => "tint s-full",
        StrategyKind::Boundary => "tint s-boundary",
        StrategyKind::Limited => "tint s-limited",
        StrategyKind::Hierarchy => "tint s-hierarchy",
        StrategyKind::Hybrid => "tint s-hybrid",
        StrategyKind::Central => "tint s-central",
        StrategyKind::CentralBatched => "tint s-central-batched",
        StrategyKind::Pipelined => "tint s-pipelined",
    }
}

fn panel(map: &Map, title: &str, measure: Measure, has_cpu_line: bool) -> HeatMap {
    let cells = map
        .cells
        .iter()
        .filter_map(|cell| {
            let choice = measure(cell)?;
            Some(HeatCell {
                column: map.sizes.iter().position(|&size| size == cell.size)?,
                row: map.k_betas.iter().position(|&value| value.total_cmp(&cell.k_beta).is_eq())?,
                class: choice.strategy.map(fill_of),
                is_hatched: is_count_wrong(cell, Some(choice)),
                words: words(cell, choice),
            })
        })
        .collect();
    let columns = as_float(map.sizes.len() as u64);
    let mut limits = Vec::new();
    if let Some(height) = row_place(&map.k_betas, 1.0) {
        limits.push(Limit { dashes: COUNTS, points: vec![(0.0, height), (columns, height)] });
    }
    if has_cpu_line {
        limits.extend(cpu_limit(map));
    }
    HeatMap {
        title: title.to_owned(),
        x_title: "crafts".to_owned(),
        y_title: "k beta, copies a firing".to_owned(),
        columns: map.sizes.iter().map(u32::to_string).collect(),
        rows: map.k_betas.iter().map(|&value| Unit::Plain.format(value)).collect(),
        cells,
        limits,
    }
}

fn words(cell: &MapCell, choice: Choice) -> [String; 2] {
    let number = |value: f64| Unit::Plain.format(value);
    let (letter, margin) = (Mark::of(choice.best).letter, number(choice.margin));
    let best = match choice.strategy {
        Some(_) => format!("{letter} {margin}"),
        None => format!("({letter}) {margin}"),
    };
    [best, format!("{}-{}, n {}", number(choice.low), number(choice.high), cell.n)]
}

/// Where strategies change places by CPU: through the middle of every size that has a prediction,
/// level to the sides of the outermost.
fn cpu_limit(map: &Map) -> Option<Limit> {
    let mut points: Vec<(f64, f64)> = map
        .predicted_cpu
        .iter()
        .filter_map(|&(size, k_beta)| {
            let column = map.sizes.iter().position(|&known| known == size)?;
            Some((as_float(column as u64) + 0.5, row_place(&map.k_betas, k_beta)?))
        })
        .collect();
    let (first, last) = (*points.first()?, *points.last()?);
    points.insert(0, (first.0 - 0.5, first.1));
    points.push((last.0 + 0.5, last.1));
    Some(Limit { dashes: "", points })
}

/// The height of `value` on the map, in rows from its lower side: rows lie in their middle, what is
/// between or beyond them by its logarithm. `None` without rows above 0.
fn row_place(rows: &[f64], value: f64) -> Option<f64> {
    let anchors: Vec<(f64, f64)> = (0_u32..)
        .zip(rows)
        .filter(|(_, row)| **row > 0.0 && row.is_finite())
        .map(|(place, row)| (row.ln(), f64::from(place) + 0.5))
        .collect();
    let value = if value > 0.0 && value.is_finite() { value.ln() } else { return None };
    let &[.., last] = anchors.as_slice() else { return None };
    // The two rows around the value, or the outermost two.
    let above = anchors.iter().position(|&(at, _)| at >= value).unwrap_or(anchors.len() - 1);
    let Some(upper) = anchors.get(above.max(1)) else {
        // A single row: as if the next were twice as high.
        return Some(last.1 + (value - last.0) / std::f64::consts::LN_2);
    };
    let lower = anchors[above.max(1) - 1];
    Some(lower.1 + (value - lower.0) / (upper.0 - lower.0) * (upper.1 - lower.1))
}

#[cfg(test)]
mod tests {
    use super::row_place;

    #[test]
    fn lines_lie_between_rows_by_their_logarithm() {
        let rows = [0.0, 0.5, 2.0, 8.0];
        let near = |value: f64, place: f64| {
            let found = row_place(&rows, value).unwrap();
            assert!((found - place).abs() < 1e-9, "{value}: {found}");
        };
        near(0.5, 1.5);
        near(1.0, 2.0);
        near(2.0, 2.5);
        near(4.0, 3.0);
        near(32.0, 4.5);
        near(0.125, 0.5);
        assert_eq!(row_place(&rows, f64::INFINITY), None);
        assert_eq!(row_place(&rows, 0.0), None);
        assert_eq!(row_place(&[], 1.0), None);
        assert_eq!(row_place(&[1.0], 2.0), Some(1.5));
    }
}
