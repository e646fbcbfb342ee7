//! The directory of one run, written as the run goes.
//!
//! ```text
//! runs/<scenario>/<stamp>-<seed>/
//!     scenario.resolved.toml   what was run, every default written out
//!     env.json                 where and with what: [`Provenance`]
//!     trials.jsonl             one [`TrialRecord`] a line
//!     timings.jsonl            one [`TimingRecord`] a line
//!     loads.jsonl              one [`LoadRecord`] a line
//!     capacities.jsonl         one [`CapacityRecord`] a line
//!     faults.jsonl             one [`FaultRecord`] a line; campaigns only
//!     events.jsonl             one [`EventLine`] a line
//!     measurements.csv         the same numbers in long form, one value a row
//!     turn-time-*.hlog, .hgrm  one histogram per timing cell
//!     load-*.hlog, .hgrm       the histograms of each cell of open mode; .hgrm of time to knowledge
//!     recovery-*.hlog, .hgrm   times of each step of recovery; campaigns only
//!     summary.json             written last, from the files above alone
//! runs/latest                  points at the newest
//! ```
//!
//! Every record is one write of whole lines to a file opened for appending, so whatever is killed,
//! a reader finds every record that was complete, and at most one torn line at an end. Nothing is
//! forced to the disk: a power cut may lose what the kernel still holds. Reading is [`super::read`].

use super::complete_faults::{log_of, table_of};
use super::directory::{make_directory, point_latest_at};
use super::event::{Event, EventLine};
use super::faults::{FaultRecord, Step};
use super::histogram::{to_interval_log, to_load_log, to_percentile_table};
use super::load::{CapacityRecord, LoadHistograms, LoadRecord};
use super::measurements;
use super::provenance::{Provenance, Resumption};
use super::read::read_run;
use super::record::{TimingRecord, TrialRecord};
use super::resume::{FleetKey, ResumeError, Unfinished, lock};
use super::statistics::{histogram_of, merged};
use super::summary::Summary;
use crate::outcome::Outcome;
use serde::Serialize;
use shared_types::limits::CRAFTS_RECORDED_MAX;
use shared_types::time::Nanos;
use shared_types::transport::clock;
use std::borrow::Cow;
use std::collections::BTreeSet;
use std::fs::{File, OpenOptions};
use std::io::Write as _;
use std::path::{Path, PathBuf};

pub use super::directory::Place;

/// Name of the resolved scenario's file.
pub const SCENARIO_FILE: &str = "scenario.resolved.toml";
/// Name of the provenance file.
pub const PROVENANCE_FILE: &str = "env.json";
/// Name of the trials' file.
pub const TRIALS_FILE: &str = "trials.jsonl";
/// Name of the timing cells' file.
pub const TIMINGS_FILE: &str = "timings.jsonl";
/// Name of the file of the cells of open mode.
pub const LOADS_FILE: &str = "loads.jsonl";
/// Name of the file of the searches for capacity.
pub const CAPACITIES_FILE: &str = "capacities.jsonl";
/// Name of the file of a campaign's faults; only campaigns have one.
pub const FAULTS_FILE: &str = "faults.jsonl";
/// Name of the events' file.
pub const EVENTS_FILE: &str = "events.jsonl";
/// Name of the long form.
pub const MEASUREMENTS_FILE: &str = "measurements.csv";
/// Name of the summary.
pub const SUMMARY_FILE: &str = "summary.json";
/// Name of the link to the newest run.
pub const LATEST_LINK: &str = "latest";

/// Why results cannot be kept.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// Found before anything was started.
    #[error(
        "results cannot be written to `{}`: {source}; choose another place with `--out DIR`",
        path.display()
    )]
    Unwritable {
        /// What could not be made.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Somebody's files are there.
    #[error(
        "`{}` is not empty, and results are never overwritten; name another directory or remove it",
        path.display()
    )]
    NotEmpty {
        /// The directory asked for.
        path: PathBuf,
    },
    /// The disk failed or filled up while the run went on.
    #[error(
        "a result could not be written to `{}`: {source}; what was written before is kept",
        path.display()
    )]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
}

/// An open run directory.
#[derive(Debug)]
pub struct Store {
    directory: PathBuf,
    began: Nanos,
    /// What had passed when the run was cut off, ns.
    passed_ns: u64,
    /// The fleets that are complete already.
    done: BTreeSet<FleetKey>,
    /// The worst of what they ended with.
    outcome: Outcome,
    /// Keeps other processes from going on with the run.
    _lock: Option<File>,
    trials: File,
    timings: File,
    loads: File,
    capacities: File,
    events: File,
    measurements: File,
}

