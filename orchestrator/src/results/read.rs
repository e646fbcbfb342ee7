//! Reads a run's directory back, whatever state it was left in.
//!
//! Only the scenario's directory itself must exist. What is absent, torn or damaged is left out and
//! listed, so that a report can say what it does not know.

use super::complete;
use super::event::{Event, EventLine};
use super::faults::FaultRecord;
use super::histogram::{IntervalLog, STALENESS_TAG, from_interval_log};
use super::inference::quantiles::Slice;
use super::load::{CapacityRecord, LoadRecord};
use super::provenance::Provenance;
use super::record::{TimingRecord, TrialRecord};
use super::store::{
    CAPACITIES_FILE, EVENTS_FILE, FAULTS_FILE, LATEST_LINK, LOADS_FILE, PROVENANCE_FILE,
    SCENARIO_FILE, SUMMARY_FILE, TIMINGS_FILE, TRIALS_FILE,
};
use crate::outcome::Outcome;
use hdrhistogram::Histogram;
use serde::de::DeserializeOwned;
use shared_types::wire::Stage;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Why a directory cannot be reported on.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// Not there, or not readable.
    #[error(
        "`{}` cannot be read: {source}; name a directory such as `runs/latest`",
        path.display()
    )]
    Unreadable {
        /// The directory.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A directory without any file of a run.
    #[error(
        "`{}` holds no run: neither {PROVENANCE_FILE} nor {TRIALS_FILE} is there; name a directory \
         such as `runs/latest`",
        path.display()
    )]
    NoRun {
        /// The directory.
        path: PathBuf,
    },
}

/// Something that a run's directory lacks.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Missing {
    /// The file.
    pub file: String,
    /// What is wrong with it.
    pub what: String,
}

/// A timing cell with its histogram, where that could be read.
#[derive(Clone, Debug, PartialEq)]
pub struct TimedCell {
    /// What was recorded.
    pub record: TimingRecord,
    /// Turn times, ns.
    pub turn_times: Option<Histogram<u64>>,
    /// The same epoch by epoch; empty where they could not be read.
    pub slices: Vec<Slice>,
}

/// A cell of open mode with its histograms, where they could be read.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadCell {
    /// What was recorded.
    pub record: LoadRecord,
    /// Time to knowledge, ns.
    pub knowledge: Option<Histogram<u64>>,
    /// The same slice by slice; empty where they could not be read.
    pub slices: Vec<Slice>,
    /// Every other stage that had events.
    pub stages: BTreeMap<Stage, Histogram<u64>>,
    /// Age of what stale reads did not see, ns.
    pub staleness: Option<Histogram<u64>>,
}

/// Everything that a run's directory says.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunData {
    /// The directory.
    pub directory: PathBuf,
    /// Where the results come from.
    pub provenance: Option<Provenance>,
    /// The scenario with every default written out.
    pub scenario: Option<String>,
    /// In the order in which they were run.
    pub trials: Vec<TrialRecord>,
    /// In the order in which they were run.
    pub timings: Vec<TimedCell>,
    /// In the order in which they were run.
    pub loads: Vec<LoadCell>,
    /// In the order in which they were searched for.
    pub capacities: Vec<CapacityRecord>,
    /// Faults of a campaign, in the order in which they were inflicted.
    pub faults: Vec<FaultRecord>,
    /// In the order in which they happened.
    pub events: Vec<EventLine>,
    /// What could not be read.
    pub missing: Vec<Missing>,
}

impl RunData {
    /// How the run ended, `None` if it was killed before it could say so.
    #[must_use]
    pub fn outcome(&self) -> Option<Outcome> {
        self.events.iter().rev().find_map(|line| match line.event {
            Event::Ended { code } => Outcome::from_code(code),
            _ => None,
        })
    }
}

