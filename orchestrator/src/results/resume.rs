//! Goes on with a run that was cut off: what of its directory stands, and what must be the same.
//!
//! A fleet whose last event is there is complete, unless records and long form disagree on it, as a power
//! cut may leave them. What the other fleets left is dropped, file by file, each replaced in one step, so
//! that a kill meanwhile changes nothing that counts. What went wrong stays told. The seed decides
//! everything else, so a run may only go on with the plan, the build and the host with which it began. Not
//! here: which fleets are planned (the run loop asks).

use super::complete;
use super::event::{Event, EventLine};
use super::load::{CapacityRecord, LoadRecord};
use super::measurements::is_about;
use super::provenance::Provenance;
use super::read::read_run;
use super::record::{Cell, TimingRecord, TrialRecord};
use super::store::{
    CAPACITIES_FILE, EVENTS_FILE, LOADS_FILE, MEASUREMENTS_FILE, SCENARIO_FILE, SUMMARY_FILE,
    TIMINGS_FILE, TRIALS_FILE,
};
use crate::outcome::Outcome;
use serde::de::DeserializeOwned;
use std::collections::BTreeSet;
use std::fs::File;
use std::path::{Path, PathBuf};

/// Why a run cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum ResumeError {
    /// No run, or not enough of one.
    #[error("`{}` cannot be resumed: {what}", path.display())]
    NoRun {
        /// The directory.
        path: PathBuf,
        /// What is wrong with it.
        what: String,
    },
    /// Somebody has it open.
    #[error("`{}` is still being written by another process; wait for its end", path.display())]
    GoesOn {
        /// The directory.
        path: PathBuf,
    },
    /// The results would not be of one kind.
    #[error(
        "`{}` cannot be resumed here: {what} was {then} and is {now}; start a run of its own",
        path.display()
    )]
    Differs {
        /// The directory.
        path: PathBuf,
        /// Which thing.
        what: String,
        /// What it was when the run began.
        then: String,
        /// What it is.
        now: String,
    },
    /// The disk failed.
    #[error("`{}` cannot be brought into order: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
}

/// A fleet of a run: crafts, and which launch of that size.
pub type FleetKey = (u32, u32);

/// A run that was cut off, opened so that nobody else goes on with it.
#[derive(Debug)]
pub struct Unfinished {
    directory: PathBuf,
    provenance: Provenance,
    scenario: String,
    events: Vec<EventLine>,
    /// Fleets of which something is lost.
    doubtful: BTreeSet<FleetKey>,
    lock: File,
}

impl Unfinished {
    /// Opens the run in `directory`.
    ///
    /// # Errors
    /// If there is none, if it lacks what it was started with, or if somebody has it open.
    pub fn open(directory: &Path) -> Result<Self, ResumeError> {
        let lacks = |what: String| ResumeError::NoRun { path: directory.to_owned(), what };
        let run = read_run(directory).map_err(|error| lacks(error.to_string()))?;
        let lock = lock(&run.directory)?;
        let lost =
            |what: &str| lacks(format!("its {what} is lost, and without it nothing is sure"));
        Ok(Self {
            lock,
            doubtful: complete::doubtful_fleets(&run),
            provenance: run.provenance.ok_or_else(|| lost("env.json"))?,
            scenario: run.scenario.ok_or_else(|| lost(SCENARIO_FILE))?,
            events: run.events,
            directory: run.directory,
        })
    }

    /// The run's directory.
    #[must_use]
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    /// Where the run comes from.
    #[must_use]
    pub const fn provenance(&self) -> &Provenance {
        &self.provenance
    }

    /// The scenario with every default written out.
    #[must_use]
    pub fn scenario(&self) -> &str {
        &self.scenario
    }

    /// The fleets that are complete.
    #[must_use]
    pub fn done(&self) -> BTreeSet<FleetKey> {
        let done = self.events.iter().filter_map(|line| match line.event {
            Event::FleetDone { block, size, .. } => Some((size, block)),
            _ => None,
        });
        done.filter(|fleet| !self.doubtful.contains(fleet)).collect()
    }

    /// The worst that has happened: in complete fleets whatever they ended with, in one that was cut off
    /// what playing it again cannot mend.
    #[must_use]
    pub fn outcome(&self) -> Outcome {
        let bad = self.events.iter().filter_map(|line| match line.event {
            Event::FleetDone { block, size, code } => {
                Outcome::from_code(code).filter(|_| !self.doubtful.contains(&(size, block)))
            }
            Event::Discrepancy { .. } => Some(Outcome::Broken),
            _ => None,
        });
        bad.fold(Outcome::Success, Outcome::worse)
    }

    /// When its last event happened, ns from its start.
    #[must_use]
    pub fn last_at_ns(&self) -> u64 {
        self.events.iter().map(|line| line.at_ns).max().unwrap_or(0)
    }

    /// Whether the run may go on as `now` would start it.
    ///
    /// # Errors
    /// The first difference.
    pub fn check(&self, now: &Provenance) -> Result<(), ResumeError> {
        let then = &self.provenance;
        let different = then.differences(now).into_iter().next();
        different.map_or(Ok(()), |(what, then, now)| {
            Err(ResumeError::Differs { path: self.directory.clone(), what, then, now })
        })
    }

