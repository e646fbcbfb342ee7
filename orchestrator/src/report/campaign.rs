//! The tables of a campaign of faults: what was killed, what went wrong, how long recovery took.

use super::compare::heading;
use super::incidents;
use super::table::{Colour, Table, column, short, wrap};
use super::{Look, Report, document};
use crate::results::faults::{CampaignFigures, Failure, SizeFigures};
use crate::results::statistics::{Distribution, Quantile};
use crate::results::summary::Summary;
use std::path::PathBuf;

/// Failures that the first screen tells.
const FAILURES_SHOWN: usize = 5;

/// The row of recoveries that had to wait until a file was old enough to go.
const AGED: &str = "reclaimed-aged";

/// The row of successors that caught up over links that failed.
const OVER_FAILING_LINKS: &str = "caught-up-links";

/// Signs of a time.
const SIGNS: usize = 4;

/// A campaign.
#[derive(Clone, Debug)]
pub struct CampaignReport {
    /// Every figure.
    pub summary: Summary,
    /// Where the results lie.
    pub directory: PathBuf,
    /// How the user calls this program.
    pub program: String,
}

impl Report for CampaignReport {
    fn table(&self, look: Look) -> String {
        let mut text = heading(&self.summary, look.colour);
        match &self.summary.timing.campaign {
            None => text += "no fault was inflicted\n",
            Some(figures) => {
                text += &counts(figures).render(look.colour);
                text += "\n";
                text += &bounds(figures);
                text += "\n";
                text += &times(figures).render(look.colour);
                text += "\n";
                text += &failures(figures, look);
                text += &legend(figures);
            }
        }
        text += &incidents::incidents(&self.summary, look.all, look.colour);
        let directory = self.directory.display();
        text += &format!("\nresults   {directory}\n");
        text + &format!("next      {} report {directory} --format csv\n", self.program)
    }

    fn json(&self) -> String {
        document::json("campaign", &self.summary, &[])
    }

    fn csv(&self) -> String {
        let mut rows = csv::Writer::from_writer(Vec::new());
        let mut write = |row: [&str; 4]| {
            rows.write_record(row).expect("invariant: memory takes every row");
        };
        write(["size", "metric", "value", "unit"]);
        for row in self.rows() {
            let size = if row.size == 0 { "all".to_owned() } else { row.size.to_string() };
            for (metric, value, unit) in figures_of(row) {
                write([&size, &metric, &value, unit]);
            }
        }
        let bytes = rows.into_inner().expect("invariant: memory takes every row");
        String::from_utf8(bytes).expect("invariant: the rows are text")
    }
}

impl CampaignReport {
    /// The figures of every size, then of all.
    fn rows(&self) -> impl Iterator<Item = &SizeFigures> {
        let figures = self.summary.timing.campaign.iter();
        figures.flat_map(|figures| figures.sizes.iter().chain([&figures.all]))
    }
}

/// Every figure of a row with its name and unit.
fn figures_of(row: &SizeFigures) -> Vec<(String, String, &'static str)> {
    let mut all: Vec<(String, String, &'static str)> = [
        ("kills", row.kills),
        ("kills-at-named-points", row.named),
        ("orchestrators-killed", row.orchestrators),
        ("pauses", row.pauses),
        ("rounds-with-failing-links", row.links),
        ("faults-without-effect", row.without_effect),
    ]
    .map(|(metric, count)| (metric.to_owned(), count.to_string(), "fault"))
    .into();
    for (failure, count) in &row.failures {
        all.push((failure.replace(' ', "-"), count.to_string(), "fault"));
    }
    if let Some(bound) = row.bound_of_zero {
        all.push(("bound-of-zero".to_owned(), bound.to_string(), "probability"));
    }
    for (name, times) in times_of(row) {
        all.push((format!("{name}-n"), times.n.to_string(), "recovery"));
        for quantile in &times.quantiles {
            let (metric, value) = (format!("{name}-{}", quantile.name), quantile.value_ns);
            all.push((metric, value.to_string(), "ns"));
        }
        all.push((format!("{name}-max"), times.max_ns.to_string(), "ns"));
    }
    all
}

/// The times of a row with their names.
fn times_of(row: &SizeFigures) -> impl Iterator<Item = (&'static str, &Distribution)> {
    let steps = row.times.iter().map(|(step, times)| (step.name(), times));
    let over_links = row.caught_up_on_failing_links.iter().map(|times| (OVER_FAILING_LINKS, times));
    let aged = row.reclaimed_after_ageing.iter().map(|times| (AGED, times));
    steps.chain(over_links).chain(aged)
}

