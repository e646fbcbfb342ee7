//! What a directory must hold because of what else it holds.
//!
//! A file of lines that was cut off between two lines reads well; that it is not whole shows in the
//! others. The long form has rows of every record, every histogram has the events that its record
//! counts, and a table of percentiles, and a run that came to its end has a summary. Only the scenario
//! stands alone: one that was cut off between two lines is a scenario.

use super::complete_faults;
use super::histogram::STALENESS_TAG;
use super::measurements::{
    HEADER, RowKey, capacity_key, is_last_of_record, key_of, load_key, timing_key, trial_key,
};
use super::read::{Damage, LoadCell, Missing, RunData, TimedCell};
use super::resume::FleetKey;
use super::store::{
    CAPACITIES_FILE, LOADS_FILE, MEASUREMENTS_FILE, SCENARIO_FILE, SUMMARY_FILE, TIMINGS_FILE,
    TRIALS_FILE,
};
use hdrhistogram::Histogram;
use shared_types::wire::Stage;
use std::collections::{BTreeMap, BTreeSet};

/// The files whose records the long form has, by the phase that its rows name.
const FILES_OF_PHASES: [(&str, &str); 4] = [
    ("counted", TRIALS_FILE),
    ("timed", TIMINGS_FILE),
    ("loaded", LOADS_FILE),
    ("capacity", CAPACITIES_FILE),
];

/// What `run` lacks besides what was seen when its records were read.
pub(super) fn lacks(run: &RunData) -> Vec<Missing> {
    let mut missing = Vec::new();
    let mut lack = |file: &str, what: String| {
        missing.push(Missing { file: file.to_owned(), what });
    };
    if run.scenario.as_ref().is_some_and(|text| text.parse::<toml::Table>().is_err()) {
        lack(SCENARIO_FILE, "damaged: it is no TOML".to_owned());
    }
    for TimedCell { record, turn_times, .. } in &run.timings {
        if turn_times.as_ref().is_some_and(|times| times.len() != record.turn_time.n) {
            lack(&format!("{}.hlog", record.file_stem()), "not all turns are there".to_owned());
        }
    }
    for cell in &run.loads {
        let mut lost: Vec<&str> = lost_stages(cell).map(Stage::name).collect();
        if cell.knowledge.is_some() && events_of(&cell.staleness) != staleness_events(cell) {
            lost.push(STALENESS_TAG);
        }
        if !lost.is_empty() {
            let what = format!("not all events are there: {}", lost.join(", "));
            lack(&format!("{}.hlog", cell.record.file_stem()), what);
        }
    }
    let stems = run.timings.iter().map(|timed| timed.record.file_stem());
    for stem in stems.chain(run.loads.iter().map(|load| load.record.file_stem())) {
        let name = format!("{stem}.hgrm");
        match std::fs::read(run.directory.join(&name)) {
            Ok(table) if is_whole_table(&table) => {}
            Ok(_) => lack(&name, "cut short or damaged".to_owned()),
            Err(error) => lack(&name, error.to_string()),
        }
    }
    match std::fs::read(run.directory.join(MEASUREMENTS_FILE)) {
        Ok(bytes) => compare_rows(run, &bytes, &mut lack),
        Err(error) => lack(MEASUREMENTS_FILE, error.to_string()),
    }
    complete_faults::lacks(run, &mut lack);
    if run.outcome().is_some()
        && let Ok(summary) = std::fs::read(run.directory.join(SUMMARY_FILE))
        && let Err(error) = serde_json::from_slice::<serde::de::IgnoredAny>(&summary)
    {
        lack(SUMMARY_FILE, format!("damaged: {error}"));
    }
    missing
}

/// Whether a table of percentiles has its last line.
pub(super) fn is_whole_table(table: &[u8]) -> bool {
    let last =
        table.strip_suffix(b"]\n").and_then(|lines| lines.rsplit(|&byte| byte == b'\n').next());
    last.is_some_and(|line| line.starts_with(b"#[Buckets"))
}

