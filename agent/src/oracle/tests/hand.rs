//! Missions whose every turn and every count is worked out by hand.

use super::fleets::{Board, RECORD, both_ways, fleet, mission_spec, no, yes};
use crate::lockstep::Outcome;
use crate::oracle::{Expected, Replay, Turnout, board_digest};
use shared_types::ids::{CraftId, Firing, Turn};
use shared_types::knowledge::{FactState, FleetNetwork, Value, Version};
use shared_types::rng::{Purpose, Stream};
use shared_types::wire::{EpochSpec, HEADER_BYTES, StrategyKind};
use xxhash_rust::xxh3::xxh3_64;

const HEADER: u64 = HEADER_BYTES as u64;

fn path(replay: &Replay) -> Vec<(u32, u32, u32)> {
    replay.path().map(|(turn, craft, firing)| (turn.0, craft.0, firing.0)).collect()
}

fn written(value: Value, count: u32, writer: u32) -> FactState {
    FactState { value, version: Version { count, writer: CraftId(writer) } }
}

/// Three crafts, root 0 above 1 and 2. In turn 0 craft 0 asserts `a`, which all share; in turn 1
/// craft 1 asserts `b`, its own, and `c`, shared with craft 2; in turn 2 craft 2 asserts its final.
fn relay_mission(group: &[u32]) -> FleetNetwork {
    let boards = vec![
        // start, a
        Board::new(2, &[0], &[]).rule(&[yes(0)], &[yes(1)], &[]),
        // a, b, c
        Board::new(3, &[], &[]).rule(&[yes(0)], &[yes(1), yes(2)], &[]),
        // a, done, c
        Board::new(3, &[], &[1]).rule(&[yes(2)], &[yes(1)], &[]),
    ];
    let links = both_ways(&[[0, 1, 1, 0], [0, 1, 2, 0], [1, 0, 2, 0], [1, 2, 2, 2]]);
    fleet(boards, &links, group)
}

fn relay_expected(strategy: StrategyKind) -> Expected {
    let network = relay_mission(&[0, 1, 1]);
    let (fleet, spec) = (network.view(), mission_spec());
    Replay::of(&fleet, &spec).expected(&fleet, &spec, strategy)
}

/// Per process (requests, records sent), to be held against requests, transmissions and bytes.
fn check_sent(expected: &Expected, wanted: &[(u64, u64)]) {
    assert_eq!(expected.processes.len(), wanted.len());
    for (process, &(samples, records)) in expected.processes.iter().zip(wanted) {
        assert_eq!(process.replication.requests, samples);
        assert_eq!(process.replication.transmissions, samples);
        assert_eq!(process.replication.bytes_sent, samples * HEADER + records * RECORD);
    }
}

/// Per process (deliveries, records received, hops), without replies.
fn check_received(expected: &Expected, wanted: &[(u64, u64, u64)]) {
    for (process, &(samples, records, hops)) in expected.processes.iter().zip(wanted) {
        assert_eq!(process.replication.deliveries, samples);
        assert_eq!(process.replication.bytes_received, samples * HEADER + records * RECORD);
        assert_eq!(process.hops, hops);
    }
}

fn check_pairs(expected: &Expected, wanted: &[[u64; 3]; 3]) {
    for (from, row) in (0..).zip(wanted) {
        for (to, &samples) in (0..).zip(row) {
            assert_eq!(expected.deliveries.between(CraftId(from), CraftId(to)), samples);
        }
    }
}

#[test]
fn relay_mission_runs_as_worked_out() {
    let network = relay_mission(&[]);
    let replay = Replay::of(&network.view(), &mission_spec());
    assert_eq!(path(&replay), [(0, 0, 0), (1, 1, 0), (2, 2, 0)]);
    assert_eq!((replay.turns, replay.outcome), (3, Outcome::Finished));
    assert_eq!(replay.conflicts, [0, 0, 0]);
    let idle = Firing::IDLE.0;
    assert_eq!(replay.script(), [[0, idle, idle], [idle, 0, idle], [idle, idle, 0]]);

    let start = written(Value::Asserted, 0, 0);
    let by = |writer| written(Value::Asserted, 1, writer);
    assert_eq!(replay.boards[0], [start, by(0)]);
    assert_eq!(replay.boards[1], [by(0), by(1), by(1)]);
    assert_eq!(replay.boards[2], [by(0), by(2), by(1)]);
    let counts = relay_expected(StrategyKind::Full);
    let rows: Vec<_> = counts
        .processes
        .iter()
        .map(|craft| (craft.firings, craft.boundary_firings, craft.idle_turns))
        .collect();
    assert_eq!(rows, [(1, 1, 2), (1, 1, 2), (1, 0, 2)]);
}

