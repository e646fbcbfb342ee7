//! `diff`: two runs beside each other, from their directories alone.

use super::{Refusal, Setting, print_report};
use crate::cli::DiffArguments;
use crate::outcome::Outcome;
use crate::report::diff::Difference;
use crate::results::diff::Diff;
use crate::results::read::read_run;

/// Compares the second run with the first.
///
/// # Errors
/// If one of them is no run directory.
pub fn diff(arguments: &DiffArguments, setting: Setting) -> Result<Outcome, Refusal> {
    let read = |path| read_run(path).map_err(|error| Refusal::new(error.to_string()));
    let (before, after) = (read(&arguments.before)?, read(&arguments.after)?);
    let names = [&arguments.before, &arguments.after].map(|path| path.display().to_string());
    let report = Difference { diff: Diff::of(&before, &after), names };
    print_report(&report, setting, arguments.all)?;
    Ok(report.diff.outcome())
}
