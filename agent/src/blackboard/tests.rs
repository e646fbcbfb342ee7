//! The counting match against a plain scan of all premises, and the sets below it.

use super::agenda::Agenda;
use super::{Blackboard, Merged};
use proptest::prelude::{ProptestConfig, Strategy, any, prop, proptest};
use shared_types::ids::{CraftId, FactId, Firing};
use shared_types::knowledge::{BoardNetwork, Csr, Literal, Value, Version};

const ME: CraftId = CraftId(3);

/// A board from rows of packed literals.
fn board(facts: u32, rules: &[(&[u32], &[u32], &[u32])], actions: &[&[u32]]) -> BoardNetwork {
    let mut network = BoardNetwork { fact_count: facts, ..BoardNetwork::default() };
    for (premises, outputs, queues) in rules {
        network.premises.push_row(premises.iter().copied());
        network.outputs.push_row(outputs.iter().copied());
        network.queues.push_row(queues.iter().copied());
    }
    for outputs in actions {
        network.action_outputs.push_row(outputs.iter().copied());
    }
    for _ in 0..facts {
        network.links.finish_row();
    }
    network.index_readers();
    network
}

fn holds(fact: u32) -> u32 {
    Literal::holds(FactId(fact)).0
}

fn absent(fact: u32) -> u32 {
    Literal::is_absent(FactId(fact)).0
}

fn candidates(blackboard: &Blackboard) -> Vec<u32> {
    (0..blackboard.candidate_count()).map(|rank| blackboard.candidate(rank).0).collect()
}

#[test]
fn rule_becomes_a_candidate_when_its_last_premise_is_met_and_fires_once() {
    let mut network = board(4, &[(&[holds(0), holds(1)], &[holds(2)], &[0])], &[&[holds(3)]]);
    network.initial = vec![0];
    let view = network.view();
    let mut blackboard = Blackboard::default();
    blackboard.reset(&view);
    assert_eq!(candidates(&blackboard), Vec::<u32>::new());
    let version = Version { count: 1, writer: CraftId(9) };
    let merged = blackboard.merge(&view, FactId(1), Value::Asserted, version);
    assert_eq!(merged, Merged { accepted: true, conflict: false });
    assert_eq!(candidates(&blackboard), [0]);
    let mut changes = Vec::new();
    blackboard.fire(&view, ME, Firing(0), &mut changes);
    assert_eq!(changes.len(), 1);
    assert_eq!(changes[0].version, Version { count: 1, writer: ME });
    assert_eq!(candidates(&blackboard), [1], "the queued action is what is left");
    blackboard.fire(&view, ME, Firing(1), &mut changes);
    assert_eq!(blackboard.state(FactId(3)).value, Value::Asserted);
    assert_eq!(candidates(&blackboard), Vec::<u32>::new());
}

#[test]
fn negated_premise_is_met_by_absence_and_not_by_ignorance() {
    let network = board(2, &[(&[absent(0)], &[holds(1)], &[])], &[]);
    let view = network.view();
    let mut blackboard = Blackboard::default();
    blackboard.reset(&view);
    assert_eq!(candidates(&blackboard), Vec::<u32>::new());
    let first = Version { count: 1, writer: ME };
    blackboard.merge(&view, FactId(0), Value::Absent, first);
    assert_eq!(candidates(&blackboard), [0]);
    let second = Version { count: 2, writer: ME };
    blackboard.merge(&view, FactId(0), Value::Asserted, second);
    assert_eq!(candidates(&blackboard), Vec::<u32>::new());
}

#[test]
fn newer_version_wins_and_equal_counts_of_two_writers_are_a_conflict() {
    let network = board(1, &[], &[]);
    let view = network.view();
    let mut blackboard = Blackboard::default();
    blackboard.reset(&view);
    let mut merge = |count, writer, value| {
        blackboard.merge(&view, FactId(0), value, Version { count, writer: CraftId(writer) })
    };
    let merged = |accepted, conflict| Merged { accepted, conflict };
    assert_eq!(merge(2, 5, Value::Asserted), merged(true, false));
    assert_eq!(merge(1, 9, Value::Absent), merged(false, false));
    assert_eq!(merge(2, 4, Value::Absent), merged(false, true));
    assert_eq!(merge(2, 6, Value::Absent), merged(true, true));
    assert_eq!(merge(2, 6, Value::Absent), merged(false, false), "the same once more");
    assert_eq!(blackboard.state(FactId(0)).value, Value::Absent);
}

