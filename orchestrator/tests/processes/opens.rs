//! Intervals of open mode on real fleets, driven below the command line: the same counts as in simulation,
//! and what a killed craft does to one.

use crate::shared::{is_gone, until};
use agent::oracle::{ObservedOpen, compare_open, compare_recovered};
use agent::process::doom::{Doom, Point};
use agent::simulation::Simulation;
use orchestrator::launch::os_process::{CraftErrors, Launcher};
use orchestrator::launch::placement::{Placement, Processors};
use orchestrator::run::answers::ANSWER_LIMIT_NS;
use orchestrator::run::backend::{Backend, PlayError, PlayedOpen};
use orchestrator::run::strike::{Blow, Strike};
use orchestrator::run::{FleetOptions, RealFleet};
use orchestrator::supervision::restart::RestartPolicy;
use orchestrator::supervision::signals::Signals;
use rustix::process::{Pid, Signal, kill_process};
use shared_types::ids::{CraftId, FactId};
use shared_types::knowledge::{BoardNetwork, Csr, FleetNetwork, Topology};
use shared_types::limits::REAL_PATIENCE_NS;
use shared_types::rng::{Purpose, Stream};
use shared_types::scenario::Pinning;
use shared_types::time::Nanos;
use shared_types::trace::{TraceRecord, to_words};
use shared_types::transport::link::LinkCounts;
use shared_types::transport::memory::MemoryOptions;
use shared_types::transport::reclaim::Steps;
use shared_types::transport::{WakeMode, clock};
use shared_types::wire::{
    CutOff, EpochSpec, LinkSpec, Losses, OpenSpec, OutageSpec, RecoverySpec, StrategyKind,
    TrialReport,
};
use std::collections::BTreeMap;

const CRAFTS: u32 = 5;
const FACTS: u32 = 8;

const STRATEGIES: [StrategyKind; 8] = [
    StrategyKind::Null,
    StrategyKind::Full,
    StrategyKind::Boundary,
    StrategyKind::Limited,
    StrategyKind::Hierarchy,
    StrategyKind::Hybrid,
    StrategyKind::Central,
    StrategyKind::CentralBatched,
];

/// Boards without rules; fact f is shared by the crafts from f on, the last by none. `bursts` bursts of
/// up to four writes and reads a craft, 1 ms apart on average.
pub(crate) fn network(bursts: u32) -> FleetNetwork {
    let boards = (0..CRAFTS).map(|craft| {
        let others = |fact| (fact..CRAFTS).filter(move |&other| other != craft && craft >= fact);
        let links: Vec<(u32, u32)> = (0..FACTS)
            .flat_map(|fact| others(fact).flat_map(move |to| [(fact, to), (fact, fact)]))
            .collect();
        let links = Csr::from_pairs(FACTS as usize, &links);
        let mut board = BoardNetwork { fact_count: FACTS, links, ..BoardNetwork::default() };
        board.index_readers();
        board
    });
    let parent = (0..CRAFTS).map(|craft| craft.checked_sub(1).map_or(u32::MAX, |below| below / 2));
    let group = (0..CRAFTS).map(|craft| craft / 3).collect();
    let trace = (0..CRAFTS).map(|craft| {
        let mut stream = Stream::new(11, 0, Purpose::Test, craft);
        let (mut records, mut at_ns) = (Vec::new(), 0);
        for _ in 0..bursts {
            at_ns += u64::from(stream.below(2_000_000));
            for _ in 0..stream.between(1, 4) {
                let fact = FactId(stream.below(FACTS));
                records.push(match stream.below(3) {
                    0 => TraceRecord::read(at_ns, fact),
                    choice => TraceRecord::write(at_ns, fact, choice == 1),
                });
            }
        }
        to_words(&records)
    });
    let network = FleetNetwork {
        boards: boards.collect(),
        topology: Topology::new(parent.collect(), group).expect("halving makes a tree"),
        script: Vec::new(),
        trace: trace.collect(),
    };
    network.view().validate().expect("links name what exists");
    network
}

fn spec(epoch: u32, strategy: StrategyKind, duration_ns: u64) -> EpochSpec {
    EpochSpec {
        epoch,
        network: 0,
        seed: 5,
        trial: 0,
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
            duration_ns,
            slice_ns: 100_000_000,
            asks_every_ns: 1_000_000,
            stamps_stages: true,
        }),
    }
}