fn events_of(histogram: &Option<Histogram<u64>>) -> u64 {
    histogram.as_ref().map_or(0, Histogram::len)
}

fn staleness_events(cell: &LoadCell) -> u64 {
    cell.record.staleness.as_ref().map_or(0, |ages| ages.n)
}

/// Stages whose histograms have not the events that the record counts, where histograms were read.
fn lost_stages(cell: &LoadCell) -> impl Iterator<Item = Stage> {
    let stages = cell.record.stages.iter().filter(|_| cell.knowledge.is_some());
    stages.filter_map(|(&stage, events)| {
        let found = match stage {
            Stage::Knowledge => events_of(&cell.knowledge),
            other => cell.stages.get(&other).map_or(0, Histogram::len),
        };
        (found != events.n).then_some(stage)
    })
}

/// The fleets of which a record or its rows are lost; all that are known if the long form is.
pub(super) fn doubtful_fleets(run: &RunData) -> BTreeSet<FleetKey> {
    let rows = std::fs::read(run.directory.join(MEASUREMENTS_FILE)).unwrap_or_default();
    let rows = csv::ReaderBuilder::new().flexible(true).from_reader(rows.as_slice());
    let told = rows.into_byte_records().filter_map(|row| key_of(&row.ok()?)).collect();
    keys_of(run).symmetric_difference(&told).filter_map(RowKey::fleet).collect()
}

/// Holds the rows of the long form against the records.
fn compare_rows(run: &RunData, bytes: &[u8], lack: &mut impl FnMut(&str, String)) {
    let mut rows = csv::ReaderBuilder::new().has_headers(false).flexible(true).from_reader(bytes);
    let (mut told, mut number, mut is_whole) = (BTreeSet::new(), 0_u64, bytes.ends_with(b"\n"));
    let mut damage = Damage::default();
    for row in rows.byte_records() {
        let key = row.as_ref().ok().and_then(key_of);
        match (number, row, key) {
            (0, Ok(header), _) if header.iter().eq(HEADER.map(str::as_bytes)) => {}
            // Written by another version: what its rows say is for others.
            (0, ..) => {
                return lack(
                    MEASUREMENTS_FILE,
                    "its header is damaged or of another version".to_owned(),
                );
            }
            (_, Ok(row), Some(key)) => {
                is_whole = bytes.ends_with(b"\n") && is_last_of_record(&row);
                told.insert(key);
            }
            _ => damage.found("row", number + 1, None),
        }
        number += 1;
    }
    if let Some(what) = damage.said() {
        lack(MEASUREMENTS_FILE, what);
    }
    if number == 0 || !is_whole {
        lack(MEASUREMENTS_FILE, "cut short".to_owned());
    }
    let kept = keys_of(run);
    let unwritten = kept.difference(&told).count();
    if unwritten > 0 {
        lack(MEASUREMENTS_FILE, format!("the rows of {unwritten} records are missing"));
    }
    let mut lost: BTreeMap<&str, usize> = BTreeMap::new();
    for key in told.difference(&kept) {
        let file = FILES_OF_PHASES.iter().find(|(phase, _)| key.phase == *phase);
        *lost.entry(file.map_or(MEASUREMENTS_FILE, |(_, file)| file)).or_default() += 1;
    }
    for (file, count) in lost {
        lack(file, format!("{count} records that {MEASUREMENTS_FILE} has are missing"));
    }
}

fn keys_of(run: &RunData) -> BTreeSet<RowKey> {
    let trials = run.trials.iter().map(trial_key);
    let timings = run.timings.iter().map(|timed| timing_key(&timed.record));
    let loads = run.loads.iter().map(|load| load_key(&load.record));
    trials.chain(timings).chain(loads).chain(run.capacities.iter().map(capacity_key)).collect()
}
