//! The directory of a sweep: what it varies, and one run's directory a cell.
//!
//! ```text
//! runs/sweep-<scenario>/<stamp>-<seed>/
//!     sweep.json     [`SweepFile`]: axes, cells with their scenarios, provenance
//!     cells/000-...  a run's directory each, see [`super::store`]
//! ```
//!
//! `sweep.json` is written once, before the first cell is started; which cells are done is seen from
//! their directories. Not here: running them.

use super::directory::{make_directory, point_latest_at};
use super::event::Event;
use super::host::HostReport;
use super::map::{Map, Observation};
use super::provenance::Provenance;
use super::read::{LoadCell, RunData, read_run};
use super::resume::{ResumeError, lock};
use super::store::{PROVENANCE_FILE, Place, StoreError};
use crate::outcome::Outcome;
use crate::scenario::{Axis, K_BETA, SIZES};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::path::{Path, PathBuf};

/// Name of the file that makes a directory one of a sweep.
pub const SWEEP_FILE: &str = "sweep.json";

/// Version of its shape.
const SWEEP_FORMAT: u32 = 1;

/// Longest name of a cell's directory, bytes.
const NAME_BYTES_MAX: usize = 80;

/// One combination of values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SweepCell {
    /// Its run's directory, below that of the sweep.
    pub directory: String,
    /// One value of each axis, as typed.
    pub values: Vec<String>,
    /// The scenario with every default written out.
    pub scenario: String,
}

/// What `sweep.json` holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SweepFile {
    /// `SWEEP_FORMAT`.
    pub format: u32,
    /// What is varied.
    pub axes: Vec<Axis>,
    /// The full grid, the last axis fastest.
    pub cells: Vec<SweepCell>,
    /// Where the results come from.
    pub provenance: Provenance,
}

/// A cell as its directory stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum CellState {
    /// Not started.
    Missing,
    /// Started, and cut off by a kill, a signal or a time limit.
    CutOff,
    /// Came to its end, with this outcome.
    Done(Outcome),
}

impl SweepFile {
    /// The sweep over `axes` of a grid whose cells have these values and scenarios.
    #[must_use]
    pub fn new(axes: Vec<Axis>, cells: Vec<(Vec<String>, String)>, provenance: Provenance) -> Self {
        let cells = (0_usize..).zip(cells).map(|(number, (values, scenario))| {
            let directory = format!("cells/{}", cell_name(number, &axes, &values));
            SweepCell { directory, values, scenario }
        });
        Self { format: SWEEP_FORMAT, cells: cells.collect(), axes, provenance }
    }

    /// Makes the directory of the sweep below `root`, and points `latest` at it.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn create(&self, root: &Path) -> Result<(PathBuf, File), StoreError> {
        let directory = make_directory(Place::Below(root), &self.provenance)?;
        let unwritable = |source| StoreError::Unwritable { path: directory.clone(), source };
        let lock = lock(&directory).map_err(|error| unwritable(std::io::Error::other(error)))?;
        let text = serde_json::to_string_pretty(self).expect("invariant: a sweep is plain data");
        let temporary = directory.join(format!(".{SWEEP_FILE}.partial"));
        std::fs::write(&temporary, text + "\n")
            .and_then(|()| std::fs::rename(&temporary, directory.join(SWEEP_FILE)))
            .and_then(|()| std::fs::create_dir(directory.join("cells")))
            .and_then(|()| point_latest_at(root, &directory))
            .map_err(unwritable)?;
        Ok((directory, lock))
    }

    /// Reads the sweep in `directory`, or the latest if that is a place of results; `None` if there is
    /// no sweep.
    #[must_use]
    pub fn find(directory: &Path) -> Option<PathBuf> {
        let latest = directory.join(super::store::LATEST_LINK);
        let has_run = directory.join(PROVENANCE_FILE).exists();
        let found = if has_run { None } else { Some(directory.to_owned()) };
        [found, std::fs::canonicalize(latest).ok().filter(|_| !has_run)]
            .into_iter()
            .flatten()
            .find(|path| path.join(SWEEP_FILE).exists())
    }

    /// Reads `sweep.json` of the sweep in `directory`.
    ///
    /// # Errors
    /// If it is not there or damaged: nothing of a sweep is sure without it.
    pub fn read(directory: &Path) -> Result<Self, ResumeError> {
        let failed = |what: String| ResumeError::NoRun { path: directory.to_owned(), what };
        let text = std::fs::read_to_string(directory.join(SWEEP_FILE))
            .map_err(|error| failed(format!("{SWEEP_FILE}: {error}")))?;
        serde_json::from_str(&text).map_err(|error| failed(format!("{SWEEP_FILE}: {error}")))
    }

    /// Whether the sweep may go on as `now` would start it.
    ///
    /// # Errors
    /// The first difference.
    pub fn check(&self, directory: &Path, now: &Provenance) -> Result<(), ResumeError> {
        match self.provenance.differences(now).into_iter().next() {
            None => Ok(()),
            Some((what, then, now)) => {
                Err(ResumeError::Differs { path: directory.to_owned(), what, then, now })
            }
        }
    }
}

