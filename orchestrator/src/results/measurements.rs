//! The long form of every measurement: `measurements.csv`, one value a row.
//!
//! A row names block, size, strategy, phase (`counted`, `timed`, `loaded` or `capacity`), load, asking
//! interval, trial and craft; the craft is `fleet` for a sum over all processes, and what does not apply
//! is empty. Values are exact: counts as printed integers, times in ns, memory in bytes.
//! docs/data-dictionary.md explains the metrics; other programs recompute the tables from this file and
//! the interval logs.

use super::load::{CapacityRecord, LoadRecord, SimulatedInterval};
use super::reasoning;
use super::record::{Cell, Counts, Label, Overhead, TimingRecord, TrialRecord};
use super::recovered;
use super::statistics::Distribution;
use shared_types::transport::link::LinkCounts;
use shared_types::wire::{Losses, Stage, Traffic};

/// The header line.
pub const HEADER: [&str; 11] = [
    "block",
    "size",
    "strategy",
    "phase",
    "load",
    "asks_every_ns",
    "trial",
    "craft",
    "metric",
    "value",
    "unit",
];

/// The phase of searches for capacity.
const CAPACITY: &str = "capacity";

/// The craft column of a sum over all processes.
const FLEET: &str = "fleet";

/// The header as a line of the file.
#[must_use]
pub fn header_line() -> Vec<u8> {
    lines([HEADER.map(str::to_owned)])
}

/// The fleet (crafts, block) that a row is about; `None` of the header and of what is no row.
#[must_use]
pub fn is_about(row: &csv::ByteRecord) -> Option<(u32, u32)> {
    let number = |place: usize| std::str::from_utf8(row.get(place)?).ok()?.parse().ok();
    (row.len() == HEADER.len()).then_some((number(1)?, number(0)?))
}

/// What the rows of one record have in common.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct RowKey {
    /// Which file has the record.
    pub(super) phase: String,
    /// Block, size, strategy, load and asking interval.
    place: [String; 5],
    /// Which trial, where there is one.
    trial: String,
}

impl RowKey {
    /// The fleet that the record is of: crafts, block.
    pub(super) fn fleet(&self) -> Option<(u32, u32)> {
        let [block, size, ..] = &self.place;
        Some((size.parse().ok()?, block.parse().ok()?))
    }
}

/// The key of a row; `None` of what is none.
pub(super) fn key_of(row: &csv::ByteRecord) -> Option<RowKey> {
    is_about(row)?;
    let text = |place: usize| Some(std::str::from_utf8(row.get(place)?).ok()?.to_owned());
    let phase = text(3)?;
    // The trials of a search for capacity are its probes.
    let trial = if phase == CAPACITY { String::new() } else { text(6)? };
    Some(RowKey { phase, place: [text(0)?, text(1)?, text(2)?, text(4)?, text(5)?], trial })
}

/// Whether the rows of a record end with this one.
pub(super) fn is_last_of_record(row: &csv::ByteRecord) -> bool {
    matches!(row.get(8), Some(b"loss-missed-multicasts" | b"is-capacity"))
}

/// The key of a trial's rows.
pub(super) fn trial_key(record: &TrialRecord) -> RowKey {
    Rows::of_trial(record).key()
}

/// The key of a timing cell's rows.
pub(super) fn timing_key(record: &TimingRecord) -> RowKey {
    Rows::of_timing(record).key()
}

/// The key of the rows of a cell of open mode.
pub(super) fn load_key(record: &LoadRecord) -> RowKey {
    Rows::of_load(record).key()
}

/// The key of a search's rows.
pub(super) fn capacity_key(record: &CapacityRecord) -> RowKey {
    Rows::of_capacity(record).key()
}