    /// Drops what a fleet that was cut off left. Hands over what keeps others out.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn tidy(self) -> Result<File, ResumeError> {
        let failed = |path: &Path, source| ResumeError::Write { path: path.to_owned(), source };
        let done = self.done();
        let entries =
            std::fs::read_dir(&self.directory).map_err(|error| failed(&self.directory, error))?;
        let mut names: Vec<String> =
            entries.flatten().map(|entry| entry.file_name().to_string_lossy().into()).collect();
        names.sort();
        for name in names {
            let path = self.directory.join(&name);
            let kept: &dyn Fn(&str) -> Vec<u8> = match name.as_str() {
                EVENTS_FILE => &|text| kept_events(text, &done),
                MEASUREMENTS_FILE => &|text| kept_rows(text, &done),
                TRIALS_FILE => &|text| {
                    kept_records(text, &done, |trial: &TrialRecord| trial.deterministic.cell)
                },
                TIMINGS_FILE => {
                    &|text| kept_records(text, &done, |timing: &TimingRecord| timing.cell)
                }
                LOADS_FILE => &|text| kept_records(text, &done, |load: &LoadRecord| load.cell),
                CAPACITIES_FILE => {
                    &|text| kept_records(text, &done, |capacity: &CapacityRecord| capacity.cell)
                }
                _ if name == SUMMARY_FILE
                    || name.starts_with('.') && name.ends_with(".partial") =>
                {
                    std::fs::remove_file(&path).map_err(|error| failed(&path, error))?;
                    continue;
                }
                _ => continue,
            };
            keep(&path, kept).map_err(|error| failed(&path, error))?;
        }
        Ok(self.lock)
    }
}

/// Takes the directory for this process, until the file is closed.
///
/// # Errors
/// If somebody has it.
pub fn lock(directory: &Path) -> Result<File, ResumeError> {
    let goes_on = || ResumeError::GoesOn { path: directory.to_owned() };
    let file = File::open(directory).map_err(|error| ResumeError::NoRun {
        path: directory.to_owned(),
        what: error.to_string(),
    })?;
    file.try_lock().map_err(|_| goes_on())?;
    Ok(file)
}

/// Replaces a file by what is kept of its whole lines.
fn keep(path: &Path, kept: &dyn Fn(&str) -> Vec<u8>) -> std::io::Result<()> {
    let bytes = std::fs::read(path)?;
    let text = String::from_utf8_lossy(&bytes);
    let whole = text.rfind('\n').map_or("", |end| &text[..=end]);
    let bytes_kept = kept(whole);
    if bytes_kept == bytes {
        return Ok(());
    }
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let temporary = path.with_file_name(format!(".{name}.partial"));
    std::fs::write(&temporary, bytes_kept)?;
    std::fs::rename(&temporary, path)
}

/// Everything of the fleets that are complete, and what must be known of the rest. The end is still to
/// come.
fn kept_events(text: &str, done: &BTreeSet<FleetKey>) -> Vec<u8> {
    let is_kept = |line: &&str| {
        let Ok(EventLine { event, .. }) = serde_json::from_str(line) else { return false };
        match event {
            Event::Ended { .. } => false,
            Event::FleetStarted { block, size, .. }
            | Event::FleetReady { block, size, .. }
            | Event::FleetDone { block, size, .. }
            | Event::EpochDone { cell: Cell { block, size, .. }, .. }
            | Event::HostChecked { block, size, .. }
            | Event::BaselineMeasured { block, size, .. } => done.contains(&(size, block)),
            Event::CraftLost { .. }
            | Event::CraftSilent { .. }
            | Event::CraftMute { .. }
            | Event::CraftRestarted { .. }
            | Event::Discrepancy { .. }
            | Event::Note { .. }
            | Event::Interrupted { .. }
            | Event::Resumed { .. } => true,
        }
    };
    text.split_inclusive('\n').filter(is_kept).collect::<String>().into_bytes()
}

/// The records whose `cell` is of a fleet that is complete.
fn kept_records<T: DeserializeOwned>(
    text: &str,
    done: &BTreeSet<FleetKey>,
    cell: impl Fn(&T) -> Cell,
) -> Vec<u8> {
    let is_kept = |line: &&str| {
        let cell = serde_json::from_str(line).ok().map(|record| cell(&record));
        cell.is_some_and(|Cell { size, block, .. }| done.contains(&(size, block)))
    };
    text.split_inclusive('\n').filter(is_kept).collect::<String>().into_bytes()
}

/// The rows whose cell is of a fleet that is complete, below the header. A row is one line unless a
/// name breaks it, which the CSV reader sees.
fn kept_rows(text: &str, done: &BTreeSet<FleetKey>) -> Vec<u8> {
    let rows =
        csv::ReaderBuilder::new().has_headers(false).flexible(true).from_reader(text.as_bytes());
    let mut writer = csv::WriterBuilder::new().flexible(true).from_writer(Vec::new());
    for (place, row) in rows.into_byte_records().enumerate() {
        let Ok(row) = row else { continue };
        if place == 0 || is_about(&row).is_some_and(|fleet| done.contains(&fleet)) {
            writer.write_byte_record(&row).expect("invariant: memory takes every row");
        }
    }
    writer.into_inner().expect("invariant: memory takes every row")
}
