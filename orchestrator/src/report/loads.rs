//! The second half of the tables: what was known how soon under equal load, and at what cost.
//!
//! One line a strategy, load and asking interval, ratios to the strategy that all are compared with,
//! and, before everything else, where counting messages puts strategies in another order than measuring
//! does. Not here: turn times, and anything of a search for capacity.

mod parts;
mod simulated;

pub(super) use simulated::{legend as simulated_legend, of_cells as simulated_cells};

use super::pairs::{ratio_cell, ratio_line};
use super::table::{Colour, DASH, Table, column, exact, short, wrap};
use crate::results::figure::Figures;
use crate::results::inference::{Verdict, blocks_needed};
use crate::results::load_pairs::{ComparedLoad, LoadMetric, Orders, StampEffect};
use crate::results::loads::LoadFigures;
use crate::results::statistics::{Quantile, as_float};
use crate::results::summary::Summary;
use shared_types::wire::{Stage, StrategyKind};

/// Signs of a number of the first screen.
const SIGNS: usize = 4;
/// Signs of the width of an interval.
const SPREAD_SIGNS: usize = 3;
/// Signs of a number under `--all`.
const SIGNS_OF_ALL: usize = 6;
/// Signs of a stage's time.
const STAGE_SIGNS: usize = 5;
/// Fewest blocks for which ratios are worth a place on the first screen.
const BLOCKS_MIN: u64 = 2;

/// Whether the times of all loads are of a virtual clock.
pub(super) fn is_simulated(summary: &Summary) -> bool {
    summary.timing.loads.iter().any(|row| row.is_simulated)
}

/// Where the orders of strategies by count, by CPU and by time to knowledge are not the same; empty
/// where they are.
pub(super) fn disagreements(summary: &Summary) -> String {
    let disagreeing = summary.timing.orders.iter().filter(|orders| orders.disagree);
    disagreeing.map(disagreement).collect()
}

fn disagreement(orders: &Orders) -> String {
    let Orders { size, load, .. } = orders;
    let names = |order: &[StrategyKind]| {
        let names: Vec<&str> = order.iter().map(|strategy| strategy.name()).collect();
        if names.is_empty() { DASH.to_owned() } else { names.join(" < ") }
    };
    let what = format!(
        "{size} crafts, load {load}: counting messages and measuring disagree on the order, least first \
         (by value alone)"
    );
    let mut text = wrap("", &what);
    for (by, order) in
        [("by samples", &orders.by_count), ("by CPU", &orders.by_cpu), ("by p99", &orders.by_p99)]
    {
        text += &wrap(&format!("  {by:<12}"), &names(order));
    }
    text
}

/// Everything of the first screen about loads; empty for a run without any.
pub(super) fn first_screen(summary: &Summary, colour: Colour) -> String {
    if summary.timing.loads.is_empty() {
        return String::new();
    }
    let table = if is_simulated(summary) { simulated::main_table } else { main_table };
    let mut text = format!("\n{}", table(summary).render(colour));
    text += &marks(summary);
    text += &ratios(summary, colour);
    text += &stamps(summary);
    text
}

/// One line a strategy, load and asking interval.
pub(super) fn main_table(summary: &Summary) -> Table {
    let mut table = Table::new(&[
        column("", "strategy"),
        column("asks", "ms"),
        column("time to knowledge, us", "p50"),
        column("time to knowledge, us", "+-%"),
        column("time to knowledge, us", "p99"),
        column("time to knowledge, us", "p99.9"),
        column("late", "p50"),
        column("per needed application", "CPU"),
        column("per needed application", "over"),
        column("per needed application", "trans"),
        column("per needed application", "bytes"),
        column("reads", "stale"),
    ]);
    sections(summary, &mut table, |figures| {
        let time = |metric: &str| short(figures.value(metric).map(|ns| ns / 1e3), SIGNS);
        let count = |metric: &str| short(figures.value(metric), SIGNS);
        let stale = short(figures.value("stale-reads-share"), SIGNS);
        vec![
            time("knowledge-p50"),
            short(figures.value("knowledge-p50-spread"), SPREAD_SIGNS),
            time("knowledge-p99"),
            time("knowledge-p99.9"),
            time("schedule-p50"),
            time("cpu-per-application"),
            time("cpu-per-application-over-null"),
            count("transmissions-per-application"),
            count("bytes-per-application"),
            if stale == DASH { stale } else { format!("{stale}%") },
        ]
    });
    table
}

