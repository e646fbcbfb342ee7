//! Checks of `[[faults.process]]`: a fault has one time, which comes, and a stop has an end.

use super::error::{Finding, Place};
use shared_types::limits::STOP_S_MAX;
use shared_types::scenario::{Blow, ProcessFault, RunMode, Scenario};

/// Checks one fault of a process, which is stated at `place`.
pub(super) fn check(
    fault: &ProcessFault,
    scenario: &Scenario,
    place: &Place,
) -> Result<(), Finding> {
    match (fault.at_turn, fault.at_s) {
        (None, None) => {
            return Err(Finding::at(place.clone(), "a craft that fails at no time")
                .help("give `at-turn` for trials, or `at-s` for intervals of open mode"));
        }
        (Some(_), Some(_)) => {
            return Err(Finding::at(place.then("at-s"), "both a turn and a time")
                .help("trials have turns, intervals of open mode have seconds; keep one"));
        }
        (Some(turn), None) => check_turn(turn, scenario, place)?,
        (None, Some(at_s)) => check_time(at_s, scenario, place)?,
    }
    match (fault.what, fault.for_s) {
        (Blow::Stop, None) => Err(Finding::at(place.then("do"), "stopped without an end")
            .help("give `for-s`, the seconds after which it goes on; others wait for it")),
        (Blow::Stop, Some(for_s)) if !(for_s > 0.0 && for_s <= STOP_S_MAX) => {
            Err(Finding::at(place.then("for-s"), format!("a stop of {for_s} s is impossible"))
                .help(format!("use more than that: above 0 and at most {STOP_S_MAX} s")))
        }
        (Blow::Kill, Some(_)) => {
            Err(Finding::at(place.then("for-s"), "who is killed does not go on").help(
                "say `do = \"stop\"`, or leave `for-s` out; `faults.restart` brings successors",
            ))
        }
        (Blow::Stop, Some(_)) | (Blow::Kill, None) => Ok(()),
    }
}

fn check_turn(turn: u32, scenario: &Scenario, place: &Place) -> Result<(), Finding> {
    let (turns, mode) = (scenario.run.turns, scenario.run.mode);
    if mode.is_open() {
        return Err(Finding::at(place.then("at-turn"), "an interval of open mode has no turns")
            .help("give `at-s`, the seconds from its beginning"));
    }
    if turn >= turns {
        let what = format!("turn {turn} never comes: a trial has {turns}");
        return Err(Finding::at(place.then("at-turn"), what)
            .help("turns are counted from 0; raise `run.turns` or fail earlier"));
    }
    Ok(())
}

fn check_time(at_s: f64, scenario: &Scenario, place: &Place) -> Result<(), Finding> {
    let (run, place) = (&scenario.run, place.then("at-s"));
    if run.mode == RunMode::Lockstep && scenario.load.is_empty() {
        return Err(Finding::at(place, "no interval of open mode is played")
            .help("give `at-turn`, or `run.mode = \"open\"`, or offer a `[[load]]`"));
    }
    if !(at_s >= 0.0 && at_s.is_finite()) {
        return Err(Finding::at(place, format!("{at_s} s is no time of an interval"))
            .help("count from 0, the beginning of the interval"));
    }
    if let Some(duration_s) = run.duration_s.filter(|&duration_s| at_s >= duration_s) {
        return Err(Finding::at(place, format!("{at_s} s never come: it lasts {duration_s}"))
            .help("raise `run.duration-s` or fail earlier"));
    }
    Ok(())
}
