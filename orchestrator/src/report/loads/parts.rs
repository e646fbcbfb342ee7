//! What time to knowledge is made of: its parts, and the hops that a change came over.

use super::{SIGNS, STAGE_SIGNS, sections};
use crate::report::table::{Table, column, exact, short};
use crate::results::loads::LoadFigures;
use crate::results::statistics::{Quantile, as_float};
use crate::results::summary::Summary;

pub(super) fn shares(summary: &Summary) -> Table {
    const PARTS: [&str; 3] = ["origin", "wake", "apply"];
    const FROM: [(&str, &str); 3] =
        [("p50", "from p50 on"), ("p99", "from p99 on"), ("p99.9", "from p99.9 on")];
    let mut columns = vec![column("", "strategy"), column("asks", "ms")];
    columns.extend(FROM.iter().flat_map(|(_, head)| PARTS.map(|part| column(head, part))));
    let mut table = Table::new(&columns);
    sections(summary, &mut table, |figures| {
        let cells = FROM.iter().flat_map(|(quantile, _)| {
            PARTS.map(|part| exact(figures.value(&format!("share-{quantile}-{part}")), 1))
        });
        cells.collect()
    });
    table
}

/// A row for each number of hops that changes of a row came over. Changes never known are in none.
pub(super) fn by_hops(summary: &Summary) -> Table {
    const SHOWN: [Quantile; 2] = [Quantile::P50, Quantile::P99];
    let mut columns = vec![column("", "strategy"), column("asks", "ms")];
    columns.extend([column("", "over"), column("", "n")]);
    for quantile in SHOWN {
        columns.extend(["value", "low", "high"].map(|head| column(quantile.name, head)));
    }
    let mut table = Table::new(&columns);
    let rows: Vec<&LoadFigures> =
        summary.timing.loads.iter().filter(|row| row.again == 0).collect();
    for rows in rows.chunk_by(|one, other| (one.size, &one.load) == (other.size, &other.load)) {
        if rows.iter().all(|row| row.by_hops().next().is_none()) {
            continue;
        }
        table.section(format!("{} crafts, load {}", rows[0].size, rows[0].load));
        for row in rows {
            let asks = row.asks_every_ns.map(|every_ns| as_float(every_ns) / 1e6);
            for over in row.by_hops() {
                let mut cells = vec![row.strategy.name().to_owned(), short(asks, SIGNS)];
                cells.extend([over.words().to_owned(), over.n.to_string()]);
                for quantile in SHOWN {
                    let figure = over.figure(quantile);
                    let value = figure.and_then(|figure| figure.value);
                    let (low, high) =
                        figure.map_or((None, None), |figure| (figure.low, figure.high));
                    let times = [value, low, high].map(|time| time.map(|ns| ns / 1e3));
                    cells.extend(times.map(|time| short(time, STAGE_SIGNS)));
                }
                table.row(cells);
            }
        }
    }
    table
}
