//! The records of open mode: one per cell of load, one per search for capacity.
//!
//! Records know nothing of files, see [`super::store`]; no figure is computed here.

use super::record::{Cell, Counts, Digest, Label, Overhead};
use super::statistics::Distribution;
use hdrhistogram::Histogram;
use serde::{Deserialize, Serialize};
use shared_types::transport::link::LinkCounts;
use shared_types::wire::{Losses, Stage};
use std::collections::BTreeMap;

/// Everything that one cell of open mode leaves, besides its histograms: a strategy under a label, at
/// one offered load, in one block.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LoadRecord {
    /// Where it belongs.
    #[serde(flatten)]
    pub cell: Cell,
    /// As [`Label::again`]; absent in files for 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub again: u32,
    /// Place in the order in which its block was measured, from 0.
    pub place: u32,
    /// Name of the load: `common`, `high`, `80%` (of the strategy's own capacity), or what the scenario
    /// calls it.
    pub load: String,
    /// Writes offered to the fleet, per second.
    pub offered_per_s: f64,
    /// Length of the measured interval, ns.
    pub duration_ns: u64,
    /// How often a client asks the centre, ns; `None` without a centre.
    pub asks_every_ns: Option<u64>,
    /// Length of the unmeasured epochs before, ns.
    pub warm_up_ns: u64,
    /// Writes of the trace.
    pub writes: u64,
    /// Writes that crafts had not made by the end of the interval.
    pub unplayed: u64,
    /// Applications at other boards that the trace needs, whatever the strategy; the same under `null`.
    pub needed: u64,
    /// Of these, known by the end of the interval.
    pub applied_by_end: u64,
    /// Of these, known after it.
    pub applied_after_end: u64,
    /// Of these, never known: they enter as "at least (end - intended)".
    pub censored: u64,
    /// Why the load is above the strategy's capacity; `None` if it is not.
    pub saturated: Option<Saturation>,
    /// Traffic of classes replication and reply.
    pub counts: Counts,
    /// What the independent replay says that traffic must be; `None` where it does not say (saturated
    /// cells, central strategies).
    pub expected: Option<Counts>,
    /// Traffic of the ledger and of repair.
    pub overhead: Overhead,
    /// What was lost, refused or had to wait, all processes.
    pub losses: Losses,
    /// What recovery did, where the fleet recovers; absent in files elsewhere.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recovery: Option<LoadRecovery>,
    /// Every stage that had events.
    pub stages: BTreeMap<Stage, Distribution>,
    /// Median share of each part of time to knowledge, in percent, among the events at or above a
    /// quantile of it: by quantile name (`p50`, `p99`, `p99.9`), then part.
    pub shares: BTreeMap<String, BTreeMap<String, f64>>,
    /// Median time to knowledge of the second half of the interval over that of the first.
    pub second_half_ratio: Option<f64>,
    /// Reads of the trace that were made.
    pub reads: u64,
    /// Of these, how many did not see a write that was intended before.
    pub stale_reads: u64,
    /// Age of what stale reads did not see: from the intended time of the oldest write not seen to the
    /// read, ns.
    pub staleness: Option<Distribution>,
    /// CPU time of all crafts and the centre in the interval, ns.
    pub fleet_cpu_ns: u64,
    /// CPU time of the orchestrator in the interval, ns.
    pub orchestrator_cpu_ns: u64,
    /// Times that the orchestrator slept and was woken in the interval.
    pub orchestrator_sleeps: u64,
    /// Time that processes of the fleet were ready to run and did not, ns.
    pub run_delay_ns: u64,
    /// Times that processes of the fleet slept.
    pub sleeps: u64,
    /// Proportional set size of all processes of the fleet, bytes.
    pub proportional_bytes: u64,
    /// Processes of the fleet, a centre counted.
    pub processes: u32,
    /// Crafts that share the fact of a write, on average over the boundary writes of the trace.
    pub sharers: f64,
    /// Share of the writes that are of boundary facts.
    pub boundary_fraction: f64,
    /// What only the simulator knows; absent in files of real processes. Where it stands, every time of
    /// the record is one of the virtual clock, and what a processor or a host would tell is 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub simulated: Option<SimulatedInterval>,
}

/// What only the simulator knows of an interval: seed and scenario decide it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SimulatedInterval {
    /// Virtual time from the beginning until nothing was due or under way any more, ns.
    pub virtual_ns: u64,
    /// Digest over all home boards at the end.
    pub board_digest: Digest,
    /// Digest over all replica stores at the end.
    pub replica_digest: Digest,
}

