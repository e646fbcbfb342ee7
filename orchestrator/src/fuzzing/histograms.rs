//! Histograms as crafts report them and as interval logs hold them: there behind base64, compression and a
//! checksum, which no mutation of a log gets past.

use crate::results::histogram::{from_interval_log, to_percentile_table};
use crate::results::statistics::{Distribution, histogram_of, merged};
use agent::metrics::read_histogram;
use base64::Engine as _;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use hdrhistogram::Histogram;
use hdrhistogram::serialization::{Serializer, V2Serializer};
use std::io::Write as _;

/// How a compressed histogram begins.
const COMPRESSED: [u8; 4] = 0x1c84_9314_u32.to_be_bytes();

/// A histogram in the V2 format, uncompressed. It is refused here and in a log, or is the same in both, and
/// once written; and it can be merged, tabled and told.
pub(super) fn read(bytes: &[u8]) {
    let read: Option<Histogram<u64>> = read_histogram(bytes);
    let mut compressed = ZlibEncoder::new(Vec::new(), Compression::fast());
    compressed.write_all(bytes).expect("memory takes every histogram");
    let compressed = compressed.finish().expect("memory takes every histogram");
    let length = u32::try_from(compressed.len()).expect("inputs are short").to_be_bytes();
    let text = base64::engine::general_purpose::STANDARD
        .encode([&COMPRESSED[..], &length, &compressed].concat());
    let logged = from_interval_log(&format!("0.000,1.000,0.000,{text}\n"));
    assert_eq!(logged.as_ref().map(|log| &log.all).ok(), read.as_ref());
    let Some(histogram) = read else { return };
    let mut written = Vec::new();
    V2Serializer::new().serialize(&histogram, &mut written).expect("what was read can be written");
    assert_eq!(read_histogram::<u64>(&written).as_ref(), Some(&histogram));
    let all = merged([&histogram, &histogram_of([7])]);
    assert!(all.len() >= histogram.len());
    let _told = (Distribution::of(&all), Distribution::of(&histogram));
    assert!(to_percentile_table(&histogram).contains("Total count"));
}

/// Nothing, one value, many, and the longest times.
pub(super) fn seeds() -> Vec<Vec<u8>> {
    let written = |values: Vec<u64>| {
        let mut bytes = Vec::new();
        let histogram = histogram_of(values);
        V2Serializer::new()
            .serialize(&histogram, &mut bytes)
            .expect("memory takes every histogram");
        bytes
    };
    let long = (0..20).map(|number| u64::MAX >> (number + 20)).collect();
    vec![written(Vec::new()), written(vec![7]), written((1..300).collect()), written(long)]
}
