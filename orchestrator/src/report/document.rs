//! The JSON and CSV forms of a run's summary, with the published means beside it.

use super::compare::PublishedMean;
use crate::results::figure::Figure;
use crate::results::inference::Comparison;
use crate::results::summary::{Deterministic, Summary, Timing};
use serde::Serialize;

/// The columns of the CSV form.
const HEADER: [&str; 14] = [
    "part",
    "size",
    "strategy",
    "trial",
    "craft",
    "metric",
    "value",
    "n",
    "low",
    "high",
    "unit",
    "load",
    "label",
    "asks_every_ns",
];

#[derive(Serialize)]
struct Document<'a> {
    report: &'a str,
    format: u32,
    deterministic: CountsAndPublished<'a>,
    timing: &'a Timing,
}

#[derive(Serialize)]
struct CountsAndPublished<'a> {
    #[serde(flatten)]
    ours: &'a Deterministic,
    published: &'a [PublishedMean],
}

/// `summary` and `published` as one JSON document.
pub(super) fn json(report: &str, summary: &Summary, published: &[PublishedMean]) -> String {
    let document = Document {
        report,
        format: summary.format,
        deterministic: CountsAndPublished { ours: &summary.deterministic, published },
        timing: &summary.timing,
    };
    let text =
        serde_json::to_string_pretty(&document).expect("invariant: documents are plain data");
    text + "\n"
}

/// `summary` and `published` as rows: one a figure, and one a count of every trial.
pub(super) fn csv(summary: &Summary, published: &[PublishedMean]) -> String {
    let mut rows = Rows::new();
    let deterministic = &summary.deterministic;
    for cell in &deterministic.cells {
        let key = Key::of("deterministic", cell.size, cell.strategy.name());
        cell.figures.iter().for_each(|(metric, figure)| rows.figure(&key, metric, figure));
        for (end, &count) in &cell.ends {
            rows.plain(&key, &format!("ended-{}", end.name()), &count.to_string(), "trial");
        }
        let agrees = cell.agrees_with_oracle.to_string();
        rows.plain(&key, "agrees-with-oracle", &agrees, "");
    }
    for cell in &deterministic.crafts {
        let key = Key::of("deterministic", cell.size, cell.strategy.name()).craft(&cell.name);
        cell.figures.iter().for_each(|(metric, figure)| rows.figure(&key, metric, figure));
    }
    for facts in &deterministic.trials {
        let strategy = facts.cell.strategy.name();
        let key = Key::of("deterministic", facts.cell.size, strategy).trial(facts.trial);
        for (metric, value, unit) in [
            ("end", facts.end.name().to_owned(), ""),
            ("turns", facts.turns.to_string(), "turn"),
            ("firings", facts.firings.to_string(), "firing"),
            ("boundary-firings", facts.boundary_firings.to_string(), "firing"),
            ("requests", facts.measured.replication.requests.to_string(), "request"),
            ("requests-expected", facts.expected.replication.requests.to_string(), "request"),
            ("deliveries", facts.measured.total().deliveries.to_string(), "sample"),
            ("hops", facts.hops.to_string(), "hop"),
            ("path-digest", facts.path_digest.to_string(), ""),
            ("board-digest", facts.board_digest.to_string(), ""),
            ("replica-digest", facts.replica_digest.to_string(), ""),
        ] {
            rows.plain(&key, metric, &value, unit);
        }
    }
    for mean in published {
        let key = Key::of("published", mean.size, mean.strategy.name());
        rows.figure(&key, "requests-published", &mean.figure);
    }
    for cell in &summary.timing.cells {
        let key = Key::of("timing", cell.size, cell.strategy.name());
        cell.figures.iter().for_each(|(metric, figure)| rows.figure(&key, metric, figure));
    }
    for cell in &summary.timing.reasoning {
        let key = Key::of("timing", cell.size, cell.strategy.name()).craft(&cell.name);
        cell.figures.iter().for_each(|(metric, figure)| rows.figure(&key, metric, figure));
    }
    for pair in &summary.timing.compared {
        let key = Key::of("timing", pair.size, pair.strategy.name());
        let metric = format!("turn-time-p50-to-{}-verdict", pair.base);
        rows.plain(&key, &metric, pair.comparison.verdict.name(), "");
    }
    loads(summary, &mut rows);
    rows.finish()
}