fn size_of(row: &SizeFigures) -> String {
    if row.size == 0 { "all".to_owned() } else { row.size.to_string() }
}

fn counts(figures: &CampaignFigures) -> Table {
    let mut table = Table::new(&[
        column("", "crafts"),
        column("kills", "all"),
        column("kills", "named"),
        column("kills", "orch"),
        column("", "pauses"),
        column("", "links"),
        column("failed", "hang"),
        column("failed", "clean"),
        column("failed", "start"),
        column("failed", "left"),
        column("failed", "lost"),
        column("failed", "board"),
    ]);
    for row in figures.sizes.iter().chain([&figures.all]) {
        let mut cells = vec![size_of(row)];
        let done = [row.kills, row.named, row.orchestrators, row.pauses, row.links];
        cells.extend(done.map(|count| count.to_string()));
        cells.extend(
            Failure::ALL
                .map(|failure| row.failures.get(failure.name()).copied().unwrap_or(0).to_string()),
        );
        table.row(cells);
    }
    table
}

fn bounds(figures: &CampaignFigures) -> String {
    let all = &figures.all;
    let Some(bound) = all.bound_of_zero else { return String::new() };
    let faults = all.kills + all.pauses + all.links;
    let without = match all.without_effect {
        0 => String::new(),
        count => format!("; {count} more took no effect and prove nothing"),
    };
    wrap(
        "zeros     ",
        &format!(
            "a failure that {faults} faults did not show has a probability below {bound:.4} at 95 % \
             (3/n){without}"
        ),
    )
}

fn times(figures: &CampaignFigures) -> Table {
    let mut table = Table::new(&[
        column("", "crafts"),
        column("", "ms from the kill"),
        column("", "n"),
        column("", "p50"),
        column("", "p90"),
        column("", "p99"),
        column("", "max"),
    ]);
    for row in figures.sizes.iter().chain([&figures.all]) {
        for (name, times) in times_of(row) {
            let quantile = |quantile: Quantile| milliseconds(times, quantile);
            table.row(vec![
                size_of(row),
                name.to_owned(),
                times.n.to_string(),
                quantile(Quantile::P50),
                quantile(Quantile::P90),
                quantile(Quantile::P99),
                short(Some(ms(times.max_ns)), SIGNS),
            ]);
        }
    }
    table
}

fn milliseconds(times: &Distribution, quantile: Quantile) -> String {
    let value = times.quantiles.iter().find(|value| value.name == quantile.name);
    short(value.map(|value| ms(value.value_ns)), SIGNS)
}

#[expect(clippy::cast_precision_loss, reason = "times of recovery are below a minute")]
fn ms(time_ns: u64) -> f64 {
    time_ns as f64 / 1e6
}

fn failures(figures: &CampaignFigures, look: Look) -> String {
    let limit = if look.all { usize::MAX } else { FAILURES_SHOWN };
    let mut text = String::new();
    for failure in figures.failures.iter().take(limit) {
        text += &wrap("! ", failure);
    }
    let more = figures.failures.len().saturating_sub(limit);
    if more > 0 {
        text += &wrap("! ", &format!("... and {more} more: see `--all`"));
    }
    text.lines().map(|line: &str| colour(look.colour, line)).collect()
}

fn colour(colour: Colour, line: &str) -> String {
    colour.alarm(line) + "\n"
}

fn legend(figures: &CampaignFigures) -> String {
    let points: Vec<String> =
        figures.points.iter().map(|(point, count)| format!("{point} {count}")).collect();
    wrap("points    ", &points.join(", "))
        + &wrap(
            "failed    ",
            "hang: a bound on waiting was reached; clean: what the dead held was not freed; start: no \
             successor, or a loss that was counted; left: files or processes; lost: counts that are \
             not the replay's with no loss counted; board: boards that are not the replay's",
        )
        + &wrap(
            "recovery  ",
            "noticed: reaped by the supervisor; reclaimed: its places and files are free (aged: after \
             what kills leave at rare moments was planted, of which one file must be 200 ms old); known: all \
             others have given the trial up; restarted: the successor is up; rejoined: it is connected \
             in the next trial, or in the interval under way. Of intervals, by the crafts' clocks: \
             peers-noticed: the last of them heard; caught-up: it knows all that it missed (links: while \
             links failed). Of an \
             orchestrator: reaped, and cleaned",
        )
}
