//! Tables 1 to 20 as they were printed, and which networks each of their rows is of.

use crate::results::networks::{Condition, Mean, Measured, Solved};
use crate::results::statistics::as_float;

/// The tables.
pub const TABLES: std::ops::RangeInclusive<u32> = 1..=20;

/// Networks behind every published mean.
pub const PUBLISHED_NETWORKS: u32 = 500;

/// What a table's columns are of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Networks as drawn.
    Unpruned,
    /// Networks that were pruned.
    Pruned,
    /// Pruned in percent of unpruned.
    Percent,
    /// Time of one pruning, pass by pass.
    Passes,
}

/// One table.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PublishedTable {
    pub(super) number: u32,
    pub(super) title: &'static str,
    pub(super) kind: Kind,
    pub(super) rows: Vec<PublishedLine>,
}

/// One row: its networks, and its columns as printed.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PublishedLine {
    pub(super) label: String,
    pub(super) condition: Condition,
    pub(super) columns: Vec<(String, f64)>,
}

macro_rules! tables {
    ($($number:literal $kind:ident $title:literal $file:literal;)*) => {
        [$(($number, Kind::$kind, $title, include_str!(concat!("../../../data/straub_table_", $file, ".csv")))),*]
    };
}

/// Number, kind, title and text of every table.
const TEXTS: [(u32, Kind, &str, &str); 20] = tables! {
    1 Unpruned "as drawn" "01_unpruned_optimal_and_naive_solver";
    2 Pruned "the pruner" "02_pruner_time_and_results";
    3 Pruned "pruned" "03_pruned_optimal_and_naive_solver";
    4 Passes "the passes of the pruner" "04_pruning_iteration_cost";
    5 Unpruned "as drawn, rules varied" "05_unpruned_rules_varied";
    6 Pruned "pruned, rules varied" "06_pruned_rules_varied";
    7 Percent "pruned in percent of as drawn, rules varied" "07_pruned_percent_of_unpruned_rules_varied";
    8 Unpruned "as drawn, facts varied" "08_unpruned_facts_varied";
    9 Pruned "pruned, facts varied" "09_pruned_facts_varied";
    10 Percent "pruned in percent of as drawn, facts varied" "10_pruned_percent_of_unpruned_facts_varied";
    11 Unpruned "as drawn, actions varied" "11_unpruned_actions_varied";
    12 Pruned "pruned, actions varied" "12_pruned_actions_varied";
    13 Percent "pruned in percent of as drawn, actions varied" "13_pruned_percent_of_unpruned_actions_varied";
    14 Unpruned "as drawn, associations varied" "14_unpruned_associations_varied";
    15 Pruned "pruned, associations varied" "15_pruned_associations_varied";
    16 Percent "pruned in percent of as drawn, associations varied" "16_pruned_percent_of_unpruned_associations_varied";
    17 Unpruned "as drawn, all varied" "17_unpruned_concurrently_varied";
    18 Pruned "pruned, all varied" "18_pruned_concurrently_varied";
    19 Percent "pruned in percent of as drawn, all varied" "19_pruned_percent_of_unpruned_concurrently_varied";
    20 Pruned "one kind not pruned" "20_not_pruning_object_types";
};

/// All tables.
pub(super) fn embedded() -> Vec<PublishedTable> {
    let table =
        |(number, kind, title, text)| PublishedTable { number, title, kind, rows: lines(text) };
    TEXTS.into_iter().map(table).collect()
}

/// The networks that `tables` are of, each once.
#[must_use]
pub fn conditions(tables: &[u32]) -> Vec<Condition> {
    let wanted = embedded().into_iter().filter(|table| tables.contains(&table.number));
    let mut conditions: Vec<Condition> =
        wanted.flat_map(|table| table.rows).map(|row| row.condition).collect();
    conditions.sort_unstable();
    conditions.dedup();
    conditions
}

fn lines(text: &str) -> Vec<PublishedLine> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let heads = reader.headers().expect("invariant: embedded tables have heads").clone();
    let rows = reader.records().map(|row| row.expect("invariant: embedded tables are well formed"));
    rows.map(|row| {
        let mut line =
            PublishedLine { label: String::new(), condition: Condition::BASE, columns: Vec::new() };
        for (head, cell) in heads.iter().zip(&row) {
            line.read(head, cell);
        }
        line
    })
    .collect()
}

impl PublishedLine {
    fn read(&mut self, head: &str, cell: &str) {
        let number = cell.parse().ok();
        let condition = &mut self.condition;
        let varied = match head {
            "initial_rules" => Some(&mut condition.rules),
            "initial_facts" => Some(&mut condition.facts),
            "initial_actions" => Some(&mut condition.actions),
            "associations" => Some(&mut condition.associations),
            _ => None,
        };
        match (varied, head, number) {
            (Some(varied), ..) => {
                *varied = cell.parse().expect("invariant: what is varied is whole");
                let space = if self.label.is_empty() { "" } else { "/" };
                self.label += &format!("{space}{cell}");
            }
            (None, "condition", _) => {
                condition.prunes = match cell {
                    "No Fact Pruning (#1)" => [false, true, true],
                    "No Action Pruning (#2)" => [true, true, false],
                    "No Rule Pruning (#3)" => [true, false, true],
                    _ => [false; 3],
                };
                cell.clone_into(&mut self.label);
            }
            (None, "statistic", _) => cell.clone_into(&mut self.label),
            (None, _, Some(value)) => self.columns.push((head.to_owned(), value)),
            (None, _, None) => unreachable!("invariant: other cells are numbers"),
        }
    }
}

