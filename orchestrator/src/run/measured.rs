//! From a played interval of open mode to its record: histograms of all crafts together, what was known
//! when, what was never known, and whether the load was above capacity.
//!
//! Nothing is filtered: a change that was never known enters as "at least (end - intended)". Not here:
//! whether counts are those of the independent replay (`super::loads`), and figures over blocks.

use super::backend::PlayedOpen;
use super::offer::Offer;
use super::repaired::mended;
use super::staleness::Staleness;
use super::verdict;
use crate::results::load::{LoadHistograms, LoadRecovery, Saturation};
use crate::results::record::{Counts, Overhead};
use crate::results::statistics::{Distribution, Quantile, as_float, merged, time_histogram};
use agent::metrics::{SHARE_STEPS, class_floor_ns, is_share_row, read_histogram, share_part_name};
use hdrhistogram::Histogram;
use shared_types::ids::CraftId;
use shared_types::limits::{APPLIED_SHARE_MIN, LAG_P99_NS_MAX, SETTLING_NS};
use shared_types::wire::{
    EpochSpec, Losses, OpenReport, OpenSpec, Stage, StrategyKind, TrialReport,
};
use std::collections::BTreeMap;

/// Asking intervals of a client of the centre for which a change may be under way at the end of an
/// interval without being late: its origin asks, and then its receiver.
const ASKS_UNDER_WAY: u64 = 2;

/// Everything that the reports of one interval add up to.
#[derive(Debug)]
pub struct Measured {
    /// All crafts together.
    pub histograms: LoadHistograms,
    /// Every stage that had events, time to knowledge included.
    pub stages: BTreeMap<Stage, Distribution>,
    /// As in the record.
    pub shares: BTreeMap<String, BTreeMap<String, f64>>,
    /// Median time to knowledge of the second half of the slices over that of the first.
    pub second_half_ratio: Option<f64>,
    /// Writes that were made.
    pub writes_played: u64,
    /// Applications known by the end of the interval.
    pub applied_by_end: u64,
    /// Those known after it.
    pub applied_after_end: u64,
    /// Those never known.
    pub censored: u64,
    /// Why the load was above capacity.
    pub saturated: Option<Saturation>,
    /// Reads that were made.
    pub reads: u64,
    /// Those of them that were stale.
    pub stale_reads: u64,
    /// Traffic of classes replication and reply.
    pub counts: Counts,
    /// Traffic of the ledger and of repair.
    pub overhead: Overhead,
    /// What was lost, refused or had to wait; what recovery made up for is not lost.
    pub losses: Losses,
    /// What recovery did, where the fleet recovers.
    pub recovery: Option<LoadRecovery>,
    /// CPU time of all processes in the interval, ns.
    pub fleet_cpu_ns: u64,
    /// Time that they were ready to run and did not, ns.
    pub run_delay_ns: u64,
    /// Times that they slept.
    pub sleeps: u64,
    /// Their proportional set size, bytes.
    pub proportional_bytes: u64,
}