/// Rows of every size and load; `values` gives the cells after name and asking interval. Of a row above
/// capacity the first of them says so.
fn sections(summary: &Summary, table: &mut Table, values: impl Fn(&Figures) -> Vec<String>) {
    let rows: Vec<&LoadFigures> =
        summary.timing.loads.iter().filter(|row| row.again == 0).collect();
    for rows in rows.chunk_by(|one, other| (one.size, &one.load) == (other.size, &other.load)) {
        table.section(heading(rows));
        for row in rows {
            table.row(with_values(row, values(&row.figures)));
        }
    }
}

/// Name, asking interval and `values` of a row.
fn with_values(row: &LoadFigures, values: Vec<String>) -> Vec<String> {
    let asks = row.asks_every_ns.map(|every_ns| as_float(every_ns) / 1e6);
    let mut cells = vec![row.strategy.name().to_owned(), short(asks, SIGNS)];
    cells.extend(values);
    if row.saturated.is_some() {
        "saturated".clone_into(&mut cells[2]);
    }
    cells
}

/// `10 crafts, load common: 2000 writes/s, needed by 0.90 others, 3 blocks, n 2688`.
fn heading(rows: &[&LoadFigures]) -> String {
    let first = rows[0];
    let value = |metric: &str| first.figures.value(metric);
    let blocks = first.figures.get("offered-rate").map_or(0, |figure| figure.n);
    let plural = if blocks == 1 { "" } else { "s" };
    format!(
        "{} crafts, load {}: {} writes/s, needed by {} others, {blocks} block{plural}, n {}",
        first.size,
        first.load,
        exact(value("offered-rate"), 0),
        exact(value("copies"), 2),
        exact(value("needed"), 0),
    )
}

/// What is marked in the rows, a line each.
fn marks(summary: &Summary) -> String {
    let mut text = String::new();
    for row in summary.timing.loads.iter().filter(|row| row.again == 0) {
        let asks =
            row.asks_every_ns.map(|every_ns| format!(" asking every {} us", every_ns / 1000));
        let name = format!("{}{} at {}", row.strategy, asks.unwrap_or_default(), row.load);
        let mut say = |what: String| text += &wrap("! ", &format!("{name}: {what}"));
        if let Some(why) = row.saturated {
            say(format!("saturated, {}", why.name()));
        } else if row.saturated_blocks > 0 {
            say(format!(
                "saturated in {} block(s), which stand in its figures",
                row.saturated_blocks
            ));
        }
        if row.is_stationary == Some(false) {
            let ratio = exact(row.figures.value("second-half-ratio"), 2);
            say(format!("not stationary, second half {ratio} of the first"));
        }
        if row.is_late {
            say("the schedule was late, no winner on latency".to_owned());
        }
        if row.is_disturbed {
            let cpu = exact(row.figures.value("orchestrator-cpu"), 2);
            say(format!("the orchestrator used {cpu} % of a core"));
        }
    }
    text
}

/// What stamping every stage does to time to knowledge, a line a load and quantile.
fn stamps(summary: &Summary) -> String {
    let lines = summary.timing.stamp_effects.iter().map(|effect| {
        let StampEffect { size, load, metric, is_within, comparison } = effect;
        let (low, high) = comparison.interval.unzip();
        let [ratio, low, high] = [Some(comparison.ratio), low, high].map(|value| exact(value, 3));
        let said = match is_within {
            Some(true) => "within 0.95-1.05",
            Some(false) => "NOT within 0.95-1.05",
            None => "no interval",
        };
        format!(
            "stamps, {size} crafts, {load}: {} with over without {ratio} ({low}-{high}): {said}\n",
            metric.name()
        )
    });
    lines.collect()
}