/// What stands beside a published figure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Ours {
    /// A mean over networks, in units of `scale` of what was measured.
    Mean(Mean, f64),
    /// A number without a range.
    Number(f64, u64),
}

/// A tick of the source, ns.
const TICK_NS: f64 = 100.0;

impl Kind {
    /// What we have for `column` of a row labelled `label`.
    pub(super) fn ours(self, label: &str, column: &str, measured: &Measured) -> Option<Ours> {
        let is_pruned = measured.condition.prunes != [false; 3];
        match self {
            Self::Passes => of_passes(label, column, measured),
            Self::Percent => {
                let column = column.strip_suffix("_percent")?;
                let column = column
                    .replace("_time", "_time_ticks_100ns")
                    .replace("time_per_unit_length", "time_per_unit_length_ticks_100ns");
                let above = of_solver(&column, &measured.pruned)?.value()?;
                let below = of_solver(&column, &measured.unpruned)?.value()?;
                Some(Ours::Number(100.0 * above / below, measured.prune_ns.n()))
            }
            Self::Pruned if is_pruned => {
                of_pruner(column, measured).or_else(|| of_solver(column, &measured.pruned))
            }
            Self::Pruned if column.starts_with("remaining") => of_pruner(column, measured),
            Self::Pruned | Self::Unpruned => of_solver(column, &measured.unpruned),
        }
    }
}

fn of_pruner(column: &str, measured: &Measured) -> Option<Ours> {
    let mean = match column {
        "pruning_time_ticks_100ns" => return Some(Ours::Mean(measured.prune_ns, TICK_NS)),
        "remaining_facts" => measured.kept[0],
        "remaining_rules" => measured.kept[1],
        "remaining_actions" => measured.kept[2],
        _ => return None,
    };
    Some(Ours::Mean(mean, 1.0))
}

fn of_passes(label: &str, column: &str, measured: &Measured) -> Option<Ours> {
    let place: usize = column.strip_prefix("iteration_")?.parse().ok()?;
    let of = |place: usize| measured.pass_ns.get(place - 1)?.value();
    let n = measured.pass_ns[0].n();
    match label {
        "mean_ticks_100ns" => Some(Ours::Mean(*measured.pass_ns.get(place - 1)?, TICK_NS)),
        "percent_of_total" => {
            let sum: f64 = (1..=measured.pass_ns.len()).filter_map(of).sum();
            Some(Ours::Number(100.0 * of(place)? / sum, n))
        }
        _ => None,
    }
}

fn of_solver(column: &str, solved: &Solved) -> Option<Ours> {
    let (mean, scale) = match column {
        "optimal_iterations" | "average_iterations" => (solved.iterations, 1.0),
        "optimal_populate_time_ticks_100ns" | "average_time_ticks_100ns" => {
            (solved.populate_ns, TICK_NS)
        }
        "optimal_solve_time_ticks_100ns" | "solve_time_ticks_100ns" => (solved.solve_ns, TICK_NS),
        "optimal_path_length" | "path_length" => (solved.path_length, 1.0),
        "naive_find_count" => (solved.naive_loops, 1.0),
        "naive_rules_run" => (solved.naive_rules, 1.0),
        "naive_actions_run" => (solved.naive_actions, 1.0),
        "naive_time_ticks_100ns" => (solved.naive_ns, TICK_NS),
        "naive_not_solved_trials_of_500" => {
            let n = solved.iterations.n();
            let share = as_float(solved.unsolved) / as_float(n);
            return Some(Ours::Number(share * f64::from(PUBLISHED_NETWORKS), n));
        }
        "time_per_unit_length_ticks_100ns" => {
            let time = solved.solve_ns.value()? / TICK_NS;
            return Some(Ours::Number(time / solved.path_length.value()?, solved.solve_ns.n()));
        }
        _ => return None,
    };
    Some(Ours::Mean(mean, scale))
}

impl Ours {
    pub(super) fn value(self) -> Option<f64> {
        match self {
            Self::Mean(mean, scale) => mean.value().map(|value| value / scale),
            Self::Number(value, _) => Some(value),
        }
    }

    pub(super) fn range(self) -> Option<(f64, f64)> {
        match self {
            Self::Mean(mean, scale) => mean.range().map(|(low, high)| (low / scale, high / scale)),
            Self::Number(..) => None,
        }
    }

    pub(super) const fn n(self) -> u64 {
        match self {
            Self::Mean(mean, _) => mean.n(),
            Self::Number(_, n) => n,
        }
    }
}