impl Measured {
    /// What `played` says of `offer`.
    ///
    /// # Errors
    /// Says which process sent a histogram that cannot be read.
    pub fn of(
        offer: &Offer,
        spec: &EpochSpec,
        open: &OpenSpec,
        played: &PlayedOpen,
    ) -> Result<Self, String> {
        let reports = &played.reports;
        let mut histograms = collected(open, reports)?;
        // Knowledge is counted at the crafts, never at the centre.
        let crafts = || of_crafts(offer, reports);
        let sum = |part: fn(&OpenReport) -> u64| crafts().map(|(_, open)| part(open)).sum::<u64>();
        // Of a craft that died, nobody knows what it had known.
        let is_whole = |craft: CraftId| played.dead.iter().all(|ended| ended.craft != craft);
        let censored = censor(offer, spec.strategy, crafts(), &is_whole, &mut histograms);
        let knowledge = merged(&histograms.knowledge);
        let mut stages: BTreeMap<Stage, Distribution> = histograms
            .stages
            .iter()
            .map(|(&stage, events)| (stage, Distribution::of(events)))
            .collect();
        if !knowledge.is_empty() {
            stages.insert(Stage::Knowledge, Distribution::of(&knowledge));
        }
        let losses = verdict::losses(reports);
        let (recovery, losses) = match spec.recovery.map(|_| mended(played, losses)) {
            Some((recovery, lost)) => (Some(recovery), lost),
            None => (None, losses),
        };
        let mut overhead = Overhead { control: played.control, ..Overhead::default() };
        let mut counts = Counts::default();
        for report in reports {
            overhead += Overhead::from(&report.counters.traffic);
            counts += Counts::from(&report.counters.traffic);
        }
        let staleness = Staleness::of(offer, reports);
        histograms.staleness = (staleness.stale > 0).then_some(staleness.ages);
        let mut measured = Self {
            shares: shares(&knowledge, reports),
            second_half_ratio: second_half_ratio(&histograms.knowledge),
            stages,
            histograms,
            writes_played: crafts().map(|(craft, open)| played_writes(offer, craft, open)).sum(),
            applied_by_end: sum(|open| open.applied_by_end),
            applied_after_end: sum(|open| open.applied_after_end),
            censored,
            saturated: None,
            reads: staleness.reads,
            stale_reads: staleness.stale,
            counts,
            overhead,
            losses,
            recovery,
            fleet_cpu_ns: reports.iter().map(|report| report.cpu_ns).sum(),
            run_delay_ns: opens(reports).map(|open| open.run_delay_ns).sum(),
            sleeps: opens(reports).map(|open| open.sleeps).sum(),
            proportional_bytes: opens(reports).map(|open| open.proportional_bytes).sum(),
        };
        measured.saturated = match played.virtual_ns {
            // A virtual clock waits for everybody; only inboxes have bounds.
            Some(_) => (losses.full_outboxes > 0).then_some(Saturation::FullOutbox),
            None => measured.saturation(offer, spec.strategy, open),
        };
        Ok(measured)
    }

    /// Why the load was above the capacity of `strategy`. What was due so late that it could not be
    /// known by the end is not asked for: see [`SETTLING_NS`].
    fn saturation(
        &self,
        offer: &Offer,
        strategy: StrategyKind,
        open: &OpenSpec,
    ) -> Option<Saturation> {
        if self.losses.full_outboxes > 0 {
            return Some(Saturation::FullOutbox);
        }
        if self.recovery.is_some_and(|recovery| recovery.deaths > 0) {
            // What a craft would have borne that did not live, nobody knows.
            return None;
        }
        let asking_ns = if strategy.has_centre() { ASKS_UNDER_WAY * open.asks_every_ns } else { 0 };
        let asked_for = offer.duration_ns.saturating_sub(SETTLING_NS + asking_ns);
        let (found, needed) = if strategy == StrategyKind::Null {
            (self.writes_played, offer.writes().0)
        } else {
            (self.applied_by_end, offer.needed_before(asked_for))
        };
        if as_float(found) < APPLIED_SHARE_MIN * as_float(needed) {
            return Some(Saturation::Unapplied);
        }
        let lag = self.histograms.stages.get(&Stage::Schedule);
        let lag_ns = lag.and_then(|lag| Quantile::P99.of(lag));
        lag_ns.is_some_and(|lag_ns| lag_ns >= LAG_P99_NS_MAX).then_some(Saturation::Lag)
    }
}

fn opens(reports: &[TrialReport]) -> impl Iterator<Item = &OpenReport> {
    reports.iter().filter_map(|report| report.open.as_ref())
}

fn of_crafts<'a>(
    offer: &'a Offer,
    reports: &'a [TrialReport],
) -> impl Iterator<Item = (CraftId, &'a OpenReport)> {
    let crafts = reports.iter().filter(|report| (report.craft as usize) < offer.trace.len());
    crafts.filter_map(|report| Some((CraftId(report.craft), report.open.as_ref()?)))
}

