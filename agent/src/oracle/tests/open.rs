//! What [`compare_open`] says of reports that were tampered with.

use crate::oracle::{Metric, ObservedOpen, compare_open};
use crate::simulation::Simulation;
use shared_types::ids::{CraftId, FactId};
use shared_types::knowledge::{BoardNetwork, Csr, FleetNetwork, Topology};
use shared_types::trace::{TraceRecord, to_words};
use shared_types::transport::memory::MemoryOptions;
use shared_types::wire::{Class, EpochSpec, OpenReport, OpenSpec, StrategyKind, TrialReport};

/// Three boards that share fact 0 and have a fact of their own; craft 0 alone writes what is shared.
fn network() -> FleetNetwork {
    let boards = (0..3_u32).map(|craft| {
        let others = (0..3).filter(|&other| other != craft);
        let links: Vec<(u32, u32)> = others.flat_map(|to| [(0, to), (0, 0)]).collect();
        let links = Csr::from_pairs(2, &links);
        let mut board = BoardNetwork { fact_count: 2, links, ..BoardNetwork::default() };
        board.index_readers();
        board
    });
    let shared = (1..=5).map(|step| TraceRecord::write(step * 10_000, FactId(0), step % 2 == 1));
    let own = [TraceRecord::write(5_000, FactId(1), true), TraceRecord::read(9_000, FactId(1))];
    FleetNetwork {
        boards: boards.collect(),
        topology: Topology::binary(3),
        script: Vec::new(),
        trace: vec![to_words(&shared.collect::<Vec<_>>()), to_words(&own), Vec::new()],
    }
}

fn spec(strategy: StrategyKind) -> EpochSpec {
    EpochSpec {
        epoch: 0,
        network: 0,
        seed: 1,
        trial: 4,
        strategy,
        own_firing_only: true,
        ignores_finals: true,
        sends_altered_only: false,
        record_bytes: 16,
        turns_max: 1,
        reasoning: shared_types::reasoning::Reasoning::default(),
        recovery: None,
        link: None,
        open: Some(OpenSpec {
            duration_ns: 1_000_000,
            slice_ns: 1_000_000,
            asks_every_ns: 10_000,
            stamps_stages: true,
        }),
    }
}

/// What is said once `tamper` has changed the reports.
fn verdict(
    strategy: StrategyKind,
    is_quiet: bool,
    tamper: impl FnOnce(&mut Vec<TrialReport>),
) -> Vec<(Option<u32>, Option<u32>, Metric)> {
    let network = network();
    let view = network.view();
    let trace: Vec<_> = view.trace.iter().map(|part| part.to_vec()).collect();
    let mut simulation = Simulation::new(3, MemoryOptions::default());
    let played = simulation.play_open(&spec(strategy), &view, &trace).expect("it is played");
    let mut reports = played.reports;
    tamper(&mut reports);
    let observed = ObservedOpen { reports: &reports, is_quiet };
    let found = compare_open(&spec(strategy), &view, &observed);
    let id = |craft: Option<CraftId>| craft.map(|craft| craft.0);
    found.iter().map(|one| (id(one.sender), id(one.craft), one.metric)).collect()
}

fn open(report: &mut TrialReport) -> &mut OpenReport {
    report.open.as_mut().expect("open mode")
}

#[test]
fn untouched_reports_pass() {
    for strategy in [StrategyKind::Null, StrategyKind::Full, StrategyKind::Boundary] {
        assert_eq!(verdict(strategy, true, |_| ()), []);
    }
}

#[test]
fn a_lost_delivery_is_named_by_its_pair_once_the_fleet_is_quiet() {
    let lose = |reports: &mut Vec<TrialReport>| reports[2].counters.deliveries_from[0] -= 1;
    let wanted = (Some(0), Some(2), Metric::DeliveriesFromSender);
    assert_eq!(verdict(StrategyKind::Boundary, true, lose), [wanted]);
    assert_eq!(verdict(StrategyKind::Boundary, false, lose), []);
    let gain = |reports: &mut Vec<TrialReport>| reports[2].counters.deliveries_from[0] += 1;
    assert_eq!(verdict(StrategyKind::Boundary, false, gain), [wanted]);
}

#[test]
fn a_centre_that_counts_nobody_is_named_by_every_client() {
    let forget = |reports: &mut Vec<TrialReport>| reports[3].counters.deliveries_from.clear();
    let found = verdict(StrategyKind::Central, true, forget);
    let wanted = [0, 1, 2].map(|craft| (Some(craft), Some(3), Metric::DeliveriesFromSender));
    assert_eq!(found, wanted);
}

#[test]
fn one_request_too_many_is_named_with_its_craft() {
    let tamper = |reports: &mut Vec<TrialReport>| {
        reports[1].counters.traffic[Class::Replication as usize].requests += 1;
    };
    let found = verdict(StrategyKind::Hierarchy, false, tamper);
    assert_eq!(found, [(None, Some(1), Metric::Requests)]);
}

#[test]
fn a_change_that_was_not_applied_is_named_by_origin_and_receiver() {
    let tamper = |reports: &mut Vec<TrialReport>| {
        open(&mut reports[1]).applied_from[0] -= 1;
        open(&mut reports[1]).applied_by_end -= 1;
    };
    let found = verdict(StrategyKind::Full, true, tamper);
    assert_eq!(found, [(Some(0), Some(1), Metric::Applications)]);
}

#[test]
fn a_board_that_is_not_as_the_trace_and_its_sharers_is_named() {
    let tamper = |reports: &mut Vec<TrialReport>| open(&mut reports[2]).held[0].count -= 1;
    let found = verdict(StrategyKind::Limited, true, tamper);
    let wanted = [
        (None, Some(2), Metric::FactsUnlikeTrace),
        (Some(0), Some(2), Metric::FactsUnlikeSharers),
        (Some(1), Some(2), Metric::FactsUnlikeSharers),
    ];
    assert_eq!(found, wanted);
}

#[test]
fn demands_are_those_of_the_prefix_that_was_played() {
    let tamper = |reports: &mut Vec<TrialReport>| open(&mut reports[0]).records_played -= 1;
    let found = verdict(StrategyKind::Boundary, true, tamper);
    assert!(found.contains(&(None, Some(0), Metric::Firings)), "{found:?}");
    assert!(found.contains(&(Some(0), Some(1), Metric::Applications)), "{found:?}");
}

#[test]
fn a_missing_report_is_named() {
    let tamper = |reports: &mut Vec<TrialReport>| {
        reports.remove(1);
    };
    let found = verdict(StrategyKind::Boundary, true, tamper);
    assert_eq!(found, [(None, Some(1), Metric::Reports)]);
}
