//! Policies: what comes first, and that what a craft knows decides its way.

use super::Control;
use super::acting::{Acting, Effect};
use crate::blackboard::Blackboard;
use crate::reasoning::planner::{Planner, Standing};
use shared_types::ids::{ActionId, CraftId, FactId, Firing, RuleId};
use shared_types::knowledge::{BoardNetwork, Csr, FleetNetwork, Literal, Topology, Value};
use shared_types::reasoning::Policy;
use shared_types::rng::{Purpose, Stream};

const CRAFT: CraftId = CraftId(0);

/// A board of `facts` facts with rules of premises, outputs and queued actions.
fn board(
    facts: u32,
    rules: &[(&[u32], &[u32], &[u32])],
    actions: &[&[u32]],
    links: &[(u32, u32)],
) -> BoardNetwork {
    let holds = |fact: &u32| Literal::holds(FactId(*fact)).0;
    let mut board = BoardNetwork { fact_count: facts, ..BoardNetwork::default() };
    for (premises, outputs, queues) in rules {
        board.premises.push_row(premises.iter().map(holds));
        board.outputs.push_row(outputs.iter().map(holds));
        board.queues.push_row(queues.iter().copied());
    }
    for outputs in actions {
        board.action_outputs.push_row(outputs.iter().map(holds));
    }
    board.links = Csr::from_pairs(facts as usize, links);
    board.index_readers();
    board
}

fn fleet(boards: Vec<BoardNetwork>) -> FleetNetwork {
    let count = u32::try_from(boards.len()).unwrap();
    FleetNetwork { boards, topology: Topology::binary(count), ..FleetNetwork::default() }
}

/// What craft 0 fires under `policy`, alone, in order, until it is idle or `most` firings are over.
fn fired(network: &FleetNetwork, policy: Policy, most: usize) -> Vec<Firing> {
    acted(network, policy, most, 1).into_iter().map(|(firing, _)| firing).collect()
}

/// The same with what became of each firing in the trial of `seed`.
fn acted(network: &FleetNetwork, policy: Policy, most: usize, seed: u64) -> Vec<(Firing, Effect)> {
    let view = network.view();
    let (mut control, mut state) = (Control::default(), Blackboard::default());
    control.reset(policy, CRAFT, &view);
    state.reset(view.board(CRAFT));
    let (mut draws, mut changes) = (Stream::new(1, 0, Purpose::Test, 0), Vec::new());
    let mut acting = Acting::new(seed, 0, CRAFT);
    let mut fired = Vec::new();
    while fired.len() < most {
        let board = view.board(CRAFT);
        let choose = || control.choose(&state, board, &mut draws);
        let firing = acting.at_hand().unwrap_or_else(choose);
        if firing.is_idle() {
            break;
        }
        let effect = acting.spend(board, firing);
        effect.bring(&mut state, board, CRAFT, firing, &mut changes);
        assert!(effect == Effect::Done || changes.is_empty());
        control.note_fired(board, (firing, effect), &changes);
        fired.push((firing, effect));
    }
    fired
}

/// Fact 0 holds. Rules 0 and 1 lead nowhere; 2 queues the action that asserts 3, from which rule 3
/// concludes the final fact 4; rules 4 and 5 lead there as well, by a longer way.
fn crossroads() -> FleetNetwork {
    let mut board = board(
        7,
        &[
            (&[0], &[1], &[]),
            (&[1], &[2], &[]),
            (&[0], &[], &[0]),
            (&[3], &[4], &[]),
            (&[0], &[5], &[]),
            (&[5], &[6], &[]),
            (&[6], &[3], &[]),
        ],
        &[&[3]],
        &[],
    );
    board.initial = vec![0];
    board.finals = vec![4];
    fleet(vec![board])
}

fn ids(firings: &[Firing]) -> Vec<u32> {
    firings.iter().map(|firing| firing.0).collect()
}

#[test]
fn the_best_path_is_taken_before_anything_else_and_what_serves_nothing_never() {
    let fired = fired(&crossroads(), Policy::BestPath, 9);
    let action = Firing::of_action(ActionId(0), 7);
    assert_eq!(fired[..3], [Firing::of_rule(RuleId(2)), action, Firing::of_rule(RuleId(3))]);
    // Then what serves the final fact though it is no longer needed; 0 and 1 serve nothing.
    assert_eq!(ids(&fired[3..]), [4, 5, 6]);
}

#[test]
fn an_action_of_several_turns_keeps_its_craft_until_it_is_over() {
    let mut network = crossroads();
    network.boards[0].action_durations = vec![3];
    network.view().validate().unwrap();
    let acted = acted(&network, Policy::BestPath, 5, 1);
    let action = Firing::of_action(ActionId(0), 7);
    let (rule, last) = (Firing::of_rule(RuleId(2)), Firing::of_rule(RuleId(3)));
    let (done, underway) = (Effect::Done, Effect::Underway);
    let wanted =
        [(rule, done), (action, underway), (action, underway), (action, done), (last, done)];
    assert_eq!(acted, wanted);
}

