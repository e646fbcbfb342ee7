//! The JSON and CSV forms of a run's summary, with the published means beside it.

use super::compare::PublishedMean;
use crate::results::figure::Figure;
use crate::results::summary::{Deterministic, Summary, Timing};
use serde::Serialize;

/// The columns of the CSV form.
const HEADER: [&str; 13] = [
    "part", "size", "strategy", "trial", "craft", "metric", "value", "n", "low", "high", "unit",
    "load", "label",
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
    for pair in &summary.timing.compared {
        let key = Key::of("timing", pair.size, pair.strategy.name());
        let metric = format!("turn-time-p50-to-{}-verdict", pair.base);
        rows.plain(&key, &metric, pair.comparison.verdict.name(), "");
    }
    rows.finish()
}

/// What a row is about.
struct Key {
    part: &'static str,
    size: String,
    strategy: &'static str,
    trial: String,
    craft: String,
}

impl Key {
    fn of(part: &'static str, size: u32, strategy: &'static str) -> Self {
        let (trial, craft) = (String::new(), String::new());
        Self { part, size: size.to_string(), strategy, trial, craft }
    }

    fn trial(self, trial: u32) -> Self {
        Self { trial: trial.to_string(), ..self }
    }

    fn craft(self, name: &str) -> Self {
        Self { craft: name.to_owned(), ..self }
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

    fn figure(&mut self, key: &Key, metric: &str, figure: &Figure) {
        let number = |value: Option<f64>| value.map_or_else(String::new, |value| value.to_string());
        self.write([
            key.part,
            &key.size,
            key.strategy,
            &key.trial,
            &key.craft,
            metric,
            &number(figure.value),
            &figure.n.to_string(),
            &number(figure.low),
            &number(figure.high),
            figure.unit,
            figure.load.unwrap_or(""),
            &figure.label,
        ]);
    }

    fn plain(&mut self, key: &Key, metric: &str, value: &str, unit: &str) {
        let (size, trial, craft) = (&key.size, &key.trial, &key.craft);
        self.write([
            key.part,
            size,
            key.strategy,
            trial,
            craft,
            metric,
            value,
            "1",
            "",
            "",
            unit,
            "",
            "",
        ]);
    }

    fn finish(self) -> String {
        let bytes = self.0.into_inner().expect("invariant: memory takes every row");
        String::from_utf8(bytes).expect("invariant: rows are made of text")
    }
}
