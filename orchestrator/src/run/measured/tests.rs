//! Reports made up by hand, and what is made of them.

use super::Measured;
use crate::results::load::Saturation;
use crate::results::statistics::time_histogram;
use crate::run::backend::PlayedOpen;
use crate::run::offer::Offer;
use agent::oracle::ExpectedOpen;
use hdrhistogram::serialization::{Serializer, V2Serializer};
use shared_types::ids::FactId;
use shared_types::knowledge::{BoardNetwork, Csr, FleetNetwork, Topology};
use shared_types::trace::TraceRecord;
use shared_types::wire::{
    EpochSpec, OpenReport, OpenSpec, ReadSeen, Stage, StrategyKind, TrialReport,
};

const MS: u64 = 1_000_000;
const INTERVAL: OpenSpec = OpenSpec {
    duration_ns: 1_000 * MS,
    slice_ns: 100 * MS,
    asks_every_ns: 50 * MS,
    stamps_stages: true,
};

/// Two crafts that share fact 0; fact 1 is each one's own.
fn network() -> FleetNetwork {
    let board = |other| {
        let links = Csr::from_pairs(2, &[(0, other), (0, 0)]);
        let mut board = BoardNetwork { fact_count: 2, links, ..BoardNetwork::default() };
        board.index_readers();
        board
    };
    FleetNetwork {
        boards: vec![board(1), board(0)],
        topology: Topology::binary(2),
        ..FleetNetwork::default()
    }
}

/// Craft 0 writes the shared fact every millisecond of a second; craft 1 reads it at `reads_ns`.
fn offer(reads_ns: &[u64]) -> Offer {
    let writes = (0..1_000).map(|at| TraceRecord::write(at * MS, FactId(0), at % 2 == 0));
    let reads = reads_ns.iter().map(|&at_ns| TraceRecord::read(at_ns, FactId(0)));
    Offer::new(network(), vec![writes.collect(), reads.collect()], 0, INTERVAL.duration_ns)
}

fn spec(strategy: StrategyKind) -> EpochSpec {
    EpochSpec {
        epoch: 0,
        network: 0,
        seed: 1,
        trial: 0,
        strategy,
        own_firing_only: true,
        ignores_finals: true,
        sends_altered_only: false,
        record_bytes: 16,
        turns_max: 1_000,
        reasoning: shared_types::reasoning::Reasoning::default(),
        recovery: None,
        link: None,
        open: Some(INTERVAL),
    }
}

fn encoded(values: impl IntoIterator<Item = u64>) -> Vec<u8> {
    let mut histogram = time_histogram();
    values.into_iter().for_each(|value| histogram.saturating_record(value));
    let mut bytes = Vec::new();
    V2Serializer::new().serialize(&histogram, &mut bytes).unwrap();
    bytes
}

/// Craft 0 has made everything, `lag_ns` late, and craft 1 has applied the first `applied` changes, 20
/// us after each was meant, in the slice in which it was.
fn reports(applied: u64, lag_ns: u64) -> Vec<TrialReport> {
    let origin = OpenReport {
        records_played: 1_000,
        applied_from: vec![0, 0],
        stages: vec![(Stage::Schedule, encoded((0..1_000).map(|_| lag_ns)))],
        knowledge_slices: vec![Vec::new(); 10],
        ..OpenReport::default()
    };
    let slice = |number: u64| (0..applied).filter(move |at| at / 100 == number).map(|_| 20_000);
    let receiver = OpenReport {
        applied_from: vec![applied, 0],
        applied_by_end: applied,
        knowledge_slices: (0..10).map(|number| encoded(slice(number))).collect(),
        ..OpenReport::default()
    };
    let report = |craft, open| TrialReport { craft, open: Some(open), ..TrialReport::default() };
    vec![report(0, origin), report(1, receiver)]
}

fn measured(strategy: StrategyKind, offer: &Offer, reports: Vec<TrialReport>) -> Measured {
    let played = PlayedOpen { reports, is_quiet: true, ..PlayedOpen::default() };
    Measured::of(offer, &spec(strategy), &INTERVAL, &played).unwrap()
}

#[test]
fn what_a_trace_needs_is_what_the_independent_replay_says() {
    let offer = offer(&[]);
    let trace: Vec<&[TraceRecord]> = offer.trace.iter().map(Vec::as_slice).collect();
    let expected = ExpectedOpen::of(&spec(StrategyKind::Boundary), &offer.network.view(), &trace);
    assert_eq!(offer.needed(), expected.applications.iter().sum::<u64>());
    assert_eq!((offer.needed(), offer.needed_before(500 * MS)), (1_000, 500));
}

#[test]
fn a_change_that_was_never_known_enters_as_at_least_the_rest_of_the_interval() {
    let offer = offer(&[]);
    let whole = measured(StrategyKind::Boundary, &offer, reports(1_000, 1_000));
    assert_eq!((whole.censored, whole.saturated), (0, None));
    // The write of the last millisecond is missing: it may still be under way.
    let cut = measured(StrategyKind::Boundary, &offer, reports(999, 1_000));
    assert_eq!((cut.censored, cut.saturated), (1, None));
    assert_eq!((cut.applied_by_end, cut.stages[&Stage::Knowledge].n), (999, 1_000));
    let last = cut.histograms.knowledge.last().unwrap();
    assert!((MS..MS + MS / 500).contains(&last.max()), "{}", last.max());
    assert_eq!(last.len(), 100);
}

