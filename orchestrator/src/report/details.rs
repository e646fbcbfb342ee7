//! Everything that the first screen leaves out: all quantiles, costs, counts, crafts and trials.

use super::incidents::{loss_text, losses};
use super::loads;
use super::table::{Colour, DASH, Table, clip, column, exact, short, wrap};
use crate::results::figure::Figures;
use crate::results::statistics::Quantile;
use crate::results::summary::Summary;
use shared_types::wire::StrategyKind;

/// Signs of the numbers of these tables.
const SIGNS: usize = 6;

/// Signs of means of counts.
const COUNT_SIGNS: usize = 5;

/// Signs of whole sums.
const SUM_SIGNS: usize = 8;

/// Signs of a craft's name.
const NAME_SIGNS: usize = 20;

/// All tables under `--all`.
pub(super) fn details(summary: &Summary, colour: Colour) -> String {
    let mut text = String::new();
    let turns = [
        ("Turn time, us", quantiles(summary)),
        ("Turn time, us, 95 % intervals over blocks", intervals(summary)),
        ("Excess of turn time over null, us", excess(summary)),
        ("Cost", costs(summary)),
        ("Counts, means a trial", counts(summary)),
        ("Crafts, sums over all trials", crafts(summary)),
        ("Thinking, a trial", thinking(summary)),
        ("Trials", trials(summary)),
    ];
    let parts: Vec<(&str, Table)> = turns.into_iter().chain(loads::details(summary)).collect();
    for (title, table) in parts.iter().filter(|(_, table)| !table.is_empty()) {
        text += &format!("\n{}\n{}", colour.heading(title), table.render(colour));
    }
    text += "\n";
    text + &wrap("lost, refused, waiting: ", &loss_text(&losses(summary)))
}

/// One row per timed cell; `value` gives the cells after the strategy.
fn timed(
    summary: &Summary,
    table: &mut Table,
    is_wanted: impl Fn(&Figures) -> bool,
    values: impl Fn(&Figures) -> Vec<String>,
) {
    for size in summary.sizes() {
        let rows: Vec<(StrategyKind, &Figures)> = summary
            .timing
            .cells
            .iter()
            .filter(|cell| cell.size == size && is_wanted(&cell.figures))
            .map(|cell| (cell.strategy, &cell.figures))
            .collect();
        if rows.is_empty() {
            continue;
        }
        table.section(format!("{size} crafts"));
        for (strategy, figures) in rows {
            let mut cells = vec![strategy.name().to_owned()];
            cells.extend(values(figures));
            table.row(cells);
        }
    }
}

fn microseconds(figures: &Figures, metric: &str) -> String {
    short(figures.value(metric).map(|ns| ns / 1e3), SIGNS)
}

/// A ratio with three decimals where they fit.
fn ratio(value: Option<f64>) -> String {
    let text = exact(value, 3);
    if text.len() <= SIGNS { text } else { short(value, SIGNS) }
}

/// A sum of counts, all its digits where they fit.
fn whole(value: Option<f64>) -> String {
    let text = exact(value, 0);
    if text.len() <= SUM_SIGNS { text } else { short(value, SUM_SIGNS) }
}

fn quantiles(summary: &Summary) -> Table {
    let mut columns = vec![column("", "strategy"), column("", "n"), column("", "min")];
    columns.extend(Quantile::ALL.iter().map(|quantile| column("", quantile.name)));
    columns.extend([column("", "max"), column("", "mean"), column("", "halves")]);
    let mut table = Table::new(&columns);
    let is_timed = |figures: &Figures| figures.get("turn-time-p50").is_some();
    timed(summary, &mut table, is_timed, |figures| {
        let n = figures.get("turn-time-p50").map_or(0, |figure| figure.n);
        let mut cells = vec![n.to_string(), microseconds(figures, "turn-time-min")];
        cells.extend(
            Quantile::ALL
                .iter()
                .map(|quantile| microseconds(figures, &format!("turn-time-{}", quantile.name))),
        );
        cells.push(microseconds(figures, "turn-time-max"));
        cells.push(microseconds(figures, "turn-time-mean"));
        cells.push(exact(figures.value("second-half-ratio"), 2));
        cells
    });
    table
}

