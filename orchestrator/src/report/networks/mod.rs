//! The published tables about pruner and solvers, 1 to 20, beside ours.
//!
//! What a pruner leaves is held to one percent of the published mean, iterations to 15 % and path
//! lengths to 30 %, root mean square over the rows of Tables 5 to 18. Times are of another machine and
//! another language: they stand beside each other and nothing is said of them. The counters of the
//! naive solver could not be reproduced. What the tables lead to is in `derived`.

mod derived;
mod published;

#[cfg(test)]
mod tests;

pub use published::{PUBLISHED_NETWORKS, TABLES, conditions};

use super::table::{Colour, Table, column, exact, wrap};
use crate::report::published::Verdict;
use crate::results::figure::Figure;
use crate::results::networks::Measured;
use derived::Derived;
use published::{Kind, Ours, PublishedTable, embedded};
use serde::Serialize;

/// How far a remaining count may be from the published mean.
const COUNT_TOLERANCE: f64 = 0.01;
/// How far iterations may be, root mean square over rows.
const ITERATIONS_TOLERANCE: f64 = 0.15;
/// How far path lengths may be, likewise.
const LENGTH_TOLERANCE: f64 = 0.30;
/// The rows over which the last two are taken.
const DEVIATION_TABLES: std::ops::RangeInclusive<u32> = 5..=18;

/// One published figure beside ours.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Cell {
    table: u32,
    row: String,
    column: String,
    published: f64,
    ours: Option<Figure>,
    /// Ours over the published one, less 1.
    deviation: Option<f64>,
    verdict: Option<Verdict>,
}

/// A deviation over many rows.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Deviation {
    column: &'static str,
    /// Root mean square of the deviations.
    value: f64,
    rows: u64,
    tolerance: f64,
    verdict: Verdict,
}

/// The tables that were asked for, beside ours.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Networks {
    /// Networks behind each of our means.
    networks: u32,
    cells: Vec<Cell>,
    deviations: Vec<Deviation>,
    derived: Derived,
    #[serde(skip)]
    tables: Vec<PublishedTable>,
    #[serde(skip)]
    by_text: bool,
}

impl Networks {
    /// `tables` beside what was `measured` of `networks` networks a condition; with `by_text` the
    /// remaining counts are those of the pruner that the text describes.
    #[must_use]
    pub fn new(tables: &[u32], measured: &[Measured], networks: u32, by_text: bool) -> Self {
        let mut measured = measured.to_vec();
        if by_text {
            measured.iter_mut().for_each(|one| one.kept = one.kept_by_text);
        }
        let tables: Vec<PublishedTable> =
            embedded().into_iter().filter(|table| tables.contains(&table.number)).collect();
        let cells: Vec<Cell> = tables.iter().flat_map(|table| cells_of(table, &measured)).collect();
        let deviations = deviations(&cells);
        let derived = Derived::of(&measured);
        Self { networks, cells, deviations, derived, tables, by_text }
    }

    /// The tables as text.
    pub(super) fn text(&self, colour: Colour) -> String {
        let mut text = String::new();
        for table in &self.tables {
            let pruner = if self.by_text { ", pruner by the text" } else { "" };
            let title = format!("Table {}: {}{pruner}", table.number, table.title);
            text += &format!("{}\n", colour.heading(&title));
            text += &self.table_text(table, colour);
            text.push('\n');
        }
        for deviation in &self.deviations {
            text += &format!(
                "{}: {:.1} % from the published means over {} rows (bound {:.0} %): {}\n",
                deviation.column,
                100.0 * deviation.value,
                deviation.rows,
                100.0 * deviation.tolerance,
                deviation.verdict.name()
            );
        }
        text += &self.derived.text();
        text += &wrap("=, !        ", "a remaining count within 1 % of the published mean, or not");
        text += &wrap(
            "iter, path  ",
            "average iterations and path length; one row says little, see the lines above",
        );
        text += &wrap(
            "times       ",
            "are of another machine and language and stand in --format csv and json, as do the \
             counters of the naive solver, which no variant reproduces",
        );
        text + &format!("ours        means over {} networks a row\n", self.networks)
    }

