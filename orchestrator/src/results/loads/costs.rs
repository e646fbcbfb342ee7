//! What a row of open mode costs and counts, over all its blocks.

use super::{Adding, Merged};
use crate::results::inference::middle_of;
use crate::results::load::LoadRecord;
use crate::results::recovered;
use crate::results::statistics::{as_float, mean_of, ratio_of_sums};
use std::collections::BTreeSet;

/// Metric, unit and label of a count of one block, and where it is from.
type Part = (&'static str, &'static str, &'static str, fn(&LoadRecord) -> u64);

/// What is sent and received.
const TRAFFIC: [Part; 6] = [
    ("requests-per-application", "request", "requests sent", |record| {
        record.counts.replication.requests
    }),
    ("transmissions-per-application", "sample", "samples published", |record| {
        record.counts.total().transmissions
    }),
    ("deliveries-per-application", "sample", "samples received", |record| {
        record.counts.total().deliveries
    }),
    ("bytes-per-application", "byte", "records and headers published", |record| {
        record.counts.total().bytes_sent
    }),
    (
        "further-transmissions-per-application",
        "sample",
        "repeats, receipts, digests and states published",
        |record| record.overhead.repair.transmissions + record.overhead.ack.transmissions,
    ),
    (
        "further-bytes-per-application",
        "byte",
        "records and headers of repeats, receipts, digests and states",
        |record| record.overhead.repair.bytes_sent + record.overhead.ack.bytes_sent,
    ),
];

/// What processes do while they do nothing.
const WAITING: [Part; 2] = [
    ("sleeps-per-application", "sleep", "times that a process slept", |record| record.sleeps),
    ("run-delay-per-application", "ns", "time that processes waited for a core", |record| {
        record.run_delay_ns
    }),
];

impl Merged<'_> {
    /// What a needed application costs: CPU time, traffic, sleep; of what was simulated traffic alone.
    pub(super) fn add_costs(&self, floor: Option<&Self>, add: &mut Adding<'_>) {
        self.add_each(&TRAFFIC, add);
        if !self.is_simulated() {
            self.add_cpu(floor, add);
            self.add_each(&WAITING, add);
        }
    }

    /// Each of `parts` a needed application.
    fn add_each(&self, parts: &[Part], add: &mut Adding<'_>) {
        let needed = self.sum(|record| record.needed);
        for &(metric, unit, label, part) in parts {
            let value = ratio_of_sums(self.records().map(|record| (part(record), record.needed)));
            add.figure(metric, value, needed, unit, &format!("{label}, a needed application"));
            add.figures.within(metric, middle_of(self.ratios(|r| (part(r), r.needed))));
        }
    }

    fn add_cpu(&self, floor: Option<&Self>, add: &mut Adding<'_>) {
        let needed = self.sum(|record| record.needed);
        let cost = |own: &Self| ratio_of_sums(own.records().map(|r| (r.fleet_cpu_ns, r.needed)));
        let own = cost(self);
        let metric = "cpu-per-application";
        add.figure(metric, own, needed, "ns", "CPU time of the fleet a needed application");
        add.figures.within(metric, middle_of(self.costs.clone()));
        let excess = floor.and_then(|floor| Some(own? - cost(floor)?));
        let metric = "cpu-per-application-over-null";
        let label = "CPU time of the fleet a needed application, excess over null";
        add.figure(metric, excess, needed, "ns", label);
        let same_blocks = |floor: &&Self| {
            let blocks = |own: &Self| own.records().map(|r| r.cell.block).collect::<Vec<_>>();
            blocks(floor) == blocks(self)
        };
        let differences = floor.filter(same_blocks).map_or_else(Vec::new, |floor| {
            self.costs.iter().zip(&floor.costs).map(|(own, floor)| own - floor).collect()
        });
        add.figures.within(metric, middle_of(differences));
    }

    /// What was offered, known, read and used beside that.
    pub(super) fn add_counts(&self, add: &mut Adding<'_>) {
        let n = self.n();
        let rate = mean_of(self.records().map(|record| record.offered_per_s));
        add.figure("offered-rate", rate, n, "write/s", "writes offered to the fleet");
        let needed = self.sum(|record| record.needed);
        let share = |part: fn(&LoadRecord) -> u64, of: fn(&LoadRecord) -> u64| {
            let parts = self.records().map(|record| (part(record), of(record)));
            ratio_of_sums(parts).map(|share| 100.0 * share)
        };
        let applied = share(|record| record.applied_by_end, |record| record.needed);
        add.figure("applied-by-end-share", applied, needed, "%", "known by the end, of all needed");
        let reads = self.sum(|record| record.reads);
        let stale = share(|record| record.stale_reads, |record| record.reads);
        add.figure("stale-reads-share", stale, reads, "%", "reads that missed a write");
        let mut whole = |metric: &str, value: u64, unit: &'static str, label: &str| {
            add.figure(metric, Some(as_float(value)), n, unit, label);
        };
        whole("writes", self.sum(|r| r.writes), "write", "writes offered");
        whole("unplayed", self.sum(|r| r.unplayed), "write", "writes not made by the end");
        whole("needed", needed, "application", "applications that the trace needs");
        let label = "applications never seen: at least (end - intended)";
        whole("censored", self.sum(|r| r.censored), "application", label);
        if !self.is_simulated() {
            let memory = self.records().map(|record| record.proportional_bytes).max().unwrap_or(0);
            whole("proportional", memory, "byte", "proportional memory of the fleet");
            let cpu = self.records().map(|r| (r.orchestrator_cpu_ns, r.duration_ns));
            let cpu = ratio_of_sums(cpu).map(|share| 100.0 * share);
            add.figure("orchestrator-cpu", cpu, n, "%", "CPU time of the orchestrator, of a core");
        }
        let copies = self.records().map(|record| record.sharers * record.boundary_fraction);
        add.figure("copies", mean_of(copies), n, "1", "other boards that a write is needed at");
        let names: BTreeSet<(&String, &String)> = self
            .records()
            .flat_map(|r| &r.shares)
            .flat_map(|(quantile, parts)| parts.keys().map(move |part| (quantile, part)))
            .collect();
        for (quantile, part) in names {
            let of_block = |record: &LoadRecord| record.shares.get(quantile)?.get(part).copied();
            let share = mean_of(self.records().filter_map(of_block));
            let label = format!("median share of {part} among the events from {quantile} on");
            add.figure(&format!("share-{quantile}-{part}"), share, n, "%", &label);
        }
    }

    /// What recovery did, where the fleet recovers: sums over its blocks.
    pub(super) fn add_recovery(&self, add: &mut Adding<'_>) {
        let recoveries = || self.records().filter_map(|record| record.recovery);
        let n = recoveries().count() as u64;
        let sums =
            recoveries().map(|recovery| recovered::values(&recovery)).reduce(|mut sums, more| {
                for (sum, more) in sums.iter_mut().zip(more) {
                    sum.1 += more.1;
                }
                sums
            });
        for (metric, value, unit, label) in sums.into_iter().flatten() {
            add.figure(metric, Some(as_float(value)), n, unit, label);
        }
    }
}
