//! The search on made-up fleets whose capacity is known.

use super::{Found, PROBES_MAX, Search};
use crate::results::load::{CapacityRecord, SearchEnd};
use crate::results::load::{Probe, Saturation};
use crate::results::record::Cell;
use shared_types::wire::StrategyKind;
use std::convert::Infallible;

fn probe(offered_per_s: f64, is_borne: bool) -> Probe {
    Probe {
        offered_per_s,
        applied_per_s: offered_per_s,
        applied_share: if is_borne { 1.0 } else { 0.5 },
        lag_p99_ns: Some(1000),
        fleet_cpu_ns: 1,
        saturated: (!is_borne).then_some(Saturation::Unapplied),
    }
}

/// Searches a fleet that bears up to `capacity`, whatever else `fails` says of a rate and the number of
/// the probe.
fn search(search: Search, capacity: f64, fails: impl Fn(f64, usize) -> bool) -> Found {
    let mut number = 0;
    let found: Result<Found, Infallible> = search.run(|rate| {
        number += 1;
        Ok(probe(rate, rate <= capacity && !fails(rate, number - 1)))
    });
    found.unwrap_or_else(|never| match never {})
}

fn capacity(found: &Found) -> f64 {
    found.probes[found.borne.expect("something was borne")].offered_per_s
}

fn record(found: Found) -> CapacityRecord {
    let cell = Cell { block: 0, size: 2, strategy: StrategyKind::Full };
    let Found { probes, borne } = found;
    CapacityRecord { cell, place: 0, asks_every_ns: None, burst: 1, probes, borne }
}

#[test]
fn capacity_is_found_to_within_five_percent_from_anywhere() {
    for truth in [37.0, 999.0, 20_000.0, 123_456.0, 3e6] {
        for first in [10.0, 20_000.0, 5e6, truth] {
            let settings = Search::default().starting_at(Some(first));
            let found = search(settings, truth, |_, _| false);
            let capacity = capacity(&found);
            assert!(
                capacity <= truth && capacity * 1.05 >= truth,
                "{truth} from {first}: {capacity}"
            );
            assert_eq!(record(found).end(), SearchEnd::Found);
        }
    }
}

#[test]
fn a_guess_that_is_near_saves_probes() {
    let probes = |first| {
        let settings = Search::default().starting_at(first);
        search(settings, 800_000.0, |_, _| false).probes.len()
    };
    assert!(probes(Some(750_000.0)) + 2 < probes(None));
}

#[test]
fn one_failure_below_capacity_changes_nothing() {
    let quiet = search(Search::default(), 300_000.0, |_, _| false);
    for place in 0..quiet.probes.len() {
        let noisy = search(Search::default(), 300_000.0, |_, number| number == place);
        let (meant, got) = (capacity(&quiet), capacity(&noisy));
        assert!((got / meant - 1.0).abs() < 1e-9, "failed at {place}: {got}, meant {meant}");
        let was_borne = quiet.probes[place].saturated.is_none();
        assert_eq!(
            noisy.probes.len(),
            quiet.probes.len() + usize::from(was_borne),
            "every probe is kept"
        );
    }
}

#[test]
fn a_fleet_that_bears_nothing_or_everything_is_told_apart() {
    let nothing = search(Search::default(), 0.0, |_, _| false);
    assert_eq!(nothing.borne, None);
    assert!(nothing.probes.iter().any(|probe| probe.offered_per_s <= 10.0), "the lowest was tried");
    assert_eq!(record(nothing).end(), SearchEnd::Nothing);
    let everything = search(Search::default(), f64::MAX, |_, _| false);
    assert!((capacity(&everything) - 5e6).abs() < 1e-9, "the highest was tried");
    assert_eq!(record(everything).end(), SearchEnd::Ceiling);
}

#[test]
fn a_search_always_ends() {
    let odd = search(Search::default(), f64::MAX, |_, number| number % 3 == 1 || number % 5 < 2);
    assert!(odd.probes.len() <= PROBES_MAX + 1);
    let never_near = Search { ratio: 1.0, ..Search::default() };
    assert!(search(never_near, 1234.5, |_, _| false).probes.len() <= PROBES_MAX + 1);
}

#[test]
fn what_ends_a_probe_ends_the_search() {
    let ended = Search::default()
        .run(|rate| if rate > 1e5 { Err("Ctrl-C") } else { Ok(probe(rate, true)) });
    assert_eq!(ended, Err("Ctrl-C"));
}
