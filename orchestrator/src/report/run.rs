//! The tables of one scenario of a user's own: how its trials ended under every strategy, what was
//! sent, and which craft reached which final fact.

use super::capacities::capacities;
use super::compare::{
    heading, legend_of_counts, legend_of_times, requests_cell, size_heading, tail_quantile,
};
use super::page::Page;
use super::pictures::gallery;
use super::table::{Colour, Table, clip, column, exact, short, wrap};
use super::{Look, Report, details, document, incidents, loads};
use crate::results::read::RunData;
use crate::results::record::{TrialEnd, TrialFacts};
use crate::results::summary::{CountedCell, Summary};
use shared_types::wire::StrategyKind;
use std::path::PathBuf;

/// Signs of a number of requests.
const REQUEST_SIGNS: usize = 6;
/// Signs of the other numbers.
const SIGNS: usize = 4;

/// A mission that was run or simulated.
#[derive(Clone, Debug)]
pub struct Mission {
    /// Every figure.
    pub summary: Summary,
    /// Where the results lie.
    pub directory: PathBuf,
    /// How the user calls this program.
    pub program: String,
}

impl Report for Mission {
    fn table(&self, look: Look) -> String {
        let mut text = heading(&self.summary, look.colour);
        text += &loads::disagreements(&self.summary);
        let table = self.main_table();
        let has_turns = !table.is_empty();
        if has_turns {
            text += &table.render(look.colour);
            text += "\n";
            text += &self.endings(look.all);
        }
        text += &loads::first_screen(&self.summary, look.colour);
        text += &capacities(&self.summary, look.colour);
        text += &incidents::incidents(&self.summary, look.all, look.colour);
        text += "\n";
        if has_turns {
            text += &legend_of_counts();
        }
        text += &loads::legend(&self.summary);
        if self.is_timed() {
            text += &legend_of_times();
        } else if has_turns {
            text += &wrap(
                "turn time     ",
                "of the trials themselves, cold, ledger included; not for comparing strategies",
            );
        }
        if look.all {
            text += &details::details(&self.summary, look.colour);
        }
        text + "\n" + &self.pointers(look)
    }

    fn json(&self) -> String {
        document::json("run", &self.summary, &[])
    }

    fn csv(&self) -> String {
        document::csv(&self.summary, &[])
    }
}

impl Mission {
    /// The page of the same report, with its pictures.
    #[must_use]
    pub fn page(&self, run: &RunData) -> Page {
        let heading = "How trials ended, and what was sent".to_owned();
        let text = self.table(Look { colour: Colour::Never, all: true });
        let pictures = gallery(run, &self.summary, &[]);
        Page::of(&self.summary, vec![(heading, self.main_table())], pictures, text)
    }

    /// Whether there are timing cells besides the trials.
    fn is_timed(&self) -> bool {
        !self.summary.timing.records.is_empty()
    }

    fn main_table(&self) -> Table {
        let tail = tail_quantile(&self.summary);
        let mut table = Table::new(&[
            column("", "strategy"),
            column("", "turns"),
            column("requests", "ours "),
            column("means a trial", "trans"),
            column("means a trial", "deliv"),
            column("means a trial", "bytes"),
            column("means a trial", "hops"),
            column("turn time, us", "p50"),
            column("turn time, us", tail.name),
            column("turn time, us", "max"),
            column("turn time, us", "over"),
            column("CPU", "over"),
        ]);
        // Without timing cells the turns of the trials stand in; they have no floor.
        let prefix = if self.is_timed() { "turn-time" } else { "trial-turn-time" };
        for size in self.summary.sizes() {
            table.section(size_heading(&self.summary, size));
            for strategy in self.summary.strategies(size) {
                let counted = self.summary.counted(size, strategy);
                let timed = self.summary.timed(size, strategy);
                let count =
                    |metric| short(counted.and_then(|cell| cell.figures.value(metric)), SIGNS);
                let time = |metric: &str| {
                    let value = timed.and_then(|cell| cell.figures.value(metric));
                    short(value.map(|ns| ns / 1e3), SIGNS)
                };
                table.row(vec![
                    strategy.name().to_owned(),
                    count("turns"),
                    requests_cell(&self.summary, size, strategy, REQUEST_SIGNS),
                    count("transmissions"),
                    count("deliveries"),
                    count("bytes"),
                    count("hops"),
                    time(&format!("{prefix}-p50")),
                    time(&format!("{prefix}-{}", tail.name)),
                    time(&format!("{prefix}-max")),
                    time("turn-time-p50-over-null"),
                    time("cpu-per-turn-over-null"),
                ]);
            }
        }
        table
    }

