//! What a craft measures in open mode, in memory that is taken before the epoch begins and never
//! grows while it is filled.
//!
//! Every event is recorded, none sampled. A stage's histogram tells times of up to a minute apart to
//! three digits. Time to knowledge is kept by slices of the interval, whose sum is the whole; of changes
//! that came over several hops it is kept by their number as well, and what is left came over one, so
//! that the common case is recorded once. How its parts share it goes into a table of counts
//! ([`Shares`]). Not here: who reads the clock (the shells), and quantiles with intervals (orchestrator,
//! results).

mod shares;

pub use shares::{
    SHARE_STEPS, Shares, TOTAL_CLASSES_PER_OCTAVE, class_floor_ns, is_share_row, share_part_name,
};

use hdrhistogram::serialization::{Deserializer, Serializer, V2Serializer};
use hdrhistogram::{Counter, Histogram};
use shared_types::ids::CraftId;
use shared_types::limits::SLICES_MAX;
use shared_types::time::Nanos;
use shared_types::wire::{OpenReport, OpenSpec, ReadSeen, Stage};

/// How a histogram in the V2 format begins that is not compressed.
const HISTOGRAM_COOKIE: [u8; 4] = 0x1c84_9313_u32.to_be_bytes();

/// The least number as a count: -2^63, 2^63 classes without events.
const LEAST_COUNT: [u8; 9] = [0xff; 9];

/// Bytes before its counts.
const HISTOGRAM_HEAD_BYTES: usize = 40;

/// More events no histogram of ours holds; sums over slices and fleets stay below 2^64.
const EVENTS_MAX: u64 = 1 << 48;

/// Decimal digits that histograms tell apart.
const DIGITS: u8 = 3;

/// Longest time that is told from a longer one, ns.
const TIME_NS_MAX: u64 = 60_000_000_000;

/// Most records of a sample that are told apart.
const RECORDS_MAX: u64 = 1 << 16;

/// A sample's way to this board, as far as it goes into time to knowledge.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Way {
    /// When its receive returned.
    pub received: Nanos,
    /// Time under way: send called to receive returned, summed over hops, relay work apart.
    pub wake_ns: u64,
    /// Hops from the change's writer to here, at least 1.
    pub hops: u16,
}

/// What one process measures in one epoch of open mode.
#[derive(Debug, Default)]
pub struct Measured {
    is_staged: bool,
    ends: Nanos,
    slice_ns: u64,
    /// The slice at hand, and when the next begins.
    slice: usize,
    slice_ends: Nanos,
    slices: Vec<Histogram<u32>>,
    /// By [`Stage`]; those of knowledge and of knowledge over one hop stay empty.
    stages: Vec<Histogram<u32>>,
    shares: Shares,
    applied_from: Vec<u64>,
    applied_by_end: u64,
    applied_after_end: u64,
    reads: Vec<ReadSeen>,
    /// Per process whether it runs on the same core only.
    is_beside: Vec<bool>,
}

impl Measured {
    /// Forgets everything and makes room for an epoch of `spec` on `processes` processes, of which
    /// those in `beside` run on the same core as this one.
    pub(crate) fn begin(&mut self, spec: &OpenSpec, processes: usize, beside: &[CraftId]) {
        self.is_staged = spec.stamps_stages;
        // Others may be told to start first: what comes from them before is of the first slice.
        (self.slice, self.slice_ends, self.ends) = (0, Nanos(u64::MAX), Nanos(u64::MAX));
        self.slice_ns = spec.slice_ns.max(1);
        let slices = spec.duration_ns.div_ceil(self.slice_ns).clamp(1, SLICES_MAX);
        self.slices.resize_with(usize::try_from(slices).unwrap_or(1), times);
        if self.stages.is_empty() {
            self.stages.extend(Stage::ALL.map(|stage| match stage {
                Stage::RecordsPerSample => upto(RECORDS_MAX),
                _ => times(),
            }));
        }
        // Resetting touches the memory, so that no page is missing in the interval.
        let stages = self.stages.iter_mut();
        let stamped = stages.filter(|times| spec.stamps_stages || !times.is_empty());
        self.slices.iter_mut().chain(stamped).for_each(Histogram::reset);
        self.shares.reset();
        self.applied_from.clear();
        self.applied_from.resize(processes, 0);
        (self.applied_by_end, self.applied_after_end) = (0, 0);
        self.reads.clear();
        self.is_beside.clear();
        self.is_beside.resize(processes, false);
        for craft in beside {
            if let Some(is_beside) = self.is_beside.get_mut(craft.index()) {
                *is_beside = true;
            }
        }
    }

