//! A soak: one fleet under one load for long, watched from outside and judged by what must not drift.
//!
//! The load comes in parts of equal length on the same living fleet, a minute each or shorter, so that
//! every part has histograms and a ledger of its own; in each of them crafts are killed and stopped and
//! links lose samples ([`scenario`]), unless the fleet is to be left in peace. [`watch`] reads memory,
//! descriptors and shared memory of the processes meanwhile; [`flat`] says what of that grew, [`ledger`]
//! what does not add up, [`verdict`] both. Not here: measuring, which is the product's job.

pub mod flat;
pub mod ledger;
pub mod scenario;
pub mod table;
pub mod verdict;
pub mod watch;

use orchestrator::results::read::{ReadError, RunData, read_run};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use watch::{Looks, Watch};

/// Most parts of a soak: as many loads as a run may offer.
const PARTS_MAX: u32 = 100;
/// Fewest, so that there is something to compare.
const PARTS_MIN: u32 = 6;
/// Longest time between two looks at the processes, ms.
const LOOK_EVERY_MS_MAX: u64 = 5_000;
/// Looks over a whole soak, unless they would be too far apart.
const LOOKS: u64 = 120;

/// What is asked of a fleet.
#[derive(Clone, Debug)]
pub struct Soak {
    /// The executable `slateswarm`.
    pub slateswarm: PathBuf,
    /// Crafts of the fleet.
    pub crafts: u32,
    /// How long, s.
    pub seconds: u32,
    /// Writes of the fleet per second.
    pub rate_per_s: u32,
    /// How changes are replicated.
    pub strategy: String,
    /// Whether crafts die and are stopped and links lose samples, in every part.
    pub has_faults: bool,
    /// Further keys of the scenario, as `KEY=VALUE`.
    pub set: Vec<String>,
    /// Where results go.
    pub out: PathBuf,
}

/// A soak that came to its end.
#[derive(Clone, Debug)]
pub struct Soaked {
    /// What the fleet measured.
    pub run: RunData,
    /// What was seen of it.
    pub looks: Looks,
}

/// Why there is no verdict.
#[derive(Debug, thiserror::Error)]
pub enum SoakError {
    /// The executable could not be started, or its scenario not be written.
    #[error("{}: {source}; build it first: cargo build --release --workspace", path.display())]
    Start {
        /// What.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// It could not be watched.
    #[error("the fleet cannot be watched: {0}")]
    Watch(std::io::Error),
    /// It ended with neither 0 nor, having broken a promise or lost something, 1 or 3.
    #[error("slateswarm failed ({0})")]
    Failed(ExitStatus),
    /// Its results cannot be read.
    #[error(transparent)]
    Results(#[from] ReadError),
}

impl Soak {
    /// How many parts the load comes in.
    #[must_use]
    pub fn parts(&self) -> u32 {
        (self.seconds / 60).clamp(PARTS_MIN, PARTS_MAX)
    }

    /// Runs it to its end.
    ///
    /// # Errors
    /// If the fleet cannot be started, watched or read, or failed.
    pub fn run(&self) -> Result<Soaked, SoakError> {
        let scenario = ScenarioFile::of(self)?;
        let mut child = self.start(scenario.path())?;
        let every_ms = (u64::from(self.seconds) * 1000 / LOOKS).clamp(100, LOOK_EVERY_MS_MAX);
        let watched = Watch::of(child.id()).and_then(|watch| watch.until_end(every_ms));
        let status = child.wait().map_err(SoakError::Watch)?;
        let looks = watched.map_err(SoakError::Watch)?;
        if !matches!(status.code(), Some(0 | 1 | 3)) {
            return Err(SoakError::Failed(status));
        }
        Ok(Soaked { run: read_run(&self.out)?, looks })
    }

    #[expect(clippy::disallowed_methods, reason = "the soak is of a program, watched from outside")]
    fn start(&self, scenario: &Path) -> Result<Child, SoakError> {
        Command::new(&self.slateswarm)
            .args(self.arguments(scenario))
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .spawn()
            .map_err(|source| SoakError::Start { path: self.slateswarm.clone(), source })
    }

    fn arguments(&self, scenario: &Path) -> Vec<OsString> {
        let mut arguments: Vec<OsString> = vec!["run".into(), scenario.into(), "--quiet".into()];
        for set in &self.set {
            arguments.extend(["--set".into(), set.into()]);
        }
        arguments.extend(["--out".into(), self.out.clone().into()]);
        arguments
    }
}

/// The scenario's file, removed on drop.
struct ScenarioFile(PathBuf);

impl ScenarioFile {
    fn of(soak: &Soak) -> Result<Self, SoakError> {
        let name = format!("slateswarm-soak-{}.toml", std::process::id());
        let file = Self(std::env::temp_dir().join(name));
        let written = std::fs::write(file.path(), soak.scenario());
        let start = |source| SoakError::Start { path: file.path().to_owned(), source };
        written.map_err(start).map(|()| file)
    }

    fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for ScenarioFile {
    fn drop(&mut self) {
        let _gone_already = std::fs::remove_file(&self.0);
    }
}