/// Adds up the histograms of all processes.
fn collected(open: &OpenSpec, reports: &[TrialReport]) -> Result<LoadHistograms, String> {
    let slices = open.duration_ns.div_ceil(open.slice_ns.max(1)).max(1);
    let slices = usize::try_from(slices).unwrap_or(usize::MAX);
    let mut histograms = LoadHistograms {
        slice_ns: open.slice_ns,
        knowledge: (0..slices).map(|_| time_histogram()).collect(),
        ..LoadHistograms::default()
    };
    for report in reports {
        let Some(open) = &report.open else { continue };
        let read = |bytes: &[u8]| {
            read_histogram(bytes)
                .ok_or_else(|| format!("process {} sent a damaged histogram", report.craft))
        };
        for (number, bytes) in open.knowledge_slices.iter().enumerate() {
            if !bytes.is_empty() {
                let slice = &mut histograms.knowledge[number.min(slices - 1)];
                *slice = merged([&*slice, &read(bytes)?]);
            }
        }
        for (stage, bytes) in &open.stages {
            let events = read(bytes)?;
            let all = histograms.stages.entry(*stage).or_insert_with(time_histogram);
            *all = merged([&*all, &events]);
        }
    }
    histograms.stages.retain(|_, events| !events.is_empty());
    Ok(histograms)
}

/// Enters what was never known in the last slice; returns how much that is. Under `null` nothing is
/// meant to be known.
fn censor<'a>(
    offer: &Offer,
    strategy: StrategyKind,
    crafts: impl Iterator<Item = (CraftId, &'a OpenReport)>,
    is_whole: &impl Fn(CraftId) -> bool,
    histograms: &mut LoadHistograms,
) -> u64 {
    if strategy == StrategyKind::Null {
        return 0;
    }
    let last = histograms.knowledge.last_mut().expect("invariant: an interval has a slice");
    let mut censored = 0;
    for (receiver, open) in crafts.filter(|&(receiver, _)| is_whole(receiver)) {
        for origin in
            (0..offer.trace.len()).map(CraftId::from_index).filter(|&craft| is_whole(craft))
        {
            let applied = open.applied_from.get(origin.index()).copied().unwrap_or(0);
            for due_ns in offer.missing(origin, receiver, applied) {
                last.saturating_record((offer.duration_ns - due_ns).max(1));
                censored += 1;
            }
        }
    }
    censored
}

/// Writes among the records that `craft` has played, always a prefix of its part.
fn played_writes(offer: &Offer, craft: CraftId, open: &OpenReport) -> u64 {
    let played = usize::try_from(open.records_played).unwrap_or(usize::MAX);
    let records = offer.trace[craft.index()].iter().take(played);
    records.filter(|record| record.holds().is_some()).count() as u64
}

/// Median of the last half of the slices over that of the first; `None` if too few events tell.
fn second_half_ratio(slices: &[Histogram<u64>]) -> Option<f64> {
    let half = slices.len() / 2;
    let median = |slices: &[Histogram<u64>]| Quantile::P50.of(&merged(slices)).map(as_float);
    let (first, second) = (median(&slices[..half])?, median(&slices[slices.len() - half..])?);
    (first > 0.0).then(|| second / first)
}

/// Median share of every part, in percent, among the events at or above each quantile of `knowledge`
/// that may be shown. Events are told apart by classes of the total: the class that a quantile lies in
/// counts as a whole.
fn shares(
    knowledge: &Histogram<u64>,
    reports: &[TrialReport],
) -> BTreeMap<String, BTreeMap<String, f64>> {
    let mut shares = BTreeMap::new();
    for quantile in [Quantile::P50, Quantile::P99, Quantile::P999] {
        let Some(least_ns) = quantile.of(knowledge) else { continue };
        let mut parts: BTreeMap<u32, BTreeMap<u32, u64>> = BTreeMap::new();
        let rows = opens(reports).flat_map(|open| &open.shares).copied();
        for [class, part, step, events] in rows.filter(|&row| is_share_row(row)) {
            if class_floor_ns(class + 1) > least_ns {
                *parts.entry(part).or_default().entry(step).or_default() += u64::from(events);
            }
        }
        let named = parts.iter().filter_map(|(&part, steps)| {
            Some((share_part_name(part)?.to_owned(), median_share(steps)?))
        });
        shares.insert(quantile.name.to_owned(), named.collect());
    }
    shares
}

/// The middle of the step in which the median lies, in percent.
fn median_share(steps: &BTreeMap<u32, u64>) -> Option<f64> {
    let all: u64 = steps.values().sum();
    let mut passed = 0;
    let median = steps.iter().find_map(|(&step, &events)| {
        passed += events;
        (2 * passed >= all).then_some(step)
    })?;
    let width = 100.0 / f64::from(SHARE_STEPS);
    Some(if median == SHARE_STEPS { 100.0 } else { (f64::from(median) + 0.5) * width })
}

#[cfg(test)]
mod tests;
