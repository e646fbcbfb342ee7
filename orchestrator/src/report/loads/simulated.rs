//! The tables of loads that were played on a virtual clock: what was sent for what the load needs, what
//! links did to it, and how much virtual time knowledge took.
//!
//! A virtual time is what links, pauses and patience add up to. No processor worked and nothing waited for
//! one, so it stands under a head of its own and beside no time of a real process.

use super::{SIGNS, sections, with_values};
use crate::report::table::{DASH, Table, column, exact, short, wrap};
use crate::results::figure::Figures;
use crate::results::summary::Summary;

/// From here on a count is shortened.
const WHOLE_BELOW: f64 = 10_000.0;

/// Samples that links swallowed.
const LOST: [&str; 2] = ["recovery-lost-on-link", "recovery-cut-off-on-link"];

/// One line a strategy, load and asking interval.
pub(super) fn main_table(summary: &Summary) -> Table {
    let mut table = columns();
    sections(summary, &mut table, values);
    table
}

/// The same for every cell of a sweep, under its heading.
pub(in crate::report) fn of_cells<'a>(
    cells: impl Iterator<Item = (String, Option<&'a Summary>)>,
) -> Table {
    let mut table = columns();
    for (heading, summary) in cells {
        table.section(heading);
        let rows = summary.into_iter().flat_map(|summary| &summary.timing.loads);
        for row in rows.filter(|row| row.again == 0) {
            table.row(with_values(row, values(&row.figures)));
        }
    }
    table
}

fn columns() -> Table {
    Table::new(&[
        column("", "strategy"),
        column("asks", "ms"),
        column("per needed application", "trans"),
        column("per needed application", "more"),
        column("per needed application", "bytes"),
        column("per needed application", "more"),
        column("samples", "lost"),
        column("samples", "again"),
        column("states", "learnt"),
        column("virtual ms", "p50"),
        column("virtual ms", "p99"),
        column("virtual ms", "max"),
    ])
}

fn values(figures: &Figures) -> Vec<String> {
    let count = |metric: &str| short(figures.value(metric), SIGNS);
    let time = |metric: &str| short(figures.value(metric).map(|ns| ns / 1e6), SIGNS);
    vec![
        count("transmissions-per-application"),
        count("further-transmissions-per-application"),
        count("bytes-per-application"),
        count("further-bytes-per-application"),
        lost(figures),
        whole(figures.value("recovery-repeats")),
        whole(figures.value("recovery-learnt")),
        time("knowledge-p50"),
        time("knowledge-p99"),
        time("knowledge-max"),
    ]
}

/// Samples that links lost, at random and in outages; a dash where nobody repairs anything.
fn lost(figures: &Figures) -> String {
    let values: Vec<f64> = LOST.iter().filter_map(|metric| figures.value(metric)).collect();
    if values.is_empty() { DASH.to_owned() } else { whole(Some(values.iter().sum())) }
}

/// A number of samples or changes: as it is, as long as it is short.
fn whole(count: Option<f64>) -> String {
    if count < Some(WHOLE_BELOW) { exact(count, 0) } else { short(count, SIGNS) }
}

/// What the columns mean.
pub(in crate::report) fn legend() -> String {
    [
        ("application", "a change at one other board that shares its fact"),
        ("trans, bytes", "samples sent for the first time, and their records and headers"),
        ("more", "the same of repeats, receipts, digests and states"),
        ("lost, again", "samples lost on links or in outages; samples repeated"),
        ("learnt", "changes that came as state, in place of their samples; in no time"),
        (
            "virtual ms",
            "time to knowledge on a virtual clock: what links, pauses and patience add up to. No \
             processor took part and nothing was measured; real processes take longer",
        ),
    ]
    .into_iter()
    .map(|(word, meaning)| wrap(&format!("{word:<14}"), meaning))
    .collect()
}

/// The rest of what a needed application costs and became of it.
pub(super) fn costs(summary: &Summary) -> Table {
    let mut table = Table::new(&[
        column("", "strategy"),
        column("asks", "ms"),
        column("", "requ."),
        column("", "deliv"),
        column("rec.", "p50"),
        column("known", "%"),
        column("", "cens."),
        column("reads", "stale"),
        column("stale", "us"),
    ]);
    sections(summary, &mut table, |figures| {
        let count = |metric: &str| short(figures.value(metric), SIGNS);
        let stale = count("stale-reads-share");
        vec![
            count("requests-per-application"),
            count("deliveries-per-application"),
            count("records-per-sample-p50"),
            exact(figures.value("applied-by-end-share"), 1),
            count("censored"),
            if stale == DASH { stale } else { format!("{stale}%") },
            short(figures.value("staleness-p50").map(|ns| ns / 1e3), SIGNS),
        ]
    });
    table
}
