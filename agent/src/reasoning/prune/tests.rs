//! Every pruner against its loops, and what pruning may never do.

use super::sound::Sound;
use super::{Kinds, literal, published, reference};
use crate::reasoning::sample::{Shape, board};
use proptest::prelude::{ProptestConfig, any, proptest};
use proptest::{prop_assert, prop_assert_eq};
use shared_types::ids::FactId;
use shared_types::knowledge::{BoardNetwork, Literal};
use shared_types::rng::{Purpose, Stream};

const KINDS: [Kinds; 4] = [
    Kinds::ALL,
    Kinds { facts: false, ..Kinds::ALL },
    Kinds { rules: false, ..Kinds::ALL },
    Kinds { actions: false, ..Kinds::ALL },
];

/// A board of a random shape, and the stream for what is asked of it.
fn drawn(seed: u64, is_negating: bool) -> (BoardNetwork, Stream) {
    let mut stream = Stream::new(seed, 0, Purpose::Test, 0);
    let shape = Shape {
        facts: stream.between(1, 40),
        rules: stream.between(1, 40),
        actions: stream.below(30),
        associations: stream.between(2, 5),
        is_negating,
    };
    (board(shape, &mut stream), stream)
}

fn some_literals(count: u32, board: &BoardNetwork, stream: &mut Stream) -> Vec<Literal> {
    (0..count).map(|_| Literal(stream.below(2 * board.fact_count))).collect()
}

fn initial(board: &BoardNetwork) -> Vec<Literal> {
    board.initial.iter().map(|&fact| Literal::holds(FactId(fact))).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn published_and_literal_pruners_keep_what_their_loops_keep(seed in any::<u64>()) {
        let (network, _) = drawn(seed, false);
        let view = network.view();
        for kinds in KINDS {
            prop_assert_eq!(published::prune(&view, kinds), reference::published(&view, kinds));
        }
        prop_assert_eq!(literal::prune(&view), reference::literal(&view));
    }

    #[test]
    fn sound_closures_follow_any_changes(seed in any::<u64>(), changes in 0_u32..12) {
        let (mut network, mut stream) = drawn(seed, true);
        // Some facts are shared with another board.
        network.links.clear();
        let mut open = Vec::new();
        for fact in 0..network.fact_count {
            let is_shared = stream.below(8) == 0;
            network.links.push_row(if is_shared { vec![1, fact] } else { Vec::new() });
            open.extend(is_shared.then_some(fact));
        }
        let view = network.view();
        let (mut known, mut goals) = (initial(&network), some_literals(2, &network, &mut stream));
        let mut sound = Sound::new(&view, known.iter().copied(), goals.iter().copied());
        for _ in 0..changes {
            let literal = some_literals(1, &network, &mut stream)[0];
            let list = if stream.below(4) == 0 { &mut goals } else { &mut known };
            let is_added = !list.contains(&literal);
            list.retain(|&one| one != literal);
            if is_added {
                list.push(literal);
            }
            // Removed from one of two equal goals it is a goal no longer.
            if goals.contains(&literal) || known.contains(&literal) || !is_added {
                sound.set_goal(&view, literal, goals.contains(&literal));
                sound.set_known(&view, literal, known.contains(&literal));
            }
        }
        prop_assert_eq!(sound.kept(&view), reference::sound(&view, &known, &goals, &open));
    }

    #[test]
    fn what_the_sound_pruner_leaves_out_derives_no_goal(seed in any::<u64>()) {
        let (network, mut stream) = drawn(seed, true);
        let view = network.view();
        let (known, goals) = (initial(&network), some_literals(1, &network, &mut stream));
        let kept = Sound::new(&view, known.iter().copied(), goals.iter().copied()).kept(&view);
        let reaches = |uses: &dyn Fn(usize) -> bool| {
            let mut holds: Vec<u32> = known.iter().map(|literal| literal.0).collect();
            loop {
                let before = holds.len();
                for rule in (0..network.premises.view().row_count()).filter(|&rule| uses(rule)) {
                    if view.premises.row(rule).iter().all(|premise| holds.contains(premise)) {
                        let queued = view.queues.row(rule).iter();
                        let acts =
                            queued.flat_map(|&action| view.action_outputs.row(action as usize));
                        let new: Vec<u32> = view.outputs.row(rule).iter().chain(acts).copied()
                            .filter(|output| !holds.contains(output)).collect();
                        holds.extend(new);
                        holds.sort_unstable();
                        holds.dedup();
                    }
                }
                if holds.len() == before {
                    return goals.iter().all(|goal| holds.contains(&goal.0));
                }
            }
        };
        prop_assert_eq!(reaches(&|rule| kept.rules[rule]), reaches(&|_| true));
        prop_assert!(goals.iter().all(|goal| kept.facts[goal.fact().index()]));
    }
}

/// A rule that asserts fact 1 through an empty action only, and one that asserts fact 2.
#[test]
fn the_three_pruners_differ_where_they_should() {
    let mut board = BoardNetwork { fact_count: 3, ..BoardNetwork::default() };
    let holds = |fact| Literal::holds(FactId(fact)).0;
    board.premises.push_row([holds(0)]);
    board.outputs.push_row([]);
    board.queues.push_row([0]);
    board.premises.push_row([holds(0)]);
    board.outputs.push_row([holds(2)]);
    board.queues.push_row([]);
    board.action_outputs.push_row([]);
    (0..3).for_each(|_| board.links.push_row([]));
    board.initial = vec![0];
    board.index_readers();
    let view = board.view();
    let pruned = published::prune(&view, Kinds::ALL);
    assert_eq!(pruned.passes, 2);
    assert_eq!(pruned.kept.facts, [true, false, false], "goals are not protected");
    assert_eq!(pruned.kept.rules, [false, true]);
    assert_eq!(pruned.kept.actions, [false]);
    // The text removes the rule whose only fact is gone, and keeps an action that does nothing.
    let kept = literal::prune(&view);
    assert_eq!((kept.rules, kept.actions), (vec![true, false], vec![true]));
    let goal = Literal::holds(FactId(2));
    let kept = Sound::new(&view, [Literal::holds(FactId(0))], [goal]).kept(&view);
    assert_eq!((kept.facts, kept.rules), (vec![true, false, true], vec![false, true]));
}
