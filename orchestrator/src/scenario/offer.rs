//! Checks of what is offered in open mode: `[trace]`, `[[load]]`, rates, lengths, asking intervals.

use super::error::{Finding, Place, place};
use super::validate::above_zero;
use shared_types::limits::{
    ASKING_INTERVALS_MAX, ASKING_MS_MAX, CHANGES_PER_FIRING_MAX, DURATION_S_MAX, LOADS_MAX,
    RATE_PER_S_MAX, TRACE_RECORDS_MAX,
};
use shared_types::scenario::{LoadEntry, Scenario};

/// Checks everything that only open mode reads.
pub(super) fn check(scenario: &Scenario) -> Result<(), Finding> {
    check_run(scenario)?;
    check_loads(&scenario.load)?;
    check_trace(scenario)?;
    check_length(scenario)
}

fn check_rate(place: Place, rate: f64) -> Result<(), Finding> {
    above_zero(place, "rate", rate, RATE_PER_S_MAX, "changes per second")
}

fn check_run(scenario: &Scenario) -> Result<(), Finding> {
    let run = &scenario.run;
    if let Some(rate) = run.rate_per_s {
        check_rate(place!["run", "rate-per-s"], rate)?;
    }
    if let Some(duration) = run.duration_s {
        above_zero(place!["run", "duration-s"], "duration", duration, DURATION_S_MAX, "seconds")?;
    }
    let asks = &run.asks_every_ms;
    if asks.is_empty() || asks.len() > ASKING_INTERVALS_MAX {
        let message = format!("{} asking intervals", asks.len());
        return Err(Finding::at(place!["run", "asks-every-ms"], message)
            .help(format!("state 1 to {ASKING_INTERVALS_MAX}, such as [1, 3, 10]")));
    }
    for (index, &every_ms) in asks.iter().enumerate() {
        let place = place!["run", "asks-every-ms", index];
        above_zero(place.clone(), "pause", every_ms, ASKING_MS_MAX, "ms")?;
        if asks[..index].contains(&every_ms) {
            return Err(Finding::at(place, format!("{every_ms} ms are stated twice"))
                .help("keep one")
                .label("again"));
        }
    }
    Ok(())
}

fn check_loads(loads: &[LoadEntry]) -> Result<(), Finding> {
    if loads.len() > LOADS_MAX {
        return Err(Finding::at(place!["load"], format!("{} loads", loads.len()))
            .help(format!("at most {LOADS_MAX} are measured in one run")));
    }
    for (index, load) in loads.iter().enumerate() {
        check_rate(place!["load", index, "rate-per-s"], load.rate_per_s)?;
        let place = place!["load", index, "name"];
        if load.name.trim().is_empty() {
            return Err(Finding::at(place, "a load without a name").help("tables name it so"));
        }
        if loads[..index].iter().any(|other| other.name == load.name) {
            return Err(Finding::at(place, format!("two loads are called `{}`", load.name))
                .help("give each a name of its own")
                .label("again"));
        }
    }
    Ok(())
}

fn check_trace(scenario: &Scenario) -> Result<(), Finding> {
    let (run, trace) = (&scenario.run, &scenario.trace);
    let most = CHANGES_PER_FIRING_MAX;
    if trace.burst == 0 || trace.burst as usize > most {
        return Err(Finding::at(place!["trace", "burst"], format!("bursts of {}", trace.burst))
            .help(format!("use 1 to {most} writes; 1 makes no bursts"))
            .label("out of bounds"));
    }
    if let Some(share) = trace.boundary_fraction.filter(|share| !(0.0..=1.0).contains(share)) {
        let message = format!("a boundary fraction of {share} is impossible");
        return Err(Finding::at(place!["trace", "boundary-fraction"], message)
            .help("it is a share of the writes: 0 writes no boundary fact, 1 nothing else")
            .label("out of bounds"));
    }
    if trace.sharers.is_some() && trace.boundary_fraction.is_none() {
        return Err(Finding::at(place!["trace", "sharers"], "sharers without a boundary fraction")
            .help(
                "set `trace.boundary-fraction` as well; without it all facts are written alike",
            ));
    }
    if trace.sharers == Some(0) {
        return Err(Finding::at(place!["trace", "sharers"], "boundary facts that nobody shares")
            .help("use at least 1; `trace.boundary-fraction = 0` writes no boundary fact"));
    }
    if !(0.0..=RATE_PER_S_MAX).contains(&trace.reads_per_s) {
        let message = format!("{} reads per second are impossible", trace.reads_per_s);
        return Err(Finding::at(place!["trace", "reads-per-s"], message)
            .help(format!("use 0 to {RATE_PER_S_MAX}"))
            .label("out of bounds"));
    }
    let loads = scenario.load.iter().map(|load| load.rate_per_s);
    let most = loads.fold(run.rate_per_s.unwrap_or(0.0).max(trace.reads_per_s), f64::max);
    let records = most * run.duration_s.unwrap_or(0.0);
    if records > TRACE_RECORDS_MAX {
        return Err(Finding::at(
            place!["run", "duration-s"],
            format!("a trace of {records} events"),
        )
        .help(format!("rate times duration is at most {TRACE_RECORDS_MAX}; shorten one")));
    }
    Ok(())
}

/// Whether it is said how much is offered for how long.
fn check_length(scenario: &Scenario) -> Result<(), Finding> {
    let Scenario { run, trace, load, .. } = scenario;
    if trace.file.is_some() && !load.is_empty() {
        return Err(Finding::at(place!["load"], "[[load]] beside `trace.file`")
            .help("a file has its own times: leave out one of the two"));
    }
    if run.mode.is_open() && load.is_empty() && trace.file.is_none() && run.rate_per_s.is_none() {
        return Err(Finding::at(place!["run", "mode"], "open mode without a rate")
            .help("set `run.rate-per-s`, state some [[load]], or name a `trace.file`"));
    }
    let is_drawn = !load.is_empty() || (run.mode.is_open() && trace.file.is_none());
    if is_drawn && run.duration_s.is_none() {
        let place = if load.is_empty() { place!["run", "mode"] } else { place!["load"] };
        return Err(Finding::at(place, "nothing says how long the load lasts")
            .help("set `run.duration-s`, such as 2"));
    }
    Ok(())
}
