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
//!     events.jsonl             one [`EventLine`] a line
//!     measurements.csv         the same numbers in long form, one value a row
//!     turn-time-*.hlog, .hgrm  one histogram per timing cell
//!     load-*.hlog, .hgrm       the histograms of each cell of open mode; .hgrm of time to knowledge
//!     summary.json             written last, from the files above alone
//! runs/latest                  points at the newest
//! ```
//!
//! Every record is one write of whole lines to a file opened for appending, so whatever is killed,
//! a reader finds every record that was complete, and at most one torn line at an end. Nothing is
//! forced to the disk: a power cut may lose what the kernel still holds. Reading is [`super::read`].

use super::event::{Event, EventLine};
use super::histogram::{to_interval_log, to_load_log, to_percentile_table};
use super::load::{CapacityRecord, LoadHistograms, LoadRecord};
use super::measurements;
use super::provenance::Provenance;
use super::read::read_run;
use super::record::{TimingRecord, TrialRecord};
use super::statistics::{histogram_of, merged};
use super::summary::Summary;
use crate::outcome::Outcome;
use serde::Serialize;
use shared_types::limits::CRAFTS_RECORDED_MAX;
use shared_types::time::Nanos;
use shared_types::transport::clock;
use std::borrow::Cow;
use std::fs::{File, OpenOptions};
use std::io::Write as _;
use std::path::{Path, PathBuf};

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
/// Name of the events' file.
pub const EVENTS_FILE: &str = "events.jsonl";
/// Name of the long form.
pub const MEASUREMENTS_FILE: &str = "measurements.csv";
/// Name of the summary.
pub const SUMMARY_FILE: &str = "summary.json";
/// Name of the link to the newest run.
pub const LATEST_LINK: &str = "latest";

/// Runs of one scenario and seed that may start within one second.
const SAME_SECOND_MAX: u32 = 1000;

/// Where a run's directory is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place<'a> {
    /// Below this directory, as `<scenario>/<stamp>-<seed>`, with `latest` pointing at it.
    Below(&'a Path),
    /// Here, in a directory that is empty or does not exist.
    Exactly(&'a Path),
}

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
        let open = |name: &str| append(&directory.join(name)).map_err(unwritable);
        let mut store = Self {
            began: clock::now(),
            trials: open(TRIALS_FILE)?,
            timings: open(TIMINGS_FILE)?,
            loads: open(LOADS_FILE)?,
            capacities: open(CAPACITIES_FILE)?,
            events: open(EVENTS_FILE)?,
            measurements: open(MEASUREMENTS_FILE)?,
            directory: directory.clone(),
        };
        store.measurements.write_all(&measurements::header_line()).map_err(unwritable)?;
        if let Place::Below(root) = place {
            point_latest_at(root, &directory).map_err(unwritable)?;
        }
        Ok(store)
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
        clock::now().since(self.began)
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

fn make_directory(place: Place<'_>, provenance: &Provenance) -> Result<PathBuf, StoreError> {
    match place {
        Place::Exactly(path) => {
            let unwritable = |source| StoreError::Unwritable { path: path.to_owned(), source };
            std::fs::create_dir_all(path).map_err(unwritable)?;
            if std::fs::read_dir(path).map_err(unwritable)?.next().is_some() {
                return Err(StoreError::NotEmpty { path: path.to_owned() });
            }
            Ok(path.to_owned())
        }
        Place::Below(root) => {
            let parent = root.join(directory_name(&provenance.scenario));
            let unwritable =
                |path: &Path, source| StoreError::Unwritable { path: path.to_owned(), source };
            std::fs::create_dir_all(&parent).map_err(|source| unwritable(&parent, source))?;
            let name = format!("{}-{}", provenance.stamp(), provenance.seed);
            (1..=SAME_SECOND_MAX)
                .find_map(|copy| {
                    let suffix = if copy == 1 { String::new() } else { format!("-{copy}") };
                    let path = parent.join(format!("{name}{suffix}"));
                    match std::fs::create_dir(&path) {
                        Ok(()) => Some(Ok(path)),
                        Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => None,
                        Err(error) => Some(Err(unwritable(&path, error))),
                    }
                })
                .unwrap_or(Err(StoreError::NotEmpty { path: parent.join(name) }))
        }
    }
}

/// A scenario's name as one component of a path.
fn directory_name(scenario: &str) -> String {
    let name: String = scenario
        .chars()
        .map(|sign| if sign.is_ascii_alphanumeric() || "-_.".contains(sign) { sign } else { '-' })
        .collect();
    let name = name.trim_matches('.');
    if name.is_empty() || name == LATEST_LINK {
        format!("scenario-{name}")
    } else {
        name.to_owned()
    }
}

/// Makes `root/latest` a relative link to `directory`, in one step for whoever looks.
fn point_latest_at(root: &Path, directory: &Path) -> std::io::Result<()> {
    let target = directory.strip_prefix(root).unwrap_or(directory);
    let temporary = root.join(format!(".{LATEST_LINK}-{}", std::process::id()));
    match std::fs::remove_file(&temporary) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(error),
        _ => {}
    }
    std::os::unix::fs::symlink(target, &temporary)?;
    std::fs::rename(&temporary, root.join(LATEST_LINK))
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
