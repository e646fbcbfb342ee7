//! The table of the highest loads that were borne: one line a strategy, one column a burst.

use super::table::{Colour, DASH, Table, column, head, short, wrap};
use crate::results::borne::Borne;
use crate::results::statistics::as_float;
use crate::results::summary::Summary;
use std::collections::{BTreeMap, BTreeSet};

/// Signs of a rate.
const SIGNS: usize = 4;

/// Table and legend; empty for a run without a search.
pub(super) fn capacities(summary: &Summary, colour: Colour) -> String {
    let table = table(summary);
    if table.is_empty() {
        return String::new();
    }
    let legend = wrap(
        "capacity      ",
        "the highest offered rate at which 99.9 % of the changes were known by the end, no outbox was \
         full and the schedule lagged by less than 1 ms at p99, as changes applied at other boards a \
         second, whole fleet; median of the blocks. > if the highest rate that is tried was borne",
    );
    format!("\n{}{legend}", table.render(colour))
}

/// One line a size and strategy: asking interval, and for each burst the median and the lowest and highest
/// block, thousands a second.
pub(super) fn table(summary: &Summary) -> Table {
    let borne = Borne::of(&summary.timing.capacities);
    let bursts: BTreeSet<u32> = borne.iter().map(|row| row.burst).collect();
    let mut columns = vec![column("", "strategy"), column("asks", "ms"), head("blocks")];
    for burst in &bursts {
        columns.push(head(&format!("{burst} a time")));
        columns.push(head("range"));
    }
    let mut table = Table::new(&columns);
    let mut sizes: BTreeMap<u32, Vec<Borne>> = BTreeMap::new();
    for row in borne {
        sizes.entry(row.size).or_default().push(row);
    }
    for (size, rows) in sizes {
        table.section(format!("{size} crafts, capacity in thousands of applied changes a second"));
        let strategies: BTreeSet<_> = rows.iter().map(|row| row.strategy).collect();
        for strategy in strategies {
            let of_burst: BTreeMap<u32, &Borne> = rows
                .iter()
                .filter(|row| row.strategy == strategy)
                .map(|row| (row.burst, row))
                .collect();
            table.row(line(strategy.name(), &of_burst, &bursts));
        }
    }
    table
}

fn line(name: &str, of_burst: &BTreeMap<u32, &Borne>, bursts: &BTreeSet<u32>) -> Vec<String> {
    let asks: BTreeSet<u64> = of_burst.values().filter_map(|row| row.asks_every_ns).collect();
    let asks: Vec<String> =
        asks.into_iter().map(|every_ns| short(Some(as_float(every_ns) / 1e6), SIGNS)).collect();
    let blocks = of_burst.values().map(|row| row.per_s.len()).max().unwrap_or(0);
    let asks = if asks.is_empty() { DASH.to_owned() } else { asks.join("/") };
    let mut cells = vec![name.to_owned(), asks, blocks.to_string()];
    for burst in bursts {
        let row = of_burst.get(burst);
        let thousands = |per_s: f64| short(Some(per_s / 1e3), SIGNS);
        let median = row.and_then(|row| Some((row.median()?, row.ceilings > 0)));
        cells.push(median.map_or_else(
            || DASH.to_owned(),
            |(per_s, is_above)| format!("{}{}", if is_above { ">" } else { "" }, thousands(per_s)),
        ));
        let range = row.and_then(|row| row.range());
        cells.push(range.map_or_else(
            || DASH.to_owned(),
            |(low, high)| format!("{}-{}", thousands(low), thousands(high)),
        ));
    }
    cells
}
