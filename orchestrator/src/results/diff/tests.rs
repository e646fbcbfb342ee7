//! Two runs made up for tests: equal ones, one that counts otherwise, a slower one, another host.

use super::{Diff, TimeDifference, Uncompared, Yardstick};
use crate::outcome::Outcome;
use crate::results::event::Event;
use crate::results::inference::Verdict;
use crate::results::read::{RunData, read_run};
use crate::results::record::Digest;
use crate::results::sample;
use shared_types::wire::Stage;

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
    let is_over_null = |time: &TimeDifference| time.over == Some(Yardstick::Null);
    assert!(there.times.iter().all(|time| is_over_null(time) && time.strategy.name() != "null"));
    assert_eq!(there.uncompared, []);
    let costly = Diff::of(&before, &on_another_host(timed(2, 14, 1.6)));
    assert!(worse(&costly).contains(&("full".to_owned(), "turn time p50")), "{:?}", costly.times);
}

/// Times to knowledge over `blocks` blocks; `full` takes `factor` times as long as `boundary`.
fn loaded(number: u32, blocks: u32, factor: f64) -> RunData {
    let folder = tempfile::tempdir().expect("a folder");
    sample::leave_loads(&folder.path().join("run"), number, blocks, 2_000, factor);
    read_run(&folder.path().join("run")).expect("a run")
}

/// The same run where every hop of the kernel takes `factor` times as long.
fn on_a_slower_host(mut run: RunData, factor: u64) -> RunData {
    for cell in &mut run.loads {
        for stage in cell.record.stages.values_mut() {
            stage.quantiles.iter_mut().for_each(|point| point.value_ns *= factor);
        }
        cell.record.fleet_cpu_ns *= factor;
    }
    for line in &mut run.events {
        if let Event::BaselineMeasured { baseline, .. } = &mut line.event {
            baseline.before.p50_ns *= factor;
            baseline.after.p50_ns *= factor;
        }
    }
    on_another_host(run)
}

#[test]
fn time_to_knowledge_of_two_hosts_is_compared_over_the_raw_hop_of_each() {
    let before = loaded(1, 14, 1.2);
    let alike = Diff::of(&before, &on_a_slower_host(loaded(2, 14, 1.2), 3));
    let knowledge = |diff: &Diff| -> Vec<(String, &'static str, f64)> {
        let times = diff.times.iter().filter(|time| time.over == Some(Yardstick::RawHop));
        times.map(|time| (time.strategy.to_string(), time.metric, time.comparison.ratio)).collect()
    };
    assert_eq!(knowledge(&alike).len(), 2 * 3, "two quantiles of all that send: {alike:?}");
    assert!(knowledge(&alike).iter().all(|one| (one.2 - 1.0).abs() < 0.05), "{alike:?}");
    assert_eq!(alike.outcome(), Outcome::Success, "{:?}", worse(&alike));
    let of_centre = |time: &&TimeDifference| time.strategy.has_centre();
    assert_eq!(alike.times.iter().filter(of_centre).count(), 3, "CPU is over null there too");
    let costly = Diff::of(&before, &on_a_slower_host(loaded(2, 14, 1.8), 3));
    assert!(worse(&costly).contains(&("full".to_owned(), "knowledge p50")), "{:?}", costly.times);
    assert!(worse(&costly).iter().all(|(strategy, _)| strategy == "full"));
    let full = knowledge(&costly)
        .into_iter()
        .find(|one| (one.0.as_str(), one.1) == ("full", "knowledge p50"));
    let (.., ratio) = full.expect("it is compared");
    assert!((ratio - 1.5).abs() < 0.1, "1.8 of 1.2: {ratio}");
    assert_eq!(costly.outcome(), Outcome::Regression);
    let few = Diff::of(&loaded(1, 3, 1.2), &on_a_slower_host(loaded(2, 3, 1.8), 3));
    assert_eq!((knowledge(&few).len(), few.outcome()), (6, Outcome::Success), "too few blocks");
}

#[test]
fn without_a_raw_baseline_time_to_knowledge_of_two_hosts_is_not_compared() {
    let mut bare = on_a_slower_host(loaded(2, 14, 1.2), 3);
    for cell in bare.loads.iter_mut().filter(|cell| cell.record.cell.strategy.name() == "full") {
        let knowledge = cell.record.stages.get_mut(&Stage::Knowledge).expect("it is known");
        knowledge.quantiles.iter_mut().for_each(|point| point.value_ns *= 2);
    }
    bare.events.retain(|line| !matches!(line.event, Event::BaselineMeasured { .. }));
    for (before, after) in [(loaded(1, 14, 1.2), bare.clone()), (bare, loaded(1, 14, 1.2))] {
        let diff = Diff::of(&before, &after);
        assert!(diff.times.iter().all(|time| time.metric == "CPU an application"));
        let of = |metric| Uncompared { metric, size: 10, why: "a run has no raw baseline" };
        for metric in ["knowledge p50", "knowledge p99"] {
            assert!(diff.uncompared.contains(&of(metric)), "{:?}", diff.uncompared);
        }
        let capacity = diff.uncompared.iter().find(|one| one.metric == "time a write at capacity");
        assert_eq!(capacity.map(|one| one.why), Some("has no yardstick of the host alone"));
        assert_eq!(diff.outcome(), Outcome::Success);
    }
    let here = Diff::of(&loaded(1, 14, 1.2), &loaded(2, 14, 1.8));
    assert!(here.uncompared.is_empty(), "on one host nothing needs it");
    assert!(worse(&here).contains(&("full".to_owned(), "knowledge p50")));
}
