//! Which reads of a trace were stale: what they should have seen by then, beside what they saw.
//!
//! A read is stale if a write of the fact by another craft that shares it was intended before the read
//! was made and was not seen. A board keeps the newest intended time that it has seen, so what is older
//! than that counts as seen: it could not change the value any more.

use super::offer::{Foreign, Offer};
use crate::results::statistics::time_histogram;
use hdrhistogram::Histogram;
use shared_types::ids::CraftId;
use shared_types::trace::TraceRecord;
use shared_types::wire::{ReadSeen, TrialReport};

/// Reads of an interval, and how old what they missed was.
#[derive(Debug)]
pub(super) struct Staleness {
    /// Reads that were made.
    pub(super) reads: u64,
    /// Of these, how many missed a write.
    pub(super) stale: u64,
    /// From the intended time of the oldest write missed to the read, ns; one event a stale read.
    pub(super) ages: Histogram<u64>,
}

impl Staleness {
    /// What `reports` say of the reads of `offer`.
    pub(super) fn of(offer: &Offer, reports: &[TrialReport]) -> Self {
        let foreign = offer.foreign();
        let mut staleness = Self { reads: 0, stale: 0, ages: time_histogram() };
        for report in reports {
            let (craft, Some(open)) = (CraftId(report.craft), &report.open) else { continue };
            let records = offer.trace.get(craft.index()).map_or(&[][..], Vec::as_slice);
            let reads: Vec<&TraceRecord> =
                records.iter().filter(|record| record.holds().is_none()).collect();
            for seen in &open.reads {
                let Some(record) = reads.get(seen.number as usize) else { continue };
                staleness.reads += 1;
                if let Some(age_ns) = age_ns(&foreign, craft, record, seen) {
                    staleness.stale += 1;
                    staleness.ages.saturating_record(age_ns.max(1));
                }
            }
        }
        staleness
    }
}

/// How old the oldest write is that a read missed; `None` if it missed none.
fn age_ns(foreign: &Foreign, craft: CraftId, record: &TraceRecord, seen: &ReadSeen) -> Option<u64> {
    let due = foreign.get(&(craft, record.fact()))?;
    let first_unseen = match seen.seen_ns {
        ReadSeen::NOTHING => 0,
        seen_ns => due.partition_point(|&at_ns| at_ns <= seen_ns),
    };
    let oldest = due.get(first_unseen).filter(|&&at_ns| at_ns < seen.at_ns)?;
    Some(seen.at_ns - oldest)
}