/// All rows of one trial.
#[must_use]
pub fn trial_lines(record: &TrialRecord) -> Vec<u8> {
    let (facts, timing) = (&record.deterministic, &record.timing);
    let mut rows = Rows::of_trial(record);
    rows.push(FLEET, "turns", facts.turns, "turn");
    rows.push(FLEET, &format!("end-{}", facts.end.name()), 1, "trial");
    rows.push(FLEET, "firings", facts.firings, "firing");
    rows.push(FLEET, "boundary-firings", facts.boundary_firings, "firing");
    rows.push(FLEET, "idle-turns", facts.idle_turns, "turn");
    rows.push(FLEET, "expected-hops", facts.expected_hops, "hop");
    rows.push(FLEET, "hops", facts.hops, "hop");
    rows.push(FLEET, "conflicts", facts.conflicts, "merge");
    rows.counts(FLEET, "expected-", &facts.expected);
    rows.counts(FLEET, "", &facts.measured);
    for craft in &facts.crafts {
        rows.push(&craft.name, "firings", craft.firings, "firing");
        rows.push(&craft.name, "boundary-firings", craft.boundary_firings, "firing");
        rows.push(&craft.name, "hops", craft.hops, "hop");
        rows.push(&craft.name, "conflicts", craft.conflicts, "merge");
        rows.counts(&craft.name, "expected-", &craft.expected);
        rows.counts(&craft.name, "", &craft.measured);
    }
    rows.push(FLEET, "epoch", timing.epoch, "epoch");
    rows.push(FLEET, "duration", timing.duration_ns, "ns");
    rows.push("orchestrator", "cpu", timing.orchestrator_cpu_ns, "ns");
    for process in &timing.processes {
        rows.push(&process.name, "cpu", process.cpu_ns, "ns");
        rows.push(&process.name, "resident", process.resident_bytes, "byte");
        for (metric, value, unit) in process.reasoning.iter().flat_map(reasoning::values) {
            rows.push(&process.name, metric, value, unit);
        }
    }
    for (turn, &time_ns) in timing.turn_times_ns.iter().enumerate() {
        rows.push(FLEET, &format!("turn-time-{turn}"), time_ns, "ns");
    }
    rows.overhead(&timing.overhead);
    rows.links(timing.links);
    rows.losses(&timing.losses);
    lines(rows.rows)
}

/// All rows of one timing cell; its turn times themselves are in the interval log.
#[must_use]
pub fn timing_lines(record: &TimingRecord) -> Vec<u8> {
    let mut rows = Rows::of_timing(record);
    rows.push(FLEET, "place", record.place, "cell");
    rows.push(FLEET, "epochs", record.epochs, "epoch");
    rows.push(FLEET, "turns", record.turns, "turn");
    rows.push(FLEET, "warm-up-turns", record.warm_up_turns, "turn");
    rows.push(FLEET, "warm-up", record.warm_up_ns, "ns");
    if let Some(ratio) = record.second_half_ratio {
        rows.push(FLEET, "second-half-ratio", ratio, "1");
    }
    rows.distribution("turn-time", &record.turn_time, "turn", "ns");
    rows.push(FLEET, "cpu", record.fleet_cpu_ns, "ns");
    rows.push("orchestrator", "cpu", record.orchestrator_cpu_ns, "ns");
    rows.push(FLEET, "processes", record.processes, "process");
    rows.push(FLEET, "resident", record.resident_bytes, "byte");
    rows.push(FLEET, "resident-max", record.resident_bytes_max, "byte");
    rows.push(FLEET, "ready", record.ready_ns, "ns");
    rows.counts(FLEET, "", &record.counts);
    rows.overhead(&record.overhead);
    rows.losses(&record.losses);
    lines(rows.rows)
}