/// Lets `play` use a real fleet of [`CRAFTS`] crafts, and looks that nothing of it is left.
fn with_fleet<T>(
    has_centre: bool,
    run_ends: Option<Nanos>,
    play: impl FnOnce(&mut RealFleet<'_>) -> T,
) -> T {
    with_restarts(has_centre, run_ends, None, play)
}

/// The same with successors for who dies.
fn with_restarts<T>(
    has_centre: bool,
    run_ends: Option<Nanos>,
    restart: Option<RestartPolicy>,
    play: impl FnOnce(&mut RealFleet<'_>) -> T,
) -> T {
    with_doomed(has_centre, run_ends, restart, BTreeMap::new(), play)
}

/// The same with crafts that are doomed from the start.
pub(crate) fn with_doomed<T>(
    has_centre: bool,
    run_ends: Option<Nanos>,
    restart: Option<RestartPolicy>,
    dooms: BTreeMap<CraftId, Doom>,
    play: impl FnOnce(&mut RealFleet<'_>) -> T,
) -> T {
    with_limit(has_centre, run_ends, restart, dooms, ANSWER_LIMIT_NS, play)
}

/// The same with a limit on answers.
pub(crate) fn with_limit<T>(
    has_centre: bool,
    run_ends: Option<Nanos>,
    restart: Option<RestartPolicy>,
    dooms: BTreeMap<CraftId, Doom>,
    answer_limit_ns: u64,
    play: impl FnOnce(&mut RealFleet<'_>) -> T,
) -> T {
    let mut signals = Signals::install().expect("signals");
    let launcher = Launcher::new(env!("CARGO_BIN_EXE_slateswarm"), CraftErrors::Kept);
    let allowed = Processors::of_this_process().expect("processors");
    let mut draws = Stream::new(1, 0, Purpose::Order, 0);
    let processes = CRAFTS + u32::from(has_centre);
    let options = FleetOptions {
        crafts: CRAFTS,
        has_centre,
        wake: WakeMode::Adaptive,
        placement: Placement::draw(&allowed, Pinning::Balanced, processes, &mut draws),
        turn_limit_ns: 5_000_000_000,
        answer_limit_ns,
        run_ends,
        restart,
        dooms,
        janitor: Steps::ALL,
    };
    let mut fleet = RealFleet::launch(options, &launcher, &mut signals).expect("a fleet");
    let mut processes = fleet.process_ids();
    let result = play(&mut fleet);
    processes.extend(fleet.process_ids());
    let end = fleet.end();
    assert!(end.trouble.is_empty(), "{:?}", end.trouble);
    assert!(processes.into_iter().all(is_gone));
    result
}

/// What must not differ between a real and a simulated interval.
fn counts(report: &TrialReport) -> impl PartialEq + std::fmt::Debug {
    let open = report.open.clone().expect("an epoch of open mode");
    (
        report.counters.traffic,
        report.counters.deliveries_from.clone(),
        report.counters.hops,
        open.records_played,
        open.applied_from,
        open.applied_by_end + open.applied_after_end,
        open.reads.len(),
        open.held.iter().map(|held| held.fact).collect::<Vec<_>>(),
    )
}

pub(crate) fn every_strategy_plays_a_trace_as_in_simulation() {
    let network = network(200);
    let view = network.view();
    let trace: Vec<_> = view.trace.iter().map(|part| part.to_vec()).collect();
    let mut simulation = Simulation::new(CRAFTS, MemoryOptions::default());
    with_fleet(true, None, |fleet| {
        for (epoch, strategy) in (0..).zip(STRATEGIES) {
            let spec = spec(epoch, strategy, 500_000_000);
            let played = fleet.play_open(&spec, &network).expect("an interval");
            assert!(played.is_quiet, "{strategy}");
            let observed = ObservedOpen { reports: &played.reports, is_quiet: true };
            assert_eq!(compare_open(&spec, &view, &observed), [], "{strategy}");
            let simulated = simulation.play_open(&spec, &view, &trace).expect("simulated");
            let processes = CRAFTS as usize + usize::from(strategy.has_centre());
            assert_eq!(played.reports.len(), processes, "{strategy}");
            for (real, simulated) in played.reports.iter().zip(&simulated.reports) {
                // How many requests a conversation takes depends on the clock.
                if !strategy.has_centre() {
                    assert_eq!(counts(real), counts(simulated), "{strategy}, {}", real.craft);
                }
                assert!(!real.counters.losses.is_partial(), "{:?}", real.counters.losses);
                assert!(real.cpu_ns > 0);
            }
        }
        let refused = fleet.play_open(&spec(99, StrategyKind::Pipelined, 1), &network);
        let said = format!("{refused:?}");
        assert!(said.contains("central-batched"), "{said}");
    });
}

pub(crate) fn killed_craft_ends_an_interval_and_nothing_is_left() {
    let network = network(2_000);
    let lost = with_fleet(false, None, |fleet| {
        let victim = i32::try_from(fleet.process_ids()[2]).expect("a process");
        let victim = Pid::from_raw(victim).expect("a process");
        let killer = std::thread::spawn(move || {
            let due = clock::now().plus(300_000_000);
            until("the interval to be under way", || (clock::now() >= due).then_some(()));
            kill_process(victim, Signal::KILL).expect("kill");
        });
        let played = fleet.play_open(&spec(0, StrategyKind::Boundary, 2_000_000_000), &network);
        killer.join().expect("the killer");
        match played {
            Err(PlayError::Lost(lost)) => lost,
            other => panic!("a craft was lost, and not: {other:?}"),
        }
    });
    let crafts: Vec<CraftId> = lost.iter().map(|ended| ended.craft).collect();
    assert_eq!(crafts, [CraftId(2)]);
}

pub(crate) fn time_limit_and_signal_end_an_interval() {
    let network = network(2_000);
    let spec = spec(0, StrategyKind::CentralBatched, 20_000_000_000);
    let soon = clock::now().plus(1_000_000_000);
    let played = with_fleet(true, Some(soon), |fleet| fleet.play_open(&spec, &network));
    assert!(matches!(played, Err(PlayError::TimeLimit)), "{played:?}");
    let played = with_fleet(true, None, |fleet| {
        let own = rustix::process::getpid();
        let asking = std::thread::spawn(move || {
            let due = clock::now().plus(300_000_000);
            until("the interval to be under way", || (clock::now() >= due).then_some(()));
            kill_process(own, Signal::TERM).expect("a signal");
        });
        let played = fleet.play_open(&spec, &network);
        asking.join().expect("who asks");
        played
    });
    assert!(matches!(played, Err(PlayError::Stopped(_))), "{played:?}");
}

pub(crate) fn what_a_saturated_interval_left_undone_reaches_no_other() {
    let mut network = network(100);
    // Every craft has more to tell than round trips fit.
    let write = |step: u64| TraceRecord::write(step * 1_000, FactId(0), step.is_multiple_of(2));
    let many: Vec<TraceRecord> = (0..100_000).map(write).collect();
    let few = std::mem::replace(&mut network.trace, vec![to_words(&many); CRAFTS as usize]);
    with_fleet(true, None, |fleet| {
        let saturated = spec(0, StrategyKind::Central, 100_000_000);
        let played = fleet.play_open(&saturated, &network).expect("an interval");
        assert!(!played.is_quiet);
        let observed = ObservedOpen { reports: &played.reports, is_quiet: false };
        assert_eq!(compare_open(&saturated, &network.view(), &observed), []);
        network.trace = few;
        let spec = EpochSpec { network: 1, ..spec(1, StrategyKind::Central, 200_000_000) };
        let played = fleet.play_open(&spec, &network).expect("an interval");
        assert!(played.is_quiet);
        for report in &played.reports {
            assert!(!report.counters.losses.is_partial(), "{:?}", report.counters.losses);
        }
        let observed = ObservedOpen { reports: &played.reports, is_quiet: true };
        assert_eq!(compare_open(&spec, &network.view(), &observed), []);
    });
}

/// An interval of 1.2 s that recovers.
pub(crate) fn recovering(epoch: u32, strategy: StrategyKind) -> EpochSpec {
    let recovery = Some(RecoverySpec::patient(REAL_PATIENCE_NS));
    EpochSpec { recovery, ..spec(epoch, strategy, 1_200_000_000) }
}

/// What came of it, with `blows` so many ms after it is asked for.
pub(crate) fn struck(
    fleet: &mut RealFleet<'_>,
    spec: &EpochSpec,
    network: &FleetNetwork,
    blows: &[(u64, u32, Blow)],
) -> PlayedOpen {
    let strategy = spec.strategy;
    let asked = clock::now();
    fleet.strike(blows.iter().map(|&(at_ms, craft, blow)| Strike {
        due: asked.plus(at_ms * 1_000_000),
        craft: CraftId(craft),
        blow,
    }));
    let played = fleet.play_open(spec, network).expect("an interval");
    assert!(!fleet.has_strikes(), "{strategy}");
    assert!(played.is_quiet, "{strategy}");
    let observed = ObservedOpen { reports: &played.reports, is_quiet: true };
    let died: Vec<CraftId> = played.dead.iter().map(|ended| ended.craft).collect();
    assert_eq!(compare_recovered(spec, &network.view(), &observed, &died), [], "{strategy}");
    let losses: Losses = played.reports.iter().fold(Losses::default(), |mut all, report| {
        all += report.counters.losses;
        all
    });
    assert_eq!((losses.late, losses.refused), (0, 0), "{strategy}");
    played
}

pub(crate) const AT_ONCE: RestartPolicy =
    RestartPolicy { limit: 100, window_ns: u64::MAX, pause_ns: 0 };

pub(crate) fn killed_crafts_are_followed_while_the_interval_goes_on() {
    let network = network(1_200);
    with_restarts(true, None, Some(AT_ONCE), |fleet| {
        for (epoch, strategy) in (0..).zip(STRATEGIES) {
            // The second has children in the tree; the centre is told last.
            let victims = if strategy.has_centre() { [1, CRAFTS] } else { [1, 4] };
            let kills = [(400, victims[0], Blow::Kill), (700, victims[1], Blow::Kill)];
            let played = struck(fleet, &recovering(epoch, strategy), &network, &kills);
            let mut died: Vec<u32> = played.dead.iter().map(|ended| ended.craft.0).collect();
            died.sort_unstable();
            assert_eq!(died, victims, "{strategy}");
            let recoveries = fleet.take_recoveries(false);
            assert_eq!(recoveries.len(), 2, "{strategy}");
            for recovery in recoveries {
                let craft = recovery.ended.craft;
                let steps = [
                    Some(recovery.noticed),
                    recovery.reclaimed.as_ref().map(|reclaimed| reclaimed.done),
                    recovery.known,
                    recovery.ready,
                    recovery.rejoined,
                ];
                assert!(steps.iter().all(Option::is_some), "{strategy}, {craft}: {steps:?}");
                assert!(steps.is_sorted(), "{strategy}, {craft}: {steps:?}");
                assert!(recovery.peers_noticed >= Some(recovery.noticed), "{strategy}, {craft}");
                assert!(recovery.caught_up > recovery.ready, "{strategy}, {craft}: {recovery:?}");
            }
            for report in &played.reports {
                let open = report.open.as_ref().expect("an epoch of open mode");
                let is_successor = victims.contains(&report.craft);
                assert_eq!(open.caught_up_ns > 0, is_successor, "{strategy}, {}", report.craft);
                let misses = is_successor && report.craft < CRAFTS;
                assert_eq!(open.records_missed > 0, misses, "{strategy}, {}", report.craft);
            }
        }
    });
}

pub(crate) fn successor_that_is_in_is_not_kept_waiting_by_one_that_dies_at_the_door() {
    const LIMIT_NS: u64 = 3_000_000_000;
    let network = network(1_200);
    with_limit(false, None, Some(AT_ONCE), BTreeMap::new(), LIMIT_NS, |fleet| {
        // Both are told to begin before the second dies as it is told to connect.
        fleet.doom(CraftId(4), Doom { point: Point::Handshake, after: 0 });
        let kills = [(400, 1, Blow::Kill), (400, 4, Blow::Kill)];
        let played = struck(fleet, &recovering(0, StrategyKind::Boundary), &network, &kills);
        let mut died: Vec<u32> = played.dead.iter().map(|ended| ended.craft.0).collect();
        died.sort_unstable();
        assert_eq!((died, fleet.take_mute()), (vec![1, 4, 4], Vec::new()));
    });
}

pub(crate) fn stopped_crafts_are_paused_and_catch_up() {
    let network = network(1_200);
    // Without restarts: who is stopped must not be taken for dead.
    with_fleet(true, None, |fleet| {
        for (epoch, strategy) in (0..).zip(STRATEGIES) {
            let blows = [
                (300, 1, Blow::Stop),
                (300, 3, Blow::Stop),
                (900, 3, Blow::Continue),
                // After the interval's end.
                (1_600, 1, Blow::Continue),
            ];
            let played = struck(fleet, &recovering(epoch, strategy), &network, &blows);
            assert!(played.dead.is_empty(), "{strategy}");
            let stopped = fleet.take_struck();
            let continued = stopped.iter().filter(|blow| blow.was_stopped);
            assert_eq!(continued.count(), 2, "{strategy}: {stopped:?}");
            for report in &played.reports {
                let open = report.open.as_ref().expect("an epoch of open mode");
                assert_eq!((open.records_missed, open.caught_up_ns), (0, 0), "{strategy}");
            }
        }
    });
}

pub(crate) fn every_fact_reaches_its_peers_over_links_that_lose_a_quarter_and_a_half() {
    for loss_per_billion in [250_000_000, 500_000_000] {
        let link = LinkSpec { loss_per_billion, ..LinkSpec::default() };
        for (strategy, links, repeats) in over(&link) {
            let is_told = strategy != StrategyKind::Null;
            assert_eq!((links.lost > 0, repeats > 0), (is_told, is_told), "{strategy}: {links:?}");
        }
    }
}

pub(crate) fn every_fact_reaches_its_peers_over_links_with_every_fault() {
    let cut_off = |from_ms: u64, until_ms: u64, whom| OutageSpec {
        from_ns: from_ms * 1_000_000,
        until_ns: until_ms * 1_000_000,
        whom,
    };
    let link = LinkSpec {
        loss_per_billion: 100_000_000,
        duplication_per_billion: 200_000_000,
        delay_ns: 500_000,
        jitter_ns: 3_000_000,
        // A sample of a hundred bytes takes 100 us and more.
        bandwidth_bits_per_s: Some(10_000_000),
        outages: vec![
            cut_off(2, 12, CutOff::Group(vec![1, 3])),
            cut_off(20, 400, CutOff::Pair(0, 2)),
        ],
        positions_ns: vec![[0; 3], [300_000, 0, 0]],
    };
    let mut all = LinkCounts::default();
    for (strategy, links, repeats) in over(&link) {
        assert_eq!(repeats > 0, strategy != StrategyKind::Null, "{strategy}: {links:?}");
        all += links;
    }
    let LinkCounts { lost, cut_off, doubled, delayed, overtaken } = all;
    for count in [lost, cut_off, doubled, delayed, overtaken] {
        assert!(count > 10, "{all:?}");
    }
}

/// What the links did, and how often something was repeated, in an interval of each strategy over `link`
/// that ends as promised.
fn over(link: &LinkSpec) -> Vec<(StrategyKind, LinkCounts, u64)> {
    // Few: under `central` each write awaits its reply, and a lost one comes a patience later.
    let network = network(20);
    let mut records = network.view().trace.iter().map(|part| part.len() as u64).collect::<Vec<_>>();
    records.push(0);
    with_fleet(true, None, |fleet| {
        let intervals = (0..).zip(STRATEGIES).map(|(epoch, strategy)| {
            let spec = EpochSpec { link: Some(link.clone()), ..recovering(epoch, strategy) };
            let played = struck(fleet, &spec, &network, &[]);
            let (mut links, mut repeats) = (LinkCounts::default(), 0);
            for (report, &records) in played.reports.iter().zip(&records) {
                let open = report.open.as_ref().expect("an epoch of open mode");
                assert_eq!(open.records_played, records, "{strategy}, {}", report.craft);
                links += report.counters.losses.links;
                repeats += report.counters.recovered.repeats;
            }
            (strategy, links, repeats)
        });
        intervals.collect()
    })
}
