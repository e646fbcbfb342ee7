//! The published tables beside ours, and what is to be said of each figure.
//!
//! Tables 1 to 20 are about networks, see [`super::networks`]. Tables 21 to 24 hold single random runs:
//! nobody can repeat them, so what is checked is what must hold between the columns of any run. Table 25
//! holds means of ten such runs: each gets its verdict from the range in which 95 % of our ten-trial means
//! lie. Nothing here comes from a clock, a host or
//! a path, so two runs of one seed give the same bytes. Only a broken identity of *our* trials is a
//! failure; what the source prints is a finding.

mod means;
mod runs;

use super::networks::Networks;
use super::published::Published;
use super::ranges::Sample;
use super::table::wrap;
use super::{Look, Report};
use crate::outcome::Outcome;
use crate::results::summary::Deterministic;
use means::MeansTable;
use runs::RunsTable;
use serde::Serialize;

/// The published tables that can be set beside ours.
pub const TABLES: std::ops::RangeInclusive<u32> = 1..=25;

/// Those of them that fleets are needed for.
pub const FLEET_TABLES: std::ops::RangeInclusive<u32> = 21..=25;

/// Trials of a size that are set beside the ten published runs.
pub use super::published::PUBLISHED_TRIALS;

/// The column that CSV rows have.
const HEADER: [&str; 12] = [
    "table", "crafts", "row", "column", "source", "value", "n", "low", "high", "unit", "verdict",
    "label",
];

/// Some of the published tables beside ours.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Reproduction {
    report: &'static str,
    /// Seed of our trials and of the ranges.
    seed: u64,
    /// Tables 1 to 20, if some were asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    networks: Option<Networks>,
    /// Tables 21 to 24, those asked for.
    runs: Vec<RunsTable>,
    /// Table 25, if asked for.
    means: Option<MeansTable>,
    /// Whether every identity held in our trials.
    identities_hold: bool,
}

impl Reproduction {
    /// `tables` (numbers of [`TABLES`]; others are ignored) beside `ours`: trials of the published
    /// experiment, of which those with numbers below [`PUBLISHED_TRIALS`] are used. `samples` give
    /// the ranges, one for each size.
    #[must_use]
    pub fn new(tables: &[u32], seed: u64, ours: &Deterministic, samples: &[Sample]) -> Self {
        let published = Published::embedded();
        let all: Vec<RunsTable> =
            published.runs.iter().map(|table| RunsTable::new(table, ours)).collect();
        let means = tables.contains(&25).then(|| MeansTable::new(&published, seed, ours, samples));
        // Whatever is shown: means of trials that break an identity are worth nothing.
        let identities_hold = all.iter().all(RunsTable::identities_hold)
            && ours.cells.iter().all(|cell| cell.agrees_with_oracle);
        let runs = all.into_iter().filter(|table| tables.contains(&table.number())).collect();
        Self { report: "reproduce", seed, networks: None, runs, means, identities_hold }
    }

    /// The same with Tables 1 to 20.
    #[must_use]
    pub fn with_networks(mut self, networks: Option<Networks>) -> Self {
        self.networks = networks;
        self
    }

    /// [`Outcome::Broken`] if an identity does not hold in our trials; what the source prints never
    /// fails.
    #[must_use]
    pub const fn outcome(&self) -> Outcome {
        if self.identities_hold { Outcome::Success } else { Outcome::Broken }
    }
}

impl Report for Reproduction {
    fn table(&self, look: Look) -> String {
        let mut text = String::new();
        if let Some(networks) = &self.networks {
            text += &networks.text(look.colour);
            text.push('\n');
        }
        for runs in &self.runs {
            text += &runs.text(look.colour);
            text.push('\n');
        }
        if !self.runs.is_empty() {
            text += &runs::legend();
            text.push('\n');
        }
        if let Some(means) = &self.means {
            text += &means.text(look.colour);
            text.push('\n');
        }
        if !self.identities_hold {
            let told = wrap("! ", "an identity does not hold in our trials: see the rows marked !");
            text += &(look.colour.alarm(told.trim_end()) + "\n\n");
        }
        text + &format!("ours      seed {}\n", self.seed)
    }

    fn json(&self) -> String {
        let text = serde_json::to_string_pretty(self).expect("invariant: documents are plain data");
        text + "\n"
    }

    fn csv(&self) -> String {
        let mut rows: Vec<[String; HEADER.len()]> = vec![HEADER.map(str::to_owned)];
        if let Some(networks) = &self.networks {
            networks.rows_into(&mut |[table, rest @ ..]| {
                let mut row = [const { String::new() }; HEADER.len()];
                row[0] = table;
                // No fleet, so no crafts.
                row[2..].clone_from_slice(&rest);
                rows.push(row);
            });
        }
        self.runs.iter().for_each(|table| table.rows_into(&mut rows));
        if let Some(means) = &self.means {
            means.rows_into(&mut rows);
        }
        let mut writer = csv::Writer::from_writer(Vec::new());
        for row in rows {
            writer.write_record(row).expect("invariant: every row has the header's length");
        }
        let bytes = writer.into_inner().expect("invariant: memory takes every row");
        String::from_utf8(bytes).expect("invariant: rows are made of text")
    }
}

#[cfg(test)]
mod tests;