/// All rows of one cell of open mode; its events themselves are in the interval log.
#[must_use]
pub fn load_lines(record: &LoadRecord) -> Vec<u8> {
    let mut rows = Rows::of_load(record);
    rows.push(FLEET, "place", record.place, "cell");
    rows.push(FLEET, "offered-rate", record.offered_per_s, "write/s");
    rows.push(FLEET, "duration", record.duration_ns, "ns");
    rows.push(FLEET, "warm-up", record.warm_up_ns, "ns");
    rows.push(FLEET, "writes", record.writes, "write");
    rows.push(FLEET, "unplayed", record.unplayed, "write");
    rows.push(FLEET, "needed", record.needed, "application");
    rows.push(FLEET, "applied-by-end", record.applied_by_end, "application");
    rows.push(FLEET, "applied-after-end", record.applied_after_end, "application");
    rows.push(FLEET, "censored", record.censored, "application");
    rows.push(FLEET, "saturated", u8::from(record.saturated.is_some()), "cell");
    for (stage, events) in &record.stages {
        let unit = if *stage == Stage::RecordsPerSample { "record" } else { "ns" };
        rows.distribution(stage.name(), events, "event", unit);
    }
    for (quantile, parts) in &record.shares {
        for (part, share) in parts {
            rows.push(FLEET, &format!("share-{quantile}-{part}"), share, "%");
        }
    }
    if let Some(ratio) = record.second_half_ratio {
        rows.push(FLEET, "second-half-ratio", ratio, "1");
    }
    rows.push(FLEET, "reads", record.reads, "read");
    rows.push(FLEET, "stale-reads", record.stale_reads, "read");
    if let Some(ages) = &record.staleness {
        rows.distribution("staleness", ages, "read", "ns");
    }
    rows.push(FLEET, "cpu", record.fleet_cpu_ns, "ns");
    rows.push("orchestrator", "cpu", record.orchestrator_cpu_ns, "ns");
    rows.push("orchestrator", "sleeps", record.orchestrator_sleeps, "sleep");
    rows.push(FLEET, "run-delay", record.run_delay_ns, "ns");
    rows.push(FLEET, "sleeps", record.sleeps, "sleep");
    rows.push(FLEET, "proportional", record.proportional_bytes, "byte");
    rows.push(FLEET, "processes", record.processes, "process");
    rows.push(FLEET, "sharers", record.sharers, "craft");
    rows.push(FLEET, "boundary-fraction", record.boundary_fraction, "1");
    rows.counts(FLEET, "", &record.counts);
    if let Some(expected) = &record.expected {
        rows.counts(FLEET, "expected-", expected);
    }
    rows.overhead(&record.overhead);
    for (metric, value, unit, _) in record.recovery.iter().flat_map(recovered::values) {
        rows.push(FLEET, metric, value, unit);
    }
    if let Some(SimulatedInterval { virtual_ns, board_digest, replica_digest }) = record.simulated {
        rows.push(FLEET, "virtual-time", virtual_ns, "ns");
        rows.push(FLEET, "board-digest", board_digest, "");
        rows.push(FLEET, "replica-digest", replica_digest, "");
    }
    rows.losses(&record.losses);
    lines(rows.rows)
}

/// All rows of one search for capacity: the column `trial` numbers the loads that were tried.
#[must_use]
pub fn capacity_lines(record: &CapacityRecord) -> Vec<u8> {
    let mut rows = Rows::of_capacity(record);
    rows.push(FLEET, "place", record.place, "cell");
    rows.push(FLEET, "burst", record.burst, "write");
    for (number, probe) in record.probes.iter().enumerate() {
        rows.trial = number.to_string();
        rows.push(FLEET, "offered-rate", probe.offered_per_s, "write/s");
        rows.push(FLEET, "applied-rate", probe.applied_per_s, "application/s");
        rows.push(FLEET, "applied-share", probe.applied_share, "1");
        if let Some(lag_ns) = probe.lag_p99_ns {
            rows.push(FLEET, "schedule-p99", lag_ns, "ns");
        }
        rows.push(FLEET, "cpu", probe.fleet_cpu_ns, "ns");
        rows.push(FLEET, "saturated", u8::from(probe.saturated.is_some()), "cell");
        let is_capacity = record.borne == Some(number);
        rows.push(FLEET, "is-capacity", u8::from(is_capacity), "cell");
    }
    lines(rows.rows)
}

/// Rows that share a cell, a phase, a load and a trial.
struct Rows {
    cell: Cell,
    label: String,
    phase: &'static str,
    load: String,
    asks_every_ns: String,
    trial: String,
    rows: Vec<[String; HEADER.len()]>,
}

impl Rows {
    fn new(cell: Cell, again: u32, phase: &'static str) -> Self {
        let label = Label { strategy: cell.strategy, again }.to_string();
        let (load, asks_every_ns, trial) = (String::new(), String::new(), String::new());
        Self { cell, label, phase, load, asks_every_ns, trial, rows: Vec::new() }
    }

    fn of_trial(record: &TrialRecord) -> Self {
        let facts = &record.deterministic;
        Self { trial: facts.trial.to_string(), ..Self::new(facts.cell, 0, "counted") }
    }

    fn of_timing(record: &TimingRecord) -> Self {
        Self::new(record.cell, record.again, "timed")
    }

    fn of_load(record: &LoadRecord) -> Self {
        let rows = Self::new(record.cell, record.again, "loaded");
        Self { load: record.load.clone(), ..rows.asking(record.asks_every_ns) }
    }

    fn of_capacity(record: &CapacityRecord) -> Self {
        Self::new(record.cell, 0, CAPACITY).asking(record.asks_every_ns)
    }

