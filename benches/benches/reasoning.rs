//! Pruners and solvers on the random networks of the published tables, each fast form beside the loops
//! that it is held against; an assertion with its rule updates; the mission network of a million cells.

use agent::blackboard::Blackboard;
use agent::blackboard::grid::GridBoard;
use agent::reasoning::Kept;
use agent::reasoning::best_path::{Combine, Costs, Repair, Solver, sweep};
use agent::reasoning::prune::sound::Sound;
use agent::reasoning::prune::{Kinds, published, reference};
use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use orchestrator::networks::draw;
use orchestrator::results::networks::Condition;
use shared_types::ids::{CraftId, FactId};
use shared_types::knowledge::grid::Grid;
use shared_types::knowledge::{BoardNetwork, Literal, Value};
use shared_types::rng::{Purpose, Stream};
use std::hint::black_box;

/// The published base, and the largest published networks.
const LARGEST: Condition =
    Condition { rules: 2000, facts: 2000, actions: 2000, associations: 5, ..Condition::BASE };

fn network(condition: Condition) -> BoardNetwork {
    let mut board = BoardNetwork::default();
    draw(condition, &mut Stream::new(1, 0, Purpose::Networks, 0), &mut board);
    board
}

fn known(board: &BoardNetwork) -> Vec<Literal> {
    board.initial.iter().map(|&fact| Literal::holds(FactId(fact))).collect()
}

fn name(condition: Condition) -> String {
    let Condition { rules, facts, actions, associations, .. } = condition;
    format!("{rules}-{facts}-{actions}-{associations}")
}

fn pruners(criterion: &mut Criterion) {
    for condition in [Condition::BASE, LARGEST] {
        let mut group = criterion.benchmark_group(format!("prune {}", name(condition)));
        let board = network(condition);
        let view = board.view();
        group.bench_function("published", |bencher| {
            bencher.iter(|| published::prune(black_box(&view), Kinds::ALL));
        });
        group.sample_size(10).bench_function("published, loops", |bencher| {
            bencher.iter(|| reference::published(black_box(&view), Kinds::ALL));
        });
        let (known, goal) = (known(&board), Literal::holds(FactId(board.fact_count - 1)));
        group.bench_function("sound", |bencher| {
            bencher.iter(|| Sound::new(black_box(&view), known.iter().copied(), [goal]));
        });
        let mut sound = Sound::new(&view, known.iter().copied(), [goal]);
        group.bench_function("sound, one fact lost and found", |bencher| {
            let mut next = known.iter().cycle();
            bencher.iter(|| {
                let literal = *next.next().expect("invariant: a cycle does not end");
                sound.set_known(&view, literal, false);
                sound.set_known(&view, literal, true);
            });
        });
        group.finish();
    }
}

fn solvers(criterion: &mut Criterion) {
    for condition in [Condition::BASE, LARGEST] {
        let mut group = criterion.benchmark_group(format!("best path {}", name(condition)));
        let board = network(condition);
        let view = board.view();
        // As few as the published solver starts from.
        let known: Vec<Literal> = known(&board).into_iter().step_by(7).collect();
        let costs = Costs::uniform(&view, Combine::Sum);
        let everything = Kept::everything(&view);
        let mut solver = Solver::default();
        group.bench_function("exact", |bencher| {
            bencher.iter(|| solver.solve(&view, &costs, None, known.iter().copied(), None));
        });
        group.bench_function("sweeps", |bencher| {
            bencher.iter(|| sweep::sweep(&view, &costs, &everything, known.iter().copied()));
        });
        let mut repair = Repair::new(&view, costs.clone(), known.iter().copied())
            .expect("invariant: uniform costs are above 0");
        group.bench_function("repair after one fact", |bencher| {
            let mut next = known.iter().cycle();
            let mut is_known = false;
            let mut literal = known[0];
            bencher.iter(|| {
                if is_known {
                    literal = *next.next().expect("invariant: a cycle does not end");
                }
                repair.set_known(&view, literal, is_known);
                is_known = !is_known;
            });
        });
        group.finish();
    }
}

/// Facts that `readers` rules read, asserted and de-asserted in turn.
fn assertions(criterion: &mut Criterion) {
    const FACTS: u32 = 256;
    let mut group = criterion.benchmark_group("assertion");
    for readers in [0_u32, 1, 4, 16, 64] {
        let mut board = BoardNetwork { fact_count: FACTS, ..BoardNetwork::default() };
        for rule in 0..FACTS * readers {
            // A second premise that never holds keeps the agenda out of it.
            let premises = [rule % FACTS, (rule + 1) % FACTS];
            board.premises.push_row(premises.map(|fact| Literal::holds(FactId(fact)).0));
            board.outputs.push_row([]);
            board.queues.push_row([]);
        }
        (0..FACTS).for_each(|_| board.links.push_row([]));
        board.index_readers();
        let view = board.view();
        let mut state = Blackboard::default();
        state.reset(&view);
        let mut next = 0_u32;
        // Every fact is read by two rules for each that names it first.
        group.bench_function(BenchmarkId::new("readers", 2 * readers), |bencher| {
            bencher.iter(|| {
                let fact = FactId(next % FACTS);
                let literal = if (next / FACTS).is_multiple_of(2) {
                    Literal::holds(fact)
                } else {
                    Literal::is_absent(fact)
                };
                next = next.wrapping_add(1);
                state.write(&view, CraftId(0), black_box(literal))
            });
        });
    }
    group.finish();
}

/// The mission network of six million facts, as a rule family.
fn grids(criterion: &mut Criterion) {
    const SIDE: u32 = 1000;
    let mut group = criterion.benchmark_group("grid 1000 x 1000");
    group.sample_size(10);
    let grid = || Grid::new(SIDE, SIDE, 100, 5).expect("invariant: the published grid");
    group.bench_function("ready", |bencher| {
        bencher.iter(|| GridBoard::new(black_box(grid())));
    });
    let observations: Vec<FactId> = {
        let mut stream = Stream::new(1, 0, Purpose::Test, 0);
        (0..1_000_000)
            .map(|_| grid().condition(stream.below(SIDE * SIDE), 1 + stream.below(6)))
            .collect()
    };
    group.throughput(Throughput::Elements(observations.len() as u64));
    group.bench_function("a million observations", |bencher| {
        bencher.iter_batched_ref(
            || GridBoard::new(grid()),
            |board| {
                for &fact in &observations {
                    black_box(board.write(fact, Value::Asserted));
                }
            },
            BatchSize::PerIteration,
        );
    });
    group.finish();
}

criterion_group!(benches, pruners, solvers, assertions, grids);
criterion_main!(benches);