/// Reads the run in `directory`, or the latest one if `directory` is a place of runs.
///
/// # Errors
/// If there is no run at all; a damaged one is read as far as it goes.
pub fn read_run(directory: &Path) -> Result<RunData, ReadError> {
    let unreadable = |source| ReadError::Unreadable { path: directory.to_owned(), source };
    std::fs::read_dir(directory).map_err(unreadable)?;
    let has_run = |path: &Path| {
        [PROVENANCE_FILE, TRIALS_FILE].into_iter().any(|name| path.join(name).exists())
    };
    let latest = directory.join(LATEST_LINK);
    let directory = if has_run(directory) {
        directory.to_owned()
    } else if has_run(&latest) {
        std::fs::canonicalize(&latest).map_err(unreadable)?
    } else {
        return Err(ReadError::NoRun { path: directory.to_owned() });
    };
    let mut reader = Reader { directory: &directory, missing: Vec::new() };
    let provenance = reader.text(PROVENANCE_FILE).and_then(|text| {
        serde_json::from_str(&text)
            .map_err(|error| reader.lacks(PROVENANCE_FILE, format!("damaged: {error}")))
            .ok()
    });
    let scenario = reader.text(SCENARIO_FILE);
    let trials = reader.lines(TRIALS_FILE);
    let timings =
        reader.lines(TIMINGS_FILE).into_iter().map(|record| reader.timed(record)).collect();
    let loads = reader.lines(LOADS_FILE).into_iter().map(|record| reader.loaded(record)).collect();
    let capacities = reader.lines(CAPACITIES_FILE);
    let is_campaign = directory.join(FAULTS_FILE).exists();
    let faults = if is_campaign { reader.lines(FAULTS_FILE) } else { Vec::new() };
    let events = reader.lines(EVENTS_FILE);
    let missing = reader.missing;
    let mut run = RunData {
        directory,
        provenance,
        scenario,
        trials,
        timings,
        loads,
        capacities,
        faults,
        events,
        missing,
    };
    if run.outcome().is_none() {
        run.missing.push(Missing {
            file: EVENTS_FILE.to_owned(),
            what: "the run did not come to its end: it was killed, or is still going on".to_owned(),
        });
    } else if !run.directory.join(SUMMARY_FILE).exists() {
        // Between the last event and the summary; while a run finishes this is its normal state.
        run.missing.push(Missing { file: SUMMARY_FILE.to_owned(), what: "absent".to_owned() });
    }
    let lacks = complete::lacks(&run);
    run.missing.extend(lacks);
    Ok(run)
}

/// Damaged parts of one file: how many, and which was the first.
#[derive(Debug, Default)]
pub(super) struct Damage {
    count: u64,
    /// What is counted.
    part: String,
    first: String,
}

impl Damage {
    /// Another one: `part` number `number`, and what is wrong with it.
    pub(super) fn found(&mut self, part: &str, number: u64, why: Option<String>) {
        self.count += 1;
        if self.count == 1 {
            let why = why.map_or_else(String::new, |why| format!(": {why}"));
            self.part = part.to_owned();
            self.first = format!("{part} {number} is damaged{why}");
        }
    }

    /// In one sentence; `None` if there is none.
    pub(super) fn said(&self) -> Option<String> {
        match self.count {
            0 => None,
            1 => Some(self.first.clone()),
            count => Some(format!("{count} {}s are damaged: {}", self.part, self.first)),
        }
    }
}

struct Reader<'a> {
    directory: &'a Path,
    missing: Vec<Missing>,
}

impl Reader<'_> {
    fn lacks(&mut self, file: &str, what: String) {
        self.missing.push(Missing { file: file.to_owned(), what });
    }

    /// A file's text, up to the first byte that is none.
    fn text(&mut self, name: &str) -> Option<String> {
        match std::fs::read(self.directory.join(name)) {
            Ok(bytes) => Some(String::from_utf8(bytes).unwrap_or_else(|error| {
                let whole = error.utf8_error().valid_up_to();
                self.lacks(name, format!("damaged at byte {whole}"));
                String::from_utf8_lossy(&error.as_bytes()[..whole]).into_owned()
            })),
            Err(error) => {
                self.lacks(name, error.to_string());
                None
            }
        }
    }

    /// The records of a file of lines; a torn one is listed, damaged ones are counted.
    fn lines<T: DeserializeOwned>(&mut self, name: &str) -> Vec<T> {
        let Some(text) = self.text(name) else { return Vec::new() };
        let (mut records, mut damage) = (Vec::new(), Damage::default());
        for (number, line) in (1_u64..).zip(text.split_inclusive('\n')) {
            if !line.ends_with('\n') {
                self.lacks(name, format!("line {number} is torn"));
                continue;
            }
            match serde_json::from_str(line) {
                Ok(record) => records.push(record),
                Err(error) => damage.found("line", number, Some(error.to_string())),
            }
        }
        if let Some(what) = damage.said() {
            self.lacks(name, what);
        }
        records
    }

    fn log(&mut self, stem: &str) -> Option<IntervalLog> {
        let name = format!("{stem}.hlog");
        self.text(&name).and_then(|text| {
            from_interval_log(&text).map_err(|error| self.lacks(&name, error.to_string())).ok()
        })
    }

    fn timed(&mut self, record: TimingRecord) -> TimedCell {
        let log = self.log(&record.file_stem());
        let (turn_times, slices) = log.map(|log| (log.all, log.slices)).unzip();
        TimedCell { record, turn_times, slices: slices.unwrap_or_default() }
    }

    fn loaded(&mut self, record: LoadRecord) -> LoadCell {
        let Some(IntervalLog { all, slices, mut tagged }) = self.log(&record.file_stem()) else {
            let (slices, stages) = (Vec::new(), BTreeMap::new());
            return LoadCell { record, knowledge: None, slices, stages, staleness: None };
        };
        let staleness = tagged.remove(STALENESS_TAG);
        let of_stage = |stage: Stage| Some((stage, tagged.remove(stage.name())?));
        let stages = Stage::ALL.into_iter().filter_map(of_stage).collect();
        LoadCell { record, knowledge: Some(all), slices, stages, staleness }
    }
}