    fn table_text(&self, published: &PublishedTable, colour: Colour) -> String {
        let of_table = || self.cells.iter().filter(|cell| cell.table == published.number);
        let shown: Vec<(&str, &'static str)> = SHOWN
            .into_iter()
            .filter(|(name, _)| of_table().any(|cell| cell.column == *name))
            .collect();
        let heads: Vec<_> = [column("", "row"), column("", "")]
            .into_iter()
            .chain(shown.iter().map(|&(_, head)| column("", head)))
            .collect();
        let mut table = Table::new(&heads);
        for line in &published.rows {
            let of =
                |name: &str| of_table().find(|cell| cell.row == line.label && cell.column == name);
            let mut rows = [
                vec![line.label.clone(), "publ.".to_owned()],
                vec![String::new(), "ours".to_owned()],
            ];
            for &(name, _) in &shown {
                let cell = of(name);
                rows[0].push(exact(cell.map(|cell| cell.published), 1));
                let value = cell.and_then(|cell| cell.ours.as_ref()?.value);
                let mark = match cell.and_then(|cell| cell.verdict) {
                    Some(Verdict::Reproduced) => "=",
                    Some(Verdict::NotReproduced) if name.starts_with("remaining") => "!",
                    _ => "",
                };
                rows[1].push(exact(value, 1) + mark);
            }
            rows.into_iter().for_each(|row| table.row(row));
        }
        table.render(colour)
    }

    /// The rows of the CSV form: table, row, column, source, value, n, low, high, unit, verdict, label.
    pub(super) fn rows_into(&self, add: &mut dyn FnMut([String; 11])) {
        let text = |value: Option<f64>| value.map_or_else(String::new, |value| value.to_string());
        for cell in &self.cells {
            let head = [cell.table.to_string(), cell.row.clone(), cell.column.clone()];
            let verdict = cell.verdict.map_or("", Verdict::name).to_owned();
            let row = |source: &str, value: String, rest: [String; 6]| {
                let [table, row, column] = head.clone();
                let [n, low, high, unit, verdict, label] = rest;
                [table, row, column, source.to_owned(), value, n, low, high, unit, verdict, label]
            };
            let empty = || [const { String::new() }; 6];
            let mut published = empty();
            published[0] = PUBLISHED_NETWORKS.to_string();
            add(row("published", cell.published.to_string(), published));
            if let Some(ours) = &cell.ours {
                let rest = [
                    ours.n.to_string(),
                    text(ours.low),
                    text(ours.high),
                    ours.unit.to_owned(),
                    verdict,
                    ours.label.clone(),
                ];
                add(row("ours", text(ours.value), rest));
            }
        }
    }
}

/// The columns of the text tables; the others stand in CSV and JSON.
const SHOWN: [(&str, &str); 11] = [
    ("remaining_facts", "facts"),
    ("remaining_rules", "rules"),
    ("remaining_actions", "actions"),
    ("optimal_iterations", "iter"),
    ("average_iterations", "iter"),
    ("average_iterations_percent", "iter %"),
    ("optimal_path_length", "path"),
    ("path_length", "path"),
    ("path_length_percent", "path %"),
    ("iteration_1", "pass 1"),
    ("iteration_2", "pass 2"),
];

fn cells_of<'a>(
    table: &'a PublishedTable,
    measured: &'a [Measured],
) -> impl Iterator<Item = Cell> + 'a {
    table.rows.iter().flat_map(move |line| {
        let of_row = measured.iter().find(|one| one.condition == line.condition);
        line.columns.iter().map(move |(column, published)| {
            let ours = of_row.and_then(|one| table.kind.ours(&line.label, column, one));
            let value = ours.and_then(Ours::value);
            let deviation = value.filter(|_| *published > 0.0).map(|value| value / published - 1.0);
            Cell {
                table: table.number,
                row: line.label.clone(),
                column: column.clone(),
                published: *published,
                ours: ours.map(|ours| figure(table.kind, column, ours)),
                deviation,
                verdict: deviation.and_then(|deviation| verdict(column, deviation)),
            }
        })
    })
}

/// Counts are held to their bound one by one, the naive solver is known not to be reproduced, and of
/// times nothing is said.
fn verdict(column: &str, deviation: f64) -> Option<Verdict> {
    if column.starts_with("naive") && !column.contains("ticks") {
        return Some(Verdict::NotReproduced);
    }
    let is_near = deviation.abs() <= COUNT_TOLERANCE;
    let verdict = if is_near { Verdict::Reproduced } else { Verdict::NotReproduced };
    column.starts_with("remaining").then_some(verdict)
}

fn figure(kind: Kind, column: &str, ours: Ours) -> Figure {
    let unit = match column {
        _ if kind == Kind::Percent => "%",
        _ if column.contains("ticks") || kind == Kind::Passes => "100 ns",
        _ => "1",
    };
    let (low, high) = ours.range().unzip();
    let label = column.replace('_', " ").replace(" ticks 100ns", "");
    Figure { low, high, ..Figure::count(ours.value(), ours.n(), unit, &label) }
}

fn deviations(cells: &[Cell]) -> Vec<Deviation> {
    let of = |column: &'static str, tolerance: f64| {
        let of_column = cells.iter().filter(|cell| {
            cell.column == column.replace(' ', "_") && DEVIATION_TABLES.contains(&cell.table)
        });
        let deviations: Vec<f64> = of_column.filter_map(|cell| cell.deviation).collect();
        let rows = deviations.len() as u64;
        let squares: f64 = deviations.iter().map(|deviation| deviation * deviation).sum();
        let value = (squares / crate::results::statistics::as_float(rows)).sqrt();
        let is_near = value <= tolerance;
        let verdict = if is_near { Verdict::Reproduced } else { Verdict::NotReproduced };
        (rows > 0).then_some(Deviation { column, value, rows, tolerance, verdict })
    };
    [of("average iterations", ITERATIONS_TOLERANCE), of("path length", LENGTH_TOLERANCE)]
        .into_iter()
        .flatten()
        .collect()
}
