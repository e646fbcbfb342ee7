//! Histograms as text: `.hlog` (V2 interval log, lossless, read by the usual HdrHistogram tools and
//! by us) and `.hgrm` (percentile table, for plots and eyes).
//!
//! Intervals without a tag are slices of the one quantity that a log is about; each tagged interval is
//! another quantity as a whole.

use super::inference::quantiles::Slice;
use super::load::LoadHistograms;
use super::statistics::time_histogram;
use agent::metrics::read_histogram;
use base64::Engine as _;
use flate2::read::ZlibDecoder;
use hdrhistogram::Histogram;
use hdrhistogram::serialization::V2DeflateSerializer;
use hdrhistogram::serialization::interval_log::{
    IntervalLogIterator, IntervalLogWriterBuilder, LogEntry, Tag,
};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::Read as _;
use std::time::Duration;

/// Steps of the percentile table in which the distance to 100 % is halved.
const STEPS_PER_HALVING: u32 = 5;

/// How a compressed histogram in the V2 format begins; the length of the rest follows.
const COMPRESSED_COOKIE: [u8; 4] = 0x1c84_9314_u32.to_be_bytes();

/// Most bytes of a histogram that is not compressed: one with our digits has half as many, of any values.
const HISTOGRAM_BYTES_MAX: u64 = 1 << 20;

/// Why an interval log cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LogError {
    /// It holds no interval.
    #[error("holds no complete interval")]
    Empty,
    /// A line is no interval, or its histogram is damaged.
    #[error("interval {0} is damaged")]
    Damaged(usize),
}

/// `slices` of times in ns as an interval log, one interval a slice, the first `start_ns` into the run.
/// The length of an interval is the sum of its values, which for turn times is the time measured.
///
/// # Panics
/// Never: memory takes every log.
#[must_use]
pub fn to_interval_log(slices: &[Vec<u64>], start_ns: u64) -> String {
    let (mut text, mut serializer) = (Vec::new(), V2DeflateSerializer::new());
    let mut builder = IntervalLogWriterBuilder::new();
    let mut writer = builder
        .add_comment("[Histogram log format version 1.3]")
        .add_comment("[values in ns; timestamps in seconds since the run began]")
        .begin_log_with(&mut text, &mut serializer)
        .expect("invariant: memory takes every log");
    let (mut began, mut histogram) = (Duration::from_nanos(start_ns), time_histogram());
    for slice in slices {
        histogram.reset();
        slice.iter().for_each(|&time_ns| histogram.saturating_record(time_ns));
        let length = Duration::from_nanos(slice.iter().copied().fold(0, u64::saturating_add));
        writer
            .write_histogram(&histogram, began, length, None)
            .expect("invariant: memory takes every log");
        began = began.saturating_add(length);
    }
    String::from_utf8(text).expect("invariant: interval logs are ASCII")
}

/// Tag of the age of what stale reads did not see, beside the names of stages.
pub const STALENESS_TAG: &str = "staleness";

/// The histograms of a cell of open mode as an interval log: time to knowledge slice by slice, the
/// first `start_ns` into the run, then every stage over the whole interval, tagged with its name.
///
/// # Panics
/// Never: memory takes every log.
#[must_use]
pub fn to_load_log(histograms: &LoadHistograms, start_ns: u64) -> String {
    let (mut text, mut serializer) = (Vec::new(), V2DeflateSerializer::new());
    let mut builder = IntervalLogWriterBuilder::new();
    let mut writer = builder
        .add_comment("[Histogram log format version 1.3]")
        .add_comment("[values in ns, of records-per-sample in records; timestamps in seconds since the run began]")
        .begin_log_with(&mut text, &mut serializer)
        .expect("invariant: memory takes every log");
    let start = Duration::from_nanos(start_ns);
    let slice = Duration::from_nanos(histograms.slice_ns);
    let mut began = start;
    for knowledge in &histograms.knowledge {
        writer
            .write_histogram(knowledge, began, slice, None)
            .expect("invariant: memory takes every log");
        began = began.saturating_add(slice);
    }
    let stages = histograms.stages.iter().map(|(stage, events)| (stage.name(), events));
    let staleness = histograms.staleness.iter().map(|ages| (STALENESS_TAG, ages));
    for (name, events) in stages.chain(staleness) {
        let tag = Tag::new(name).expect("invariant: names of stages hold no comma");
        writer
            .write_histogram(events, start, began.saturating_sub(start), Some(tag))
            .expect("invariant: memory takes every log");
    }
    String::from_utf8(text).expect("invariant: interval logs are ASCII")
}