#[test]
fn a_load_is_above_capacity_if_too_little_is_known_or_the_schedule_lags_or_an_outbox_was_full() {
    let offer = offer(&[]);
    let of = |strategy, reports| measured(strategy, &offer, reports).saturated;
    let boundary = StrategyKind::Boundary;
    assert_eq!(of(boundary, reports(996, 1_000)), Some(Saturation::Unapplied));
    assert_eq!(of(boundary, reports(1_000, MS)), Some(Saturation::Lag));
    assert_eq!(of(boundary, reports(1_000, MS - 10_000)), None);
    let mut full = reports(1_000, 1_000);
    full[0].counters.losses.full_outboxes = 1;
    assert_eq!(of(boundary, full), Some(Saturation::FullOutbox));
    // Nothing is known under null; there the schedule alone tells.
    assert_eq!(of(StrategyKind::Null, reports(0, 1_000)), None);
    let mut unplayed = reports(0, 1_000);
    unplayed[0].open.as_mut().unwrap().records_played = 900;
    assert_eq!(of(StrategyKind::Null, unplayed), Some(Saturation::Unapplied));
}

#[test]
fn a_client_of_the_centre_may_wait_for_two_questions() {
    let offer = offer(&[]);
    let of = |applied| measured(StrategyKind::Central, &offer, reports(applied, 1_000)).saturated;
    // Twice 50 ms are a hundred writes.
    assert_eq!(of(899), None);
    assert_eq!(of(890), Some(Saturation::Unapplied));
}

#[test]
fn a_read_is_stale_if_an_earlier_write_was_not_seen() {
    let offer = offer(&[5 * MS + 500_000, 5 * MS + 500_000, 7 * MS, 900 * MS]);
    let mut reports = reports(1_000, 1_000);
    let read = |number, at_ns, seen_ns| ReadSeen { number, at_ns, seen_ns };
    reports[1].open.as_mut().unwrap().reads = vec![
        // Everything up to 5 ms was seen.
        read(0, 5 * MS + 500_000, 5 * MS),
        // Those of 4 and 5 ms were not: the older one counts.
        read(1, 5 * MS + 500_000, 3 * MS),
        // A write of the same instant is not before it.
        read(2, 7 * MS, 6 * MS),
        // Nothing at all was seen.
        read(3, 900 * MS, ReadSeen::NOTHING),
    ];
    let measured = measured(StrategyKind::Boundary, &offer, reports);
    assert_eq!((measured.reads, measured.stale_reads), (4, 2));
    let ages = measured.histograms.staleness.unwrap();
    let ages: Vec<u64> = ages.iter_recorded().map(|step| step.value_iterated_to()).collect();
    assert!((1_500_000..1_502_000).contains(&ages[0]), "{ages:?}");
    assert!((900 * MS..901 * MS).contains(&ages[1]), "{ages:?}");
}

#[test]
fn halves_and_shares_are_of_all_crafts_together() {
    let offer = offer(&[]);
    let mut reports = reports(1_000, 1_000);
    let open = reports[1].open.as_mut().unwrap();
    for (number, slice) in open.knowledge_slices.iter_mut().enumerate() {
        let time = if number < 5 { 20_000 } else { 30_000 };
        *slice = encoded((0..100).map(|_| time));
    }
    // The class of 30 us: of it three quarters on the way; of shorter ones nothing is asked at p99.
    let class_of =
        |ns| (0_u32..).take_while(|&class| agent::metrics::class_floor_ns(class) <= ns).last();
    let (long, short) = (class_of(30_000).unwrap(), class_of(20_000).unwrap());
    open.shares = vec![[short, 1, 2, 400], [long, 1, 15, 300], [long, 1, 5, 200]];
    // There is no such class, no such part and no such share.
    open.shares.extend([[u32::MAX, 1, 2, 900], [long, 9, 2, 900], [long, 1, 40, 900]]);
    let measured = measured(StrategyKind::Boundary, &offer, reports);
    let ratio = measured.second_half_ratio.unwrap();
    assert!((ratio - 1.5).abs() < 0.01, "{ratio}");
    assert_eq!(measured.shares["p99"]["wake"], 77.5);
    assert_eq!(measured.shares["p50"]["wake"], 27.5, "the class of the median counts as a whole");
}

#[test]
fn a_damaged_histogram_is_refused_by_name() {
    let mut reports = reports(1_000, 1_000);
    reports[1].open.as_mut().unwrap().knowledge_slices[3].truncate(20);
    let played = PlayedOpen { reports, is_quiet: true, ..PlayedOpen::default() };
    let result = Measured::of(&offer(&[]), &spec(StrategyKind::Boundary), &INTERVAL, &played);
    assert!(result.unwrap_err().contains("process 1"));
}