/// Every compared strategy beside the base, one line a strategy and load.
fn ratios(summary: &Summary, colour: Colour) -> String {
    let compared = &summary.timing.compared_loads;
    let Some(blocks) = compared.iter().map(|pair| pair.comparison.blocks).max() else {
        return String::new();
    };
    if blocks < BLOCKS_MIN {
        return String::new();
    }
    let mut text = String::new();
    for row in
        summary.timing.loads.chunk_by(|one, other| one.load == other.load && one.size == other.size)
    {
        let (size, load) = (row[0].size, &row[0].load);
        let pairs: Vec<&ComparedLoad> =
            compared.iter().filter(|pair| (pair.size, &pair.load) == (size, load)).collect();
        if let Some(first) = pairs.first() {
            let title =
                format!("{size} crafts, load {load}, over {}, and 95 % interval", first.base);
            text += &format!("\n{}\n{}", colour.heading(&title), section(&pairs));
        }
    }
    text + &meaning(compared)
}

fn section(pairs: &[&ComparedLoad]) -> String {
    let heads = ["knowledge p50 ", "knowledge p99 ", "CPU "].map(str::to_owned);
    let mut text = ratio_line("", heads.into_iter());
    let of = |metric: LoadMetric, strategy: StrategyKind| {
        pairs.iter().find(|pair| (pair.metric, pair.strategy) == (metric, strategy))
    };
    for strategy in StrategyKind::ALL {
        let cells = LoadMetric::ALL.map(|metric| {
            of(metric, strategy).map_or_else(String::new, |pair| {
                let cell = ratio_cell(&pair.comparison);
                let is_named = pair.comparison.verdict == Verdict::Winner && pair.is_late;
                if is_named { cell.replace(['<', '>'], "l") } else { cell }
            })
        });
        if cells.iter().any(|cell| !cell.is_empty()) {
            text += &ratio_line(strategy.name(), cells.into_iter());
        }
    }
    let floors = LoadMetric::ALL.map(|metric| {
        let of_metric = pairs.iter().filter(|pair| pair.metric == metric);
        let floor = of_metric.filter_map(|pair| pair.comparison.floor).next();
        format!("{} ", short(floor, SIGNS))
    });
    text + &ratio_line("A-A floor", floors.into_iter())
}

fn meaning(compared: &[ComparedLoad]) -> String {
    let has = |verdict| compared.iter().any(|pair| pair.comparison.verdict == verdict);
    let mut text = String::new();
    if has(Verdict::Noisy) {
        text += "the host was noisy: no winner under load is named\n";
    }
    if has(Verdict::TooFewBlocks) {
        let (count, needed) = (compared.len(), blocks_needed(compared.len()));
        text += &format!(
            "too few blocks to name a winner among {count} comparisons: `--blocks {needed}` may\n"
        );
    }
    if compared.iter().any(|pair| pair.is_late) {
        text += "l: the schedule was late, so that no winner on latency is named\n";
    }
    text
}

/// What the columns mean.
pub(super) fn legend(summary: &Summary) -> String {
    if summary.timing.loads.is_empty() {
        return String::new();
    }
    if is_simulated(summary) {
        return simulated::legend();
    }
    [
        (
            "knowledge",
            "intended to applied at a board that shares it; +-%: half its interval, in %",
        ),
        ("late", "intended to made at the origin, us, part of it"),
        (
            "application",
            "a change at one other board that shares its fact; CPU in us, excess over null",
        ),
        ("stale", "reads that missed a write by another, intended before them"),
    ]
    .into_iter()
    .map(|(word, meaning)| wrap(&format!("{word:<14}"), meaning))
    .collect()
}