fn intervals(summary: &Summary) -> Table {
    const SHOWN: [(&str, &str); 4] = [
        ("p50", "turn-time-p50"),
        ("p99", "turn-time-p99"),
        ("p50 over null", "turn-time-p50-over-null"),
        ("CPU over null", "cpu-per-turn-over-null"),
    ];
    let mut columns = vec![column("", "strategy")];
    columns.extend(SHOWN.iter().flat_map(|(name, _)| [column(name, "low"), column(name, "high")]));
    let mut table = Table::new(&columns);
    let has_interval =
        |figures: &Figures| figures.get("turn-time-p50").is_some_and(|figure| figure.low.is_some());
    timed(summary, &mut table, has_interval, |figures| {
        let ends = SHOWN.iter().flat_map(|(_, metric)| {
            let figure = figures.get(metric);
            [figure.and_then(|figure| figure.low), figure.and_then(|figure| figure.high)]
        });
        ends.map(|end| short(end.map(|ns| ns / 1e3), SIGNS)).collect()
    });
    table
}

fn excess(summary: &Summary) -> Table {
    let mut columns = vec![column("", "strategy")];
    columns.extend(Quantile::ALL.iter().map(|quantile| column("", quantile.name)));
    let mut table = Table::new(&columns);
    let has_floor = |figures: &Figures| figures.value("turn-time-p50-over-null").is_some();
    timed(summary, &mut table, has_floor, |figures| {
        Quantile::ALL
            .iter()
            .map(|quantile| {
                microseconds(figures, &format!("turn-time-{}-over-null", quantile.name))
            })
            .collect()
    });
    table
}

fn costs(summary: &Summary) -> Table {
    let mut table = Table::new(&[
        column("", "strategy"),
        column("CPU a turn, us", "fleet"),
        column("CPU a turn, us", "over"),
        column("CPU a turn, us", "orch."),
        column("ledger a turn", "samples"),
        column("ledger a turn", "bytes"),
        column("res. MB", "fleet"),
        column("res. MB", "max"),
        column("ms", "ready"),
        column("", "procs"),
        column("", "warm"),
    ]);
    let is_timed = |figures: &Figures| figures.get("cpu-per-turn").is_some();
    timed(summary, &mut table, is_timed, |figures| {
        let scaled = |metric: &str, scale: f64| {
            short(figures.value(metric).map(|value| value / scale), SIGNS)
        };
        vec![
            microseconds(figures, "cpu-per-turn"),
            microseconds(figures, "cpu-per-turn-over-null"),
            microseconds(figures, "orchestrator-cpu-per-turn"),
            scaled("control-per-turn", 1.0),
            scaled("control-bytes-per-turn", 1.0),
            scaled("resident", 1e6),
            scaled("resident-max", 1e6),
            scaled("ready", 1e6),
            exact(figures.value("processes"), 0),
            exact(figures.value("warm-up-turns"), 0),
        ]
    });
    table
}

fn counts(summary: &Summary) -> Table {
    let mut table = Table::new(&[
        column("", "strategy"),
        column("", "turns"),
        column("", "fired"),
        column("", "bound"),
        column("", "idle"),
        column("requests", "ours"),
        column("requests", "replay"),
        column("over", "full"),
        column("over", "bound."),
        column("", "reply"),
        column("", "confl"),
    ]);
    for size in summary.sizes() {
        table.section(format!("{size} crafts"));
        for cell in summary.deterministic.cells.iter().filter(|cell| cell.size == size) {
            let mean = |metric| short(cell.figures.value(metric), COUNT_SIGNS);
            table.row(vec![
                cell.strategy.name().to_owned(),
                mean("turns"),
                mean("firings"),
                mean("boundary-firings"),
                mean("idle-turns"),
                mean("requests"),
                mean("requests-expected"),
                ratio(cell.figures.value("requests-to-full")),
                ratio(cell.figures.value("requests-to-boundary")),
                mean("replies"),
                mean("conflicts"),
            ]);
        }
    }
    table
}