#[test]
fn null_sends_nothing() {
    let expected = relay_expected(StrategyKind::Null);
    check_sent(&expected, &[(0, 0), (0, 0), (0, 0)]);
    check_received(&expected, &[(0, 0, 0), (0, 0, 0), (0, 0, 0)]);
    assert_eq!(expected.owed, [0, 0, 0]);
}

#[test]
fn full_sends_every_firing_once_to_all() {
    let expected = relay_expected(StrategyKind::Full);
    check_sent(&expected, &[(1, 1), (1, 2), (1, 1)]);
    check_received(&expected, &[(2, 3, 2), (2, 2, 2), (2, 3, 2)]);
    check_pairs(&expected, &[[0, 1, 1], [1, 0, 1], [1, 1, 0]]);
    assert_eq!(expected.owed, [2, 2, 2]);
}

#[test]
fn boundary_sends_to_sharers_what_they_share() {
    let expected = relay_expected(StrategyKind::Boundary);
    check_sent(&expected, &[(2, 2), (1, 1), (0, 0)]);
    check_received(&expected, &[(0, 0, 0), (1, 1, 1), (2, 2, 2)]);
    check_pairs(&expected, &[[0, 1, 1], [0, 0, 1], [0, 0, 0]]);
    assert_eq!(expected.owed, [2, 1, 0]);
}

#[test]
fn limited_sends_boundary_changes_to_each_other_craft() {
    let expected = relay_expected(StrategyKind::Limited);
    check_sent(&expected, &[(2, 2), (2, 2), (0, 0)]);
    check_received(&expected, &[(1, 1, 1), (1, 1, 1), (2, 2, 2)]);
    check_pairs(&expected, &[[0, 1, 1], [1, 0, 1], [0, 0, 0]]);
    assert_eq!(expected.owed, [2, 2, 0]);
}

#[test]
fn hierarchy_relays_over_the_root() {
    // Firing 0: 0 → 1, 0 → 2. Firing 1: 1 → 0 → 2, where 0 passes on and does not apply.
    let expected = relay_expected(StrategyKind::Hierarchy);
    check_sent(&expected, &[(3, 3), (1, 1), (0, 0)]);
    check_received(&expected, &[(1, 1, 0), (1, 1, 1), (2, 2, 3)]);
    check_pairs(&expected, &[[0, 1, 2], [1, 0, 0], [0, 0, 0]]);
    assert_eq!(expected.owed, [2, 1, 0]);
}

#[test]
fn hybrid_goes_over_the_leader_between_groups_and_directly_inside() {
    // Craft 1 leads the group of 1 and 2. Firing 0: 0 → 1 → 2. Firing 1: 1 → 2.
    let expected = relay_expected(StrategyKind::Hybrid);
    check_sent(&expected, &[(1, 1), (2, 2), (0, 0)]);
    check_received(&expected, &[(0, 0, 0), (1, 1, 1), (2, 2, 3)]);
    check_pairs(&expected, &[[0, 1, 0], [0, 0, 2], [0, 0, 0]]);
    assert_eq!(expected.owed, [2, 1, 0]);
}

#[test]
fn central_converses_with_every_craft() {
    // Register, three instructions, one result, sign off; craft 2 also checks its final three times.
    // `a` is news for 1 and 2, `c` for 2.
    for (strategy, last) in [
        (StrategyKind::Central, 9),
        (StrategyKind::Pipelined, 9),
        (StrategyKind::CentralBatched, 6),
    ] {
        let expected = relay_expected(strategy);
        check_sent(&expected, &[(6, 1), (6, 2), (last, 1), (0, 0)]);
        check_received(&expected, &[(0, 0, 6), (0, 0, 6), (0, 0, last), (12 + last, 4, 12 + last)]);
        let centre = &expected.processes[3].reply;
        assert_eq!(centre.requests, 12 + last);
        assert_eq!(centre.transmissions, 12 + last);
        assert_eq!(centre.bytes_sent, (12 + last) * HEADER + 3 * RECORD);
        for (craft, samples, records) in [(0, 6, 0), (1, 6, 1), (2, last, 2)] {
            let reply = &expected.processes[craft].reply;
            assert_eq!(reply.deliveries, samples);
            assert_eq!(reply.bytes_received, samples * HEADER + records * RECORD);
            let craft = CraftId::from_index(craft);
            assert_eq!(expected.deliveries.between(craft, CraftId(3)), samples);
            assert_eq!(expected.deliveries.between(CraftId(3), craft), samples);
        }
    }
}