impl SweepFile {
    /// The map, if fleet sizes and copies of a boundary change are varied, over the runs of the cells.
    #[must_use]
    pub fn map(&self, runs: &[Option<RunData>]) -> Option<Map> {
        let copies = self.axes.iter().position(|axis| axis.key == K_BETA)?;
        self.axes.iter().position(|axis| axis.key == SIZES)?;
        let mut observations = Vec::new();
        let measured = self.cells.iter().zip(runs);
        for (cell, run) in measured.filter_map(|(cell, run)| Some((cell, run.as_ref()?))) {
            let Ok(k_beta) = cell.values[copies].parse() else { continue };
            let is_clean = HostReport::of(&run.events).is_clean();
            let of_load = |load: &LoadCell| Observation::of(k_beta, &load.record, is_clean);
            observations.extend(run.loads.iter().map(of_load));
        }
        Some(Map::of(&observations, self.provenance.seed))
    }
}

impl SweepCell {
    /// What its directory, below `sweep`, says of the run.
    #[must_use]
    pub fn run(&self, sweep: &Path) -> Option<RunData> {
        read_run(&sweep.join(&self.directory)).ok()
    }

    /// How far it has come.
    #[must_use]
    pub fn state(run: Option<&RunData>) -> CellState {
        let Some(run) = run.filter(|run| run.provenance.is_some()) else {
            return CellState::Missing;
        };
        let cut_off = [Outcome::Interrupted, Outcome::Terminated, Outcome::TimeLimit];
        let ended = run.events.iter().any(|line| matches!(line.event, Event::Ended { .. }));
        match run.outcome().filter(|outcome| ended && !cut_off.contains(outcome)) {
            Some(outcome) => CellState::Done(outcome),
            None => CellState::CutOff,
        }
    }
}

/// `007-links-100-crafts-5`: number, and what the cell is.
fn cell_name(number: usize, axes: &[Axis], values: &[String]) -> String {
    let named =
        axes.iter().zip(values).map(|(axis, value)| format!("{}-{value}", axis.short_name()));
    let name = named.collect::<Vec<_>>().join("-");
    let plain = |sign: char| if sign.is_ascii_alphanumeric() || sign == '.' { sign } else { '-' };
    let mut name: String = format!("{number:03}-{name}").chars().map(plain).collect();
    name.truncate(NAME_BYTES_MAX);
    name.trim_end_matches(['-', '.']).to_owned()
}

#[cfg(test)]
mod tests {
    use super::cell_name;
    use crate::scenario::Axis;

    #[test]
    fn a_cell_is_named_by_what_it_is_and_cannot_leave_its_place() {
        let axes = [
            Axis { key: "network.links".into(), values: vec![] },
            Axis { key: "name".into(), values: vec![] },
        ];
        let named = |name: &str| cell_name(7, &axes, &["100".to_owned(), name.to_owned()]);
        assert_eq!(named("five"), "007-links-100-name-five");
        assert_eq!(named("../../x"), "007-links-100-name-..-..-x");
        assert!(named(&"x/".repeat(200)).len() <= super::NAME_BYTES_MAX);
    }
}
