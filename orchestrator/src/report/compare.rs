//! The main table: what every strategy sends and costs, one line a strategy and fleet size.
//!
//! Counts are means a trial over the trials that came to their end; requests carry a mark that says
//! whether every trial's counts are those of the independent replay. Times are those of the timing
//! cells; how much they exceed strategy `null` is what a strategy costs.

use super::capacities::capacities;
use super::page::Page;
use super::pictures::gallery;
use super::table::{Colour, Table, clip, column, short, wrap};
use super::{Look, Report, details, document, incidents, loads, pairs};
use crate::results::figure::Figure;
use crate::results::host::HostState;
use crate::results::read::RunData;
use crate::results::record::TrialEnd;
use crate::results::statistics::Quantile;
use crate::results::summary::Summary;
use serde::Serialize;
use shared_types::wire::StrategyKind;
use std::path::PathBuf;

/// Signs of a count that is set beside a published one.
const REQUEST_SIGNS: usize = 5;
/// Signs of the width of an interval.
const SPREAD_SIGNS: usize = 3;
/// Signs of the other numbers.
const SIGNS: usize = 4;

/// A published mean of requests a trial.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PublishedMean {
    /// Crafts.
    pub size: u32,
    /// How changes were replicated.
    pub strategy: StrategyKind,
    /// The mean as printed.
    pub figure: Figure,
    /// Whether some rule explains it; else it is marked and footnoted.
    pub is_explained: bool,
}

/// A comparison of strategies.
#[derive(Clone, Debug)]
pub struct Compare {
    /// Every figure.
    pub summary: Summary,
    /// Published means of the same experiment; empty where the scenario is not the published one.
    pub published: Vec<PublishedMean>,
    /// Where the results lie.
    pub directory: PathBuf,
    /// How the user calls this program.
    pub program: String,
}

impl Report for Compare {
    fn table(&self, look: Look) -> String {
        let mut text = heading(&self.summary, look.colour);
        text += &loads::disagreements(&self.summary);
        text += &self.main_table().render(look.colour);
        text += &pairs::ratios(&self.summary, look.colour);
        text += &loads::first_screen(&self.summary, look.colour);
        text += &capacities(&self.summary, look.colour);
        text += &incidents::incidents(&self.summary, look.all, look.colour);
        text += "\n";
        text += &self.legend();
        text += &loads::legend(&self.summary);
        if look.all {
            text += &details::details(&self.summary, look.colour);
        }
        text + "\n" + &self.pointers(look)
    }

    fn json(&self) -> String {
        document::json("compare", &self.summary, &self.published)
    }

    fn csv(&self) -> String {
        document::csv(&self.summary, &self.published)
    }
}

impl Compare {
    /// The page of the same report, with its pictures.
    #[must_use]
    pub fn page(&self, run: &RunData) -> Page {
        let heading = "What every strategy sends and costs".to_owned();
        let text = self.table(Look { colour: Colour::Never, all: true });
        let pictures = gallery(run, &self.summary, &self.published);
        Page::of(&self.summary, vec![(heading, self.main_table())], pictures, text)
    }

    fn main_table(&self) -> Table {
        let tail = tail_quantile(&self.summary);
        let mut table = Table::new(&[
            column("", "strategy"),
            column("requests", "ours "),
            column("requests", "publ. "),
            column("means a trial", "trans"),
            column("means a trial", "deliv"),
            column("means a trial", "bytes"),
            column("means a trial", "hops"),
            column("turn time, us", "p50"),
            column("turn time, us", "+-%"),
            column("turn time, us", tail.name),
            column("turn time, us", "over"),
            column("CPU", "over"),
        ]);
        for size in self.summary.sizes() {
            table.section(size_heading(&self.summary, size));
            for strategy in self.summary.strategies(size) {
                table.row(self.row(size, strategy, tail));
            }
        }
        table
    }

