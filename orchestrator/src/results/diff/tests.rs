//! Two runs made up for tests: equal ones, one that counts otherwise, a slower one, another host.

use super::Diff;
use crate::outcome::Outcome;
use crate::results::inference::Verdict;
use crate::results::read::{RunData, read_run};
use crate::results::record::Digest;
use crate::results::sample;

/// A complete run of two sizes.
fn counted() -> RunData {
    let folder = tempfile::tempdir().expect("a folder");
    sample::leave_run(&folder.path().join("run"), &[2, 3]);
    read_run(&folder.path().join("run")).expect("a run")
}

/// Turn times over `blocks` blocks; `full` takes `factor` times as long as `boundary`.
fn timed(number: u32, blocks: u32, factor: f64) -> RunData {
    let folder = tempfile::tempdir().expect("a folder");
    sample::leave_blocks(&folder.path().join("run"), number, blocks, factor);
    read_run(&folder.path().join("run")).expect("a run")
}

fn on_another_host(mut run: RunData) -> RunData {
    let provenance = run.provenance.as_mut().expect("a provenance");
    provenance.host.id = Some(Digest(0xbeef));
    run
}

/// Strategy and metric of what is worse.
fn worse(diff: &Diff) -> Vec<(String, &'static str)> {
    let worse = diff.times.iter().filter(|time| time.is_regression);
    worse.map(|time| (time.strategy.to_string(), time.metric)).collect()
}

#[test]
fn equal_runs_have_no_difference() {
    let diff = Diff::of(&counted(), &counted());
    assert_eq!((diff.counts.len(), diff.outcome()), (0, Outcome::Success));
    assert_eq!(diff.counts_compared, 2 * 7 * 10, "every trial");
    assert!(!diff.times.is_empty() && worse(&diff).is_empty());
}

#[test]
fn one_request_more_in_one_trial_is_a_regression() {
    let mut after = counted();
    after.trials[17].deterministic.measured.replication.requests += 1;
    let diff = Diff::of(&counted(), &after);
    let facts = &after.trials[17].deterministic;
    let [only] = &diff.counts[..] else { panic!("{:?}", diff.counts) };
    assert_eq!((only.size, only.strategy), (facts.cell.size, facts.cell.strategy));
    assert_eq!(
        (only.metric.as_str(), only.what.as_str()),
        ("requests", format!("trial {}", facts.trial).as_str())
    );
    assert_eq!(diff.outcome(), Outcome::Regression);
    let diff = Diff::of(&after, &counted());
    assert_eq!(diff.outcome(), Outcome::Regression, "fewer is a difference as well");
}

#[test]
fn counts_of_different_experiments_are_not_compared() {
    for (scenario, seed) in [("[run]\nseed = 7\nturns = 9\n", 7), ("[run]\nseed = 7\n", 8)] {
        let mut after = counted();
        after.scenario = Some(scenario.to_owned());
        after.provenance.as_mut().expect("a provenance").seed = seed;
        after.trials[0].deterministic.turns += 1;
        let diff = Diff::of(&counted(), &after);
        assert_eq!((diff.counts_compared, diff.outcome()), (0, Outcome::Success));
        assert_eq!(diff.common.experiments.len(), 1, "{:?}", diff.common);
    }
    let mut after = counted();
    after.scenario =
        Some("[fleet]\ncores = 1\n[run]\nseed = 7\ntrials = 3\nblocks = 9\n".to_owned());
    assert!(
        Diff::of(&counted(), &after).common.experiments.is_empty(),
        "where and how often it ran"
    );
}

#[test]
fn a_fifth_more_is_found_on_one_host_and_a_second_run_alike_is_not() {
    let before = timed(1, 14, 1.0);
    let slower = Diff::of(&before, &timed(2, 14, 1.6));
    assert!(worse(&slower).contains(&("full".to_owned(), "turn time p50")), "{:?}", slower.times);
    assert!(worse(&slower).iter().all(|(strategy, _)| strategy == "full"));
    assert_eq!(slower.outcome(), Outcome::Regression);
    assert_eq!(Diff::of(&timed(2, 14, 1.6), &before).outcome(), Outcome::Success, "faster is none");
    let alike = Diff::of(&before, &timed(3, 14, 1.0));
    assert_eq!(alike.outcome(), Outcome::Success, "{:?}", alike.times);
}

#[test]
fn few_blocks_and_noise_name_no_regression() {
    let few = Diff::of(&timed(1, 5, 1.0), &timed(2, 5, 2.0));
    assert!(few.times.iter().all(|time| time.comparison.verdict == Verdict::TooFewBlocks));
    let mut noisy = timed(2, 14, 2.0);
    noisy.events.clear();
    let diff = Diff::of(&timed(1, 14, 1.0), &noisy);
    assert!(diff.times.iter().all(|time| time.comparison.verdict == Verdict::Noisy));
    assert_eq!(diff.outcome(), Outcome::Success);
}

#[test]
fn between_hosts_only_ratios_to_their_own_floor_count() {
    let before = timed(1, 14, 1.0);
    let mut slow_host = timed(2, 14, 1.0);
    for timed in &mut slow_host.timings {
        for point in &mut timed.record.turn_time.quantiles {
            point.value_ns *= 3;
        }
        timed.record.fleet_cpu_ns *= 3;
    }
    let here = Diff::of(&before, &slow_host);
    assert_eq!(here.outcome(), Outcome::Regression, "on one host three times slower is");
    let there = Diff::of(&before, &on_another_host(slow_host));
    assert_eq!(there.outcome(), Outcome::Success, "{:?}", worse(&there));
    assert!(there.times.iter().all(|time| time.is_relative && time.strategy.name() != "null"));
    let costly = Diff::of(&before, &on_another_host(timed(2, 14, 1.6)));
    assert!(worse(&costly).contains(&("full".to_owned(), "turn time p50")), "{:?}", costly.times);
}