#[test]
fn a_plan_goes_another_way_once_its_action_was_in_vain_and_tries_again_one_that_may_repeat() {
    let mut network = crossroads();
    network.boards[0].action_likelihoods = vec![0.5_f64.to_bits()];
    network.view().validate().unwrap();
    let action = Firing::of_action(ActionId(0), 7);
    let (rule, last) = (Firing::of_rule(RuleId(2)), Firing::of_rule(RuleId(3)));
    let (mut failed, mut tries) = (0, 0);
    for seed in 0..200 {
        let once = acted(&network, Policy::BestPath, 6, seed);
        assert_eq!((once[0].0, once[1].0), (rule, action));
        let rest: Vec<Firing> = once[2..].iter().map(|&(firing, _)| firing).collect();
        if once[1].1 == Effect::InVain {
            failed += 1;
            assert_eq!(ids(&rest), [4, 5, 6, 3], "the longer way, then the end");
        } else {
            assert_eq!(rest[0], last);
        }
        let mut repeating = network.clone();
        repeating.boards[0].repeating_actions = vec![0];
        let again = acted(&repeating, Policy::BestPath, 40, seed);
        let runs: Vec<Effect> = again
            .iter()
            .filter(|(firing, _)| *firing == action)
            .map(|&(_, effect)| effect)
            .collect();
        assert_eq!(runs.iter().filter(|&&effect| effect == Effect::Done).count(), 1);
        assert_eq!(runs.last(), Some(&Effect::Done), "until it succeeds");
        assert_eq!(again[1 + runs.len()].0, last);
        tries += runs.len();
    }
    // Four standard deviations: of 200 draws, and of 200 times until the first success.
    assert!((72..=128).contains(&failed), "{failed}");
    assert!((320..=480).contains(&tries), "{tries}");
}

#[test]
fn the_naive_order_runs_actions_at_once_and_rules_round_and_round() {
    assert_eq!(ids(&fired(&crossroads(), Policy::Naive, 9)), [0, 1, 2, 7, 3, 4, 5, 6]);
    let mut circle = board(2, &[(&[0], &[1], &[]), (&[0], &[1], &[])], &[], &[]);
    circle.initial = vec![0];
    circle.repeating_rules = vec![0, 1];
    assert_eq!(ids(&fired(&fleet(vec![circle]), Policy::Naive, 4)), [0, 1, 0, 1]);
}

/// Craft 0 asserts a shared fact by the dear rule 0 or the cheap rule 1; craft 1 needs it for the end.
#[test]
fn a_plan_crosses_boards_and_follows_what_is_known() {
    let mut first = board(3, &[(&[0], &[1], &[]), (&[2], &[1], &[])], &[], &[(1, 1), (1, 0)]);
    first.initial = vec![0];
    first.rule_costs = vec![5.0_f64.to_bits(), 1.0_f64.to_bits()];
    let mut second = board(2, &[(&[0], &[1], &[])], &[], &[]);
    second.finals = vec![1];
    let network = fleet(vec![first, second]);
    let view = network.view();
    view.validate().unwrap();
    let mut planner = Planner::new(CRAFT, &view);
    assert_eq!(planner.steps(), [Firing::of_rule(RuleId(0))]);
    let goal = |cost| Standing::Underway { craft: CraftId(1), fact: FactId(1), cost };
    assert_eq!(planner.standing(), goal(7.0));
    assert_eq!(planner.plan().unwrap().rests_on, [Literal::holds(FactId(0))]);
    planner.note(FactId(2), Value::Asserted);
    assert_eq!(planner.steps(), [Firing::of_rule(RuleId(1))]);
    assert_eq!(planner.standing(), goal(3.0));
    // What has run cannot run again.
    planner.note_fired(view.board(CRAFT), Firing::of_rule(RuleId(1)));
    assert_eq!(planner.steps(), [Firing::of_rule(RuleId(0))]);
    planner.note(FactId(1), Value::Asserted);
    assert!(planner.steps().is_empty());
    assert_eq!(planner.standing(), goal(2.0));
    planner.note(FactId(1), Value::Absent);
    planner.note_fired(view.board(CRAFT), Firing::of_rule(RuleId(0)));
    assert!(planner.steps().is_empty());
    assert_eq!(planner.standing(), Standing::Unreachable);
    assert!(planner.plan().is_none());
}

/// Forty diamonds one above the other: under sums the cost doubles at each.
#[test]
fn costs_that_numbers_do_not_tell_apart_are_out_of_reach_and_planning_ends() {
    let rows: Vec<[Vec<u32>; 2]> = (0..60).map(|step| [vec![step, step], vec![step + 1]]).collect();
    let rules: Vec<(&[u32], &[u32], &[u32])> =
        rows.iter().map(|[premises, outputs]| (&premises[..], &outputs[..], &[][..])).collect();
    let mut tower = board(61, &rules, &[], &[]);
    tower.finals = vec![60];
    let network = fleet(vec![tower]);
    let mut planner = Planner::new(CRAFT, &network.view());
    planner.note(FactId(0), Value::Asserted);
    assert!(planner.steps().is_empty());
    assert_eq!(planner.standing(), Standing::Unreachable);
    planner.note(FactId(30), Value::Asserted);
    assert_eq!(planner.steps().len(), 30);
}
