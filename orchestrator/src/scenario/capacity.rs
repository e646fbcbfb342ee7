//! Checks of `[capacity]`.

use super::error::{Finding, place};
use super::validate::above_zero;
use shared_types::limits::{
    CHANGES_PER_FIRING_MAX, DURATION_S_MAX, RATE_PER_S_MAX, TRACE_RECORDS_MAX,
};
use shared_types::scenario::{Capacity, Scenario};

/// Most searches, and most loads at shares of capacity, of one run.
const LISTED_MAX: usize = 16;

/// Most percent of its capacity that a strategy is offered.
const PERCENT_MAX: u32 = 1000;

/// Checks what a search for capacity may be told.
pub(super) fn check(scenario: &Scenario) -> Result<(), Finding> {
    let Capacity { bursts, probe_s, first_per_s, highest_per_s, loads_percent } =
        &scenario.capacity;
    above_zero(place!["capacity", "probe-s"], "probe", *probe_s, DURATION_S_MAX, "seconds")?;
    for (key, rate) in [("first-per-s", first_per_s), ("highest-per-s", highest_per_s)] {
        above_zero(place!["capacity", key], "rate", *rate, RATE_PER_S_MAX, "changes per second")?;
    }
    if first_per_s > highest_per_s {
        let message = format!("a search from {first_per_s} that ends at {highest_per_s}");
        return Err(Finding::at(place!["capacity", "first-per-s"], message)
            .help("start at or below `capacity.highest-per-s`"));
    }
    if highest_per_s * probe_s > TRACE_RECORDS_MAX {
        let message = format!("a probe of {} events", highest_per_s * probe_s);
        return Err(Finding::at(place!["capacity", "highest-per-s"], message)
            .help(format!("rate times length of a probe is at most {TRACE_RECORDS_MAX}")));
    }
    check_list("bursts", bursts, u32::try_from(CHANGES_PER_FIRING_MAX).unwrap_or(u32::MAX))?;
    check_list("loads-percent", loads_percent, PERCENT_MAX)?;
    if bursts.is_empty() && !loads_percent.is_empty() {
        return Err(Finding::at(
            place!["capacity", "loads-percent"],
            "shares of a capacity that is not searched",
        )
        .help("state `capacity.bursts = [1]` as well"));
    }
    Ok(())
}

fn check_list(key: &'static str, numbers: &[u32], most: u32) -> Result<(), Finding> {
    if numbers.len() > LISTED_MAX {
        return Err(Finding::at(place!["capacity", key], format!("{} entries", numbers.len()))
            .help(format!("state at most {LISTED_MAX}")));
    }
    for (index, &number) in numbers.iter().enumerate() {
        if number == 0 || number > most || numbers[..index].contains(&number) {
            return Err(Finding::at(place!["capacity", key, index], format!("`{number}` here"))
                .help(format!("each is 1 to {most}, and stands there once"))
                .label("out of bounds or again"));
        }
    }
    Ok(())
}
