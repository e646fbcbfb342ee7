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
use super::map::{Map, Observation};
use super::provenance::Provenance;
use super::read::{RunData, read_run};
use super::resume::{ResumeError, lock};
use super::store::{PROVENANCE_FILE, Place, StoreError};
use crate::outcome::Outcome;
use crate::scenario::{Axis, K_BETA, SIZES};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::path::{Path, PathBuf};

/// Name of the file that makes a directory one of a sweep.
pub const SWEEP_FILE: &str = "sweep.json";

/// Name of the folder of its cells.
const CELLS_FOLDER: &str = "cells";

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
            let directory = format!("{CELLS_FOLDER}/{}", cell_name(number, &axes, &values));
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
            .and_then(|()| std::fs::create_dir(directory.join(CELLS_FOLDER)))
            .and_then(|()| point_latest_at(root, &directory))
            .map_err(unwritable)?;
        Ok((directory, lock))
    }

    /// The sweep in `directory`, or the latest if that is a place of results; `None` if there is no sweep,
    /// not even one that lost its file.
    #[must_use]
    pub fn find(directory: &Path) -> Option<PathBuf> {
        let latest = directory.join(super::store::LATEST_LINK);
        let has_run = directory.join(PROVENANCE_FILE).exists();
        let found = if has_run { None } else { Some(directory.to_owned()) };
        [found, std::fs::canonicalize(latest).ok().filter(|_| !has_run)]
            .into_iter()
            .flatten()
            .find(|path| path.join(SWEEP_FILE).exists() || path.join(CELLS_FOLDER).is_dir())
    }

    /// Reads `sweep.json` of the sweep in `directory`.
    ///
    /// # Errors
    /// If it is not there or damaged: nothing of a sweep is sure without it.
    pub fn read(directory: &Path) -> Result<Self, ResumeError> {
        let failed = |what: String| ResumeError::NoRun { path: directory.to_owned(), what };
        let text = std::fs::read_to_string(directory.join(SWEEP_FILE))
            .map_err(|error| failed(format!("{SWEEP_FILE}: {error}")))?;
        let sweep: Self = serde_json::from_str(&text)
            .map_err(|error| failed(format!("{SWEEP_FILE} is damaged: {error}")))?;
        match sweep.contradiction() {
            Some(what) => Err(failed(format!("{SWEEP_FILE} is damaged: {what}"))),
            None => Ok(sweep),
        }
    }

    /// What is left of the sweep in `directory` where `sweep.json` is lost or damaged: its cells, by the
    /// names of their directories. `None` if no cell says where it comes from.
    #[must_use]
    pub fn of_cells(directory: &Path) -> Option<Self> {
        let entries = std::fs::read_dir(directory.join(CELLS_FOLDER)).ok()?;
        let mut names: Vec<String> =
            entries.flatten().filter_map(|entry| entry.file_name().into_string().ok()).collect();
        names.sort();
        let cell = |name: &String| SweepCell {
            directory: format!("{CELLS_FOLDER}/{name}"),
            values: vec![name.clone()],
            scenario: String::new(),
        };
        let cells: Vec<SweepCell> = names.iter().map(cell).collect();
        let provenance = cells.iter().find_map(|cell| cell.run(directory)?.provenance)?;
        let axes = vec![Axis { key: "cell".to_owned(), values: names }];
        Some(Self { format: SWEEP_FORMAT, axes, cells, provenance })
    }

    /// Why this is no sweep. Above all, no cell lies outside: a sweep that goes on removes what a cell
    /// that was cut off left.
    fn contradiction(&self) -> Option<String> {
        if self.format != SWEEP_FORMAT {
            return Some(format!("its format is {}, not {SWEEP_FORMAT}", self.format));
        }
        self.cells.iter().find_map(|cell| {
            let below = cell.directory.strip_prefix(CELLS_FOLDER);
            let is_inside =
                below.and_then(|name| name.strip_prefix('/')).is_some_and(cell_name_is_plain);
            let is_complete = cell.values.len() == self.axes.len();
            (!is_inside || !is_complete).then(|| format!("cell `{}` is none", cell.directory))
        })
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
    /// The map, if fleet sizes and copies of a boundary change are varied, over the runs of the cells: of
    /// the load that was measured first.
    #[must_use]
    pub fn map(&self, runs: &[Option<RunData>]) -> Option<Map> {
        if self.provenance.is_simulated {
            // A map is of costs, which a virtual clock has none of.
            return None;
        }
        let copies = self.axes.iter().position(|axis| axis.key == K_BETA)?;
        self.axes.iter().position(|axis| axis.key == SIZES)?;
        let all = runs.iter().flatten().flat_map(|run| &run.loads);
        let mut loads: Vec<&str> = Vec::new();
        for load in all.map(|cell| cell.record.load.as_str()) {
            if !loads.contains(&load) {
                loads.push(load);
            }
        }
        let (load, others) = loads.split_first().map_or(("", &[][..]), |(one, rest)| (*one, rest));
        let mut observations = Vec::new();
        let measured = self.cells.iter().zip(runs);
        for (cell, run) in measured.filter_map(|(cell, run)| Some((cell, run.as_ref()?))) {
            let Some(k_beta) = cell.values.get(copies).and_then(|value| value.parse().ok()) else {
                continue;
            };
            observations.extend(Observation::of_run(k_beta, run, load));
        }
        Some(Map {
            load: load.to_owned(),
            other_loads: others.iter().map(|&load| load.to_owned()).collect(),
            ..Map::of(&observations, self.provenance.seed)
        })
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

/// Whether `name` may be one of [`cell_name`].
fn cell_name_is_plain(name: &str) -> bool {
    let is_plain = |sign: char| sign.is_ascii_alphanumeric() || "-.".contains(sign);
    name.starts_with(|first: char| first.is_ascii_digit()) && name.chars().all(is_plain)
}

#[cfg(test)]
mod tests {
    use super::{SWEEP_FILE, SweepFile, cell_name};
    use crate::results::sample::{leave_run, provenance};
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
        for name in ["five", "../../x", &"x/".repeat(200)] {
            assert!(super::cell_name_is_plain(&named(name)), "{name}");
        }
    }

    /// A sweep of two cells, one of which was run.
    fn sweep(place: &std::path::Path) -> SweepFile {
        let axes =
            vec![Axis { key: "run.seed".into(), values: vec!["7".to_owned(), "8".to_owned()] }];
        let cells = ["7", "8"].map(|seed| (vec![seed.to_owned()], format!("run.seed = {seed}")));
        let file = SweepFile::new(axes, cells.into(), provenance());
        leave_run(&place.join(&file.cells[0].directory), &[2]);
        std::fs::write(place.join(SWEEP_FILE), serde_json::to_vec(&file).unwrap()).unwrap();
        file
    }

    #[test]
    fn without_its_file_a_sweep_is_its_cells() {
        let place = tempfile::tempdir().unwrap();
        let whole = sweep(place.path());
        assert_eq!(SweepFile::read(place.path()).unwrap(), whole);
        for left in [Some(vec![0; 300]), Some(b"{\"format\":1,".to_vec()), None] {
            let path = place.path().join(SWEEP_FILE);
            match left {
                Some(bytes) => std::fs::write(&path, bytes).unwrap(),
                None => std::fs::remove_file(&path).unwrap(),
            }
            assert!(SweepFile::read(place.path()).is_err());
            assert_eq!(SweepFile::find(place.path()).as_deref(), Some(place.path()));
            let left = SweepFile::of_cells(place.path()).unwrap();
            assert_eq!(left.cells.len(), 1, "what was never started is not there");
            assert_eq!(left.cells[0].directory, whole.cells[0].directory);
            assert_eq!(left.cells[0].run(place.path()).unwrap().trials.len(), 7 * 10);
        }
    }

    #[test]
    fn a_cell_outside_of_its_sweep_is_refused() {
        let place = tempfile::tempdir().unwrap();
        let whole = sweep(place.path());
        for outside in ["cells/../../precious", "/precious", "cells", "cells/", "cells/.."] {
            let mut file = whole.clone();
            file.cells[1].directory = outside.to_owned();
            std::fs::write(place.path().join(SWEEP_FILE), serde_json::to_vec(&file).unwrap())
                .unwrap();
            let error = SweepFile::read(place.path()).unwrap_err().to_string();
            assert!(error.contains("damaged") && error.contains(outside), "{error}");
        }
    }
}
