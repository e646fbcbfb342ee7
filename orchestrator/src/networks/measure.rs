//! Prunes and solves networks of one condition and adds up what comes out.

use super::draw::{distinct, draw};
use crate::results::networks::{Condition, Mean, Measured, Solved};
use crate::results::statistics::as_float;
use agent::reasoning::best_path::published::PublishedSweeps;
use agent::reasoning::prune::{Kinds, literal, published, reference};
use agent::reasoning::{Kept, naive};
use shared_types::ids::FactId;
use shared_types::knowledge::{BoardNetwork, BoardView};
use shared_types::rng::{Purpose, Stream};
use shared_types::transport::clock;

/// Facts that hold when a solver starts, whatever the network.
const START_FACTS: u32 = 42;

/// Networks whose passes are timed one by one, as many as published.
const TIMED_PASSES: u32 = 5;

/// Measures networks `0..networks` of `seed` under `condition`.
///
/// # Panics
/// If [`Condition::check`] refuses the condition.
#[must_use]
pub fn measure(condition: Condition, seed: u64, networks: u32) -> Measured {
    let mut measured = Measured::new(condition);
    let mut board = BoardNetwork::default();
    for number in 0..networks {
        let mut stream = Stream::new(seed, number, Purpose::Networks, 0);
        draw(condition, &mut stream, &mut board);
        let view = board.view();
        let (pruned, prune_ns) = timed(|| published::prune(&view, condition.kinds()));
        measured.prune_ns.add(prune_ns);
        if number < TIMED_PASSES {
            let mut passes = reference::Passes::new(&view, condition.kinds());
            for mean in &mut measured.pass_ns {
                mean.add(timed(|| passes.pass()).1);
            }
        }
        count(&mut measured.kept, &pruned.kept);
        count(&mut measured.kept_by_text, &literal::prune(&view));
        solve(&view, &Kept::everything(&view), &mut stream, &mut measured.unpruned);
        if condition.kinds() != (Kinds { facts: false, rules: false, actions: false }) {
            solve(&view, &pruned.kept, &mut stream, &mut measured.pruned);
        }
    }
    measured
}

fn count(means: &mut [Mean; 3], kept: &Kept) {
    for (mean, count) in means.iter_mut().zip(kept.counts()) {
        mean.add(as_float(count as u64));
    }
}

/// Solves for a random goal among the facts that can be reached from a random start.
fn solve(view: &BoardView<'_>, kept: &Kept, stream: &mut Stream, solved: &mut Solved) {
    let candidates = (0..view.fact_count).filter(|&fact| kept.facts[fact as usize]).collect();
    let start: Vec<FactId> =
        distinct(START_FACTS, candidates, stream).into_iter().map(FactId).collect();
    let (sweeps, populate_ns) = timed(|| PublishedSweeps::of(view, kept, &start));
    solved.iterations.add(f64::from(sweeps.iterations));
    solved.populate_ns.add(populate_ns);
    let reached: Vec<FactId> = sweeps.reached().collect();
    if reached.is_empty() {
        solved.unsolved += 1;
        return;
    }
    let goal = reached[stream.below(FactId::from_index(reached.len()).0) as usize];
    let (length, solve_ns) = timed(|| sweeps.path_length(view, kept, goal));
    solved.solve_ns.add(solve_ns);
    solved.path_length.add(f64::from(length));
    let (chained, naive_ns) = timed(|| naive::chain(view, kept, &start, goal));
    solved.naive_ns.add(naive_ns);
    solved.naive_loops.add(f64::from(chained.loops));
    solved.naive_rules.add(as_float(chained.rules));
    solved.naive_actions.add(as_float(chained.actions));
    solved.unsolved += u64::from(!chained.is_solved);
}

/// What `work` yields, and how long it took, ns.
fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let began = clock::now();
    let result = std::hint::black_box(work());
    (result, as_float(clock::now().since(began)))
}
