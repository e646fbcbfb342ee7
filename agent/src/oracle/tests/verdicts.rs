//! What `compare` says of reports that are right, and of reports that are wrong in one number.

use super::fleets::{Shape, mission_spec, symmetric_fleet};
use crate::oracle::{Discrepancy, Expected, Metric, Observed, Replay, compare};
use shared_types::ids::CraftId;
use shared_types::knowledge::FleetNetwork;
use shared_types::wire::{Class, Counters, StrategyKind, TrialReport};

const SHAPE: Shape =
    Shape { crafts: 4, seed: 3, outputs_max: 2, negates: true, repeats: true, is_uncertain: false };

fn fleet() -> FleetNetwork {
    symmetric_fleet(SHAPE)
}

/// The reports of a run that did exactly what is expected.
fn faultless(replay: &Replay, expected: &Expected) -> Vec<TrialReport> {
    let digests: Vec<(u32, u64)> = (0..).zip(replay.board_digests()).collect();
    let processes = expected.processes.len();
    (0..)
        .zip(&expected.processes)
        .map(|(craft, process)| {
            let mut counters = Counters {
                deliveries_from: (0..processes)
                    .map(|sender| {
                        expected.deliveries.between(CraftId::from_index(sender), CraftId(craft))
                    })
                    .collect(),
                hops: process.hops,
                firings: process.firings,
                boundary_firings: process.boundary_firings,
                idle_turns: process.idle_turns,
                conflicts: process.conflicts,
                ..Counters::default()
            };
            counters.traffic[Class::Replication as usize] = process.replication;
            counters.traffic[Class::Reply as usize] = process.reply;
            let is_centre = craft as usize == replay.boards.len();
            let board_digests = match expected.strategy {
                StrategyKind::Null => Vec::new(),
                strategy if strategy.has_centre() && is_centre => digests.clone(),
                strategy if strategy.has_centre() => Vec::new(),
                _ => vec![digests[craft as usize]],
            };
            TrialReport {
                craft,
                counters,
                board_digests,
                replica_digest: expected.replica_digest(CraftId(craft)),
                ..TrialReport::default()
            }
        })
        .collect()
}

fn judged(strategy: StrategyKind, spoil: impl Fn(&mut Vec<TrialReport>)) -> Vec<Discrepancy> {
    let network = fleet();
    let (fleet, spec) = (network.view(), mission_spec());
    let replay = Replay::of(&fleet, &spec);
    let expected = replay.expected(&fleet, &spec, strategy);
    let mut reports = faultless(&replay, &expected);
    spoil(&mut reports);
    let observed = Observed {
        trial: 5,
        turns: replay.turns,
        outcome: replay.outcome,
        path_digest: replay.path_digest(),
        reports: &reports,
    };
    compare(&replay, &expected, &observed)
}

#[test]
fn faultless_reports_pass_under_every_strategy() {
    for strategy in StrategyKind::ALL {
        assert_eq!(judged(strategy, |_| {}), []);
        assert_eq!(judged(strategy, |reports| reports.reverse()), []);
    }
}

#[test]
fn one_unicast_too_many_is_named_with_strategy_trial_and_craft() {
    let found = judged(StrategyKind::Boundary, |reports| {
        reports[2].counters.traffic[Class::Replication as usize].requests += 1;
    });
    assert_eq!(
        (found.len(), found[0].metric, found[0].craft),
        (1, Metric::Requests, Some(CraftId(2)))
    );
    assert_eq!(found[0].found, found[0].expected + 1);
    let message = found[0].to_string();
    assert!(message.starts_with("strategy boundary, trial 5, craft 2: requests "), "{message}");
}

#[test]
fn delivery_from_nowhere_is_named_by_its_pair() {
    let found = judged(StrategyKind::Full, |reports| {
        reports[1].counters.deliveries_from[3] += 1;
    });
    assert_eq!(found.len(), 1);
    let message = found[0].to_string();
    assert!(message.starts_with("strategy full, trial 5, from 3 to 1: deliveries "), "{message}");
}

#[test]
fn missing_report_is_named() {
    let found = judged(StrategyKind::Hierarchy, |reports| {
        reports.remove(0);
    });
    let metrics: Vec<Metric> = found.iter().map(|found| found.metric).collect();
    assert_eq!(metrics, [Metric::Reports, Metric::BoardReports]);
    assert!(found.iter().all(|found| found.craft == Some(CraftId(0))));
}

#[test]
fn another_board_or_replica_is_named_by_its_digest() {
    let found = judged(StrategyKind::Limited, |reports| {
        reports[0].board_digests[0].1 ^= 1;
        reports[3].replica_digest ^= 1;
    });
    let metrics: Vec<Metric> = found.iter().map(|found| found.metric).collect();
    assert_eq!(metrics, [Metric::BoardDigest, Metric::ReplicaDigest]);
    assert!(found[0].to_string().contains(&format!("{:016x}", found[0].expected)));
}

#[test]
fn another_path_is_named_for_the_whole_fleet() {
    let network = fleet();
    let (fleet, spec) = (network.view(), mission_spec());
    let replay = Replay::of(&fleet, &spec);
    let expected = replay.expected(&fleet, &spec, StrategyKind::Central);
    let reports = faultless(&replay, &expected);
    let observed = Observed {
        trial: 0,
        turns: replay.turns + 1,
        outcome: replay.outcome,
        path_digest: !replay.path_digest(),
        reports: &reports,
    };
    let found = compare(&replay, &expected, &observed);
    let rows: Vec<_> = found.iter().map(|found| (found.metric, found.craft)).collect();
    assert_eq!(rows, [(Metric::Turns, None), (Metric::PathDigest, None)]);
}
