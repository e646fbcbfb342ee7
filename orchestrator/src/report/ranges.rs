//! What ten trials may show under our model: the range in which a published mean must lie.
//!
//! From the counts of many replayed trials, groups of ten are drawn again and again; the middle 95 %
//! of the groups' means (for a ratio: of the groups' ratios of sums) is the range. Trials that reach
//! no final fact are counted and left out, as in the source. All draws come from the seed. Not here:
//! where the counts come from (`crate::expectation`).

use super::published::{
    PUBLISHED_TRIALS, Published, PublishedRow, Verdict, is_source_inconsistent,
};
use serde::{Deserialize, Serialize};
use shared_types::rng::{Purpose, Stream};
use shared_types::wire::StrategyKind;

/// Groups of ten trials that are drawn for a range.
const GROUPS: usize = 10_000;

/// Counts of one trial that reached a final fact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TrialCounts {
    /// Turns.
    pub turns: u64,
    /// Requests under every strategy that the source tables.
    pub requests: PublishedRow<u64>,
}

/// Counts of many trials of one fleet size.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sample {
    /// Boards.
    pub crafts: u32,
    /// Trials that reached a final fact.
    pub trials: Vec<TrialCounts>,
    /// Trials that did not, left out of every figure.
    pub dropped: u32,
}

/// What is tabled or stated about a fleet size.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Column {
    /// Mean turns.
    Turns,
    /// Mean requests of a strategy.
    Requests(StrategyKind),
    /// Requests of the first strategy as a ratio to those of the second: a ratio of sums.
    Ratio(StrategyKind, StrategyKind),
}

impl Column {
    /// Every column of Table 25, and the ratios that the text discusses.
    pub const ALL: [Self; 10] = [
        Self::Turns,
        Self::Requests(StrategyKind::Boundary),
        Self::Requests(StrategyKind::Full),
        Self::Requests(StrategyKind::Limited),
        Self::Requests(StrategyKind::Central),
        Self::Requests(StrategyKind::Hierarchy),
        Self::Ratio(StrategyKind::Boundary, StrategyKind::Full),
        Self::Ratio(StrategyKind::Limited, StrategyKind::Boundary),
        Self::Ratio(StrategyKind::Central, StrategyKind::Boundary),
        Self::Ratio(StrategyKind::Hierarchy, StrategyKind::Boundary),
    ];

    /// The column's numerator and denominator in one trial; a mean divides by the trial.
    #[expect(clippy::cast_precision_loss, reason = "counts of a trial are far below 2^53")]
    fn parts(self, trial: &TrialCounts) -> [f64; 2] {
        let requests = |strategy| trial.requests.requests(strategy).unwrap_or(0) as f64;
        match self {
            Self::Turns => [trial.turns as f64, 1.0],
            Self::Requests(strategy) => [requests(strategy), 1.0],
            Self::Ratio(above, below) => [requests(above), requests(below)],
        }
    }

    /// What the source printed for `crafts` boards, `None` if nothing.
    #[must_use]
    pub fn published(self, published: &Published, crafts: u32) -> Option<f64> {
        let means = published.means_of(crafts)?;
        match self {
            Self::Turns => Some(means.full / f64::from(crafts)),
            Self::Requests(strategy) => means.requests(strategy),
            Self::Ratio(above, below) => Some(means.requests(above)? / means.requests(below)?),
        }
    }

    /// Whether no rule explains what the source printed for `crafts` boards.
    #[must_use]
    pub const fn is_source_inconsistent(self, crafts: u32) -> bool {
        match self {
            Self::Turns => false,
            Self::Requests(strategy) => is_source_inconsistent(crafts, strategy),
            Self::Ratio(above, below) => {
                is_source_inconsistent(crafts, above) || is_source_inconsistent(crafts, below)
            }
        }
    }
}

/// A column's expectation and the range of its ten-trial means.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Range {
    /// Over all trials.
    pub value: f64,
    /// 2.5 % of the groups of ten lie below.
    pub low: f64,
    /// 2.5 % of the groups of ten lie above.
    pub high: f64,
}

impl Range {
    /// Whether a published mean lies in the range.
    #[must_use]
    pub fn contains(&self, mean: f64) -> bool {
        (self.low..=self.high).contains(&mean)
    }
}

impl Sample {
    /// The column's value over all trials and the range of its ten-trial means.
    ///
    /// # Panics
    /// If no trial reached a final fact.
    #[must_use]
    pub fn range(&self, column: Column, seed: u64) -> Range {
        let parts: Vec<[f64; 2]> = self.trials.iter().map(|trial| column.parts(trial)).collect();
        let trials = u32::try_from(parts.len()).expect("invariant: trials are numbered by 32 bits");
        let mut stream = Stream::new(seed, 0, Purpose::Bootstrap, self.crafts);
        let mut groups: Vec<f64> = (0..GROUPS)
            .map(|_| {
                let drawn = (0..PUBLISHED_TRIALS).map(|_| parts[stream.below(trials) as usize]);
                ratio_of_sums(drawn)
            })
            .collect();
        groups.sort_unstable_by(f64::total_cmp);
        let tail = GROUPS / 40;
        let value = ratio_of_sums(parts.iter().copied());
        Range { value, low: groups[tail], high: groups[GROUPS - 1 - tail] }
    }

    /// What is to be said of the published value of `column`; `None` if the source has none.
    ///
    /// # Panics
    /// If no trial reached a final fact.
    #[must_use]
    pub fn verdict(&self, column: Column, published: &Published, seed: u64) -> Option<Verdict> {
        let mean = column.published(published, self.crafts)?;
        Some(if column.is_source_inconsistent(self.crafts) {
            Verdict::SourceInconsistent
        } else if self.range(column, seed).contains(mean) {
            Verdict::Reproduced
        } else {
            Verdict::NotReproduced
        })
    }
}

/// Sum of numerators over sum of denominators; a group without any denominator counts as infinite.
fn ratio_of_sums(parts: impl Iterator<Item = [f64; 2]>) -> f64 {
    let [above, below] =
        parts.fold([0.0, 0.0], |sums, part| [sums[0] + part[0], sums[1] + part[1]]);
    if below == 0.0 { f64::INFINITY } else { above / below }
}