    /// The interval lasts from `started` to `ends`; `reads` reads will be made.
    pub(crate) fn start(&mut self, started: Nanos, ends: Nanos, reads: usize) {
        self.ends = ends;
        self.slice = 0;
        self.slice_ends = started.plus(self.slice_ns);
        self.reads.reserve(reads);
    }

    /// Whether stages are stamped, and not time to knowledge alone.
    #[inline]
    #[must_use]
    pub const fn is_staged(&self) -> bool {
        self.is_staged
    }

    /// Counts an event of `stage`.
    #[inline]
    pub(crate) fn stage(&mut self, stage: Stage, value: u64) {
        if self.is_staged {
            note(&mut self.stages[stage as usize], value, 1);
        }
    }

    /// Counts how long a sample from `source` was under way over `hops` hops.
    #[inline]
    pub(crate) fn woken(&mut self, source: u32, hops: u16, wake_ns: u64) {
        let stage = if hops > 1 {
            Stage::WakeRelayed
        } else if self.is_beside.get(source as usize).copied().unwrap_or(false) {
            Stage::WakeSameCore
        } else {
            Stage::WakeOtherCore
        };
        self.stage(stage, wake_ns);
    }

    /// Counts `changes` changes that were meant to be made at `intended`, came by `way` and are known
    /// at `now`.
    #[inline]
    pub(crate) fn known(&mut self, now: Nanos, intended: Nanos, way: Way, changes: u32) {
        let total_ns = now.since(intended);
        while now >= self.slice_ends && self.slice + 1 < self.slices.len() {
            self.slice += 1;
            self.slice_ends = self.slice_ends.plus(self.slice_ns);
        }
        note(&mut self.slices[self.slice], total_ns, changes);
        if now <= self.ends {
            self.applied_by_end += u64::from(changes);
        } else {
            self.applied_after_end += u64::from(changes);
        }
        if self.is_staged {
            let apply_ns = now.since(way.received);
            note(&mut self.stages[Stage::Apply as usize], apply_ns, changes);
            if way.hops > 1 {
                let place = usize::from(way.hops).min(Stage::BY_HOPS.len()) - 1;
                note(&mut self.stages[Stage::BY_HOPS[place] as usize], total_ns, changes);
            }
            self.shares.count(total_ns, way.wake_ns, apply_ns, changes);
        }
    }

    /// Counts `changes` changes of `origin` as applied.
    #[inline]
    pub(crate) fn applied(&mut self, origin: CraftId, changes: u32) {
        self.applied_from[origin.index()] += u64::from(changes);
    }

    /// Keeps what a read saw.
    #[inline]
    pub(crate) fn read(&mut self, at_ns: u64, seen_ns: u64) {
        let number = u32::try_from(self.reads.len()).unwrap_or(u32::MAX);
        self.reads.push(ReadSeen { number, at_ns, seen_ns });
    }

    /// Everything measured; what the process and its board know is for the caller to add.
    pub(crate) fn report(&self) -> OpenReport {
        let over_one_hop = self.over_one_hop();
        let stages = Stage::ALL.into_iter().zip(&self.stages).map(|(stage, times)| match stage {
            Stage::KnowledgeOneHop => (stage, over_one_hop.as_ref().unwrap_or(times)),
            _ => (stage, times),
        });
        let filled = stages.filter(|(_, times)| !times.is_empty());
        OpenReport {
            applied_from: self.applied_from.clone(),
            applied_by_end: self.applied_by_end,
            applied_after_end: self.applied_after_end,
            stages: filled.map(|(stage, times)| (stage, serialized(times))).collect(),
            knowledge_slices: self
                .slices
                .iter()
                .map(|times| if times.is_empty() { Vec::new() } else { serialized(times) })
                .collect(),
            shares: self.shares.rows(),
            reads: self.reads.clone(),
            ..OpenReport::default()
        }
    }

