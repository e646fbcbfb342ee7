//! The files of a results directory one by one: records and documents as JSON, interval logs.

use crate::results::event::{Event, EventLine, ProcessEnd};
use crate::results::histogram::{from_interval_log, to_load_log, to_percentile_table};
use crate::results::load::{CapacityRecord, LoadRecord};
use crate::results::measurements::{
    capacity_lines, header_line, is_about, load_lines, timing_lines, trial_lines,
};
use crate::results::provenance::Provenance;
use crate::results::record::{Cell, TimingRecord, TrialRecord};
use crate::results::sample::{capacity, load, provenance, timing, trial};
use crate::results::sweep::SweepFile;
use crate::scenario::Axis;
use serde::Serialize;
use serde::de::DeserializeOwned;
use shared_types::wire::StrategyKind;
use std::fmt::Debug;

const CELL: Cell = Cell { block: 1, size: 3, strategy: StrategyKind::CentralBatched };

/// One byte that says what it is, then the JSON. What is read is the same after it was written and read
/// again; every row of its long form is about its fleet.
pub(super) fn read(bytes: &[u8]) {
    let Some((kind, json)) = bytes.split_first() else { return };
    match kind % 7 {
        0 => {
            rows(reread(json).as_ref(), trial_lines, |trial: &TrialRecord| trial.deterministic.cell)
        }
        1 => rows(reread(json).as_ref(), timing_lines, |timing: &TimingRecord| timing.cell),
        2 => rows(reread(json).as_ref(), load_lines, |load: &LoadRecord| load.cell),
        3 => rows(reread(json).as_ref(), capacity_lines, |capacity: &CapacityRecord| capacity.cell),
        4 => drop(reread::<EventLine>(json)),
        5 => drop(reread::<Provenance>(json).map(|then| {
            assert_eq!(then.differences(&then), []);
            then.stamp()
        })),
        _ => drop(reread::<SweepFile>(json)),
    }
}

fn reread<T: Serialize + DeserializeOwned + PartialEq + Debug>(json: &[u8]) -> Option<T> {
    let value: T = serde_json::from_slice(json).ok()?;
    let written = serde_json::to_vec(&value).expect("what was read can be written");
    let again: T = serde_json::from_slice(&written).expect("what was written can be read");
    assert_eq!(again, value);
    Some(value)
}

fn rows<T>(record: Option<&T>, lines: fn(&T) -> Vec<u8>, cell: impl Fn(&T) -> Cell) {
    let Some(record) = record else { return };
    let (cell, lines) = (cell(record), lines(record));
    let reader = csv::ReaderBuilder::new().has_headers(false).from_reader(lines.as_slice());
    for row in reader.into_byte_records() {
        let row = row.expect("what was written is CSV");
        assert_eq!(is_about(&row), Some((cell.size, cell.block)), "{row:?}");
    }
}

/// One of each.
pub(super) fn seeds() -> Vec<Vec<u8>> {
    fn seed(kind: u8, value: &impl Serialize) -> Vec<u8> {
        let json = serde_json::to_vec(value).expect("records are plain data");
        [vec![kind], json].concat()
    }
    let lost = Event::CraftLost {
        size: 3,
        name: "craft-1".to_owned(),
        end: ProcessEnd::Signal(9),
        phase: "turn 3 of trial 0".to_owned(),
    };
    let axes = vec![Axis { key: "network.links".to_owned(), values: vec!["1".to_owned()] }];
    let cells = vec![(vec!["1".to_owned()], "[run]\nseed = 7\n".to_owned())];
    vec![
        seed(0, &trial(2, StrategyKind::Full, 1)),
        seed(1, &timing(3, StrategyKind::Boundary, 40).0),
        seed(2, &load(CELL, 1, "80%", 40, 1.5).0),
        seed(3, &capacity(CELL)),
        seed(4, &EventLine { at_ns: 5, event: lost }),
        seed(4, &EventLine { at_ns: 9, event: Event::Ended { code: 3 } }),
        seed(5, &provenance()),
        seed(6, &SweepFile::new(axes, cells, provenance())),
        [&[7][..], &header_line()].concat(),
    ]
}

/// An interval log is refused, or its slices hold as many values as all of it, and it can be tabled.
pub(super) fn logs(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let Ok(log) = from_interval_log(text) else { return };
    let values = log.slices.iter().flatten().map(|&(_, count)| u128::from(count)).sum::<u128>();
    assert_eq!(values.min(u128::from(u64::MAX)), u128::from(log.all.len()));
    assert!(to_percentile_table(&log.all).contains("Total count"));
}

/// With and without tags.
pub(super) fn logs_seeds() -> Vec<Vec<u8>> {
    let log = |factor| to_load_log(&load(CELL, 0, "common", 40, factor).1, 5_000_000).into_bytes();
    vec![log(1.0), log(3.0)]
}