/// The figures of open mode, what is marked in their rows, and what comparisons say.
fn loads(summary: &Summary, rows: &mut Rows) {
    for row in &summary.timing.loads {
        let label = row.label().to_string();
        let key = Key { asks_every_ns: row.asks_every_ns, ..Key::of("load", row.size, &label) };
        row.figures.iter().for_each(|(metric, figure)| rows.figure(&key, metric, figure));
        let said = |is_true: Option<bool>| is_true.map_or_else(String::new, |it| it.to_string());
        for (metric, value) in [
            ("is-saturated", said(Some(row.saturated.is_some()))),
            ("is-stationary", said(row.is_stationary)),
            ("is-late", said(Some(row.is_late))),
            ("is-disturbed", said(Some(row.is_disturbed))),
        ] {
            rows.plain(&Key { load: &row.load, ..key }, metric, &value, "");
        }
    }
    for pair in &summary.timing.compared_loads {
        let key = Key {
            asks_every_ns: pair.asks_every_ns,
            load: &pair.load,
            ..Key::of("load", pair.size, pair.strategy.name())
        };
        let metric = format!("{}-to-{}", pair.metric.name(), pair.base);
        rows.comparison(&key, &metric, &pair.comparison);
        if pair.is_late {
            rows.plain(&key, &format!("{metric}-is-late"), "true", "");
        }
    }
}

/// What a row is about.
#[derive(Clone, Copy)]
struct Key<'a> {
    part: &'static str,
    size: u32,
    strategy: &'a str,
    trial: Option<u32>,
    craft: &'a str,
    /// Of what is no figure; a figure says itself.
    load: &'a str,
    asks_every_ns: Option<u64>,
}

impl<'a> Key<'a> {
    const fn of(part: &'static str, size: u32, strategy: &'a str) -> Self {
        Self { part, size, strategy, trial: None, craft: "", load: "", asks_every_ns: None }
    }

    const fn trial(self, trial: u32) -> Self {
        Self { trial: Some(trial), ..self }
    }

    const fn craft(self, name: &'a str) -> Self {
        Self { craft: name, ..self }
    }
}

struct Rows(csv::Writer<Vec<u8>>);

impl Rows {
    fn new() -> Self {
        let mut rows = Self(csv::Writer::from_writer(Vec::new()));
        rows.write(HEADER);
        rows
    }

    fn write(&mut self, row: [&str; HEADER.len()]) {
        self.0.write_record(row).expect("invariant: every row has the header's length");
    }

    fn figure(&mut self, key: &Key<'_>, metric: &str, figure: &Figure) {
        self.write([
            key.part,
            &key.size.to_string(),
            key.strategy,
            &text(key.trial),
            key.craft,
            metric,
            &text(figure.value),
            &figure.n.to_string(),
            &text(figure.low),
            &text(figure.high),
            figure.unit,
            figure.load.as_deref().unwrap_or(key.load),
            &figure.label,
            &text(key.asks_every_ns),
        ]);
    }

    fn plain(&mut self, key: &Key<'_>, metric: &str, value: &str, unit: &'static str) {
        self.write([
            key.part,
            &key.size.to_string(),
            key.strategy,
            &text(key.trial),
            key.craft,
            metric,
            value,
            "1",
            "",
            "",
            unit,
            key.load,
            "",
            &text(key.asks_every_ns),
        ]);
    }

    /// A ratio by block, its p, the floor and the verdict.
    fn comparison(&mut self, key: &Key<'_>, metric: &str, comparison: &Comparison) {
        let figure =
            |value: Option<f64>, label: &str| Figure::count(value, comparison.blocks, "1", label);
        let (low, high) = comparison.interval.unzip();
        let ratio = figure(Some(comparison.ratio), "ratio by block");
        self.figure(key, metric, &Figure { low, high, ..ratio });
        let chance = figure(Some(comparison.p_value), "chance of such a distance, corrected");
        self.figure(key, &format!("{metric}-p"), &chance);
        let floor = figure(comparison.floor, "distance from itself, the A-A floor");
        self.figure(key, &format!("{metric}-floor"), &floor);
        self.plain(key, &format!("{metric}-verdict"), comparison.verdict.name(), "");
    }

    fn finish(self) -> String {
        let bytes = self.0.into_inner().expect("invariant: memory takes every row");
        String::from_utf8(bytes).expect("invariant: rows are made of text")
    }
}

/// A number, empty where there is none.
fn text(number: Option<impl ToString>) -> String {
    number.map_or_else(String::new, |number| number.to_string())
}