/// Four crafts in a line of the tree: 3 below 1 below 0, 2 below 0. Craft 3 changes `x`, shared with
/// 1, and `y`, shared with 1 and 2, in one firing.
#[test]
fn one_firing_with_two_shared_facts_is_one_request_per_hop() {
    let boards = vec![
        Board::new(1, &[], &[]),
        Board::new(2, &[], &[]),
        Board::new(2, &[], &[]),
        Board::new(3, &[0], &[2]).rule(&[yes(0)], &[yes(1), yes(2)], &[]),
    ];
    let links = both_ways(&[[3, 1, 1, 0], [3, 2, 1, 1], [3, 2, 2, 1]]);
    let network = fleet(boards, &links, &[]);
    let (fleet, spec) = (network.view(), mission_spec());
    let replay = Replay::of(&fleet, &spec);
    assert_eq!((replay.turns, replay.outcome), (1, Outcome::Finished));

    let boundary = replay.expected(&fleet, &spec, StrategyKind::Boundary);
    check_sent(&boundary, &[(0, 0), (0, 0), (0, 0), (2, 3)]);
    // 3 → 1 carries both, 1 → 0 and 0 → 2 only `y`; craft 0 is no final receiver.
    let hierarchy = replay.expected(&fleet, &spec, StrategyKind::Hierarchy);
    check_sent(&hierarchy, &[(1, 1), (1, 1), (0, 0), (1, 2)]);
    check_received(&hierarchy, &[(1, 1, 0), (1, 2, 1), (1, 1, 3), (0, 0, 0)]);
    assert_eq!((hierarchy.requests(), &hierarchy.owed[..]), (3, &[2][..]));
    let limited = replay.expected(&fleet, &spec, StrategyKind::Limited);
    check_sent(&limited, &[(0, 0), (0, 0), (0, 0), (3, 6)]);
}

/// Both crafts write the shared fact in the same turn: craft 0 asserts, craft 1 de-asserts.
fn contest(own_firing_only: bool) -> Replay {
    let boards = vec![
        Board::new(2, &[0], &[1]).rule(&[yes(0)], &[yes(1)], &[]),
        Board::new(2, &[0], &[]).rule(&[yes(0)], &[no(1)], &[]),
    ];
    let network = fleet(boards, &both_ways(&[[0, 1, 1, 1]]), &[]);
    Replay::of(&network.view(), &EpochSpec { own_firing_only, ..mission_spec() })
}

#[test]
fn simultaneous_writes_conflict_at_both_and_the_higher_craft_wins() {
    let replay = contest(true);
    assert_eq!(replay.conflicts, [1, 1]);
    assert_eq!(replay.boards[0][1], written(Value::Absent, 1, 1));
    assert_eq!(replay.boards[0], replay.boards[1]);
    // The firing had newly asserted the final before the merge took it back.
    assert_eq!((replay.turns, replay.outcome), (1, Outcome::Finished));
}

#[test]
fn delivered_final_ends_a_mission_but_not_where_only_own_firings_count() {
    let boards =
        || vec![Board::new(2, &[0], &[]).rule(&[yes(0)], &[yes(1)], &[]), Board::new(2, &[], &[1])];
    let network = fleet(boards(), &both_ways(&[[0, 1, 1, 1]]), &[]);
    let fleet = network.view();
    let spec = mission_spec();
    let replay = Replay::of(&fleet, &spec);
    assert_eq!((replay.turns, replay.outcome), (1, Outcome::Finished));
    let replay = Replay::of(&fleet, &EpochSpec { own_firing_only: true, ..spec.clone() });
    assert_eq!((replay.turns, replay.outcome), (2, Outcome::Stalled));
    let replay = Replay::of(&fleet, &EpochSpec { ignores_finals: true, ..spec.clone() });
    assert_eq!((replay.turns, replay.outcome), (50, Outcome::Dropped));
    assert_eq!(replay.firings.len(), 1);
}

