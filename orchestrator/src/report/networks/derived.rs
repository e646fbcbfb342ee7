//! What the tables lead to: when pruning pays, how often it helps, and where the naive solver is
//! faster; beside what the source says of itself.

use super::published::{Kind, PublishedTable, embedded};
use crate::report::table::wrap;
use crate::results::networks::{Condition, Measured};
use serde::Serialize;

/// Conditions under which the source compares pruned with unpruned networks.
const CONDITIONS: usize = 25;

/// Figures that follow from what was measured; those of conditions that were not are absent.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(super) struct Derived {
    /// Solves by the naive solver after which the time of the pruner is made up for; absent where
    /// pruning saves no time.
    break_even_solves: Option<f64>,
    /// Conditions in which pruning lowers preparation time, iterations, path length, solve time.
    helped: Option<[usize; 4]>,
    /// The same counted in the printed tables.
    helped_as_printed: [usize; 4],
    /// Conditions in which the naive solver takes less time than preparing and solving, unpruned and
    /// pruned.
    naive_is_faster: Option<[usize; 2]>,
}

impl Derived {
    pub(super) fn of(measured: &[Measured]) -> Self {
        let base = measured.iter().find(|one| one.condition == Condition::BASE);
        let break_even_solves = base.and_then(|one| {
            let saved = one.unpruned.naive_ns.value()? - one.pruned.naive_ns.value()?;
            (saved > 0.0).then_some(one.prune_ns.value()? / saved)
        });
        let tables = embedded();
        let rows: Vec<(&PublishedTable, Condition)> = tables
            .iter()
            .filter(|table| table.kind == Kind::Percent)
            .flat_map(|table| table.rows.iter().map(move |row| (table, row.condition)))
            .collect();
        let ours: Vec<&Measured> = rows
            .iter()
            .filter_map(|(_, condition)| measured.iter().find(|one| one.condition == *condition))
            .collect();
        let has_all = ours.len() == CONDITIONS;
        Self {
            break_even_solves,
            helped: has_all.then(|| helped(&ours)),
            helped_as_printed: helped_as_printed(&tables),
            naive_is_faster: has_all.then(|| naive_is_faster(&ours)),
        }
    }

    pub(super) fn text(&self) -> String {
        let mut text = String::new();
        if let Some(solves) = self.break_even_solves {
            text += &wrap(
                "break-even  ",
                &format!("of pruning: {solves:.1} solves by the naive solver (published 153.2)"),
            );
        }
        let [time, iterations, length, solve] = self.helped_as_printed;
        if let Some([our_time, our_iterations, our_length, our_solve]) = self.helped {
            text += &wrap(
                "helped      ",
                &format!(
                    "in {our_time} of {CONDITIONS} conditions pruning lowers preparation time \
                     ({time} in the printed tables), iterations in {our_iterations} ({iterations}), \
                     path length in {our_length} ({length}), solve time in {our_solve} ({solve})"
                ),
            );
        }
        if let Some([unpruned, pruned]) = self.naive_is_faster {
            text += &wrap(
                "naive       ",
                &format!(
                    "faster than preparing and solving once in {unpruned} of {CONDITIONS} \
                     conditions, pruned in {pruned}"
                ),
            );
        }
        text
    }
}

fn helped(ours: &[&Measured]) -> [usize; 4] {
    let count = |of: fn(&crate::results::networks::Solved) -> Option<f64>| {
        let is_lower = |one: &&&Measured| of(&one.pruned) < of(&one.unpruned);
        ours.iter().filter(is_lower).count()
    };
    [
        count(|solved| solved.populate_ns.value()),
        count(|solved| solved.iterations.value()),
        count(|solved| solved.path_length.value()),
        count(|solved| solved.solve_ns.value()),
    ]
}

fn helped_as_printed(tables: &[PublishedTable]) -> [usize; 4] {
    let columns = [
        "average_time_percent",
        "average_iterations_percent",
        "path_length_percent",
        "solve_time_percent",
    ];
    columns.map(|name| {
        let rows = tables.iter().flat_map(|table| &table.rows);
        let cells = rows.flat_map(|row| &row.columns);
        cells.filter(|(column, value)| column == name && *value < 100.0).count()
    })
}

fn naive_is_faster(ours: &[&Measured]) -> [usize; 2] {
    let count = |of: fn(&Measured) -> &crate::results::networks::Solved| {
        let is_faster = |one: &&&Measured| {
            let solved = of(one);
            let solver = solved.populate_ns.value().zip(solved.solve_ns.value());
            solved.naive_ns.value() < solver.map(|(populate, solve)| populate + solve)
        };
        ours.iter().filter(is_faster).count()
    };
    [count(|one| &one.unpruned), count(|one| &one.pruned)]
}
