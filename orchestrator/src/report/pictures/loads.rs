//! What pictures of open mode have in common: which rows they show, and under which names.
//!
//! Of a central strategy, which is measured at several asking intervals, the middle one is shown; the
//! others stand in the tables. `null` sends nothing, so that nothing is ever known under it.

use crate::report::svg::look::Mark;
use crate::report::svg::number::Unit;
use crate::results::loads::LoadFigures;
use crate::results::statistics::as_float;
use crate::results::summary::Summary;
use shared_types::wire::StrategyKind;
use std::collections::BTreeSet;

/// A row with its name and look.
pub(super) struct Shown<'a> {
    pub(super) row: &'a LoadFigures,
    pub(super) name: String,
    pub(super) mark: Mark,
}

/// Fleet sizes that were measured under load, ascending.
pub(super) fn sizes(summary: &Summary) -> Vec<u32> {
    let sizes: BTreeSet<u32> = summary.timing.loads.iter().map(|row| row.size).collect();
    sizes.into_iter().collect()
}

/// Loads of the fleets of `size`, in their order.
pub(super) fn loads(summary: &Summary, size: u32) -> Vec<&str> {
    let mut loads = Vec::new();
    for row in summary.timing.loads.iter().filter(|row| row.size == size) {
        if !loads.contains(&row.load.as_str()) {
            loads.push(&row.load);
        }
    }
    loads
}

/// One row a strategy that sends anything.
pub(super) fn shown<'a>(summary: &'a Summary, size: u32, load: &str) -> Vec<Shown<'a>> {
    let common_rate = common_rate(summary, size, load);
    let of_load = |row: &&LoadFigures| row.size == size && row.load == load && row.again == 0;
    let rows: Vec<&LoadFigures> = summary.timing.loads.iter().filter(of_load).collect();
    let strategies = StrategyKind::ALL.into_iter().filter(|&kind| kind != StrategyKind::Null);
    strategies
        .filter_map(|strategy| {
            let mut own: Vec<&LoadFigures> =
                rows.iter().copied().filter(|row| row.strategy == strategy).collect();
            own.sort_by_key(|row| row.asks_every_ns);
            let row = *own.get(own.len().saturating_sub(1) / 2)?;
            let mut name = strategy.name().to_owned();
            if let Some(every_ns) = row.asks_every_ns {
                name += &format!(" {}", Unit::Time.format(as_float(every_ns)));
            }
            if let Some(rate) = row.figures.value("offered-rate").filter(|_| common_rate.is_none())
            {
                name += &format!(", {}", Unit::PerSecond.format(rate));
            }
            if row.saturated.is_some() {
                name += ": saturated";
            }
            Some(Shown { row, name, mark: Mark::of(strategy) })
        })
        .collect()
}

/// `10 crafts, load common, 20 k/s offered`.
pub(super) fn title(summary: &Summary, size: u32, load: &str) -> String {
    let rate = common_rate(summary, size, load);
    let rate = rate.map_or_else(String::new, |rate| {
        format!(", {} offered to the fleet", Unit::PerSecond.format(rate))
    });
    format!("{size} crafts, load {load}{rate}")
}

/// The rate that is offered under every strategy; `None` for loads that are a share of each one's own
/// capacity.
fn common_rate(summary: &Summary, size: u32, load: &str) -> Option<f64> {
    let rows = summary.timing.loads.iter().filter(|row| row.size == size && row.load == load);
    let rates: Vec<f64> = rows.filter_map(|row| row.figures.value("offered-rate")).collect();
    let (first, rest) = rates.split_first()?;
    rest.iter().all(|rate| (rate / first - 1.0).abs() < 0.01).then_some(*first)
}

/// Why a panel of `lines` shows nothing.
pub(super) fn no_values<'a, 'b: 'a>(
    title: &str,
    lines: impl IntoIterator<Item = &'a Shown<'b>>,
) -> String {
    let mut lines = lines.into_iter().peekable();
    let is_any = lines.peek().is_some();
    let why = if is_any && lines.all(|line| line.row.saturated.is_some()) {
        "every strategy is saturated"
    } else {
        "too few events, or their histograms are lost"
    };
    format!("{title}: {why}")
}

/// What is wrong with the rows of `size`, as notes.
pub(super) fn warnings(summary: &Summary, size: u32) -> Vec<String> {
    let rows = || summary.timing.loads.iter().filter(move |row| row.size == size && row.again == 0);
    let mut notes = Vec::new();
    if rows().any(|row| row.asks_every_ns.is_some()) {
        notes.push(
            "The time behind a central strategy's name is how often a craft asks.".to_owned(),
        );
    }
    let mut note = |is_so: fn(&LoadFigures) -> bool, what: &str| {
        let named: Vec<String> = rows()
            .filter(|row| is_so(row))
            .map(|row| format!("{} at load {}", row.strategy, row.load))
            .collect();
        if !named.is_empty() {
            notes.push(format!("{what}: {}.", named.join(", ")));
        }
    };
    note(|row| row.saturated.is_some(), "Saturated, so without percentiles");
    note(|row| row.is_stationary == Some(false), "Not stationary, the second half was slower");
    note(|row| row.is_late, "The schedule's lateness exceeds half of the median: no winner named");
    if !summary.timing.host.is_clean() {
        notes
            .push("The host was noisy, or was not watched: these times name no winner.".to_owned());
    }
    notes
}
