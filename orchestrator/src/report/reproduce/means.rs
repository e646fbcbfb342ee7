//! Table 25: means of ten published runs beside means of ten trials of ours and the range in which
//! such means lie.

use super::HEADER;
use crate::report::published::{PUBLISHED_SIZES, PUBLISHED_TRIALS, Published, Verdict};
use crate::report::ranges::{Column, Range, Sample};
use crate::report::table::{Colour, Table, column, exact, wrap};
use crate::results::figure::Figure;
use crate::results::record::TrialFacts;
use crate::results::statistics::ratio_of_sums;
use crate::results::summary::Deterministic;
use serde::Serialize;
use shared_types::wire::StrategyKind;
use std::collections::BTreeMap;

/// Table 25 beside ours.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct MeansTable {
    table: u32,
    rows: Vec<MeanRow>,
}

/// One mean or ratio of one fleet size.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct MeanRow {
    crafts: u32,
    column: String,
    published: Option<Figure>,
    ours: Figure,
    expected: Option<Figure>,
    verdict: Option<Verdict>,
}

impl MeansTable {
    pub(super) fn new(
        published: &Published,
        seed: u64,
        ours: &Deterministic,
        samples: &[Sample],
    ) -> Self {
        let mut rows = Vec::new();
        for (_, crafts) in PUBLISHED_SIZES {
            let trials = OurTrials::new(crafts, ours);
            let sample =
                samples.iter().find(|sample| sample.crafts == crafts && !sample.trials.is_empty());
            for column in Column::ALL {
                rows.push(MeanRow {
                    crafts,
                    column: name_of(column),
                    published: column
                        .published(published, crafts)
                        .map(|value| published_figure(column, value)),
                    ours: trials.figure(column),
                    expected: sample.map(|sample| {
                        expected_figure(column, sample.range(column, seed), sample.trials.len())
                    }),
                    verdict: sample.and_then(|sample| sample.verdict(column, published, seed)),
                });
            }
        }
        Self { table: 25, rows }
    }

    pub(super) fn text(&self, colour: Colour) -> String {
        let mut table = Table::new(&[
            column("", "mean or ratio"),
            column("", "published"),
            column("", "ours"),
            column("95 % range", "low"),
            column("95 % range", "high"),
            column("", "verdict"),
        ]);
        let mut above = 0;
        for row in &self.rows {
            if row.crafts != above {
                table.section(format!("{} blackboards", row.crafts));
                above = row.crafts;
            }
            let expected = row.expected.as_ref();
            let number = |value: Option<f64>| exact(value, decimals(row.ours.unit));
            table.row(vec![
                row.column.clone(),
                number(row.published.as_ref().and_then(|figure| figure.value)),
                number(row.ours.value),
                number(expected.and_then(|figure| figure.low)),
                number(expected.and_then(|figure| figure.high)),
                row.verdict.map_or("-", Verdict::name).to_owned(),
            ]);
        }
        format!(
            "{}\n{}\n{}",
            colour.heading("Table 25: means of ten runs, replication requests"),
            table.render(colour),
            self.notes()
        )
    }

    fn notes(&self) -> String {
        let mut text = wrap(
            "reproduced  ",
            "the published mean lies in the range that holds 95 % of ten-trial means under our \
             model; ours are one such draw",
        );
        let has = |verdict| self.rows.iter().any(|row| row.verdict == Some(verdict));
        if has(Verdict::SourceInconsistent) {
            text += &wrap(
                "source      ",
                "inconsistent: with two boards it prints limited = hierarchy = full, which no rule \
                 explains; kept as data, not imitated",
            );
        }
        if has(Verdict::NotReproduced) {
            text += &wrap("not         ", "reproduced: the published mean lies outside our range");
        }
        text + &self.slips()
    }