    fn row(&self, size: u32, strategy: StrategyKind, tail: Quantile) -> Vec<String> {
        let counted = self.summary.counted(size, strategy);
        let timed = self.summary.timed(size, strategy);
        let count = |metric| counted.and_then(|cell| cell.figures.value(metric));
        let microseconds =
            |metric: &str| timed.and_then(|cell| cell.figures.value(metric)).map(|ns| ns / 1e3);
        let mut cells = vec![strategy.name().to_owned()];
        cells.push(requests_cell(&self.summary, size, strategy, REQUEST_SIGNS));
        cells.push(self.published_cell(size, strategy));
        for metric in ["transmissions", "deliveries", "bytes", "hops"] {
            cells.push(short(count(metric), SIGNS));
        }
        cells.push(short(microseconds("turn-time-p50"), SIGNS));
        let spread = timed.and_then(|cell| cell.figures.value("turn-time-p50-spread"));
        cells.push(short(spread, SPREAD_SIGNS));
        for metric in [
            &format!("turn-time-{}", tail.name),
            "turn-time-p50-over-null",
            "cpu-per-turn-over-null",
        ] {
            cells.push(short(microseconds(metric), SIGNS));
        }
        cells
    }

    fn published_cell(&self, size: u32, strategy: StrategyKind) -> String {
        let mean =
            self.published.iter().find(|mean| (mean.size, mean.strategy) == (size, strategy));
        match mean {
            Some(mean) => {
                let mark = if mean.is_explained { ' ' } else { '*' };
                format!("{}{mark}", short(mean.figure.value, REQUEST_SIGNS))
            }
            None => super::table::DASH.to_owned(),
        }
    }

    fn legend(&self) -> String {
        let mut text = legend_of_counts();
        if !self.published.is_empty() {
            text += &wrap("publ.         ", "mean of ten published runs (dissertation, Table 25)");
        }
        if self.published.iter().any(|mean| !mean.is_explained) {
            text += &wrap("*             ", "source inconsistent: no rule explains this mean");
        }
        if !self.summary.timing.records.is_empty() {
            text += &legend_of_times();
            if self
                .summary
                .timing
                .cells
                .iter()
                .any(|cell| cell.figures.value("turn-time-p50-spread").is_some())
            {
                text += &wrap(
                    "+-%           ",
                    "half the 95 % interval of p50 over blocks, in % of it",
                );
            }
        }
        text
    }

    fn pointers(&self, look: Look) -> String {
        let (directory, program) = (self.directory.display(), &self.program);
        let mut lines = Vec::new();
        if !look.all {
            lines.push(format!("{program} report {directory} --all"));
        }
        if !self.published.is_empty() {
            lines.push(format!("{program} reproduce"));
        }
        lines.push(format!("{program} run two-craft"));
        let lead = |place| if place == 0 { "next      " } else { "          " };
        let next: String = lines
            .iter()
            .enumerate()
            .map(|(place, line)| format!("{}{line}\n", lead(place)))
            .collect();
        format!("results   {directory}\n{next}")
    }
}

/// What was run, where: one line.
pub(super) fn heading(summary: &Summary, colour: Colour) -> String {
    let Some(provenance) = &summary.timing.provenance else { return String::new() };
    let host = &provenance.host;
    let how = if provenance.is_simulated { "simulated, " } else { "" };
    let line = format!(
        "{}, seed {}: {how}{} build {} on {}, {}",
        provenance.scenario,
        provenance.seed,
        provenance.versions.profile,
        provenance.versions.commit,
        host.kernel,
        host.cpu_model,
    );
    colour.heading(&clip(&line, super::table::WIDTH)) + "\n" + &host_line(summary)
}

/// Whether the host was quiet while times were measured, where somebody looked.
fn host_line(summary: &Summary) -> String {
    let host = &summary.timing.host;
    let Some(state) = host.state else { return String::new() };
    let foreign = host.blocks.iter().map(|block| block.foreign_cores);
    let most = foreign.max_by(f64::total_cmp).unwrap_or(0.0);
    let word = match state {
        HostState::Clean => "clean",
        HostState::Noisy => "noisy",
    };
    format!("host {word}: others kept up to {most:.2} cores busy while times were measured\n")
}

