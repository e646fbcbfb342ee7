//! What was played against what the trace alone demands.

use super::{Befalls, Conditions, ProcessFault, SimulatedOpen};
use crate::oracle::{ExpectedOpen, ObservedOpen, compare_open, compare_recovered, disagreements};
use crate::simulation::Simulation;
use hdrhistogram::Histogram;
use hdrhistogram::serialization::Deserializer;
use proptest::prelude::{ProptestConfig, prop_assert_eq, proptest};
use shared_types::ids::{CraftId, FactId};
use shared_types::knowledge::{BoardNetwork, Csr, FleetNetwork, FleetView, Topology, Value};
use shared_types::rng::{Purpose, Stream};
use shared_types::trace::{TraceRecord, to_words};
use shared_types::transport::link::{LinkCounts, StatedLink};
use shared_types::transport::memory::MemoryOptions;
use shared_types::wire::{
    Class, Counters, CutOff, EpochSpec, LinkSpec, OpenReport, OpenSpec, OutageSpec, ReadSeen,
    RecoverySpec, Stage, StrategyKind, TrialReport,
};

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

const FACTS: u32 = 12;

/// Boards without rules; half of the facts are shared, each by as many crafts as its id says.
fn network(crafts: u32, seed: u64) -> FleetNetwork {
    let mut stream = Stream::new(seed, 0, Purpose::Test, 0);
    let mut links = vec![Vec::<(u32, u32)>::new(); crafts as usize];
    for fact in 0..FACTS / 2 {
        let mut sharers: Vec<u32> = (0..crafts).collect();
        stream.shuffle(&mut sharers);
        sharers.truncate((fact as usize + 2).min(crafts as usize));
        sharers.sort_unstable();
        for &from in &sharers {
            for &to in sharers.iter().filter(|&&to| to != from) {
                links[from as usize].extend([(fact, to), (fact, fact)]);
            }
        }
    }
    let boards = links.iter().map(|links| {
        let links = Csr::from_pairs(FACTS as usize, links);
        let mut board = BoardNetwork { fact_count: FACTS, links, ..BoardNetwork::default() };
        board.index_readers();
        board
    });
    let parent = (0..crafts).map(|craft| craft.checked_sub(1).map_or(u32::MAX, |below| below / 2));
    let group = (0..crafts).map(|craft| craft / 3).collect();
    let topology = Topology::new(parent.collect(), group).expect("halving makes a tree");
    let network =
        FleetNetwork { boards: boards.collect(), topology, script: Vec::new(), trace: Vec::new() };
    network.view().validate().expect("links name what exists");
    network
}

/// Random bursts, about `gap_ns` apart, with some reads.
fn trace(crafts: u32, seed: u64, gap_ns: u32) -> Vec<Vec<TraceRecord>> {
    let of_craft = |craft| {
        let mut stream = Stream::new(seed, 1, Purpose::Test, craft);
        let (mut records, mut at_ns) = (Vec::new(), 0);
        for _ in 0..30 {
            at_ns += u64::from(stream.below(2 * gap_ns));
            for _ in 0..stream.between(1, 6) {
                let fact = FactId(stream.below(FACTS));
                records.push(match stream.below(3) {
                    0 => TraceRecord::read(at_ns, fact),
                    choice => TraceRecord::write(at_ns, fact, choice == 1),
                });
            }
        }
        records
    };
    (0..crafts).map(of_craft).collect()
}

fn spec(strategy: StrategyKind, record_bytes: u32) -> EpochSpec {
    EpochSpec {
        epoch: 0,
        network: 0,
        seed: 5,
        trial: 0,
        strategy,
        own_firing_only: true,
        ignores_finals: true,
        sends_altered_only: false,
        record_bytes,
        turns_max: 1,
        reasoning: shared_types::reasoning::Reasoning::default(),
        recovery: None,
        link: None,
        open: Some(OpenSpec {
            duration_ns: 50_000_000,
            slice_ns: 10_000_000,
            asks_every_ns: 50_000,
            stamps_stages: true,
        }),
    }
}

fn open(report: &TrialReport) -> &OpenReport {
    report.open.as_ref().expect("an epoch of open mode")
}