    /// One line for every way in which trials of a strategy ended; every trial under `all`.
    fn endings(&self, all: bool) -> String {
        let mut text = String::new();
        for cell in &self.summary.deterministic.cells {
            let trials: Vec<&TrialFacts> = self
                .summary
                .deterministic
                .trials
                .iter()
                .filter(|facts| {
                    (facts.cell.size, facts.cell.strategy) == (cell.size, cell.strategy)
                })
                .collect();
            let lead = format!("{:<16}", cell.strategy.name());
            match trials.as_slice() {
                [only] => text += &wrap(&lead, &ending(only)),
                many if all => {
                    for facts in many {
                        text += &wrap(&lead, &format!("trial {}: {}", facts.trial, ending(facts)));
                    }
                }
                _ => text += &wrap(&lead, &endings_in_short(cell, &trials)),
            }
        }
        text
    }

    fn pointers(&self, look: Look) -> String {
        let directory = self.directory.display();
        let mut text = format!("results   {directory}\n");
        if !look.all {
            text += &format!("next      {} report {directory} --all\n", self.program);
        }
        let strategies: Vec<StrategyKind> = self
            .summary
            .sizes()
            .into_iter()
            .flat_map(|size| self.summary.strategies(size))
            .collect();
        if let [only] = strategies.as_slice() {
            let other = if *only == StrategyKind::Full { "boundary" } else { "full" };
            text += &format!("          the same with `--strategies {only},{other}`\n");
        }
        text
    }
}

/// How one trial ended, in words.
fn ending(facts: &TrialFacts) -> String {
    match (facts.end, &facts.final_fact) {
        (TrialEnd::Finished, Some(reached)) => format!(
            "finished in turn {}: `{}` became true on `{}`",
            reached.turn,
            clip(&reached.fact, 40),
            clip(&reached.craft, 40)
        ),
        (TrialEnd::Finished, None) => format!("finished after {} turns", facts.turns),
        (TrialEnd::Stalled, _) => format!(
            "stalled after {} turns: no craft had anything left to run and nothing was in flight",
            facts.turns
        ),
        (TrialEnd::Dropped, _) => {
            format!("dropped: no final fact in the {} turns that the scenario allows", facts.turns)
        }
        (TrialEnd::Partial, _) => format!("partial: something was lost in turn {}", facts.turns),
    }
}

fn endings_in_short(cell: &CountedCell, trials: &[&TrialFacts]) -> String {
    let ends: Vec<String> = TrialEnd::ALL
        .into_iter()
        .filter_map(|end| Some(format!("{} {}", cell.ends.get(&end)?, end.name())))
        .collect();
    let mut reached: Vec<&str> = trials
        .iter()
        .filter_map(|facts| facts.final_fact.as_ref().map(|fact| fact.craft.as_str()))
        .collect();
    reached.sort_unstable();
    let by: Vec<String> = reached
        .chunk_by(|one, other| one == other)
        .map(|same| format!("{} {}x", clip(same[0], 24), same.len()))
        .collect();
    let turns = exact(cell.figures.value("turns"), 1);
    let by = if by.is_empty() {
        String::new()
    } else {
        format!("; final fact reached by {}", by.join(", "))
    };
    format!("{}; mean turns {turns}{by}", ends.join(", "))
}
