//! Running a program that prints one JSON object, for comparisons of two or three of them.

use serde_json::Value;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};

/// Why a comparison gave no result.
#[derive(Debug, thiserror::Error)]
pub enum RatioError {
    /// A program could not be started.
    #[error("{program}: {source}; build it first: cargo build --release --workspace")]
    Start {
        /// Which.
        program: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A program failed.
    #[error("{program} failed ({status})")]
    Failed {
        /// Which.
        program: PathBuf,
        /// How it ended.
        status: ExitStatus,
    },
    /// A program's output is not what was expected.
    #[error("{program} printed no {wanted}")]
    NoFigure {
        /// Which.
        program: PathBuf,
        /// What was looked for.
        wanted: &'static str,
    },
}

/// Where `slateswarm` leaves results that nobody needs once their figures are read; removed on drop.
pub(crate) struct ResultsDirectory(PathBuf);

impl ResultsDirectory {
    /// One for this process.
    pub(crate) fn of_this_process() -> Self {
        Self(std::env::temp_dir().join(format!("slateswarm-benches-{}", std::process::id())))
    }

    /// Where it is.
    pub(crate) fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for ResultsDirectory {
    fn drop(&mut self) {
        // It does not exist if `slateswarm` refused to start.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Runs `program` to its end and parses its standard output.
///
/// # Errors
/// If it cannot be started, fails, or prints no JSON.
#[expect(clippy::disallowed_methods, reason = "the comparison is between two programs")]
pub(crate) fn answer_of(program: &Path, arguments: &[OsString]) -> Result<Value, RatioError> {
    let output = Command::new(program)
        .args(arguments)
        .stdin(Stdio::null())
        .stderr(Stdio::inherit())
        .output()
        .map_err(|source| RatioError::Start { program: program.to_owned(), source })?;
    if !output.status.success() {
        let (program, status) = (program.to_owned(), output.status);
        return Err(RatioError::Failed { program, status });
    }
    serde_json::from_slice(&output.stdout)
        .map_err(|_| RatioError::NoFigure { program: program.to_owned(), wanted: "JSON" })
}

/// The positive number `value` of `program`.
///
/// # Errors
/// If it is none.
pub(crate) fn figure(
    program: &Path,
    wanted: &'static str,
    value: Option<&Value>,
) -> Result<f64, RatioError> {
    value
        .and_then(Value::as_f64)
        .filter(|&number| number > 0.0)
        .ok_or_else(|| RatioError::NoFigure { program: program.to_owned(), wanted })
}

/// The median of `ratios`, `None` if there is none.
pub(crate) fn median(ratios: impl Iterator<Item = f64>) -> Option<f64> {
    let mut ratios: Vec<f64> = ratios.collect();
    ratios.sort_by(f64::total_cmp);
    let middle = ratios.len() / 2;
    match ratios.len() {
        0 => None,
        count if count % 2 == 1 => Some(ratios[middle]),
        _ => Some((ratios[middle - 1] + ratios[middle]) / 2.0),
    }
}
