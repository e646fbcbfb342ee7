//! Traces as files: `time_ns,craft,fact,value`, one record a row, ascending by time.
//!
//! `value` is `true` (asserted), `false` (de-asserted) or `read`. Crafts and facts go by their names,
//! facts without one by their number. A file that cannot be replayed is refused with its line and what
//! to do about it.

use super::trace::Trace;
use crate::scenario::{NameTable, nearest};
use miette::Diagnostic;
use shared_types::ids::{CraftId, FactId};
use shared_types::knowledge::FleetView;
use shared_types::trace::TraceRecord;
use std::io::{Read, Write};

const HEADER: [&str; 4] = ["time_ns", "craft", "fact", "value"];

/// Why there is no trace.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error, Diagnostic)]
#[error("{message}")]
pub struct TraceError {
    message: String,
    #[help]
    remedy: String,
}

impl TraceError {
    /// A trace cannot be drawn without `key`, which may be `example`.
    pub(super) fn unstated(key: &str, example: u32) -> Self {
        let remedy = format!("state it in the scenario, or `--set {key}={example}`");
        Self { message: format!("`{key}` is not stated, and a trace needs it"), remedy }
    }

    /// `craft` has no `kind` that could be written.
    pub(super) fn nothing_to_write(craft: CraftId, kind: &str, remedy: &str) -> Self {
        Self { message: format!("craft {craft} has no {kind} to write"), remedy: remedy.to_owned() }
    }

    fn at(
        file: &str,
        line: u64,
        message: impl std::fmt::Display,
        remedy: impl Into<String>,
    ) -> Self {
        Self { message: format!("{file}:{line}: {message}"), remedy: remedy.into() }
    }
}

/// Writes `trace` as a file: by time, records of one time by craft.
///
/// # Errors
/// If `into` cannot be written.
pub fn write(trace: &Trace, names: &NameTable, into: impl Write) -> std::io::Result<()> {
    let mut rows: Vec<(u64, CraftId, &TraceRecord)> = Vec::new();
    for (records, craft) in trace.crafts.iter().zip((0..).map(CraftId)) {
        rows.extend(records.iter().map(|record| (record.at_ns, craft, record)));
    }
    rows.sort_by_key(|&(at_ns, craft, _)| (at_ns, craft));
    let mut file = ::csv::Writer::from_writer(into);
    file.write_record(HEADER)?;
    for (at_ns, craft, record) in rows {
        let fact = names.fact(craft, record.fact());
        let is_numbered = names.fact_id(craft, &fact).is_none();
        let fact = if is_numbered { record.fact.to_string() } else { fact.into_owned() };
        let value = match record.holds() {
            None => "read",
            Some(true) => "true",
            Some(false) => "false",
        };
        file.write_record([&at_ns.to_string(), names.craft(craft), &fact, value])?;
    }
    file.flush()
}

/// Reads a trace for `fleet` from a file that errors call `file`.
///
/// # Errors
/// The first row that cannot be replayed, with its line and a remedy.
pub fn read(
    file: &str,
    from: impl Read,
    fleet: &FleetView<'_>,
    names: &NameTable,
) -> Result<Trace, TraceError> {
    let mut trace = Trace { crafts: vec![Vec::new(); fleet.boards.len()] };
    let reader = ::csv::ReaderBuilder::new().has_headers(false).flexible(true).from_reader(from);
    let mut last_ns = None;
    let mut has_header = false;
    for row in reader.into_records() {
        let row = row.map_err(|error| {
            let line = error.position().map_or(1, ::csv::Position::line);
            TraceError::at(
                file,
                line,
                "this row cannot be read",
                "write UTF-8 text, comma-separated",
            )
        })?;
        let line = row.position().map_or(1, ::csv::Position::line);
        let fields: Vec<&str> = row.iter().map(str::trim).collect();
        if !has_header {
            has_header = true;
            if fields != HEADER {
                let wanted = HEADER.join(",");
                return Err(TraceError::at(
                    file,
                    line,
                    format!("the first line is not `{wanted}`"),
                    "put it there; `slateswarm record SCENARIO` writes such a file",
                ));
            }
            continue;
        }
        let (craft, record) = parse(&fields, fleet, names)
            .map_err(|(message, remedy)| TraceError::at(file, line, message, remedy))?;
        if last_ns.is_some_and(|last_ns| record.at_ns < last_ns) {
            return Err(TraceError::at(file, line, "time goes back", "sort the rows by `time_ns`"));
        }
        last_ns = Some(record.at_ns);
        trace.crafts[craft.index()].push(record);
    }
    if !has_header {
        return Err(TraceError::at(file, 1, "the file is empty", "`slateswarm record` writes one"));
    }
    Ok(trace)
}

/// One row; an error is what is wrong and what to do about it.
fn parse(
    fields: &[&str],
    fleet: &FleetView<'_>,
    names: &NameTable,
) -> Result<(CraftId, TraceRecord), (String, String)> {
    let [time, craft_name, fact_name, value] = *fields else {
        let message = format!("{} fields instead of 4", fields.len());
        return Err((message, format!("write `{}`", HEADER.join(","))));
    };
    let at_ns: u64 = time.parse().map_err(|_| {
        let remedy = "write whole nanoseconds from the start of the trial";
        (format!("`{time}` is no time"), remedy.to_owned())
    })?;
    let craft = names.craft_id(craft_name).ok_or_else(|| {
        let crafts = (0..fleet.craft_count()).map(|craft| names.craft(CraftId(craft)));
        let remedy = nearest(craft_name, crafts).map_or_else(
            || format!("crafts are called `{}` and so on", names.craft(CraftId(0))),
            |near| format!("did you mean `{near}`?"),
        );
        (format!("there is no craft `{craft_name}`"), remedy)
    })?;
    let fact_count = fleet.board(craft).fact_count;
    let by_number = || fact_name.parse().ok().filter(|&fact| fact < fact_count).map(FactId);
    let fact = names.fact_id(craft, fact_name).or_else(by_number).ok_or_else(|| {
        let remedy = match fact_count.checked_sub(1) {
            Some(last) => format!("use a fact's name, or its number: 0 to {last}"),
            None => "leave the row out: this craft has no facts".to_owned(),
        };
        (format!("`{craft_name}` has no fact `{fact_name}`"), remedy)
    })?;
    let record = match value {
        "read" => TraceRecord::read(at_ns, fact),
        "true" => TraceRecord::write(at_ns, fact, true),
        "false" => TraceRecord::write(at_ns, fact, false),
        other => {
            let remedy = "write `true` (asserted), `false` (de-asserted) or `read`";
            return Err((format!("`{other}` is no value"), remedy.to_owned()));
        }
    };
    Ok((craft, record))
}
