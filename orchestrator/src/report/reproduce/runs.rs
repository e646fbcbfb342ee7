//! Tables 21 to 24: ten single random runs of the source beside ten trials of ours.

use super::HEADER;
use crate::report::published::{
    PUBLISHED_STRATEGIES, PUBLISHED_TRIALS, PublishedRow, PublishedRuns, Verdict,
};
use crate::report::table::{Colour, DASH, Table, column, wrap};
use crate::results::record::{TrialEnd, TrialFacts};
use crate::results::summary::Deterministic;
use serde::Serialize;
use shared_types::wire::StrategyKind;
use std::collections::BTreeMap;

/// One of Tables 21 to 24 beside ours.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct RunsTable {
    table: u32,
    crafts: u32,
    rows: Vec<RunRow>,
}

/// A published run and one of our trials. They share nothing but their place in the table.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct RunRow {
    run: u32,
    published: PublishedRun,
    ours: Option<OurRun>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
struct PublishedRun {
    turns: Option<u64>,
    requests: BTreeMap<StrategyKind, u64>,
    verdicts: BTreeMap<StrategyKind, Verdict>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
struct OurRun {
    trial: u32,
    end: TrialEnd,
    turns: u32,
    requests: BTreeMap<StrategyKind, u64>,
    /// Whether every count is that of the independent replay.
    agrees_with_oracle: bool,
    /// Strategies whose requests are not what the other columns demand.
    broken: Vec<StrategyKind>,
}

impl RunsTable {
    pub(super) fn new(published: &PublishedRuns, ours: &Deterministic) -> Self {
        let rows = published
            .rows
            .iter()
            .zip(0..)
            .map(|(row, trial)| RunRow {
                run: row.label,
                published: published_run(published, row),
                ours: OurRun::new(published.crafts, trial, ours),
            })
            .collect();
        Self { table: published.table, crafts: published.crafts, rows }
    }

    pub(super) const fn number(&self) -> u32 {
        self.table
    }

    pub(super) fn identities_hold(&self) -> bool {
        self.rows.iter().filter_map(|row| row.ours.as_ref()).all(OurRun::identities_hold)
    }

    pub(super) fn text(&self, colour: Colour) -> String {
        let mut columns = vec![column("", "run"), column("published", "turns")];
        columns.extend(HEADS.map(|head| column("published", head)));
        columns.push(column("ours", "turns"));
        columns.extend(HEADS.map(|head| column("ours", head)));
        columns.push(column("", "ok"));
        let mut table = Table::new(&columns);
        for row in &self.rows {
            let mut cells = vec![row.run.to_string(), text_of(row.published.turns)];
            cells.extend(PUBLISHED_STRATEGIES.map(|strategy| {
                let mark = match row.published.verdicts[&strategy] {
                    Verdict::SourceInconsistent => "*",
                    Verdict::NotReproduced => "!",
                    Verdict::Reproduced | Verdict::Unchecked => "",
                };
                format!("{}{mark}", row.published.requests[&strategy])
            }));
            cells.extend(our_cells(row.ours.as_ref()));
            table.row(cells);
        }
        let title =
            format!("Table {}: {} blackboards, replication requests", self.table, self.crafts);
        format!("{}\n{}", colour.heading(&title), table.render(colour))
    }