/// The tables under `--all`: quantiles with their intervals, stages, shares, costs, recovery.
pub(super) fn details(summary: &Summary) -> Vec<(&'static str, Table)> {
    if is_simulated(summary) {
        return vec![
            ("Time to knowledge, us of the virtual clock", knowledge(summary)),
            ("Time to knowledge by hops, us of the virtual clock", parts::by_hops(summary)),
            ("What links and recovery did, sums over blocks", parts::recovered(summary)),
            ("Simulated, a needed application", simulated::costs(summary)),
        ];
    }
    vec![
        ("Time to knowledge, us", knowledge(summary)),
        ("Time to knowledge and CPU, us, 95 % intervals over blocks", intervals(summary)),
        ("Stages, us, p50", stages(summary, Quantile::P50)),
        ("Stages, us, p99", stages(summary, Quantile::P99)),
        ("Median share of the parts of time to knowledge, %", parts::shares(summary)),
        ("Time to knowledge by hops, us, 95 % intervals over blocks", parts::by_hops(summary)),
        ("Under load, a needed application", parts::costs(summary)),
        ("What recovery did, sums over blocks", parts::recovered(summary)),
    ]
}

fn microseconds(figures: &Figures, metric: &str) -> String {
    short(figures.value(metric).map(|ns| ns / 1e3), SIGNS_OF_ALL)
}

fn knowledge(summary: &Summary) -> Table {
    let mut columns = vec![column("", "strategy"), column("asks", "ms"), column("", "n")];
    columns.extend(Quantile::ALL.iter().map(|quantile| column("", quantile.name)));
    columns.extend([column("", "max"), column("", "halves")]);
    let mut table = Table::new(&columns);
    sections(summary, &mut table, |figures| {
        let n = figures.get("knowledge-p50").map_or(0, |figure| figure.n);
        let mut cells = vec![if n == 0 { DASH.to_owned() } else { n.to_string() }];
        let quantiles = Quantile::ALL.iter();
        cells.extend(quantiles.map(|q| microseconds(figures, &format!("knowledge-{}", q.name))));
        cells.push(microseconds(figures, "knowledge-max"));
        cells.push(exact(figures.value("second-half-ratio"), 2));
        cells
    });
    table
}

fn intervals(summary: &Summary) -> Table {
    const SHOWN: [(&str, &str); 3] = [
        ("p50", "knowledge-p50"),
        ("p99", "knowledge-p99"),
        ("CPU over null", "cpu-per-application-over-null"),
    ];
    let mut columns = vec![column("", "strategy"), column("asks", "ms")];
    columns.extend(SHOWN.iter().flat_map(|(name, _)| [column(name, "low"), column(name, "high")]));
    let mut table = Table::new(&columns);
    sections(summary, &mut table, |figures| {
        let ends = SHOWN.iter().flat_map(|(_, metric)| {
            let figure = figures.get(metric);
            [figure.and_then(|figure| figure.low), figure.and_then(|figure| figure.high)]
        });
        ends.map(|end| short(end.map(|ns| ns / 1e3), SIGNS_OF_ALL)).collect()
    });
    table
}

/// Every stage at one quantile.
fn stages(summary: &Summary, quantile: Quantile) -> Table {
    const SHOWN: [(&str, &str, Stage); 7] = [
        ("", "schedule", Stage::Schedule),
        ("", "publish", Stage::Publish),
        ("wake", "same", Stage::WakeSameCore),
        ("wake", "other", Stage::WakeOtherCore),
        ("wake", "relayed", Stage::WakeRelayed),
        ("", "apply", Stage::Apply),
        ("at", "centre", Stage::AppliedAtCentre),
    ];
    let mut columns = vec![column("", "strategy"), column("asks", "ms")];
    columns.extend(SHOWN.iter().map(|(group, head, _)| column(group, head)));
    let mut table = Table::new(&columns);
    sections(summary, &mut table, |figures| {
        let metric = |stage: Stage| format!("{}-{}", stage.name(), quantile.name);
        let cells = SHOWN.iter().map(|(_, _, stage)| {
            short(figures.value(&metric(*stage)).map(|ns| ns / 1e3), STAGE_SIGNS)
        });
        cells.collect()
    });
    table
}