/// What an interval log holds.
#[derive(Clone, Debug, PartialEq)]
pub struct IntervalLog {
    /// All intervals without a tag together.
    pub all: Histogram<u64>,
    /// The values of each of them.
    pub slices: Vec<Slice>,
    /// The others, by tag.
    pub tagged: BTreeMap<String, Histogram<u64>>,
}

/// Reads an interval log.
///
/// # Errors
/// If there is no interval without a tag, or one cannot be decoded.
pub fn from_interval_log(text: &str) -> Result<IntervalLog, LogError> {
    let (mut all, mut slices): (Option<Histogram<u64>>, _) = (None, Vec::new());
    let mut tagged = BTreeMap::new();
    let entries = IntervalLogIterator::new(text.as_bytes());
    for (number, entry) in entries.enumerate() {
        let damaged = || LogError::Damaged(number);
        let LogEntry::Interval(interval) = entry.map_err(|_| damaged())? else { continue };
        let bytes = base64::engine::general_purpose::STANDARD
            .decode(interval.encoded_histogram())
            .map_err(|_| damaged())?;
        let one: Histogram<u64> =
            inflated(bytes).and_then(|bytes| read_histogram(&bytes)).ok_or_else(damaged)?;
        if let Some(tag) = interval.tag() {
            tagged.insert(tag.as_str().to_owned(), one);
            continue;
        }
        let steps = one.iter_recorded();
        slices.push(steps.map(|step| (step.value_iterated_to(), step.count_at_value())).collect());
        match &mut all {
            Some(all) => all.add(&one).map_err(|_| damaged())?,
            None => all = Some(one),
        }
    }
    Ok(IntervalLog { all: all.ok_or(LogError::Empty)?, slices, tagged })
}

/// What `bytes` hold if they are compressed, else themselves; `None` if they are damaged.
fn inflated(bytes: Vec<u8>) -> Option<Vec<u8>> {
    let Some(rest) = bytes.strip_prefix(&COMPRESSED_COOKIE) else { return Some(bytes) };
    let (length, compressed) = rest.split_first_chunk()?;
    if u32::from_be_bytes(*length) as usize != compressed.len() {
        return None;
    }
    let mut inflated = Vec::new();
    // Read to its end, where its checksum is.
    let mut reader = ZlibDecoder::new(compressed).take(HISTOGRAM_BYTES_MAX);
    reader.read_to_end(&mut inflated).ok().map(|_| inflated)
}

/// `histogram` as a percentile table in the format of the usual plotters. Values in ns.
#[must_use]
pub fn to_percentile_table(histogram: &Histogram<u64>) -> String {
    let mut text = String::from("       Value     Percentile TotalCount 1/(1-Percentile)\n\n");
    let mut count = 0;
    for step in histogram.iter_quantiles(STEPS_PER_HALVING) {
        count += step.count_since_last_iteration();
        let (value, quantile) = (step.value_iterated_to(), step.quantile_iterated_to());
        // Writing to a string cannot fail.
        let _ = if quantile < 1.0 {
            let one_in = 1.0 / (1.0 - quantile);
            writeln!(text, "{value:12} {quantile:2.12} {count:10} {one_in:14.2}")
        } else {
            writeln!(text, "{value:12} {quantile:2.12} {count:10}")
        };
    }
    let _ = writeln!(
        text,
        "#[Mean    = {:12.3}, StdDeviation   = {:12.3}]\n#[Max     = {:12}, Total count    = {:12}]\n\
         #[Buckets = {:12}, SubBuckets     = {:12}]",
        histogram.mean(),
        histogram.stdev(),
        histogram.max(),
        histogram.len(),
        histogram.buckets(),
        (2 * 10_u32.pow(u32::from(histogram.sigfig()))).next_power_of_two(),
    );
    text
}