/// Requests with the mark that says whether the trials agree with the independent replay.
pub(super) fn requests_cell(
    summary: &Summary,
    size: u32,
    strategy: StrategyKind,
    signs: usize,
) -> String {
    let Some(cell) = summary.counted(size, strategy) else {
        return super::table::DASH.to_owned();
    };
    let mark = if cell.agrees_with_oracle { '=' } else { '!' };
    format!("{}{mark}", short(cell.figures.value("requests"), signs))
}

/// `10 crafts, 5.0-5.5 processes per core, 10 trials, 100-1000 turns timed`.
pub(super) fn size_heading(summary: &Summary, size: u32) -> String {
    let mut parts = vec![if size == 1 { "1 craft".to_owned() } else { format!("{size} crafts") }];
    let timed: Vec<_> = summary.timing.cells.iter().filter(|cell| cell.size == size).collect();
    let values = |metric: &str| -> Vec<f64> {
        timed.iter().filter_map(|cell| cell.figures.value(metric)).collect()
    };
    let per_core = values("processes-per-core");
    if let Some(range) = range(&per_core, 1) {
        parts.push(format!("{range} processes per core"));
    }
    let counted: Vec<_> =
        summary.deterministic.cells.iter().filter(|cell| cell.size == size).collect();
    let in_means: Vec<f64> =
        counted.iter().filter_map(|cell| cell.figures.value("trials")).collect();
    if let Some(range) = range(&in_means, 0) {
        parts.push(format!("{range} trials"));
    }
    for end in [TrialEnd::Stalled, TrialEnd::Dropped, TrialEnd::Partial] {
        let count: u64 = counted.iter().filter_map(|cell| cell.ends.get(&end)).sum();
        if count > 0 {
            parts.push(format!("{count} {}", end.name()));
        }
    }
    if let Some(range) = range(&values("turns"), 0) {
        parts.push(format!("{range} turns timed"));
    }
    parts.join(", ")
}

/// Smallest and largest value, once if they are the same.
fn range(values: &[f64], decimals: usize) -> Option<String> {
    let low = values.iter().copied().min_by(f64::total_cmp)?;
    let high = values.iter().copied().max_by(f64::total_cmp)?;
    let (low, high) = (format!("{low:.decimals$}"), format!("{high:.decimals$}"));
    Some(if low == high { low } else { format!("{low}-{high}") })
}

/// The highest quantile that at least half of the timed cells can show; p99 if none can show more.
pub(super) fn tail_quantile(summary: &Summary) -> Quantile {
    let cells = summary.timing.cells.len();
    let is_common = |quantile: &Quantile| {
        let metric = format!("turn-time-{}", quantile.name);
        let shown =
            summary.timing.cells.iter().filter(|cell| cell.figures.value(&metric).is_some());
        2 * shown.count() >= cells.max(1)
    };
    [Quantile::P999, Quantile::P99, Quantile::P90]
        .into_iter()
        .find(is_common)
        .unwrap_or(Quantile::P99)
}

/// What counts mean.
pub(super) fn legend_of_counts() -> String {
    [
        ("request", "all changes of one firing over one hop; a multicast is one"),
        ("= !", "counts of all trials equal the independent replay's; or do not"),
        ("trans", "transmission: one sample published, replies of a centre included"),
        ("deliv", "delivery: one sample received by another craft"),
        ("bytes, hops", "published records and headers; hops of all final deliveries"),
    ]
    .into_iter()
    .map(|(word, meaning)| wrap(&format!("{word:<14}"), meaning))
    .collect()
}

/// What times mean.
pub(super) fn legend_of_times() -> String {
    [
        ("turn time", "a lockstep turn with its ledger; - if fewer than 10 lie beyond"),
        ("over, CPU", "excess over null, which sends nothing: of p50; of CPU a turn, us"),
    ]
    .into_iter()
    .map(|(word, meaning)| wrap(&format!("{word:<14}"), meaning))
    .collect()
}
