//! The table of a sweep: chosen metrics, cell by cell.

use super::page::Page;
use super::pictures::map::map as picture;
use super::table::{DASH, Table, WIDTH, column, head, short, wrap};
use super::{Look, Report, loads, map};
use crate::outcome::Outcome;
use crate::results::figure::{Figure, Figures};
use crate::results::map::Map;
use crate::results::summary::Summary;
use crate::results::sweep::{CellState, SweepFile};
use crate::scenario::nearest;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::PathBuf;

/// Signs of a number.
const SIGNS: usize = 6;

/// What is shown unless something else is asked for; metrics that a sweep lacks are left out.
const METRICS: [&str; 6] =
    ["turns", "requests", "turn-time-p50", "knowledge-p50", "knowledge-p99", "cpu-per-application"];

/// A sweep that was run, or is under way.
#[derive(Clone, Debug)]
pub struct Sweep {
    /// What it varies.
    pub file: SweepFile,
    /// One a cell, in the order of the grid.
    pub cells: Vec<Cell>,
    /// The map, where the sweep is one.
    pub map: Option<Map>,
    /// The metrics of the table; empty for the usual ones.
    pub metrics: Vec<String>,
    /// Where it lies.
    pub directory: PathBuf,
    /// How the user calls this program.
    pub program: String,
}

/// A cell as its directory says.
#[derive(Clone, Debug)]
pub struct Cell {
    /// How far it has come.
    pub state: CellState,
    /// What was measured, if it was started.
    pub summary: Option<Summary>,
}

/// One row: a strategy of a cell, under a load if it has one.
#[derive(Serialize)]
struct Row<'a> {
    size: u32,
    strategy: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    load: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    asks_every_ns: Option<u64>,
    figures: BTreeMap<&'a str, &'a Figure>,
}

#[derive(Serialize)]
struct CellDocument<'a> {
    directory: &'a str,
    values: BTreeMap<&'a str, &'a str>,
    state: CellState,
    rows: Vec<Row<'a>>,
}

#[derive(Serialize)]
struct Document<'a> {
    report: &'static str,
    format: u32,
    axes: &'a [crate::scenario::Axis],
    #[serde(skip_serializing_if = "Option::is_none")]
    map: Option<&'a Map>,
    cells: Vec<CellDocument<'a>>,
}

impl Sweep {
    /// The worst outcome of all cells that came to an end.
    #[must_use]
    pub fn outcome(&self) -> Outcome {
        let ended = self.cells.iter().filter_map(|cell| match cell.state {
            CellState::Done(outcome) => Some(outcome),
            CellState::Missing | CellState::CutOff => None,
        });
        ended.fold(Outcome::Success, Outcome::worse)
    }

    /// The first metric asked for that no cell has, and the nearest that one has.
    #[must_use]
    pub fn unknown_metric(&self) -> Option<(&str, Option<String>)> {
        let rows: Vec<Row<'_>> = self.cells.iter().flat_map(|cell| self.rows(cell, &[])).collect();
        let known: BTreeSet<&str> =
            rows.iter().flat_map(|row| row.figures.keys().copied()).collect();
        if known.is_empty() {
            return None;
        }
        let unknown = self.metrics.iter().find(|metric| !known.contains(metric.as_str()))?;
        Some((unknown, nearest(unknown, known).map(str::to_owned)))
    }