#[test]
fn repeating_rule_stays_a_candidate_and_repeating_action_waits_for_its_queue() {
    let mut network = board(2, &[(&[holds(0)], &[holds(1)], &[0])], &[&[absent(1)]]);
    network.initial = vec![0];
    network.repeating_rules = vec![0];
    network.repeating_actions = vec![0];
    let view = network.view();
    let mut blackboard = Blackboard::default();
    blackboard.reset(&view);
    let mut changes = Vec::new();
    for round in 1..=3 {
        blackboard.fire(&view, ME, Firing(0), &mut changes);
        assert_eq!(candidates(&blackboard), [0, 1]);
        blackboard.fire(&view, ME, Firing(1), &mut changes);
        assert_eq!(candidates(&blackboard), [0]);
        assert_eq!(changes[0].version.count, 2 * round);
    }
}

#[test]
fn final_fact_counts_only_when_newly_asserted() {
    let rules: [(&[u32], &[u32], &[u32]); 2] = [(&[], &[holds(0)], &[]), (&[], &[holds(0)], &[])];
    let mut network = board(1, &rules, &[]);
    network.finals = vec![0];
    let view = network.view();
    let mut blackboard = Blackboard::default();
    blackboard.reset(&view);
    let mut changes = Vec::new();
    assert!(blackboard.fire(&view, ME, Firing(1), &mut changes));
    assert!(!blackboard.fire(&view, ME, Firing(0), &mut changes));
    assert!(blackboard.has_final(&view));
}

#[test]
fn fact_written_twice_in_one_firing_is_one_change_with_the_last_version() {
    let network = board(1, &[(&[], &[holds(0), absent(0)], &[])], &[]);
    let view = network.view();
    let mut blackboard = Blackboard::default();
    blackboard.reset(&view);
    let mut changes = Vec::new();
    blackboard.fire(&view, ME, Firing(0), &mut changes);
    assert_eq!(changes.len(), 1);
    assert_eq!((changes[0].value, changes[0].version.count), (Value::Absent, 2));
}

#[test]
fn agenda_finds_the_member_of_every_rank_across_blocks() {
    let mut agenda = Agenda::default();
    agenda.reset(10_000);
    let members: Vec<u32> =
        (0..10_000).filter(|number| number % 7 == 3 || *number > 9_900).collect();
    for &member in &members {
        agenda.insert(member as usize);
        agenda.insert(member as usize);
    }
    agenda.remove(5);
    let found: Vec<u32> = (0..agenda.len()).map(|rank| agenda.select(rank)).collect();
    assert_eq!(found, members);
}

fn literal(facts: u32) -> impl Strategy<Value = u32> {
    (0..facts, any::<bool>()).prop_map(|(fact, negated)| fact << 1 | u32::from(negated))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]
    #[test]
    fn counting_match_agrees_with_a_plain_scan(
        rules in prop::collection::vec(
            (prop::collection::vec(literal(8), 0..4), prop::collection::vec(literal(8), 1..3)), 1..12),
        deliveries in prop::collection::vec((0_u32..8, 1_u8..3, 1_u32..6, 0_u32..4), 0..20),
        picks in prop::collection::vec(any::<u32>(), 0..12),
    ) {
        let mut network = BoardNetwork { fact_count: 8, initial: vec![1, 4], ..BoardNetwork::default() };
        for (premises, outputs) in &rules {
            network.premises.push_row(premises.iter().copied());
            network.outputs.push_row(outputs.iter().copied());
        }
        network.queues = Csr::from_pairs(rules.len(), &[]);
        network.links = Csr::from_pairs(8, &[]);
        network.index_readers();
        let view = network.view();
        let mut blackboard = Blackboard::default();
        blackboard.reset(&view);
        let mut fired = vec![false; rules.len()];
        let mut changes = Vec::new();
        let check = |blackboard: &Blackboard, fired: &[bool]| {
            let plain: Vec<u32> = (0_u32..).zip(rules.iter().zip(fired))
                .filter(|(_, ((premises, _), fired))| !**fired && premises.iter().all(|&packed| {
                    let literal = Literal(packed);
                    literal.is_met_by(blackboard.state(literal.fact()).value)
                }))
                .map(|(rule, _)| rule)
                .collect();
            assert_eq!(candidates(blackboard), plain);
        };
        check(&blackboard, &fired);
        let mut picks = picks.into_iter();
        for (fact, value, count, writer) in deliveries {
            let value = Value::from_code(value).expect("1 and 2 are values");
            let version = Version { count, writer: CraftId(writer) };
            blackboard.merge(&view, FactId(fact), value, version);
            check(&blackboard, &fired);
            if let (Some(pick), 1..) = (picks.next(), blackboard.candidate_count()) {
                let firing = blackboard.candidate(pick % blackboard.candidate_count());
                fired[firing.0 as usize] = true;
                blackboard.fire(&view, ME, firing, &mut changes);
                check(&blackboard, &fired);
            }
        }
    }
}