#[cfg(test)]
mod tests {
    use super::{
        COMPRESSED_COOKIE, LogError, from_interval_log, to_interval_log, to_percentile_table,
    };
    use crate::results::statistics::time_histogram;
    use base64::Engine as _;
    use flate2::Compression;
    use flate2::write::ZlibEncoder;
    use std::io::Write as _;

    #[test]
    fn an_interval_log_gives_back_the_very_histogram() {
        let mut histogram = time_histogram();
        let slices: Vec<Vec<u64>> = vec![(1..900).collect(), (900..2000).map(|v| v * v).collect()];
        slices.iter().flatten().for_each(|&value| histogram.saturating_record(value));
        let log = from_interval_log(&to_interval_log(&slices, 5_000_000)).unwrap();
        assert_eq!(log.all, histogram);
        let counts: Vec<u64> =
            log.slices.iter().map(|slice| slice.iter().map(|&(_, count)| count).sum()).collect();
        assert_eq!(counts, [899, 1100]);
    }

    #[test]
    fn an_empty_histogram_survives_too() {
        let log = from_interval_log(&to_interval_log(&[Vec::new()], 0)).unwrap();
        assert_eq!((log.all.len(), log.slices), (0, vec![Vec::new()]));
    }

    #[test]
    fn intervals_are_added_up_and_damage_is_named() {
        let log = to_interval_log(&[vec![7]], 0);
        let twice = format!("{log}{}", log.lines().last().unwrap());
        assert_eq!(from_interval_log(&format!("{twice}\n")).map(|both| both.all.len()), Ok(2));
        assert_eq!(from_interval_log("#nothing\n"), Err(LogError::Empty));
        let torn = &log[..log.len() - 20];
        assert!(from_interval_log(torn).is_err());
    }

    #[test]
    fn a_histogram_that_asks_for_gibibytes_and_one_that_inflates_to_them_are_damaged() {
        let head = |length: u32| {
            let words = [0x1c84_9313, length, 0, 3, 0, 1, 0, u32::MAX, 0x3ff0_0000, 0];
            words.iter().flat_map(|word: &u32| word.to_be_bytes()).collect::<Vec<u8>>()
        };
        let read = |bytes: &[u8]| {
            let text = base64::engine::general_purpose::STANDARD.encode(bytes);
            from_interval_log(&format!("0.000,1.000,0.000,{text}\n")).map(|log| log.all.len())
        };
        assert_eq!(read(&head(0)), Ok(0));
        assert_eq!(read(&head(u32::MAX)), Err(LogError::Damaged(0)));
        let deflated = |plain: &[u8]| {
            let mut zlib = ZlibEncoder::new(Vec::new(), Compression::fast());
            zlib.write_all(plain).unwrap();
            let zlib = zlib.finish().unwrap();
            let length = u32::try_from(zlib.len()).unwrap().to_be_bytes();
            [&COMPRESSED_COOKIE[..], &length, &zlib].concat()
        };
        let whole = deflated(&head(0));
        assert_eq!(read(&whole), Ok(0));
        assert_eq!(read(&whole[..whole.len() - 1]), Err(LogError::Damaged(0)));
        let mut altered = whole.clone();
        *altered.last_mut().unwrap() ^= 1;
        assert_eq!(read(&altered), Err(LogError::Damaged(0)), "its checksum is looked at");
        let mut zeros = head(1 << 26);
        zeros.resize(40 + (1 << 26), 0);
        assert_eq!(read(&deflated(&zeros)), Err(LogError::Damaged(0)));
    }

    #[test]
    fn the_percentile_table_ends_with_all_values() {
        let mut histogram = time_histogram();
        (1..=100_u64).for_each(|value| histogram.saturating_record(value));
        let table = to_percentile_table(&histogram);
        assert!(table.contains("100 1.000000000000        100\n"), "{table}");
        assert!(table.contains("Total count    =          100"), "{table}");
    }
}
