//! The long form of every measurement: `measurements.csv`, one value a row.
//!
//! A row names block, size, strategy, phase (`counted` or `timed`), trial and craft; the craft is
//! `fleet` for a sum over all processes, and empty where a row is about no craft. Values are exact:
//! counts as printed integers, times in ns, memory in bytes. docs/data-dictionary.md explains the
//! metrics; other programs recompute the tables from this file and the interval logs.

use super::record::{Cell, Counts, Overhead, TimingRecord, TrialRecord};
use shared_types::wire::{Losses, Traffic};

/// The header line.
pub const HEADER: [&str; 9] =
    ["block", "size", "strategy", "phase", "trial", "craft", "metric", "value", "unit"];

/// The craft column of a sum over all processes.
const FLEET: &str = "fleet";

/// The header as a line of the file.
#[must_use]
pub fn header_line() -> Vec<u8> {
    lines([HEADER.map(str::to_owned)])
}

/// All rows of one trial.
#[must_use]
pub fn trial_lines(record: &TrialRecord) -> Vec<u8> {
    let (facts, timing) = (&record.deterministic, &record.timing);
    let mut rows = Rows::new(facts.cell, "counted", &facts.trial.to_string());
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
    }
    for (turn, &time_ns) in timing.turn_times_ns.iter().enumerate() {
        rows.push(FLEET, &format!("turn-time-{turn}"), time_ns, "ns");
    }
    rows.overhead(&timing.overhead);
    rows.losses(&timing.losses);
    lines(rows.rows)
}

/// All rows of one timing cell; its turn times themselves are in the interval log.
#[must_use]
pub fn timing_lines(record: &TimingRecord) -> Vec<u8> {
    let mut rows = Rows::new(record.cell, "timed", "");
    rows.label = record.label().to_string();
    rows.push(FLEET, "place", record.place, "cell");
    rows.push(FLEET, "epochs", record.epochs, "epoch");
    rows.push(FLEET, "turns", record.turns, "turn");
    rows.push(FLEET, "warm-up-turns", record.warm_up_turns, "turn");
    rows.push(FLEET, "warm-up", record.warm_up_ns, "ns");
    if let Some(ratio) = record.second_half_ratio {
        rows.push(FLEET, "second-half-ratio", ratio, "1");
    }
    let time = &record.turn_time;
    rows.push(FLEET, "turn-time-n", time.n, "turn");
    rows.push(FLEET, "turn-time-min", time.min_ns, "ns");
    rows.push(FLEET, "turn-time-mean", time.mean_ns, "ns");
    for point in &time.quantiles {
        rows.push(FLEET, &format!("turn-time-{}", point.name), point.value_ns, "ns");
    }
    rows.push(FLEET, "turn-time-max", time.max_ns, "ns");
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

/// Rows that share a cell, a phase and a trial.
struct Rows {
    cell: Cell,
    label: String,
    phase: &'static str,
    trial: String,
    rows: Vec<[String; HEADER.len()]>,
}

impl Rows {
    fn new(cell: Cell, phase: &'static str, trial: &str) -> Self {
        let label = cell.strategy.to_string();
        Self { cell, label, phase, trial: trial.to_owned(), rows: Vec::new() }
    }

    fn push(&mut self, craft: &str, metric: &str, value: impl ToString, unit: &str) {
        self.rows.push([
            self.cell.block.to_string(),
            self.cell.size.to_string(),
            self.label.clone(),
            self.phase.to_owned(),
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
