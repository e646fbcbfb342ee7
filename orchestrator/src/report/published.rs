//! What the dissertation published about replication: Tables 21 to 25, and what can be checked in them
//! without running anything.
//!
//! The tables are embedded as they were printed (`orchestrator/data`). Rows of Tables 21 to 24 are
//! single random runs, so only identities between their columns can be checked; means of Table 25 get
//! their verdict from the range of ten-trial means under our model ([`super::ranges`]).

use serde::{Deserialize, Serialize};
use shared_types::wire::StrategyKind;

/// Trials behind every published mean.
pub const PUBLISHED_TRIALS: usize = 10;

/// Sizes of the published fleets, with the number of each table of single runs.
pub const PUBLISHED_SIZES: [(u32, u32); 4] = [(21, 2), (22, 3), (23, 5), (24, 10)];

/// The columns of the tables, in printed order.
pub const PUBLISHED_STRATEGIES: [StrategyKind; 5] = [
    StrategyKind::Boundary,
    StrategyKind::Full,
    StrategyKind::Limited,
    StrategyKind::Central,
    StrategyKind::Hierarchy,
];

/// Final facts of every published board.
const FINALS: u64 = 100;

/// Replication requests of one run, or their means, per approach.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PublishedRow<Count> {
    /// The run's number, or for means the number of boards.
    #[serde(alias = "run", alias = "blackboards")]
    pub label: u32,
    /// The proposed approach: `boundary`.
    #[serde(alias = "proposed_replication_requests", alias = "mean_proposed_replication_requests")]
    pub proposed: Count,
    /// Full replication.
    #[serde(
        alias = "full_replication_replication_requests",
        alias = "mean_full_replication_replication_requests"
    )]
    pub full: Count,
    /// Limited replication.
    #[serde(
        alias = "limited_replication_replication_requests",
        alias = "mean_limited_replication_replication_requests"
    )]
    pub limited: Count,
    /// One central blackboard.
    #[serde(
        alias = "central_blackboard_replication_requests",
        alias = "mean_central_blackboard_replication_requests"
    )]
    pub central: Count,
    /// Along the hierarchy.
    #[serde(
        alias = "hierarchy_replication_requests",
        alias = "mean_hierarchy_replication_requests"
    )]
    pub hierarchy: Count,
}

impl<Count: Copy> PublishedRow<Count> {
    /// The column of `strategy`, `None` if the source has none.
    #[must_use]
    pub const fn requests(&self, strategy: StrategyKind) -> Option<Count> {
        match strategy {
            StrategyKind::Boundary => Some(self.proposed),
            StrategyKind::Full => Some(self.full),
            StrategyKind::Limited => Some(self.limited),
            StrategyKind::Central => Some(self.central),
            StrategyKind::Hierarchy => Some(self.hierarchy),
            StrategyKind::Null
            | StrategyKind::Hybrid
            | StrategyKind::CentralBatched
            | StrategyKind::Pipelined => None,
        }
    }
}

/// One of Tables 21 to 24.
#[derive(Clone, Debug, PartialEq)]
pub struct PublishedRuns {
    /// Its number in the dissertation.
    pub table: u32,
    /// Boards of every run.
    pub crafts: u32,
    /// The runs.
    pub rows: Vec<PublishedRow<u64>>,
}

/// What can be said of a published figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// The identity holds in the printed row, or the printed mean lies in our range.
    Reproduced,
    /// No rule explains what is printed.
    SourceInconsistent,
    /// The identity does not hold in the printed row, or the printed mean lies outside our range.
    NotReproduced,
    /// Nothing can be checked: a single random run.
    Unchecked,
}

impl Verdict {
    /// The verdict in words.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Reproduced => "reproduced",
            Self::SourceInconsistent => "source inconsistent",
            Self::NotReproduced => "not reproduced",
            Self::Unchecked => "single run",
        }
    }
}

/// Whether no rule explains what the source prints for `strategy` in a fleet of `crafts`: with two
/// boards, limited and hierarchy equal full.
#[must_use]
pub const fn is_source_inconsistent(crafts: u32, strategy: StrategyKind) -> bool {
    crafts == 2 && matches!(strategy, StrategyKind::Limited | StrategyKind::Hierarchy)
}

impl PublishedRuns {
    /// Turns of a run: in the published experiment no craft idles, so a run of T turns has N T
    /// firings, which are the requests of full replication. `None` if they are no multiple of N.
    #[must_use]
    pub fn turns(&self, row: &PublishedRow<u64>) -> Option<u64> {
        let crafts = u64::from(self.crafts);
        row.full.is_multiple_of(crafts).then(|| row.full / crafts)
    }

    /// What the row's other columns demand of the column of `strategy`: full a multiple of the
    /// boards, central N (102 T + 2), limited (N - 1) times proposed.
    #[must_use]
    pub fn verdict(&self, row: &PublishedRow<u64>, strategy: StrategyKind) -> Verdict {
        if is_source_inconsistent(self.crafts, strategy) {
            return Verdict::SourceInconsistent;
        }
        let crafts = u64::from(self.crafts);
        let turns = self.turns(row);
        let holds = match strategy {
            StrategyKind::Full => turns.is_some(),
            StrategyKind::Central => {
                turns.is_some_and(|turns| row.central == crafts * ((FINALS + 2) * turns + 2))
            }
            StrategyKind::Limited => row.limited == (crafts - 1) * row.proposed,
            _ => return Verdict::Unchecked,
        };
        if holds { Verdict::Reproduced } else { Verdict::NotReproduced }
    }
}

/// All that is embedded.
#[derive(Clone, Debug, PartialEq)]
pub struct Published {
    /// Tables 21 to 24.
    pub runs: Vec<PublishedRuns>,
    /// Table 25, one row per fleet size.
    pub means: Vec<PublishedRow<f64>>,
}

impl Published {
    /// Reads the embedded tables.
    ///
    /// # Panics
    /// Never: the tables are part of the executable and a test reads them.
    #[must_use]
    pub fn embedded() -> Self {
        let runs = [
            include_str!("../../data/straub_table_21_two_blackboards.csv"),
            include_str!("../../data/straub_table_22_three_blackboards.csv"),
            include_str!("../../data/straub_table_23_five_blackboards.csv"),
            include_str!("../../data/straub_table_24_ten_blackboards.csv"),
        ];
        let means = include_str!("../../data/straub_table_25_summary_of_averages.csv");
        Self {
            runs: PUBLISHED_SIZES
                .into_iter()
                .zip(runs)
                .map(|((table, crafts), text)| PublishedRuns { table, crafts, rows: rows(text) })
                .collect(),
            means: rows(means),
        }
    }

    /// The table of single runs with `number`, 21 to 24.
    #[must_use]
    pub fn table(&self, number: u32) -> Option<&PublishedRuns> {
        self.runs.iter().find(|runs| runs.table == number)
    }

    /// The single runs of fleets of `crafts`.
    #[must_use]
    pub fn runs_of(&self, crafts: u32) -> Option<&PublishedRuns> {
        self.runs.iter().find(|runs| runs.crafts == crafts)
    }

    /// The means for fleets of `crafts`.
    #[must_use]
    pub fn means_of(&self, crafts: u32) -> Option<&PublishedRow<f64>> {
        self.means.iter().find(|row| row.label == crafts)
    }
}

fn rows<Row: serde::de::DeserializeOwned>(text: &str) -> Vec<Row> {
    csv::Reader::from_reader(text.as_bytes())
        .deserialize()
        .collect::<Result<_, _>>()
        .expect("invariant: embedded tables are well formed")
}

#[cfg(test)]
mod tests;