fn decoded(bytes: &[u8]) -> Histogram<u64> {
    Deserializer::new().deserialize(&mut &bytes[..]).expect("a histogram")
}

/// The histogram of `stage`; empty if there is none.
fn stage(report: &TrialReport, stage: Stage) -> Histogram<u64> {
    let found = open(report).stages.iter().find(|(of, _)| *of == stage);
    found.map_or_else(|| Histogram::new(3).expect("valid"), |(_, bytes)| decoded(bytes))
}

/// Time to knowledge over all slices.
fn knowledge(report: &TrialReport) -> Histogram<u64> {
    let mut all = Histogram::new(3).expect("valid");
    for slice in open(report).knowledge_slices.iter().filter(|slice| !slice.is_empty()) {
        all += decoded(slice);
    }
    all
}

fn play(
    spec: &EpochSpec,
    network: &FleetNetwork,
    trace: &[Vec<TraceRecord>],
    jitter_ns: u32,
) -> (Simulation, SimulatedOpen) {
    let options = MemoryOptions { jitter_ns, ..MemoryOptions::default() };
    let mut simulation = Simulation::new(network.view().craft_count(), options);
    let played = simulation.play_open(spec, &network.view(), trace).expect("it is played");
    (simulation, played)
}

/// What was played, in the oracle's terms.
fn observed(played: &SimulatedOpen) -> [Vec<u64>; 3] {
    let class = Class::Replication as usize;
    let of = |count: fn(&shared_types::wire::Traffic) -> u64| {
        let reports = played.reports.iter();
        reports.map(|report| count(&report.counters.traffic[class])).collect::<Vec<_>>()
    };
    let applications = played.reports.iter().map(|report| knowledge(report).len()).collect();
    [of(|traffic| traffic.requests), of(|traffic| traffic.transmissions), applications]
}

fn check(strategy: StrategyKind, crafts: u32, seed: u64, record_bytes: u32, jitter_ns: u32) {
    let (network, trace) = (network(crafts, seed), trace(crafts, seed, 20_000));
    let (spec, view) = (spec(strategy, record_bytes), network.view());
    let (simulation, played) = play(&spec, &network, &trace, jitter_ns);
    let parts: Vec<&[TraceRecord]> = trace.iter().map(Vec::as_slice).collect();
    let expected = ExpectedOpen::of(&spec, &view, &parts);
    let view = FleetView { trace: parts, ..view };
    let observed_open = ObservedOpen { reports: &played.reports, is_quiet: true };
    assert_eq!(compare_open(&spec, &view, &observed_open), [], "{strategy}, seed {seed}");
    let [requests, transmissions, mut applications] = observed(&played);
    applications.truncate(crafts as usize);
    assert_eq!(applications, expected.applications, "{strategy}, seed {seed}");
    if !strategy.has_centre() {
        assert_eq!(requests, expected.requests, "{strategy}, seed {seed}");
        assert_eq!(transmissions, expected.transmissions, "{strategy}, seed {seed}");
        for (report, receiver) in played.reports.iter().zip((0..).map(CraftId)) {
            for sender in (0..crafts).map(CraftId) {
                let delivered = report.counters.deliveries_from[sender.index()];
                let wanted = expected.deliveries.between(sender, receiver);
                assert_eq!(delivered, wanted, "{strategy}");
            }
        }
    }
    for report in &played.reports {
        assert!(!report.counters.losses.is_partial(), "{:?}", report.counters.losses);
    }
    if strategy != StrategyKind::Null {
        let state = |craft, fact| simulation.fact(craft, fact).expect("the craft took part");
        assert_eq!(disagreements(&view, state), [], "{strategy}, seed {seed}");
    }
    let of_trace = |craft: usize, reads: bool| {
        trace[craft].iter().filter(|record| record.holds().is_none() == reads).count() as u64
    };
    for (craft, report) in played.reports.iter().enumerate().take(crafts as usize) {
        let schedule = stage(report, Stage::Schedule);
        assert_eq!(schedule.len(), of_trace(craft, false));
        assert!(schedule.max() <= 1, "the virtual clock is never late");
        assert_eq!(open(report).reads.len() as u64, of_trace(craft, true));
        assert_eq!(open(report).records_played, trace[craft].len() as u64);
    }
}