impl Store {
    /// Makes the directory with everything that is known before the run, and points `latest` at it.
    ///
    /// # Errors
    /// If it cannot be written; nothing that matters is left behind then.
    pub fn create(
        place: Place<'_>,
        provenance: &Provenance,
        resolved_scenario: &str,
    ) -> Result<Self, StoreError> {
        let directory = make_directory(place, provenance)?;
        let unwritable = |source| StoreError::Unwritable { path: directory.clone(), source };
        let write = |name: &str, bytes: &[u8]| {
            std::fs::write(directory.join(name), bytes).map_err(unwritable)
        };
        write(SCENARIO_FILE, resolved_scenario.as_bytes())?;
        write(PROVENANCE_FILE, pretty(provenance).as_bytes())?;
        let mut store = Self::open(&directory).map_err(unwritable)?;
        store.measurements.write_all(&measurements::header_line()).map_err(unwritable)?;
        if let Place::Below(root) = place {
            point_latest_at(root, &directory).map_err(unwritable)?;
        }
        Ok(store)
    }

    /// Goes on with a run that was cut off, as `now` would start it: what is incomplete is dropped, and
    /// the provenance keeps the moment.
    ///
    /// # Errors
    /// If plan, build or host are others, or a file cannot be written.
    pub fn resume(unfinished: Unfinished, now: &Provenance) -> Result<Self, ResumeError> {
        unfinished.check(now)?;
        let (done, outcome) = (unfinished.done(), unfinished.outcome());
        let (passed_ns, mut provenance) =
            (unfinished.last_at_ns(), unfinished.provenance().clone());
        let directory = unfinished.directory().to_owned();
        let lock = unfinished.tidy()?;
        let failed = |source| ResumeError::Write { path: directory.clone(), source };
        let fleets = done.len() as u64;
        let (date, host) = (now.date.clone(), now.host.clone());
        provenance.resumed.push(Resumption { date, host, fleets });
        let opened = Self::open(&directory).map_err(failed)?;
        let mut store = Self { passed_ns, done, outcome, _lock: Some(lock), ..opened };
        if store.measurements.metadata().map_err(failed)?.len() == 0 {
            store.measurements.write_all(&measurements::header_line()).map_err(failed)?;
        }
        let kept = store.replace(PROVENANCE_FILE, &pretty(&provenance));
        kept.and_then(|()| store.event(Event::Resumed { fleets }))
            .map_err(|error| failed(std::io::Error::other(error)))?;
        Ok(store)
    }

    /// Opens the files of records in `directory`.
    fn open(directory: &Path) -> std::io::Result<Self> {
        let open = |name: &str| append(&directory.join(name));
        Ok(Self {
            began: clock::now(),
            passed_ns: 0,
            done: BTreeSet::new(),
            outcome: Outcome::Success,
            _lock: lock(directory).ok(),
            trials: open(TRIALS_FILE)?,
            timings: open(TIMINGS_FILE)?,
            loads: open(LOADS_FILE)?,
            capacities: open(CAPACITIES_FILE)?,
            events: open(EVENTS_FILE)?,
            measurements: open(MEASUREMENTS_FILE)?,
            directory: directory.to_owned(),
        })
    }

    /// Whether the fleet of `size` crafts in `block` is complete since before the run was cut off.
    #[must_use]
    pub fn has_fleet(&self, size: u32, block: u32) -> bool {
        self.done.contains(&(size, block))
    }

    /// The worst of what complete fleets ended with before the run was cut off.
    #[must_use]
    pub const fn outcome_so_far(&self) -> Outcome {
        self.outcome
    }

