//! What a soak prints: a line a part, then what the processes took over time.

use super::Soaked;
use super::verdict::Thirds;
use super::watch::{Cost, Look};
use orchestrator::report::table::{Colour, DASH, Table, column};
use orchestrator::results::load::{LoadRecord, Saturation};
use orchestrator::results::statistics::Quantile;
use shared_types::wire::Stage;

/// Time to knowledge and the ledger of every part.
#[must_use]
pub fn parts(soaked: &Soaked) -> String {
    let times = "time to knowledge, us";
    let mut table = Table::new(&[
        column("", "part"),
        column("", "writes"),
        column("samples", "sent"),
        column("samples", "delivered"),
        column("", "lost"),
        column(times, "p50"),
        column(times, "p99"),
        column(times, "p99.9"),
        column(times, "max"),
        column("", "above capacity"),
    ]);
    soaked.run.loads.iter().for_each(|load| table.row(part(&load.record)));
    table.render(Colour::Never)
}

fn part(record: &LoadRecord) -> Vec<String> {
    let total = record.counts.total();
    let knowledge = record.stages.get(&Stage::Knowledge);
    let us = |ns: Option<u64>| ns.map_or_else(|| DASH.to_owned(), |ns| (ns / 1000).to_string());
    let at = |quantile| us(knowledge.and_then(|known| known.quantile_ns(quantile)));
    vec![
        record.load.clone(),
        record.writes.to_string(),
        total.transmissions.to_string(),
        total.deliveries.to_string(),
        (record.losses.gaps + record.losses.full_outboxes).to_string(),
        at(Quantile::P50),
        at(Quantile::P99),
        at(Quantile::P999),
        us(knowledge.map(|known| known.max_ns)),
        record.saturated.map_or(DASH, Saturation::name).to_owned(),
    ]
}

/// The largest value of each third of the time.
#[must_use]
pub fn resources(soaked: &Soaked) -> String {
    let mut table = Table::new(&[
        column("", "largest in each third"),
        column("third", "first"),
        column("third", "second"),
        column("third", "last"),
    ]);
    let largest =
        |value: fn(&Cost) -> u64| move |look: &Look| look.crafts.values().map(value).max();
    let sum =
        |value: fn(&Cost) -> u64| move |look: &Look| Some(look.crafts.values().map(value).sum());
    let mut row = |name: &str, thirds: Thirds, unit: u64| {
        let cells = thirds.0.map(|value| (value / unit).to_string());
        table.row([name.to_owned()].into_iter().chain(cells).collect());
    };
    let looks = &soaked.looks;
    row("resident, one craft, KiB", Thirds::of(looks, largest(|cost| cost.resident_bytes)), 1024);
    row(
        "proportional, one craft, KiB",
        Thirds::of(looks, largest(|cost| cost.proportional_bytes)),
        1024,
    );
    row(
        "proportional, all crafts, KiB",
        Thirds::of(looks, sum(|cost| cost.proportional_bytes)),
        1024,
    );
    row("descriptors, one craft", Thirds::of(looks, largest(|cost| cost.descriptors)), 1);
    row("descriptors, all crafts", Thirds::of(looks, sum(|cost| cost.descriptors)), 1);
    row("shared memory, KiB", Thirds::of(looks, |look| Some(look.shared_bytes)), 1024);
    row("shared memory, files", Thirds::of(looks, |look| Some(look.shared_files)), 1);
    table.render(Colour::Never)
}
