//! Pruners and solvers on the random networks of the published tables, each fast form beside the loops
//! that it is held against, and how the cost of either grows with the network.

use agent::reasoning::Kept;
use agent::reasoning::best_path::{Combine, Costs, Repair, Solver, sweep};
use agent::reasoning::prune::sound::Sound;
use agent::reasoning::prune::{Kinds, published, reference};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use orchestrator::networks::draw;
use orchestrator::results::networks::Condition;
use shared_types::ids::FactId;
use shared_types::knowledge::{BoardNetwork, Literal};
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

fn growth(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("growth with edges");
    group.sample_size(10);
    for thousands in [1, 10, 100, 1000] {
        let size = thousands * 250;
        let condition = Condition { rules: size, facts: size, actions: size, ..Condition::BASE };
        let board = network(condition);
        let view = board.view();
        let edges = board.premises.view().item_count()
            + board.outputs.view().item_count()
            + board.queues.view().item_count()
            + board.action_outputs.view().item_count();
        let known = known(&board);
        let costs = Costs::uniform(&view, Combine::Sum);
        group.throughput(Throughput::Elements(edges as u64));
        group.bench_with_input(BenchmarkId::new("prune", edges), &view, |bencher, view| {
            bencher.iter(|| published::prune(view, Kinds::ALL));
        });
        let mut solver = Solver::default();
        group.bench_with_input(BenchmarkId::new("best path", edges), &view, |bencher, view| {
            bencher.iter(|| solver.solve(view, &costs, None, known.iter().copied(), None));
        });
    }
    group.finish();
}

criterion_group!(benches, pruners, solvers, growth);
criterion_main!(benches);