    /// The run's directory.
    #[must_use]
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    /// Keeps a trial; of a fleet above [`CRAFTS_RECORDED_MAX`] only what is said there.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn append_trial(&mut self, record: &TrialRecord) -> Result<(), StoreError> {
        let record = bounded(record);
        let done = self.trials.write_all(&json_line(record.as_ref()));
        self.written(done, TRIALS_FILE)?;
        let done = self.measurements.write_all(&measurements::trial_lines(&record));
        self.written(done, MEASUREMENTS_FILE)
    }

    /// Keeps a timing cell and its turn times, ns, epoch by epoch. Their histograms are complete on
    /// disk before the record that names them.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn append_timing(
        &mut self,
        record: &TimingRecord,
        turn_times: &[Vec<u64>],
    ) -> Result<(), StoreError> {
        let (stem, at_ns) = (record.file_stem(), self.elapsed_ns());
        self.replace(&format!("{stem}.hlog"), &to_interval_log(turn_times, at_ns))?;
        self.replace(
            &format!("{stem}.hgrm"),
            &to_percentile_table(&histogram_of(turn_times.iter().flatten().copied())),
        )?;
        let done = self.timings.write_all(&json_line(record));
        self.written(done, TIMINGS_FILE)?;
        let done = self.measurements.write_all(&measurements::timing_lines(record));
        self.written(done, MEASUREMENTS_FILE)
    }

    /// Keeps a cell of open mode and its histograms, which are complete on disk before the record that
    /// names them.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn append_load(
        &mut self,
        record: &LoadRecord,
        histograms: &LoadHistograms,
    ) -> Result<(), StoreError> {
        let (stem, at_ns) = (record.file_stem(), self.elapsed_ns());
        self.replace(&format!("{stem}.hlog"), &to_load_log(histograms, at_ns))?;
        let knowledge = merged(&histograms.knowledge);
        self.replace(&format!("{stem}.hgrm"), &to_percentile_table(&knowledge))?;
        let done = self.loads.write_all(&json_line(record));
        self.written(done, LOADS_FILE)?;
        let done = self.measurements.write_all(&measurements::load_lines(record));
        self.written(done, MEASUREMENTS_FILE)
    }

    /// Keeps a search for capacity.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn append_capacity(&mut self, record: &CapacityRecord) -> Result<(), StoreError> {
        let done = self.capacities.write_all(&json_line(record));
        self.written(done, CAPACITIES_FILE)?;
        let done = self.measurements.write_all(&measurements::capacity_lines(record));
        self.written(done, MEASUREMENTS_FILE)
    }

    /// Keeps a fault of a campaign.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn append_fault(&mut self, record: &FaultRecord) -> Result<(), StoreError> {
        let path = self.directory.join(FAULTS_FILE);
        let done = append(&path).and_then(|mut file| file.write_all(&json_line(record)));
        self.written(done, FAULTS_FILE)
    }

    /// Keeps the times of a step of recovery, ns, as histograms.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn keep_recovery_times(&self, step: Step, times_ns: Vec<u64>) -> Result<(), StoreError> {
        let table = to_percentile_table(&histogram_of(times_ns.iter().copied()));
        self.replace(&table_of(step), &table)?;
        let log = to_interval_log(&[times_ns], self.elapsed_ns());
        self.replace(&log_of(step), &log)
    }

    /// Keeps an event, stamped with the time since the directory was made.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn event(&mut self, event: Event) -> Result<(), StoreError> {
        let line = EventLine { at_ns: self.elapsed_ns(), event };
        let done = self.events.write_all(&json_line(&line));
        self.written(done, EVENTS_FILE)
    }

    /// Ends the run: the last event, then the summary, computed from the files as any later report
    /// computes it. Returns the summary for the tables on the terminal.
    ///
    /// # Errors
    /// If a file cannot be written or read back.
    pub fn finish(mut self, outcome: Outcome) -> Result<Summary, StoreError> {
        self.event(Event::Ended { code: outcome.code() })?;
        let mut run = read_run(&self.directory).map_err(|error| StoreError::Write {
            path: self.directory.clone(),
            source: std::io::Error::other(error),
        })?;
        run.missing.retain(|missing| missing.file != SUMMARY_FILE);
        let summary = Summary::of(&run);
        self.replace(SUMMARY_FILE, &pretty(&summary))?;
        Ok(summary)
    }

    fn elapsed_ns(&self) -> u64 {
        self.passed_ns.saturating_add(clock::now().since(self.began))
    }

    /// Writes a whole file under another name and moves it into place.
    fn replace(&self, name: &str, text: &str) -> Result<(), StoreError> {
        let temporary = self.directory.join(format!(".{name}.partial"));
        let done = std::fs::write(&temporary, text)
            .and_then(|()| std::fs::rename(&temporary, self.directory.join(name)));
        self.written(done, name)
    }

    fn written(&self, done: std::io::Result<()>, name: &str) -> Result<(), StoreError> {
        done.map_err(|source| StoreError::Write { path: self.directory.join(name), source })
    }
}

/// The record, without the crafts of a large fleet that are as expected.
fn bounded(record: &TrialRecord) -> Cow<'_, TrialRecord> {
    if record.deterministic.crafts.len() <= CRAFTS_RECORDED_MAX {
        return Cow::Borrowed(record);
    }
    let mut small = record.clone();
    small.deterministic.crafts.retain(|craft| craft.measured != craft.expected);
    small.deterministic.crafts.truncate(CRAFTS_RECORDED_MAX);
    small.timing.processes.clear();
    Cow::Owned(small)
}

fn append(path: &Path) -> std::io::Result<File> {
    OpenOptions::new().append(true).create(true).open(path)
}

fn json_line(record: &impl Serialize) -> Vec<u8> {
    let mut line = serde_json::to_vec(record).expect("invariant: records are plain data");
    line.push(b'\n');
    line
}

fn pretty(document: &impl Serialize) -> String {
    let text = serde_json::to_string_pretty(document).expect("invariant: documents are plain data");
    text + "\n"
}
