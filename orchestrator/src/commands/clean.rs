//! `clean`: removes what runs that died left behind, and says what it found.
//!
//! Every start does the same silently. A living run is never touched, so it may be called at any time.

use super::{Refusal, Setting, print_bytes};
use crate::cli::Format;
use crate::launch::beside::clean_all;
use crate::launch::run_root::{CleanReport, RunRootError};
use crate::outcome::Outcome;
use shared_types::transport::RunPaths;
use std::io::{self, Write};

/// `clean`.
pub(super) fn carry_out(setting: Setting) -> Result<Outcome, Refusal> {
    let report = clean().map_err(|error| Refusal::new(error.to_string()))?;
    let mut text = Vec::new();
    write(&report, setting.format, &mut text).expect("invariant: memory takes every write");
    print_bytes(&text)?;
    Ok(outcome(&report))
}

/// Cleans below the base of this user, and what killed campaigns left beside it.
///
/// # Errors
/// If the base cannot be read or belongs to somebody else.
pub fn clean() -> Result<CleanReport, RunRootError> {
    clean_all(RunPaths::new(0).base())
}

/// How the invocation ends: what could not be removed breaks the promise that nothing stays.
#[must_use]
pub const fn outcome(report: &CleanReport) -> Outcome {
    if report.failed.is_empty() { Outcome::Success } else { Outcome::Broken }
}

/// Writes the report.
///
/// # Errors
/// If it cannot be written.
pub fn write(report: &CleanReport, format: Format, out: &mut dyn Write) -> io::Result<()> {
    match format {
        Format::Table => write_text(report, out),
        Format::Json => {
            serde_json::to_writer_pretty(&mut *out, report)?;
            writeln!(out)
        }
        Format::Csv => write_rows(report, out),
    }
}

fn write_text(report: &CleanReport, out: &mut dyn Write) -> io::Result<()> {
    for run in &report.removed {
        writeln!(out, "removed  run {run}")?;
    }
    for process in &report.killed {
        writeln!(out, "killed   process {process}, a craft that outlived its run")?;
    }
    for run in &report.living {
        writeln!(out, "living   run {run}, left alone")?;
    }
    for (run, problem) in &report.failed {
        writeln!(out, "failed   run {run}: {problem}")?;
    }
    if report.removed.is_empty() && report.failed.is_empty() {
        writeln!(out, "nothing to clean")?;
    }
    Ok(())
}

fn write_rows(report: &CleanReport, out: &mut dyn Write) -> io::Result<()> {
    let mut rows = csv::Writer::from_writer(out);
    rows.write_record(["what", "name", "problem"])?;
    let runs = [("removed", &report.removed), ("living", &report.living)];
    for (what, names) in runs {
        for name in names {
            rows.write_record([what, name, ""])?;
        }
    }
    for process in &report.killed {
        rows.write_record(["killed", &process.to_string(), ""])?;
    }
    for (run, problem) in &report.failed {
        rows.write_record(["failed", run, problem])?;
    }
    rows.flush()
}

#[cfg(test)]
mod tests {
    use super::{CleanReport, Format, Outcome, outcome, write};

    fn sample() -> CleanReport {
        CleanReport {
            removed: vec!["0000002a".into()],
            living: vec!["00000007".into()],
            failed: vec![("00000009".into(), "no permission".into())],
            killed: vec![4711],
        }
    }

    fn written(report: &CleanReport, format: Format) -> String {
        let mut out = Vec::new();
        write(report, format, &mut out).unwrap();
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn every_format_shows_every_finding() {
        for format in [Format::Table, Format::Json, Format::Csv] {
            let text = written(&sample(), format);
            for finding in ["0000002a", "00000007", "00000009", "no permission", "4711"] {
                assert!(text.contains(finding), "{finding} is missing in {text}");
            }
        }
    }

    #[test]
    fn only_what_cannot_be_removed_is_a_broken_promise() {
        assert_eq!(outcome(&sample()), Outcome::Broken);
        assert_eq!(outcome(&CleanReport { failed: vec![], ..sample() }), Outcome::Success);
        assert_eq!(written(&CleanReport::default(), Format::Table), "nothing to clean\n");
    }
}