/// What recovery did in an interval, all processes that lived at its end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LoadRecovery {
    /// Processes that died and were followed by a new life.
    pub deaths: u64,
    /// Records of the trace that were due before a successor came, which skipped them: those between death
    /// and return were never made.
    pub records_missed: u64,
    /// Samples sent again.
    pub repeats: u64,
    /// Samples that were never repeated, so that the state was asked for instead.
    pub given_up: u64,
    /// Changes that were learnt from states; no time to knowledge is counted for them.
    pub learnt: u64,
    /// Questions for a state that stayed without an answer.
    pub states_missed: u64,
    /// What links of the scenario did to samples; nothing of it is lost for good.
    #[serde(default)]
    pub links: LinkCounts,
    /// Samples that full outboxes dropped, and that recovery made up for.
    pub dropped: u64,
}

impl LoadRecord {
    /// The name, without extension, of the files that hold the cell's histograms.
    #[must_use]
    pub fn file_stem(&self) -> String {
        let Cell { block, size, strategy } = self.cell;
        let again = if self.again == 0 { String::new() } else { format!("-again-{}", self.again) };
        let asks = self
            .asks_every_ns
            .map_or_else(String::new, |every_ns| format!("-asks-{}us", every_ns / 1000));
        let load: String =
            self.load.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect();
        format!("load-{load}-block-{block}-crafts-{size}-{strategy}{asks}{again}")
    }

    /// The label under which it was measured.
    #[must_use]
    pub const fn label(&self) -> Label {
        Label { strategy: self.cell.strategy, again: self.again }
    }
}

/// The histograms of a cell of open mode, all crafts together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadHistograms {
    /// Length of a slice, ns.
    pub slice_ns: u64,
    /// Time to knowledge, ns, slice by slice of the interval; what came later, or never, is in the last.
    pub knowledge: Vec<Histogram<u64>>,
    /// Every other stage that had events; times in ns.
    pub stages: BTreeMap<Stage, Histogram<u64>>,
    /// Age of what stale reads did not see, ns; `None` without a stale read.
    pub staleness: Option<Histogram<u64>>,
}

/// Why a load is above a strategy's capacity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Saturation {
    /// Fewer than 99.9 % of the changes were known by the end.
    Unapplied,
    /// An outbox was full.
    FullOutbox,
    /// The schedule lagged by 1 ms or more at p99.
    Lag,
}

impl Saturation {
    /// Why, in words.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Unapplied => "below 99.9 % known by the end",
            Self::FullOutbox => "an outbox was full",
            Self::Lag => "the schedule lagged by 1 ms at p99",
        }
    }
}

/// One load that was tried in a search for capacity.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Probe {
    /// Writes offered to the fleet, per second.
    pub offered_per_s: f64,
    /// Changes applied at other boards by the end, per second.
    pub applied_per_s: f64,
    /// Share of what the trace needs that was applied by the end.
    pub applied_share: f64,
    /// 99th percentile of the schedule's lateness, ns.
    pub lag_p99_ns: Option<u64>,
    /// CPU time of the fleet, ns.
    pub fleet_cpu_ns: u64,
    /// Why it was too much; `None` if it was not.
    pub saturated: Option<Saturation>,
}

/// The highest load that a strategy bore in one block.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CapacityRecord {
    /// Where it belongs.
    #[serde(flatten)]
    pub cell: Cell,
    /// Place in the order in which its block was measured, from 0.
    pub place: u32,
    /// How often a client asks the centre, ns; `None` without a centre.
    pub asks_every_ns: Option<u64>,
    /// Writes of one craft that are due together.
    pub burst: u32,
    /// Every load that was tried, in the order in which it was.
    pub probes: Vec<Probe>,
    /// Index of the probe with the highest rate that was borne; `None` if none was.
    pub borne: Option<usize>,
}

impl CapacityRecord {
    /// The probe with the highest rate that was borne.
    #[must_use]
    pub fn capacity(&self) -> Option<&Probe> {
        self.probes.get(self.borne?)
    }

    /// Why the search ended.
    #[must_use]
    pub fn end(&self) -> SearchEnd {
        let Some(borne) = self.capacity() else { return SearchEnd::Nothing };
        let is_above = |probe: &Probe| probe.offered_per_s > borne.offered_per_s;
        if self.probes.iter().any(is_above) { SearchEnd::Found } else { SearchEnd::Ceiling }
    }
}

/// Why a search for capacity ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum SearchEnd {
    /// Between a rate that was borne and a higher one that was not.
    Found,
    /// Not even the lowest rate was borne.
    Nothing,
    /// The highest rate that is tried was borne: the capacity is above it.
    Ceiling,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "the shape that serde asks for")]
const fn is_zero(number: &u32) -> bool {
    *number == 0
}