    fn asking(self, every_ns: Option<u64>) -> Self {
        Self { asks_every_ns: every_ns.map_or_else(String::new, |every| every.to_string()), ..self }
    }

    fn key(self) -> RowKey {
        let Self { cell, label, phase, load, asks_every_ns, trial, rows: _ } = self;
        let place = [cell.block.to_string(), cell.size.to_string(), label, load, asks_every_ns];
        RowKey { phase: phase.to_owned(), place, trial }
    }

    /// What a record says of a histogram of `events` whose values are in `unit`.
    fn distribution(
        &mut self,
        metric: &str,
        distribution: &Distribution,
        events: &str,
        unit: &str,
    ) {
        self.push(FLEET, &format!("{metric}-n"), distribution.n, events);
        self.push(FLEET, &format!("{metric}-min"), distribution.min_ns, unit);
        self.push(FLEET, &format!("{metric}-mean"), distribution.mean_ns, unit);
        for point in &distribution.quantiles {
            self.push(FLEET, &format!("{metric}-{}", point.name), point.value_ns, unit);
        }
        self.push(FLEET, &format!("{metric}-max"), distribution.max_ns, unit);
    }

    fn push(&mut self, craft: &str, metric: &str, value: impl ToString, unit: &str) {
        self.rows.push([
            self.cell.block.to_string(),
            self.cell.size.to_string(),
            self.label.clone(),
            self.phase.to_owned(),
            self.load.clone(),
            self.asks_every_ns.clone(),
            self.trial.clone(),
            craft.to_owned(),
            metric.to_owned(),
            value.to_string(),
            unit.to_owned(),
        ]);
    }

    fn counts(&mut self, craft: &str, prefix: &str, counts: &Counts) {
        self.traffic(craft, &format!("{prefix}replication"), &counts.replication);
        self.traffic(craft, &format!("{prefix}reply"), &counts.reply);
    }

    fn overhead(&mut self, overhead: &Overhead) {
        self.traffic(FLEET, "repair", &overhead.repair);
        self.traffic(FLEET, "ack", &overhead.ack);
        self.traffic(FLEET, "best-effort", &overhead.best_effort);
        self.traffic(FLEET, "control", &overhead.control);
        self.traffic(FLEET, "telemetry", &overhead.telemetry);
    }

    fn traffic(&mut self, craft: &str, class: &str, traffic: &Traffic) {
        self.push(craft, &format!("{class}-requests"), traffic.requests, "request");
        self.push(craft, &format!("{class}-transmissions"), traffic.transmissions, "sample");
        self.push(craft, &format!("{class}-deliveries"), traffic.deliveries, "sample");
        self.push(craft, &format!("{class}-bytes-sent"), traffic.bytes_sent, "byte");
        self.push(craft, &format!("{class}-bytes-received"), traffic.bytes_received, "byte");
    }

    fn links(&mut self, links: Option<LinkCounts>) {
        let Some(LinkCounts { lost, cut_off, doubled, delayed, overtaken }) = links else { return };
        for (metric, value) in [
            ("lost", lost),
            ("cut-off", cut_off),
            ("doubled", doubled),
            ("delayed", delayed),
            ("overtaken", overtaken),
        ] {
            self.push(FLEET, &format!("link-{metric}"), value, "sample");
        }
    }

    fn losses(&mut self, losses: &Losses) {
        let Losses {
            late,
            refused,
            old_incarnation,
            gaps,
            repeats,
            full_inboxes,
            full_outboxes,
            missed_multicasts,
            // Made up for; with the record's part of recovery.
            links: _,
        } = *losses;
        for (metric, value) in [
            ("late", late),
            ("refused", refused),
            ("old-incarnation", old_incarnation),
            ("gaps", gaps),
            ("repeats", repeats),
            ("full-inboxes", full_inboxes),
            ("full-outboxes", full_outboxes),
            ("missed-multicasts", missed_multicasts),
        ] {
            self.push(FLEET, &format!("loss-{metric}"), value, "sample");
        }
    }
}

/// Rows as lines of the file, quoted where a name needs it.
fn lines(rows: impl IntoIterator<Item = [String; HEADER.len()]>) -> Vec<u8> {
    let mut writer = csv::WriterBuilder::new().has_headers(false).from_writer(Vec::new());
    for row in rows {
        writer.write_record(row).expect("invariant: every row has the header's length");
    }
    writer.into_inner().expect("invariant: memory takes every row")
}