#[test]
fn delivery_reaches_rules_in_the_next_turn_and_is_not_forwarded() {
    // 0.1 → 1.1 → 2.1 as directed slots: craft 2 never hears of what craft 0 wrote.
    let boards = vec![
        Board::new(2, &[0], &[]).rule(&[yes(0)], &[yes(1)], &[]),
        Board::new(3, &[], &[]).rule(&[yes(1)], &[yes(2)], &[]),
        Board::new(2, &[], &[]),
    ];
    let network = fleet(boards, &[[0, 1, 1, 1], [1, 1, 2, 1]], &[]);
    let replay = Replay::of(&network.view(), &mission_spec());
    assert_eq!(path(&replay), [(0, 0, 0), (1, 1, 0)]);
    assert_eq!((replay.turns, replay.outcome), (3, Outcome::Stalled));
    assert_eq!(replay.boards[2][1], FactState::default());
}

#[test]
fn actions_run_once_unless_they_repeat_and_are_queued_again() {
    // A repeating rule (0) queues a single action (firing 1) and a repeating one (firing 2).
    let boards = vec![
        Board::new(3, &[0], &[])
            .rule(&[yes(0)], &[], &[0, 1])
            .action(&[yes(1)])
            .action(&[yes(2)])
            .repeating(&[0], &[1]),
    ];
    let network = fleet(boards, &[], &[]);
    let spec = EpochSpec { turns_max: 60, ..mission_spec() };
    let replay = Replay::of(&network.view(), &spec);
    let fired: Vec<u32> = replay.path().map(|(_, _, firing)| firing.0).collect();
    assert_eq!((fired.len(), fired[0]), (60, 0));
    assert_eq!(fired.iter().filter(|&&firing| firing == 1).count(), 1);
    assert!(fired.iter().filter(|&&firing| firing == 2).count() > 10);
    assert!(fired.windows(2).all(|pair| pair != [2, 2]), "queued again only by the rule");
}

#[test]
fn candidates_are_drawn_in_id_order_rules_before_actions() {
    let boards = vec![
        Board::new(4, &[0], &[])
            .rule(&[no(3)], &[yes(1)], &[])
            .rule(&[yes(0)], &[yes(1)], &[0])
            .rule(&[yes(0)], &[yes(2)], &[0])
            .action(&[yes(1)]),
    ];
    let network = fleet(boards, &[], &[]);
    let replay = Replay::of(&network.view(), &mission_spec());
    // Candidates: rules 1 and 2; then the other rule and action 0 (firing 3); then what is left.
    let mut stream = Stream::new(7, 0, Purpose::Firing, 0);
    let first = [1, 2][stream.below(2) as usize];
    let second = [3 - first, 3][stream.below(2) as usize];
    let third = [6 - first - second][stream.below(1) as usize];
    assert_eq!(path(&replay), [(0, 0, first), (1, 0, second), (2, 0, third)]);
    assert_eq!(replay.outcome, Outcome::Stalled);
}

#[test]
fn fact_written_twice_by_a_firing_is_one_change_with_the_last_version() {
    let boards =
        vec![Board::new(3, &[0], &[2]).rule(&[yes(0)], &[yes(2), yes(1), no(2), yes(2)], &[])];
    let network = fleet(boards, &[], &[]);
    let replay = Replay::of(&network.view(), &mission_spec());
    let changes = replay.changes(&replay.firings[0]);
    assert_eq!(changes.iter().map(|change| change.fact.0).collect::<Vec<_>>(), [1, 2]);
    assert_eq!(changes[1].version, Version { count: 3, writer: CraftId(0) });
    assert_eq!((changes[1].value, changes[1].altered), (Value::Asserted, true));
}

#[test]
fn changes_that_alter_nothing_are_sent_unless_the_scenario_says_otherwise() {
    // The rule fires three times; only the first time it alters the shared fact.
    let boards = || {
        vec![
            Board::new(2, &[0], &[]).rule(&[yes(0)], &[yes(1)], &[]).repeating(&[0], &[]),
            Board::new(2, &[], &[]),
        ]
    };
    let network = fleet(boards(), &both_ways(&[[0, 1, 1, 1]]), &[]);
    let fleet = network.view();
    let outputs = EpochSpec { turns_max: 3, ..mission_spec() };
    let altered = EpochSpec { sends_altered_only: true, ..outputs.clone() };
    for (spec, sent, count) in [(&outputs, 3, 3), (&altered, 1, 1)] {
        let replay = Replay::of(&fleet, spec);
        assert_eq!(replay.boards[1][1], written(Value::Asserted, count, 0));
        assert_eq!(replay.boards[0][1], written(Value::Asserted, 3, 0));
        for strategy in [StrategyKind::Full, StrategyKind::Boundary, StrategyKind::Limited] {
            let expected = replay.expected(&fleet, spec, strategy);
            check_sent(&expected, &[(sent, sent), (0, 0)]);
            assert_eq!(expected.processes[0].boundary_firings, sent);
        }
        // A result is sent for every firing, if need be without records.
        let central = replay.expected(&fleet, spec, StrategyKind::Central);
        check_sent(&central, &[(2 + 3 + 3, sent), (2 + 3, 0), (0, 0)]);
    }
}