#[test]
fn every_strategy_sends_delivers_and_applies_what_the_trace_demands() {
    for seed in 0..30 {
        let crafts = 1 + u32::try_from(seed % 9).expect("small");
        for strategy in STRATEGIES {
            check(strategy, crafts, seed, 16, 1_000);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn neither_delays_nor_sizes_of_records_move_a_count_they_should_not(
        seed in 0_u64..10_000, crafts in 2_u32..10, strategy in 0_usize..8, jitter_ns in 0_u32..200_000,
    ) {
        check(STRATEGIES[strategy], crafts, seed, 16, jitter_ns);
        let (network, trace) = (network(crafts, seed), trace(crafts, seed, 20_000));
        let played = |jitter| observed(&play(&spec(STRATEGIES[strategy], 64), &network, &trace, jitter).1);
        // How many requests a conversation takes depends on when its replies come.
        let is_decided = !STRATEGIES[strategy].has_centre();
        let counted = |jitter| played(jitter).into_iter().skip(if is_decided { 0 } else { 2 });
        prop_assert_eq!(counted(0).collect::<Vec<_>>(), counted(jitter_ns).collect::<Vec<_>>());
    }
}

#[test]
fn a_burst_that_no_sample_takes_is_split_and_still_counted_change_by_change() {
    let network = network(3, 1);
    let burst = vec![TraceRecord::write(1_000, FactId(1), true); 40];
    let trace = [burst, Vec::new(), Vec::new()];
    // 4 KiB a record: 15 of them fit 64 KiB.
    for (strategy, hops) in [(StrategyKind::Boundary, 2), (StrategyKind::Full, 1)] {
        let (_, played) = play(&spec(strategy, 4112), &network, &trace, 1_000);
        let [requests, transmissions, applications] = observed(&played);
        assert_eq!((requests[0], transmissions[0]), (40 * hops, 3 * hops), "{strategy}");
        assert_eq!(applications, [0, 40, 40]);
    }
}

#[test]
fn the_last_write_of_a_slow_trace_holds_on_every_board_that_shares_it() {
    let network = network(5, 3);
    let (mut trace, mut last) = (vec![Vec::new(); 5], Value::Unknown);
    for step in 0..40_u32 {
        let holds = step % 3 != 0;
        last = if holds { Value::Asserted } else { Value::Absent };
        let at_ns = u64::from(step) * 1_000_000;
        trace[(step % 5) as usize].push(TraceRecord::write(at_ns, FactId(5), holds));
    }
    for strategy in STRATEGIES.into_iter().filter(|&strategy| strategy != StrategyKind::Null) {
        let (simulation, played) = play(&spec(strategy, 16), &network, &trace, 10_000);
        for craft in (0..5).map(CraftId) {
            let state = simulation.fact(craft, FactId(5)).expect("the craft took part");
            assert_eq!((state.value, state.version.count), (last, 40), "{strategy}");
            let knowledge = knowledge(&played.reports[craft.index()]);
            assert!(knowledge.max() < 1_000_000, "each was known before the next");
            assert!(knowledge.min() > 0);
        }
    }
}

#[test]
fn links_act_in_a_simulated_interval_and_every_board_holds_what_is_promised() {
    let mut network = network(5, 3);
    let trace = trace(5, 3, 200_000);
    network.trace = trace.iter().map(|part| to_words(part)).collect();
    let view = network.view();
    let whom = CutOff::Group(vec![1]);
    let link = LinkSpec {
        loss_per_billion: 100_000_000,
        duplication_per_billion: 200_000_000,
        delay_ns: 100_000,
        jitter_ns: 300_000,
        bandwidth_bits_per_s: Some(50_000_000),
        outages: vec![OutageSpec { from_ns: 1_000_000, until_ns: 3_000_000, whom }],
        positions_ns: Vec::new(),
    };
    let mut all = LinkCounts::default();
    for strategy in STRATEGIES {
        let recovery = Some(RecoverySpec::patient(2_000_000));
        let spec = EpochSpec { recovery, ..spec(strategy, 16) };
        let mut simulation = Simulation::new(5, MemoryOptions::default());
        simulation.network().set_link(StatedLink::new(link.clone(), 7));
        let played = simulation.play_open(&spec, &view, &trace).expect("it is played");
        let observed = ObservedOpen { reports: &played.reports, is_quiet: true };
        assert_eq!(compare_recovered(&spec, &view, &observed, &[]), [], "{strategy}");
        all += played.links;
    }
    let LinkCounts { lost, cut_off, doubled, delayed, overtaken } = all;
    for count in [lost, cut_off, doubled, delayed, overtaken] {
        assert!(count > 20, "{all:?}");
    }
}

/// A fleet of five over links that do everything at once, under `conditions`.
fn play_over_links(strategy: StrategyKind, conditions: &Conditions) -> (EpochSpec, SimulatedOpen) {
    let (mut network, trace) = (network(5, 3), trace(5, 3, 400_000));
    network.trace = trace.iter().map(|part| to_words(part)).collect();
    let link = LinkSpec {
        loss_per_billion: 250_000_000,
        duplication_per_billion: 100_000_000,
        delay_ns: 100_000,
        jitter_ns: 0,
        bandwidth_bits_per_s: None,
        outages: Vec::new(),
        positions_ns: Vec::new(),
    };
    let recovery = Some(RecoverySpec::patient(1_000_000));
    let spec = EpochSpec { recovery, ..spec(strategy, 16) };
    let mut simulation = Simulation::new(5, MemoryOptions::default());
    simulation.network().set_link(StatedLink::new(link, 7));
    let view = network.view();
    let played =
        simulation.play_open_under(&spec, &view, &trace, conditions).expect("it is played");
    if played.is_quiet {
        let died: Vec<CraftId> = played.dead.iter().map(|&(craft, _)| craft).collect();
        let observed = ObservedOpen { reports: &played.reports, is_quiet: true };
        assert_eq!(compare_recovered(&spec, &view, &observed, &died), [], "{strategy}");
    }
    (spec, played)
}

#[test]
fn what_is_sent_is_received_or_was_lost_on_a_link() {
    for strategy in STRATEGIES {
        let (_, played) = play_over_links(strategy, &Conditions::default());
        let sum = |of: fn(&Counters) -> u64| {
            played.reports.iter().map(|report| of(&report.counters)).sum::<u64>()
        };
        let sent = sum(|counters| counters.traffic.iter().map(|class| class.transmissions).sum());
        let received = sum(|counters| counters.traffic.iter().map(|class| class.deliveries).sum());
        let twice = sum(|counters| counters.losses.repeats);
        // A multicast goes to all four others, a sample sent again to one.
        let multicasts = match strategy {
            StrategyKind::Full => {
                sum(|counters| counters.traffic[Class::Replication as usize].transmissions)
            }
            _ => 0,
        };
        let departed = sent + 3 * multicasts;
        let LinkCounts { lost, cut_off, doubled, .. } = played.links;
        assert_eq!(departed + doubled, received + twice + lost + cut_off, "{strategy}");
        assert!(strategy == StrategyKind::Null || lost > sent / 10, "{strategy}: {lost} of {sent}");
    }
}

#[test]
fn processes_end_stop_and_come_back_while_the_others_play_on() {
    let fault = |craft, at_ns, what| ProcessFault { craft: CraftId(craft), at_ns, what };
    let faults = vec![
        fault(1, 3_000_000, Befalls::Kill { pause_ns: 2_000_000 }),
        fault(3, 4_000_000, Befalls::Stop { for_ns: 5_000_000 }),
        fault(1, 9_000_000, Befalls::Kill { pause_ns: 0 }),
        // A process that is gone cannot end, and one that ends while it is stopped does not go on.
        fault(1, 9_100_000, Befalls::Kill { pause_ns: 0 }),
        fault(4, 5_000_000, Befalls::Stop { for_ns: 90_000_000 }),
        fault(4, 6_000_000, Befalls::Kill { pause_ns: 0 }),
    ];
    let conditions = Conditions { faults, rest_ns: Some(10_000_000_000) };
    for strategy in STRATEGIES {
        let (_, played) = play_over_links(strategy, &conditions);
        assert!(played.is_quiet, "{strategy}");
        let dead: Vec<(u32, u32)> =
            played.dead.iter().map(|(craft, life)| (craft.0, life.0)).collect();
        assert_eq!(dead, [(1, 0), (4, 0), (1, 1)], "{strategy}");
        let missed: Vec<u64> =
            played.reports.iter().take(5).map(|report| open(report).records_missed).collect();
        assert!(missed[1] > 0 && missed[4] > 0, "{strategy}: {missed:?}");
        assert_eq!([missed[0], missed[2], missed[3]], [0; 3], "{strategy}");
        let (_, again) = play_over_links(strategy, &conditions);
        assert_eq!((played.reports, played.links), (again.reports, again.links), "{strategy}");
    }
}

#[test]
fn a_fleet_that_finds_no_rest_is_given_up() {
    let stop = Befalls::Stop { for_ns: 60_000_000_000 };
    let fault = ProcessFault { craft: CraftId(1), at_ns: 1_000_000, what: stop };
    let conditions = Conditions { faults: vec![fault], rest_ns: Some(100_000_000) };
    let (spec, played) = play_over_links(StrategyKind::Boundary, &conditions);
    let duration_ns = spec.open.expect("open mode").duration_ns;
    assert!(!played.is_quiet && played.duration_ns <= duration_ns + 100_000_000);
}

#[test]
fn what_plays_no_traces_is_refused_with_a_remedy() {
    let network = network(2, 1);
    let mut simulation = Simulation::new(2, MemoryOptions::default());
    let refused = simulation.play_open(&spec(StrategyKind::Pipelined, 16), &network.view(), &[]);
    let said = refused.err().map(|error| error.to_string()).unwrap_or_default();
    assert!(said.contains("`pipelined`") && said.contains("`central-batched`"), "{said}");
}

/// Two crafts share fact 0; craft 0 writes it `writes` times, a microsecond apart.
fn one_way(writes: u64) -> (FleetNetwork, Vec<Vec<TraceRecord>>) {
    let network = network(2, 1);
    let write = |step| TraceRecord::write(1_000_000 + step * 1_000, FactId(0), step % 2 == 0);
    (network, vec![(0..writes).map(write).collect(), Vec::new()])
}

#[test]
fn a_client_of_the_centre_has_one_request_under_way() {
    let (network, trace) = one_way(20);
    let requests_and_transmissions = |strategy| {
        let (_, played) = play(&spec(strategy, 16), &network, &trace, 50_000);
        let traffic =
            |craft: usize, class: Class| played.reports[craft].counters.traffic[class as usize];
        let writes = stage(&played.reports[0], Stage::RecordsPerSample);
        let most = writes.max();
        assert_eq!(played.reports.len(), 3, "{strategy}: the centre reports as well");
        assert_eq!(
            traffic(0, Class::Replication).transmissions
                + traffic(1, Class::Replication).transmissions,
            traffic(2, Class::Reply).transmissions,
            "{strategy}: one reply a request"
        );
        assert_eq!(knowledge(&played.reports[1]).len(), 20, "{strategy}");
        assert_eq!(stage(&played.reports[2], Stage::AppliedAtCentre).len(), 20, "{strategy}");
        (most, knowledge(&played.reports[1]).max())
    };
    let (most, slow) = requests_and_transmissions(StrategyKind::Central);
    assert_eq!(most, 1, "one write a request");
    let (most, fast) = requests_and_transmissions(StrategyKind::CentralBatched);
    assert!(most > 1, "what waits for a reply goes together");
    assert!(fast <= slow, "{fast} {slow}");
}

#[test]
fn knowledge_through_the_centre_waits_for_the_next_question() {
    let (network, trace) = one_way(1);
    let known_after = |asks_every_ns: u64| {
        let mut spec = spec(StrategyKind::CentralBatched, 16);
        spec.open.as_mut().expect("open mode").asks_every_ns = asks_every_ns;
        let (_, played) = play(&spec, &network, &trace, 0);
        knowledge(&played.reports[1]).max()
    };
    let [often, rarely] = [20_000, 20_000_000].map(known_after);
    assert!(often < 100_000, "{often}");
    assert!(rarely > 10 * often, "{rarely} {often}");
}

#[test]
fn news_that_no_reply_holds_ride_on_several() {
    let network = network(3, 1);
    let burst = vec![TraceRecord::write(1_000, FactId(1), true); 40];
    let trace = [burst, Vec::new(), Vec::new()];
    // 4 KiB a record: 15 of them fit 64 KiB.
    let (_, played) = play(&spec(StrategyKind::CentralBatched, 4112), &network, &trace, 1_000);
    for receiver in [1, 2] {
        assert_eq!(open(&played.reports[receiver]).applied_from[0], 40);
    }
    assert_eq!(stage(&played.reports[0], Stage::RecordsPerSample).max(), 15);
}

#[test]
fn a_read_sees_the_newest_write_that_its_board_knows() {
    let network = network(2, 1);
    let writes = [(1_000_000, true), (5_000_000, false)];
    let reads = [500_000, 3_000_000, 9_000_000].map(|at_ns| TraceRecord::read(at_ns, FactId(0)));
    let writes = writes.map(|(at_ns, holds)| TraceRecord::write(at_ns, FactId(0), holds));
    let trace = vec![writes.to_vec(), reads.to_vec()];
    for strategy in STRATEGIES {
        let (_, played) = play(&spec(strategy, 16), &network, &trace, 1_000);
        let seen = &open(&played.reports[1]).reads;
        let times: Vec<(u32, u64)> = seen.iter().map(|read| (read.number, read.at_ns)).collect();
        assert_eq!(times, [(0, 500_000), (1, 3_000_000), (2, 9_000_000)], "{strategy}");
        let newest: Vec<u64> = seen.iter().map(|read| read.seen_ns).collect();
        let nothing = ReadSeen::NOTHING;
        let wanted = match strategy {
            StrategyKind::Null => [nothing; 3],
            _ => [nothing, 1_000_000, 5_000_000],
        };
        assert_eq!(newest, wanted, "{strategy}");
    }
}

#[test]
fn what_is_due_after_the_end_is_not_played() {
    let network = network(4, 2);
    let trace = trace(4, 2, 20_000);
    for strategy in STRATEGIES {
        let mut spec = spec(strategy, 16);
        let duration_ns = 300_000;
        spec.open.as_mut().expect("open mode").duration_ns = duration_ns;
        let (_, played) = play(&spec, &network, &trace, 1_000);
        for (report, part) in played.reports.iter().zip(&trace) {
            let due = part.iter().filter(|record| record.at_ns < duration_ns).count();
            assert!(due < part.len());
            assert_eq!(open(report).records_played, due as u64, "{strategy}");
        }
        let parts = trace.iter().map(Vec::as_slice).collect();
        let view = FleetView { trace: parts, ..network.view() };
        let observed = ObservedOpen { reports: &played.reports, is_quiet: true };
        assert_eq!(compare_open(&spec, &view, &observed), [], "{strategy}");
        let after: u64 = played.reports.iter().map(|report| open(report).applied_after_end).sum();
        let by: u64 = played.reports.iter().map(|report| open(report).applied_by_end).sum();
        assert!(strategy == StrategyKind::Null || by > 0, "{strategy}: {by} and {after} later");
    }
}

#[test]
fn without_stamps_only_time_to_knowledge_is_recorded() {
    let (network, trace) = one_way(20);
    for strategy in [StrategyKind::Boundary, StrategyKind::CentralBatched] {
        let mut spec = spec(strategy, 16);
        spec.open.as_mut().expect("open mode").stamps_stages = false;
        let (_, played) = play(&spec, &network, &trace, 1_000);
        assert_eq!(knowledge(&played.reports[1]).len(), 20, "{strategy}");
        for report in &played.reports {
            assert_eq!(open(report).stages, [], "{strategy}");
            assert_eq!(open(report).shares, [[0; 4]; 0], "{strategy}");
        }
    }
}

/// Hops that a change of `from` comes over to `to`, by what the strategy says.
fn hops(strategy: StrategyKind, view: &FleetView<'_>, from: CraftId, to: CraftId) -> usize {
    let parent = |craft: u32| craft.checked_sub(1).map(|below| below / 2);
    let path = |craft: CraftId| std::iter::successors(Some(craft.0), |&at| parent(at));
    match strategy {
        StrategyKind::Central | StrategyKind::CentralBatched => 2,
        StrategyKind::Hierarchy => {
            let shared = path(from).filter(|at| path(to).any(|other| other == *at)).count();
            path(from).count() + path(to).count() - 2 * shared
        }
        StrategyKind::Hybrid => {
            let next =
                |&at: &CraftId| (at != to).then(|| view.topology.next_hop_over_leaders(at, to));
            if view.topology.are_grouped(from, to) {
                1
            } else {
                std::iter::successors(Some(from), next).count() - 1
            }
        }
        _ => 1,
    }
}

#[test]
fn time_to_knowledge_is_told_apart_by_the_hops_that_a_change_came_over() {
    let mut most = 0;
    for (crafts, seed) in [(2, 1), (5, 3), (12, 7), (40, 9)] {
        let (network, trace) = (network(crafts, seed), trace(crafts, seed, 20_000));
        let view = network.view();
        for strategy in STRATEGIES.into_iter().filter(|&strategy| strategy != StrategyKind::Null) {
            let (_, played) = play(&spec(strategy, 16), &network, &trace, 50_000);
            for (report, receiver) in played.reports.iter().zip((0..crafts).map(CraftId)) {
                let mut wanted = [0_u64; Stage::BY_HOPS.len()];
                for (part, origin) in trace.iter().zip((0..).map(CraftId)) {
                    let writes = part.iter().filter(|record| record.holds().is_some());
                    let needed = writes
                        .filter(|record| {
                            let target = view.board(origin).target_on(record.fact(), receiver);
                            target.is_some()
                        })
                        .count();
                    if needed > 0 {
                        let hops = hops(strategy, &view, origin, receiver);
                        most = most.max(hops);
                        wanted[hops.min(wanted.len()) - 1] += needed as u64;
                    }
                }
                let found = Stage::BY_HOPS.map(|hops| stage(report, hops).len());
                assert_eq!(found, wanted, "{strategy}, {crafts} crafts, {receiver}");
                let all = Stage::BY_HOPS.map(|hops| stage(report, hops)).into_iter();
                let max = all.filter(|times| !times.is_empty()).map(|times| times.max()).max();
                let known = knowledge(report);
                assert_eq!(max.unwrap_or(0), known.max(), "{strategy}");
            }
        }
    }
    assert!(most > Stage::BY_HOPS.len(), "some came over more than are told apart");
}

#[test]
fn shares_add_up_to_every_application() {
    let (network, trace) = (network(5, 3), trace(5, 3, 20_000));
    for strategy in STRATEGIES {
        let (_, played) = play(&spec(strategy, 16), &network, &trace, 1_000);
        for report in &played.reports {
            let of_part = |part| {
                let rows = open(report).shares.iter().filter(|row| row[1] == part);
                rows.map(|row| u64::from(row[3])).sum::<u64>()
            };
            let known = knowledge(report).len();
            assert_eq!([0, 1, 2].map(of_part), [known; 3], "{strategy}");
        }
    }
}

#[test]
fn two_facts_that_lead_to_one_are_two_applications_whatever_their_counts() {
    let mut network = network(2, 1);
    let links = [(FACTS - 2, 1), (FACTS - 2, 0), (FACTS - 1, 1), (FACTS - 1, 0)];
    network.boards[0].links = Csr::from_pairs(FACTS as usize, &links);
    network.view().validate().expect("links name what exists");
    let write = |fact| TraceRecord::write(1_000_000, FactId(fact), true);
    let trace = vec![vec![write(FACTS - 2), write(FACTS - 1)], Vec::new()];
    for strategy in STRATEGIES.into_iter().filter(|&strategy| strategy != StrategyKind::Null) {
        let (_, played) = play(&spec(strategy, 16), &network, &trace, 50_000);
        assert_eq!(knowledge(&played.reports[1]).len(), 2, "{strategy}");
    }
}
