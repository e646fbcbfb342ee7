//! What time to knowledge is made of, its parts and the hops that a change came over; what it costs; and what
//! recovery did.

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

/// A row for each one in which recovery did anything.
pub(super) fn recovered(summary: &Summary) -> Table {
    const SHOWN: [(&str, &str, &str); 8] = [
        ("", "deaths", "recovery-deaths"),
        ("records", "missed", "recovery-records-missed"),
        ("lost", "links", "recovery-lost-on-link"),
        ("lost", "dropped", "recovery-dropped"),
        ("", "again", "recovery-repeats"),
        ("given", "up", "recovery-given-up"),
        ("states", "learnt", "recovery-learnt"),
        ("states", "missed", "recovery-states-missed"),
    ];
    let mut columns = vec![column("", "strategy"), column("asks", "ms")];
    columns.extend(SHOWN.iter().map(|(group, head, _)| column(group, head)));
    let mut table = Table::new(&columns);
    let values = |row: &LoadFigures| SHOWN.map(|(_, _, metric)| row.figures.value(metric));
    let has_any = |row: &&LoadFigures| {
        row.again == 0 && values(row).into_iter().flatten().any(|value| value > 0.0)
    };
    let rows: Vec<&LoadFigures> = summary.timing.loads.iter().filter(has_any).collect();
    for rows in rows.chunk_by(|one, other| (one.size, &one.load) == (other.size, &other.load)) {
        table.section(format!("{} crafts, load {}", rows[0].size, rows[0].load));
        for row in rows {
            let asks = row.asks_every_ns.map(|every_ns| as_float(every_ns) / 1e6);
            let mut cells = vec![row.strategy.name().to_owned(), short(asks, SIGNS)];
            cells.extend(values(row).map(|value| exact(value, 0)));
            table.row(cells);
        }
    }
    table
}

/// What a needed application costs besides CPU time, and what became of the rest.
pub(super) fn costs(summary: &Summary) -> Table {
    let mut table = Table::new(&[
        column("", "strategy"),
        column("asks", "ms"),
        column("", "requ."),
        column("", "trans"),
        column("", "bytes"),
        column("", "sleeps"),
        column("delay", "us"),
        column("rec.", "p50"),
        column("known", "%"),
        column("", "cens."),
        column("stale", "us"),
    ]);
    sections(summary, &mut table, |figures| {
        let count = |metric: &str| short(figures.value(metric), SIGNS);
        let time = |metric: &str| short(figures.value(metric).map(|ns| ns / 1e3), SIGNS);
        vec![
            count("requests-per-application"),
            count("transmissions-per-application"),
            count("bytes-per-application"),
            count("sleeps-per-application"),
            time("run-delay-per-application"),
            count("records-per-sample-p50"),
            exact(figures.value("applied-by-end-share"), 1),
            count("censored"),
            time("staleness-p50"),
        ]
    });
    table
}