/// Craft 0 queues an action of `turns` turns that asserts what is final on the board of craft 1.
fn errand(turns: u32, likelihood: f64) -> FleetNetwork {
    let mut first = Board::new(2, &[0], &[]).rule(&[yes(0)], &[], &[0]).action(&[yes(1)]);
    first.0.action_durations = vec![turns];
    first.0.action_likelihoods = vec![likelihood.to_bits()];
    let boards = vec![first, Board::new(2, &[], &[1])];
    fleet(boards, &both_ways(&[[0, 1, 1, 1]]), &[])
}

#[test]
fn an_action_is_worked_on_for_its_turns_and_told_once_it_is_over() {
    let network = errand(3, 1.0);
    let (fleet, spec) = (network.view(), mission_spec());
    let replay = Replay::of(&fleet, &spec);
    assert_eq!(path(&replay), [(0, 0, 0), (1, 0, 1), (2, 0, 1), (3, 0, 1)]);
    assert_eq!((replay.turns, replay.outcome), (4, Outcome::Finished));
    let turnouts: Vec<Turnout> = replay.firings.iter().map(|fired| fired.turnout).collect();
    assert_eq!(turnouts, [Turnout::Done, Turnout::Underway, Turnout::Underway, Turnout::Done]);
    assert_eq!(replay.boards[1][1], written(Value::Asserted, 1, 0));
    for strategy in [StrategyKind::Full, StrategyKind::Boundary] {
        let expected = replay.expected(&fleet, &spec, strategy);
        check_sent(&expected, &[(1, 1), (0, 0)]);
        let [first, second] = &expected.processes[..] else { panic!("two crafts") };
        assert_eq!((first.firings, first.boundary_firings, first.idle_turns), (4, 1, 0));
        assert_eq!((second.firings, second.idle_turns), (0, 4));
    }
}

#[test]
fn an_action_in_vain_has_run_and_brings_about_nothing() {
    let spec = mission_spec();
    // The least likelihood: the first draw of the seed is above it.
    assert!(Stream::new(spec.seed, spec.trial, Purpose::Outcomes, 0).unit() > 0.001);
    let network = errand(2, 0.001);
    let replay = Replay::of(&network.view(), &spec);
    assert_eq!(path(&replay), [(0, 0, 0), (1, 0, 1), (2, 0, 1)]);
    assert_eq!((replay.turns, replay.outcome), (4, Outcome::Stalled), "nothing is left to do");
    assert_eq!(replay.firings[2].turnout, Turnout::InVain);
    assert_eq!(replay.boards[1][1], FactState::default());
}

#[test]
fn replicas_hold_the_newest_of_what_others_told() {
    let replica = |origin: u32, fact: u32, count: u32| {
        let mut bytes = Vec::new();
        bytes.extend(origin.to_le_bytes());
        bytes.extend(fact.to_le_bytes());
        bytes.push(1);
        bytes.extend(count.to_le_bytes());
        bytes.extend(origin.to_le_bytes());
        bytes
    };
    let full = relay_expected(StrategyKind::Full);
    let told = [replica(0, 1, 1), replica(1, 1, 1), replica(1, 2, 1)].concat();
    assert_eq!(full.replica_digest(CraftId(2)), xxh3_64(&told));
    let limited = relay_expected(StrategyKind::Limited);
    let told = [replica(0, 1, 1), replica(1, 2, 1)].concat();
    assert_eq!(limited.replica_digest(CraftId(2)), xxh3_64(&told));
    assert_eq!(relay_expected(StrategyKind::Boundary).replica_digest(CraftId(2)), 0);
}

#[test]
fn digests_are_over_little_endian_rows() {
    let states = [written(Value::Asserted, 258, 3), FactState::default()];
    let bytes = [1, 2, 1, 0, 0, 3, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
    assert_eq!(board_digest(&states), xxh3_64(&bytes));
    let path = [(Turn(1), CraftId(2), Firing(259))];
    let bytes = [1, 0, 0, 0, 2, 0, 0, 0, 3, 1, 0, 0];
    assert_eq!(crate::oracle::path_digest(path), xxh3_64(&bytes));
}