    /// The rows of a cell with the figures of `metrics`, or with all.
    fn rows<'a>(&self, cell: &'a Cell, metrics: &[&str]) -> Vec<Row<'a>> {
        let Some(summary) = &cell.summary else { return Vec::new() };
        let chosen = |all: &[&'a Figures]| -> BTreeMap<&'a str, &'a Figure> {
            let figures = all.iter().flat_map(|figures| figures.iter());
            figures.filter(|(name, _)| metrics.is_empty() || metrics.contains(name)).collect()
        };
        let mut rows = Vec::new();
        for size in summary.sizes() {
            for strategy in summary.strategies(size) {
                let counted = summary.counted(size, strategy).map(|cell| &cell.figures);
                let timed = summary.timed(size, strategy).map(|cell| &cell.figures);
                let figures: Vec<&Figures> = counted.into_iter().chain(timed).collect();
                let figures = chosen(&figures);
                if !figures.is_empty() {
                    let strategy = strategy.to_string();
                    rows.push(Row { size, strategy, load: None, asks_every_ns: None, figures });
                }
            }
        }
        for load in &summary.timing.loads {
            let figures = chosen(&[&load.figures]);
            if load.again == 0 && !figures.is_empty() {
                rows.push(Row {
                    size: load.size,
                    strategy: load.strategy.to_string(),
                    load: Some(&load.load),
                    asks_every_ns: load.asks_every_ns,
                    figures,
                });
            }
        }
        rows
    }

    fn chosen(&self) -> Vec<&str> {
        if self.metrics.is_empty() {
            METRICS.to_vec()
        } else {
            self.metrics.iter().map(String::as_str).collect()
        }
    }

    /// `key=value` of every axis.
    fn name(&self, number: usize) -> String {
        let values = self.file.axes.iter().zip(&self.file.cells[number].values);
        values.map(|(axis, value)| format!("{}={value}", axis.key)).collect::<Vec<_>>().join(" ")
    }

    /// The same, and how far the cell has come.
    fn heading(&self, number: usize, state: CellState) -> String {
        let state = match state {
            CellState::Missing => " (not started)".to_owned(),
            CellState::CutOff => " (cut off)".to_owned(),
            CellState::Done(Outcome::Success) => String::new(),
            CellState::Done(outcome) => format!(" (exit code {})", outcome.code()),
        };
        self.name(number) + &state
    }

    /// The table of loads that were simulated; `None` where none were, or metrics are asked for.
    fn simulated_table(&self, look: Look) -> Option<String> {
        let summaries = || self.cells.iter().filter_map(|cell| cell.summary.as_ref());
        if !self.metrics.is_empty() || !summaries().any(loads::is_simulated) {
            return None;
        }
        let cells = self
            .cells
            .iter()
            .enumerate()
            .map(|(number, cell)| (self.heading(number, cell.state), cell.summary.as_ref()));
        Some(loads::simulated_cells(cells).render(look.colour) + "\n" + &loads::simulated_legend())
    }

    fn main_table(&self, metrics: &[&str], look: Look) -> String {
        let units: BTreeMap<&str, &str> = self
            .cells
            .iter()
            .flat_map(|cell| self.rows(cell, metrics))
            .flat_map(|row| row.figures.into_iter().map(|(name, figure)| (name, figure.unit)))
            .collect();
        let mut columns = vec![column("", "strategy")];
        columns.extend(metrics.iter().map(|&metric| head(metric)));
        let mut table = Table::new(&columns);
        let mut unit_row = vec![String::new()];
        unit_row.extend(metrics.iter().map(|metric| match units.get(metric) {
            None => DASH.to_owned(),
            Some(&"ns") => "us".to_owned(),
            Some(&"1") => "ratio".to_owned(),
            Some(unit) => (*unit).to_owned(),
        }));
        table.row(unit_row);
        for (number, cell) in self.cells.iter().enumerate() {
            table.section(self.heading(number, cell.state));
            for row in self.rows(cell, metrics) {
                let load = row.load.map_or_else(String::new, |load| format!(" {load}"));
                let mut cells = vec![format!("{}{load}", row.strategy)];
                cells.extend(metrics.iter().map(|metric| {
                    let figure = row.figures.get(metric);
                    let scale = figure.map_or(1.0, |f| if f.unit == "ns" { 1e3 } else { 1.0 });
                    short(figure.and_then(|figure| figure.value).map(|value| value / scale), SIGNS)
                }));
                table.row(cells);
            }
        }
        table.render(look.colour)
    }
}

impl Sweep {
    /// The page: the map if there is one, and what a terminal shows.
    #[must_use]
    pub fn page(&self) -> Page {
        let look = Look { all: true, ..Look::default() };
        let provenance = &self.file.provenance;
        Page {
            title: provenance.scenario.clone(),
            origin: vec![
                format!("{} with seed {}", provenance.command.join(" "), provenance.seed),
                format!("begun {}", provenance.date),
            ],
            pictures: self.map.iter().map(picture).collect(),
            text: self.table(look),
            ..Page::default()
        }
    }