    /// Time to knowledge of what came over one hop: everything without what came over more. `None`
    /// where stages are not stamped.
    fn over_one_hop(&self) -> Option<Histogram<u32>> {
        let mut times = self.is_staged.then(times)?;
        for slice in &self.slices {
            times.add(slice).expect("invariant: all have the same bounds");
        }
        for stage in &Stage::BY_HOPS[1..] {
            times
                .subtract(&self.stages[*stage as usize])
                .expect("invariant: whatever came over hops is known");
        }
        Some(times)
    }
}

fn times() -> Histogram<u32> {
    upto(TIME_NS_MAX)
}

fn upto(most: u64) -> Histogram<u32> {
    Histogram::new_with_bounds(1, most, DIGITS).expect("invariant: the bounds are valid")
}

/// Counts `times` events of `value`; what is beyond the bounds counts at the bound.
#[inline]
fn note(histogram: &mut Histogram<u32>, value: u64, times: u32) {
    if times > 0 {
        let value = value.clamp(histogram.low(), histogram.high());
        histogram.record_n(value, times).expect("invariant: the value lies within the bounds");
    }
}

/// A histogram in the V2 format of HdrHistogram, uncompressed, as crafts report it; `None` if the bytes are
/// none, as of an empty slice, or if it tells more digits apart or holds more events than any of ours.
///
/// The library takes as much memory as the head asks for, up to 4 GiB, before it looks at what follows:
/// what follows is held against the head first.
#[must_use]
pub fn read_histogram<T: Counter>(bytes: &[u8]) -> Option<Histogram<T>> {
    let counts = bytes.get(HISTOGRAM_HEAD_BYTES..)?;
    let word = |at: usize| Some(u32::from_be_bytes(*bytes.get(at..)?.first_chunk()?));
    let is_whole = word(4)? as usize == counts.len() && word(12)? <= u32::from(DIGITS);
    // The library negates this number, which cannot be; no other count or two of ours have it within.
    let has_least = counts.windows(LEAST_COUNT.len()).any(|bytes| bytes == LEAST_COUNT);
    if !bytes.starts_with(&HISTOGRAM_COOKIE) || !is_whole || has_least {
        return None;
    }
    let read = Deserializer::new().deserialize(&mut &bytes[..]).ok();
    read.filter(|histogram: &Histogram<T>| histogram.len() <= EVENTS_MAX)
}

fn serialized<T: Counter>(histogram: &Histogram<T>) -> Vec<u8> {
    let mut bytes = Vec::new();
    V2Serializer::new()
        .serialize(histogram, &mut bytes)
        .expect("invariant: memory takes every histogram");
    bytes
}

#[cfg(test)]
mod tests {
    use super::{
        DIGITS, EVENTS_MAX, HISTOGRAM_HEAD_BYTES, Histogram, LEAST_COUNT, read_histogram,
        serialized, times,
    };

    #[test]
    fn a_histogram_is_read_back_and_one_that_asks_for_more_memory_than_it_has_is_refused() {
        let mut events = times();
        events.record_n(1_000, 7).expect("in bounds");
        let bytes = serialized(&events);
        assert_eq!(read_histogram(&bytes).as_ref(), Some(&events));
        assert_eq!(read_histogram::<u32>(&[]), None);
        let with = |at: usize, word: u32| {
            let mut bytes = bytes.clone();
            bytes[at..at + 4].copy_from_slice(&word.to_be_bytes());
            read_histogram::<u32>(&bytes)
        };
        assert_eq!(with(4, u32::MAX), None, "length of the counts");
        assert_eq!(with(12, 5), None, "digits");
        assert_eq!(with(0, 0x1c84_9314), None, "compressed");
        let head = [&bytes[..4], &9_u32.to_be_bytes(), &bytes[8..HISTOGRAM_HEAD_BYTES]].concat();
        assert_eq!(read_histogram::<u32>(&[&head[..], &LEAST_COUNT].concat()), None);
    }

    #[test]
    fn a_histogram_of_more_events_than_there_can_be_is_refused() {
        let read = |events: u64| {
            let mut histogram = Histogram::<u64>::new(DIGITS).expect("the digits are valid");
            histogram.record_n(1_000, events).expect("in bounds");
            read_histogram::<u64>(&serialized(&histogram)).map(|histogram| histogram.len())
        };
        assert_eq!(read(EVENTS_MAX), Some(EVENTS_MAX));
        assert_eq!(read(EVENTS_MAX + 1), None);
    }
}