    pub(super) fn rows_into(&self, rows: &mut Vec<[String; HEADER.len()]>) {
        let mut push =
            |run: u32, column: &str, source: &str, value: String, unit: &str, verdict: &str| {
                let label = "single run".to_owned();
                let (table, crafts) = (self.table.to_string(), self.crafts.to_string());
                let (none, one) = (String::new, "1".to_owned());
                let (column, source) = (column.to_owned(), source.to_owned());
                let (unit, verdict) = (unit.to_owned(), verdict.to_owned());
                rows.push([
                    table,
                    crafts,
                    run.to_string(),
                    column,
                    source,
                    value,
                    one,
                    none(),
                    none(),
                    unit,
                    verdict,
                    label,
                ]);
            };
        for row in &self.rows {
            let turns = row.published.turns.map_or_else(String::new, |turns| turns.to_string());
            push(row.run, "turns", "published", turns, "turn", "");
            for (strategy, requests) in &row.published.requests {
                let verdict = row.published.verdicts[strategy].name();
                let value = requests.to_string();
                push(row.run, strategy.name(), "published", value, "request", verdict);
            }
            let Some(ours) = &row.ours else { continue };
            push(row.run, "turns", "ours", ours.turns.to_string(), "turn", "");
            for (strategy, requests) in &ours.requests {
                let verdict = if ours.broken.contains(strategy) { "broken" } else { "holds" };
                push(row.run, strategy.name(), "ours", requests.to_string(), "request", verdict);
            }
        }
    }
}

/// Heads of the columns, in the order of [`PUBLISHED_STRATEGIES`].
const HEADS: [&str; 5] = ["bound", "full", "limit", "cent", "hier"];

fn text_of(count: Option<u64>) -> String {
    count.map_or_else(|| DASH.to_owned(), |count| count.to_string())
}

fn published_run(published: &PublishedRuns, row: &PublishedRow<u64>) -> PublishedRun {
    PublishedRun {
        turns: published.turns(row),
        requests: PUBLISHED_STRATEGIES
            .into_iter()
            .filter_map(|strategy| Some((strategy, row.requests(strategy)?)))
            .collect(),
        verdicts: PUBLISHED_STRATEGIES
            .into_iter()
            .map(|strategy| (strategy, published.verdict(row, strategy)))
            .collect(),
    }
}

impl OurRun {
    /// Trial `trial` of fleets of `crafts`, `None` if it was not run to its end.
    fn new(crafts: u32, trial: u32, ours: &Deterministic) -> Option<Self> {
        let facts: Vec<&TrialFacts> = ours
            .trials
            .iter()
            .filter(|facts| facts.cell.size == crafts && facts.trial == trial)
            .filter(|facts| facts.cell.block == 0 && facts.end != TrialEnd::Partial)
            .filter(|facts| PUBLISHED_STRATEGIES.contains(&facts.cell.strategy))
            .collect();
        let first = facts.first()?;
        let requests: BTreeMap<StrategyKind, u64> = facts
            .iter()
            .map(|facts| (facts.cell.strategy, facts.measured.replication.requests))
            .collect();
        Some(Self {
            trial,
            end: first.end,
            turns: first.turns,
            broken: broken(u64::from(crafts), u64::from(first.turns), &requests),
            requests,
            agrees_with_oracle: facts.iter().all(|facts| facts.agrees_with_oracle()),
        })
    }

    fn identities_hold(&self) -> bool {
        self.agrees_with_oracle && self.broken.is_empty()
    }
}

/// Strategies whose requests break an identity of the experiment: full = N T, central =
/// N (102 T + 2), limited = (N - 1) boundary, boundary <= full, boundary <= hierarchy.
fn broken(crafts: u64, turns: u64, requests: &BTreeMap<StrategyKind, u64>) -> Vec<StrategyKind> {
    let of = |strategy: StrategyKind| requests.get(&strategy).copied();
    let boundary = of(StrategyKind::Boundary);
    let holds = |strategy: StrategyKind, found: u64| match strategy {
        StrategyKind::Full => found == crafts * turns,
        StrategyKind::Central => found == crafts * (102 * turns + 2),
        StrategyKind::Limited => boundary.is_none_or(|boundary| found == limited(crafts, boundary)),
        StrategyKind::Hierarchy => boundary.is_none_or(|boundary| found >= boundary),
        StrategyKind::Boundary => of(StrategyKind::Full).is_none_or(|full| found <= full),
        StrategyKind::Null
        | StrategyKind::Hybrid
        | StrategyKind::CentralBatched
        | StrategyKind::Pipelined => true,
    };
    requests
        .iter()
        .filter(|&(&strategy, &found)| !holds(strategy, found))
        .map(|(&strategy, _)| strategy)
        .collect()
}

/// With one link a fact, a boundary change goes to one peer, and under limited to all others.
const fn limited(crafts: u64, boundary: u64) -> u64 {
    (crafts - 1) * boundary
}

fn our_cells(ours: Option<&OurRun>) -> Vec<String> {
    let Some(ours) = ours else { return vec![DASH.to_owned(); HEADS.len() + 2] };
    let mut cells = vec![ours.turns.to_string()];
    cells.extend(PUBLISHED_STRATEGIES.map(|strategy| {
        let mark = if ours.broken.contains(&strategy) { "!" } else { "" };
        format!("{}{mark}", text_of(ours.requests.get(&strategy).copied()))
    }));
    cells.push(match (ours.identities_hold(), ours.end) {
        (false, _) => "!".to_owned(),
        (true, TrialEnd::Finished) => "=".to_owned(),
        // In no mean of ours, as in none of the source.
        (true, end) => end.name().chars().take(4).collect(),
    });
    cells
}

/// What the marks mean.
pub(super) fn legend() -> String {
    let runs = format!(
        "each side {PUBLISHED_TRIALS} single random runs: rows do not correspond, identities must \
         hold within each"
    );
    [
        ("rows", runs.as_str()),
        (
            "identities",
            "full = N T; central = N (102 T + 2); limited = (N - 1) boundary (boundary is the \
             source's proposed approach)",
        ),
        ("=", "ours: all counts of processes equal the independent replay's, identities hold"),
        ("*", "source inconsistent: with two boards it prints limited = hierarchy = full"),
        ("!", "an identity does not hold"),
    ]
    .into_iter()
    .map(|(word, meaning)| wrap(&format!("{word:<12}"), meaning))
    .collect()
}
