//! What a soak prints: a line a part, what was made up for, how successors came, and what the processes
//! took over time.

use super::Soaked;
use super::flat::{Thirds, middle};
use super::ledger::{self, Successor};
use super::watch::{Cost, Look};
use orchestrator::report::table::{Colour, DASH, Table, column};
use orchestrator::results::load::{LoadRecord, LoadRecovery, Saturation};
use orchestrator::results::statistics::{Quantile, as_float};
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

/// What befell the fleet in every part, and what was made up for.
#[must_use]
pub fn repaired(soaked: &Soaked) -> String {
    let mut table = Table::new(&[
        column("", "part"),
        column("", "deaths"),
        column("records", "missed"),
        column("lost on links", "samples"),
        column("lost on links", "%"),
        column("", "sent again"),
        column("", "given up"),
        column("changes", "from states"),
        column("states", "missed"),
    ]);
    for load in &soaked.run.loads {
        let Some(recovery) = load.record.recovery else { continue };
        table.row(repaired_part(&load.record, &recovery));
    }
    table.render(Colour::Never)
}

fn repaired_part(record: &LoadRecord, recovery: &LoadRecovery) -> Vec<String> {
    let LoadRecovery {
        deaths,
        records_missed,
        repeats,
        given_up,
        learnt,
        states_missed,
        links,
        dropped: _,
    } = *recovery;
    let lost_on_link = links.lost;
    let on_links = lost_on_link + ledger::received(record);
    let share = 100.0 * as_float(lost_on_link) / as_float(on_links.max(1));
    vec![
        record.load.clone(),
        deaths.to_string(),
        records_missed.to_string(),
        lost_on_link.to_string(),
        format!("{share:.2}"),
        repeats.to_string(),
        given_up.to_string(),
        learnt.to_string(),
        states_missed.to_string(),
    ]
}

/// How all successors came.
#[must_use]
pub fn successors(soaked: &Soaked) -> String {
    let successors: Vec<Successor> = ledger::successors(&soaked.run).collect();
    let mut table = Table::new(&[
        column("", "ms from when a death was noticed"),
        column("", "n"),
        column("", "middle"),
        column("", "largest"),
    ]);
    let mut row = |name: &str, value: fn(&Successor) -> Option<u64>| {
        let times = || successors.iter().filter_map(value);
        let ms = |ns: u64| format!("{:.1}", as_float(ns) / 1e6);
        table.row(vec![
            name.to_owned(),
            times().count().to_string(),
            ms(middle(times())),
            ms(times().max().unwrap_or(0)),
        ]);
    };
    row("heard of by the others", |successor| successor.peers_noticed_ns);
    row("reclaimed", |successor| Some(successor.reclaimed_ns));
    row("restarted", |successor| Some(successor.ready_ns));
    row("connected", |successor| Some(successor.rejoined_ns));
    row("caught up", |successor| successor.caught_up_ns);
    table.render(Colour::Never)
}

/// The middle value of each third of the time.
#[must_use]
pub fn resources(soaked: &Soaked) -> String {
    let mut table = Table::new(&[
        column("", "middle value of each third"),
        column("third", "first"),
        column("third", "second"),
        column("third", "last"),
    ]);
    let largest = |value: fn(&Cost) -> u64| {
        move |look: &Look| look.crafts.values().map(value).max().unwrap_or(0)
    };
    let sum = |value: fn(&Cost) -> u64| move |look: &Look| look.crafts.values().map(value).sum();
    let looks = &soaked.looks;
    let mut row = |name: &str, value: &dyn Fn(&Look) -> u64, unit: u64| {
        let cells = Thirds::of(looks.iter().map(value)).0.map(|value| (value / unit).to_string());
        table.row([name.to_owned()].into_iter().chain(cells).collect());
    };
    row("resident, largest craft, KiB", &largest(|cost| cost.resident_bytes), 1024);
    row("proportional, largest craft, KiB", &largest(|cost| cost.proportional_bytes), 1024);
    row("proportional, all crafts, KiB", &sum(|cost| cost.proportional_bytes), 1024);
    row("descriptors, largest craft", &largest(|cost| cost.descriptors), 1);
    row("descriptors, all crafts", &sum(|cost| cost.descriptors), 1);
    row("resident, orchestrator, KiB", &|look| look.orchestrator.resident_bytes, 1024);
    row("descriptors, orchestrator", &|look| look.orchestrator.descriptors, 1);
    row("shared memory, KiB", &|look| look.shared_bytes, 1024);
    row("shared memory, files", &|look| look.shared_files, 1);
    table.render(Colour::Never)
}