    /// The source's summary gives means as ratios and swaps two of them; these are the true ones.
    fn slips(&self) -> String {
        let mut text = wrap(
            "slips       ",
            "the source's summary of Table 25 gives means as ratios and swaps two; its own means \
             give these ratios to proposed (boundary):",
        );
        for strategy in [StrategyKind::Limited, StrategyKind::Hierarchy, StrategyKind::Central] {
            let wanted = name_of(Column::Ratio(strategy, StrategyKind::Boundary));
            let ratios: Vec<String> = self
                .rows
                .iter()
                .filter(|row| row.column == wanted)
                .filter_map(|row| Some((row.crafts, row.published.as_ref()?.value?)))
                .map(|(crafts, ratio)| {
                    let decimals = if ratio < 100.0 { 1 } else { 0 };
                    format!("{ratio:.decimals$} (N = {crafts})")
                })
                .collect();
            text += &format!("            {:<10}{}\n", strategy.name(), ratios.join(", "));
        }
        text
    }

    pub(super) fn rows_into(&self, rows: &mut Vec<[String; HEADER.len()]>) {
        for row in &self.rows {
            let sources = [
                ("published", row.published.as_ref()),
                ("ours", Some(&row.ours)),
                ("range", row.expected.as_ref()),
            ];
            for (source, figure) in sources {
                let Some(figure) = figure else { continue };
                let number =
                    |value: Option<f64>| value.map_or_else(String::new, |value| value.to_string());
                rows.push([
                    self.table.to_string(),
                    row.crafts.to_string(),
                    String::new(),
                    row.column.clone(),
                    source.to_owned(),
                    number(figure.value),
                    figure.n.to_string(),
                    number(figure.low),
                    number(figure.high),
                    figure.unit.to_owned(),
                    row.verdict.map_or("", Verdict::name).to_owned(),
                    figure.label.clone(),
                ]);
            }
        }
    }
}

fn name_of(column: Column) -> String {
    match column {
        Column::Turns => "turns".to_owned(),
        Column::Requests(strategy) => strategy.name().to_owned(),
        Column::Ratio(above, below) => format!("{above} / {below}"),
    }
}

/// Ratios are told with three decimals, means as the source prints them.
fn decimals(unit: &str) -> usize {
    if unit == "1" { 3 } else { 1 }
}

fn unit_of(column: Column) -> &'static str {
    match column {
        Column::Turns => "turn",
        Column::Requests(_) => "request",
        Column::Ratio(..) => "1",
    }
}

fn published_figure(column: Column, value: f64) -> Figure {
    Figure::count(Some(value), PUBLISHED_TRIALS as u64, unit_of(column), "as published")
}

fn expected_figure(column: Column, range: Range, trials: usize) -> Figure {
    let label = "all replayed trials; low and high: 95 % of means of ten";
    let figure = Figure::count(Some(range.value), trials as u64, unit_of(column), label);
    Figure { low: Some(range.low), high: Some(range.high), ..figure }
}

/// Turns and requests of our trials of one size, by trial.
struct OurTrials {
    turns: BTreeMap<u32, u64>,
    requests: BTreeMap<StrategyKind, BTreeMap<u32, u64>>,
}

impl OurTrials {
    fn new(crafts: u32, ours: &Deterministic) -> Self {
        let is_used = |facts: &&TrialFacts| {
            facts.cell.size == crafts
                && facts.cell.block == 0
                && (facts.trial as usize) < PUBLISHED_TRIALS
                && facts.end.is_in_means()
        };
        let mut trials = Self { turns: BTreeMap::new(), requests: BTreeMap::new() };
        for facts in ours.trials.iter().filter(is_used) {
            let requests = trials.requests.entry(facts.cell.strategy).or_default();
            requests.insert(facts.trial, facts.measured.replication.requests);
            trials.turns.insert(facts.trial, u64::from(facts.turns));
        }
        trials
    }

    fn figure(&self, column: Column) -> Figure {
        let empty = BTreeMap::new();
        let requests = |strategy| self.requests.get(&strategy).unwrap_or(&empty);
        let pairs: Vec<(u64, u64)> = match column {
            Column::Turns => self.turns.values().map(|&turns| (turns, 1)).collect(),
            Column::Requests(strategy) => {
                requests(strategy).values().map(|&requests| (requests, 1)).collect()
            }
            Column::Ratio(above, below) => requests(above)
                .iter()
                .filter_map(|(trial, &above)| Some((above, *requests(below).get(trial)?)))
                .collect(),
        };
        let n = pairs.len() as u64;
        Figure::count(ratio_of_sums(pairs), n, unit_of(column), "our trials")
    }
}
