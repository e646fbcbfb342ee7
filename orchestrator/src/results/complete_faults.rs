//! What the directory of a campaign must hold because of what else it holds.
//!
//! A campaign that came to its end has every time of every step of recovery twice, in the line of its fault
//! and in the log of the step, a table of percentiles beside that log, and a summary that counts the
//! faults. Not here: lines that cannot be read (`read`), and the files of other runs (`complete`).

use super::complete::is_whole_table;
use super::faults::Step;
use super::histogram::from_interval_log;
use super::read::RunData;
use super::store::{FAULTS_FILE, SUMMARY_FILE};
use serde_json::Value;
use std::io;

/// Counts in the figures of a campaign that together are all of its faults.
const COUNTED: [&str; 4] = ["kills", "pauses", "links", "without_effect"];

/// Tells `lack` what the campaign in `run` lacks; nothing of other runs.
pub(super) fn lacks(run: &RunData, lack: &mut impl FnMut(&str, String)) {
    let has_ended = run.outcome().is_some();
    let mut lost = counted_in_summary(run).saturating_sub(run.faults.len() as u64);
    for step in Step::ALL {
        let timed = run.faults.iter().filter(|fault| fault.times_ns.contains_key(&step));
        let timed = timed.count() as u64;
        let (log, table) = (log_of(step), table_of(step));
        match std::fs::read_to_string(run.directory.join(&log)) {
            Ok(text) => match from_interval_log(&text).map(|log| log.all.len()) {
                Ok(kept) if kept < timed => lack(&log, "not all times are there".to_owned()),
                Ok(kept) => lost = lost.max(kept - timed),
                Err(error) => lack(&log, error.to_string()),
            },
            Err(error) if is_not_due(&error, timed, has_ended) => {}
            Err(error) => lack(&log, error.to_string()),
        }
        match std::fs::read(run.directory.join(&table)) {
            Ok(bytes) if is_whole_table(&bytes) => {}
            Ok(_) => lack(&table, "cut short or damaged".to_owned()),
            Err(error) if is_not_due(&error, timed, has_ended) => {}
            Err(error) => lack(&table, error.to_string()),
        }
    }
    if lost > 0 {
        lack(FAULTS_FILE, format!("at least {lost} faults that other files count are missing"));
    }
}

/// Whether a file need not be there: it comes at the end of a campaign, for a step that some recovery took.
fn is_not_due(error: &io::Error, timed: u64, has_ended: bool) -> bool {
    error.kind() == io::ErrorKind::NotFound && (timed == 0 || !has_ended)
}

/// The faults that the summary counts; none if there is no summary, or none that can be read.
fn counted_in_summary(run: &RunData) -> u64 {
    let text = std::fs::read(run.directory.join(SUMMARY_FILE)).unwrap_or_default();
    let summary: Value = serde_json::from_slice(&text).unwrap_or_default();
    let all = &summary["timing"]["campaign"]["all"];
    let counts = COUNTED.iter().filter_map(|count| all[count].as_u64());
    counts.fold(0, u64::saturating_add)
}

/// The file with the times of a step of recovery.
pub(super) fn log_of(step: Step) -> String {
    format!("recovery-{}.hlog", step.name())
}

/// The file with the percentiles of a step of recovery.
pub(super) fn table_of(step: Step) -> String {
    format!("recovery-{}.hgrm", step.name())
}