fn crafts(summary: &Summary) -> Table {
    let mut table = Table::new(&[
        column("", "craft"),
        column("", "firings"),
        column("", "bound."),
        column("requests", "ours "),
        column("requests", "replay"),
        column("", "deliv"),
        column("", "bytes"),
        column("", "hops"),
    ]);
    let mut above = None;
    for cell in &summary.deterministic.crafts {
        if above != Some((cell.size, cell.strategy)) {
            table.section(format!("{} crafts, {}", cell.size, cell.strategy));
            above = Some((cell.size, cell.strategy));
        }
        let sum = |metric| whole(cell.figures.value(metric));
        let mark = if cell.agrees_with_oracle { '=' } else { '!' };
        table.row(vec![
            clip(&cell.name, NAME_SIGNS),
            sum("firings"),
            sum("boundary-firings"),
            format!("{}{mark}", sum("requests")),
            sum("requests-expected"),
            sum("deliveries"),
            sum("bytes"),
            sum("hops"),
        ]);
    }
    table
}

fn thinking(summary: &Summary) -> Table {
    let mut table = Table::new(&[
        column("", "craft"),
        column("", "plans"),
        column("", "costs"),
        column("needed", "facts"),
        column("needed", "rules"),
        column("needed", "acts"),
        column("", "prune"),
        column("", "slices"),
        column("", "items"),
        column("", "moved"),
        column("us", "prune"),
        column("us", "maint"),
    ]);
    let mut above = None;
    for cell in &summary.timing.reasoning {
        if above != Some((cell.size, cell.strategy)) {
            table.section(format!("{} crafts, {}", cell.size, cell.strategy));
            above = Some((cell.size, cell.strategy));
        }
        let mean = |metric| short(cell.figures.value(metric), COUNT_SIGNS);
        let us = |metric| short(cell.figures.value(metric).map(|ns| ns / 1e3), COUNT_SIGNS);
        table.row(vec![
            clip(&cell.name, NAME_SIGNS),
            mean("reasoning-plans"),
            mean("reasoning-costs-changed"),
            mean("reasoning-kept-facts"),
            mean("reasoning-kept-rules"),
            mean("reasoning-kept-actions"),
            mean("reasoning-prunings"),
            mean("reasoning-slices"),
            mean("reasoning-looked-at"),
            mean("reasoning-moved"),
            us("reasoning-prune"),
            us("reasoning-maintain"),
        ]);
    }
    table
}

fn trials(summary: &Summary) -> Table {
    let mut table = Table::new(&[
        column("", "trial"),
        column("", "end"),
        column("", "turns"),
        column("", "firings"),
        column("", "bound."),
        column("requests", "ours "),
        column("requests", "replay"),
        column("", "hops"),
        column("", "path digest"),
    ]);
    let mut above = None;
    for facts in &summary.deterministic.trials {
        let cell = facts.cell;
        if above != Some(cell) {
            let block =
                if cell.block == 0 { String::new() } else { format!(", block {}", cell.block) };
            table.section(format!("{} crafts, {}{block}", cell.size, cell.strategy));
            above = Some(cell);
        }
        let mark = if facts.agrees_with_oracle() { '=' } else { '!' };
        let digest = facts.path_digest.to_string();
        table.row(vec![
            facts.trial.to_string(),
            facts.end.name().to_owned(),
            facts.turns.to_string(),
            facts.firings.to_string(),
            facts.boundary_firings.to_string(),
            format!("{}{mark}", facts.measured.replication.requests),
            facts.expected.replication.requests.to_string(),
            facts.hops.to_string(),
            if facts.path_digest.0 == 0 { DASH.to_owned() } else { digest },
        ]);
    }
    table
}
