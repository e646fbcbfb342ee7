//! How the cost of pruning and planning grows with a network: random networks of the published kind, from
//! a thousand edges to ten million.
//!
//! Every measurement is repeated and the shortest counts: what a host adds only ever lengthens it. The time
//! an edge would be flat if memory were all alike; it rises where a network outgrows a cache.

use agent::reasoning::best_path::{Combine, Costs, Repair, Solver};
use agent::reasoning::prune::sound::Sound;
use agent::reasoning::prune::{Kinds, published};
use orchestrator::networks::draw;
use orchestrator::report::svg::axis::Axis;
use orchestrator::report::svg::lines::{LineChart, Point, Series};
use orchestrator::report::svg::look::Mark;
use orchestrator::report::svg::number::Unit;
use orchestrator::report::svg::picture::{Panel, Picture};
use orchestrator::report::svg::scale::{Bounds, Spread};
use orchestrator::results::networks::Condition;
use shared_types::ids::FactId;
use shared_types::knowledge::{BoardNetwork, Literal};
use shared_types::rng::{Purpose, Stream};
use shared_types::transport::clock;
use shared_types::wire::StrategyKind;
use std::hint::black_box;

/// Entries of all lists of a network that has one rule, one fact and one action: about four.
const EDGES_EACH: u64 = 4;

/// What is measured, in this order.
pub const WORK: [&str; 4] = ["prune, published", "prune, sound", "best path", "repair, one fact"];

/// Facts that are lost and found again for one time of a repair.
const REPAIRS: usize = 100;

/// The times of one network.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Entries of all its lists.
    pub edges: u64,
    /// Shortest times of [`WORK`], ns.
    pub shortest_ns: [u64; 4],
}

/// Measures networks of about `edges` edges, each `repeats` times.
///
/// # Panics
/// If `repeats` is 0.
#[must_use]
pub fn measure(edges: u64, repeats: u32) -> Row {
    let size = u32::try_from((edges / EDGES_EACH).max(8)).unwrap_or(u32::MAX);
    let condition = Condition { rules: size, facts: size, actions: size, ..Condition::BASE };
    let mut board = BoardNetwork::default();
    draw(condition, &mut Stream::new(1, 0, Purpose::Networks, 0), &mut board);
    let view = board.view();
    let known: Vec<Literal> =
        board.initial.iter().map(|&fact| Literal::holds(FactId(fact))).collect();
    let goal = Literal::holds(FactId(size - 1));
    let costs = Costs::uniform(&view, Combine::Sum);
    let mut solver = Solver::default();
    let shortest = |work: &mut dyn FnMut()| -> u64 {
        let times = (0..repeats).map(|_| {
            let started = clock::now();
            work();
            clock::now().since(started)
        });
        times.min().expect("invariant: at least one repeat")
    };
    let mut repair = Repair::new(&view, costs.clone(), known.iter().copied())
        .expect("invariant: uniform costs are above 0");
    let some: Vec<Literal> =
        known.iter().copied().step_by((known.len() / REPAIRS).max(1)).take(REPAIRS).collect();
    let shortest_ns = [
        shortest(&mut || {
            black_box(published::prune(black_box(&view), Kinds::ALL));
        }),
        shortest(&mut || {
            black_box(Sound::new(black_box(&view), known.iter().copied(), [goal]));
        }),
        shortest(&mut || {
            black_box(solver.solve(&view, &costs, None, known.iter().copied(), None));
        }),
        shortest(&mut || {
            for &literal in &some {
                repair.set_known(&view, literal, false);
                repair.set_known(&view, literal, true);
            }
        }) / (2 * some.len() as u64),
    ];
    let items = |table: &shared_types::knowledge::Csr| table.view().item_count() as u64;
    let edges = items(&board.premises)
        + items(&board.outputs)
        + items(&board.queues)
        + items(&board.action_outputs);
    Row { edges, shortest_ns }
}

/// The rows as a table for documents: times, and in brackets ns an edge.
#[must_use]
pub fn table(rows: &[Row]) -> String {
    let mut text = format!("| edges | {} |\n|---|---|---|---|---|\n", WORK.join(" | "));
    for row in rows {
        let cells: Vec<String> = (0..)
            .zip(row.shortest_ns)
            .map(|(place, time_ns)| match place {
                // A repair touches what depends on the fact, however large the rest is.
                3 => Unit::Time.format(float(time_ns)),
                _ => format!(
                    "{} ({:.2})",
                    Unit::Time.format(float(time_ns)),
                    float(time_ns) / float(row.edges)
                ),
            })
            .collect();
        text += &format!("| {} | {} |\n", row.edges, cells.join(" | "));
    }
    text
}

/// The rows as a picture; `None` if there is nothing to show.
#[must_use]
pub fn picture(rows: &[Row]) -> Option<Picture> {
    let times = rows.iter().flat_map(|row| row.shortest_ns.map(float));
    let series = (0..).zip(WORK).map(|(place, name): (usize, &str)| Series {
        mark: Mark::of(StrategyKind::ALL[place + 1]),
        name: name.to_owned(),
        points: rows
            .iter()
            .map(|row| Point {
                x: float(row.edges),
                y: float(row.shortest_ns[place]),
                interval: None,
                is_marked: true,
            })
            .collect(),
        is_reference: false,
    });
    let chart = LineChart {
        title: "time over edges, both logarithmic".to_owned(),
        x: Axis::measured(
            "edges",
            Bounds::around(Spread::Log, rows.iter().map(|row| float(row.edges)))?,
            Unit::Count,
        ),
        y: Axis::measured("shortest time", Bounds::around(Spread::Log, times)?, Unit::Time),
        series: series.collect(),
        dodge: 0.0,
        height: 330.0,
    };
    Some(Picture {
        name: "reasoning-growth".to_owned(),
        title: "Pruning and planning grow with the network's edges".to_owned(),
        about: "Random networks of the published kind, three associations. A line that rises by one \
                decade a decade is linear; a repair depends on what a fact touches, not on the rest."
            .to_owned(),
        legend: Vec::new(),
        panels: vec![Panel::Lines(chart)],
        notes: vec!["Shortest of the repeated times of one network a point.".to_owned()],
    })
}

#[expect(clippy::cast_precision_loss, reason = "for a table and a picture")]
const fn float(number: u64) -> f64 {
    number as f64
}

#[cfg(test)]
mod tests {
    use super::{Row, WORK, measure, picture, table};

    #[test]
    fn a_network_has_about_the_edges_asked_for() {
        for edges in [1_000, 10_000] {
            let row = measure(edges, 1);
            assert!((edges * 3 / 4..edges * 5 / 4).contains(&row.edges), "{row:?}");
            assert!(row.shortest_ns.iter().all(|&time| time > 0), "{row:?}");
        }
    }

    #[test]
    fn rows_are_shown_as_table_and_picture() {
        let row = |edges| Row { edges, shortest_ns: [edges, 2 * edges, 3 * edges, 50] };
        let rows = [row(1_000), row(10_000)];
        let text = table(&rows);
        assert!(text.contains("| 10000 | 10 us (1.00) | 20 us (2.00) | "), "{text}");
        assert_eq!(text.lines().count(), 4);
        let drawn = picture(&rows).unwrap().document();
        assert!(WORK.iter().all(|name| drawn.contains(name)), "{drawn}");
        assert!(picture(&[]).is_none());
    }
}