    /// The table with as many of the metrics as a terminal is wide.
    fn wide_table(&self, look: Look) -> String {
        let mut metrics = self.chosen();
        let mut text = self.main_table(&metrics, look);
        let mut left_out = Vec::new();
        while metrics.len() > 1 && text.lines().any(|line| line.chars().count() > WIDTH) {
            left_out.extend(metrics.pop());
            text = self.main_table(&metrics, look);
        }
        if !left_out.is_empty() {
            left_out.reverse();
            let what = format!("too wide for {}; see --format csv", left_out.join(", "));
            text += &wrap("! ", &what);
        }
        text
    }
}

impl Report for Sweep {
    fn table(&self, look: Look) -> String {
        let drawn = self.map.as_ref().map_or_else(String::new, |map| map::text(map, look.colour));
        let mut text = String::new();
        if self.map.is_none() || look.all || !self.metrics.is_empty() {
            text = self.simulated_table(look).unwrap_or_else(|| self.wide_table(look));
        }
        text = [drawn, text]
            .iter()
            .filter(|part| !part.is_empty())
            .cloned()
            .collect::<Vec<_>>()
            .join("\n");
        let done = self.cells.iter().filter(|cell| matches!(cell.state, CellState::Done(_)));
        let (done, all) = (done.count(), self.cells.len());
        text += &format!("\ncells     {done} of {all} done\n");
        let directory = self.directory.display();
        text += &format!("results   {directory}\n");
        if done < all {
            text += &format!("next      {} sweep --resume {directory}\n", self.program);
        } else if let Some(cell) = self.file.cells.first() {
            let _infallible =
                writeln!(text, "next      {} report {directory}/{}", self.program, cell.directory);
        }
        text
    }

    fn json(&self) -> String {
        let metrics: Vec<&str> = self.metrics.iter().map(String::as_str).collect();
        let cells = self.file.cells.iter().zip(&self.cells).map(|(cell, measured)| CellDocument {
            directory: &cell.directory,
            values: self
                .file
                .axes
                .iter()
                .zip(&cell.values)
                .map(|(axis, value)| (axis.key.as_str(), value.as_str()))
                .collect(),
            state: measured.state,
            rows: self.rows(measured, &metrics),
        });
        let document = Document {
            report: "sweep",
            format: self.file.format,
            axes: &self.file.axes,
            map: self.map.as_ref(),
            cells: cells.collect(),
        };
        let text =
            serde_json::to_string_pretty(&document).expect("invariant: documents are plain data");
        text + "\n"
    }

    fn csv(&self) -> String {
        let metrics: Vec<&str> = self.metrics.iter().map(String::as_str).collect();
        let mut writer = csv::Writer::from_writer(Vec::new());
        let mut write = |row: Vec<String>| {
            writer.write_record(row).expect("invariant: every row has the header's length");
        };
        let axes = self.file.axes.iter().map(|axis| axis.key.clone());
        let rest = [
            "size",
            "strategy",
            "load",
            "asks_every_ns",
            "metric",
            "value",
            "n",
            "low",
            "high",
            "unit",
            "label",
        ];
        let fixed = rest.map(str::to_owned);
        write(std::iter::once("cell".to_owned()).chain(axes).chain(fixed).collect());
        let number = |value: Option<f64>| value.map_or_else(String::new, |value| value.to_string());
        for (cell, measured) in self.file.cells.iter().zip(&self.cells) {
            for row in self.rows(measured, &metrics) {
                for (metric, figure) in &row.figures {
                    let mut line = vec![cell.directory.clone()];
                    line.extend(cell.values.iter().cloned());
                    line.extend([
                        row.size.to_string(),
                        row.strategy.clone(),
                        row.load.unwrap_or_default().to_owned(),
                        row.asks_every_ns.map_or_else(String::new, |ns| ns.to_string()),
                        (*metric).to_owned(),
                        number(figure.value),
                        figure.n.to_string(),
                        number(figure.low),
                        number(figure.high),
                        figure.unit.to_owned(),
                        figure.label.clone(),
                    ]);
                    write(line);
                }
            }
        }
        let bytes = writer.into_inner().expect("invariant: memory takes every row");
        String::from_utf8(bytes).expect("invariant: rows are made of text")
    }
}
