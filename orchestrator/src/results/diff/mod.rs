//! Two runs beside each other: what seed and scenario decide must be equal, what clocks say is a ratio.
//!
//! Counts are compared trial by trial wherever both runs played the same experiment; one difference is a
//! regression, whichever way it goes. Times are paired by block and stand by the rules of any winner
//! (see [`super::inference`]), the distance of a strategy from itself in either run as floor. Between
//! two hosts no absolute verdict is given: there every time is divided first by what its own host takes
//! without us, in the same block: turns by those of strategy `null`, which sends nothing, time to
//! knowledge by the raw hop. Not here: how it is shown.

mod counts;
mod times;

#[cfg(test)]
mod tests;

pub use counts::CountDifference;
pub use times::{TimeDifference, Uncompared, Yardstick};

use super::host::HostReport;
use super::read::RunData;
use crate::outcome::Outcome;
use serde::Serialize;
use shared_types::scenario::{Fleet, OneOrMany, Replication, Run, Scenario};

/// What two runs are in.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Common {
    /// Why their counts are of different experiments; empty if they are of one.
    pub experiments: Vec<String>,
    /// In what their hosts differ (what, before, after); empty if it is one host.
    pub hosts: Vec<(String, String, String)>,
    /// Whether both had their host for themselves.
    pub is_clean: bool,
}

/// Two runs, the second measured against the first.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Diff {
    /// What they share and what not.
    pub common: Common,
    /// Trials and cells of both whose counts were compared.
    pub counts_compared: u64,
    /// Where counts of the same experiment are not equal.
    pub counts: Vec<CountDifference>,
    /// Every time that both measured and that may be compared.
    pub times: Vec<TimeDifference>,
    /// The others.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub uncompared: Vec<Uncompared>,
}

impl Diff {
    /// `after` beside `before`.
    #[must_use]
    pub fn of(before: &RunData, after: &RunData) -> Self {
        let hosts = match (&before.provenance, &after.provenance) {
            (Some(then), Some(now)) => {
                let mut pairs = then.host.pairs(&now.host);
                pairs.retain(|(_, then, now)| then != now);
                pairs
            }
            // A host that is not known is no host to compare with.
            _ => vec![("the host".to_owned(), "unknown".to_owned(), "unknown".to_owned())],
        };
        let is_clean = [before, after].iter().all(|run| HostReport::of(&run.events).is_clean());
        let common = Common { experiments: experiments(before, after), hosts, is_clean };
        let (counts_compared, counts) = if common.experiments.is_empty() {
            counts::differences(before, after)
        } else {
            (0, Vec::new())
        };
        let (times, uncompared) = times::differences(before, after, &common);
        Self { common, counts_compared, counts, times, uncompared }
    }

    /// A regression if counts differ or a time is worse beyond doubt.
    #[must_use]
    pub fn outcome(&self) -> Outcome {
        let is_worse = self.times.iter().any(|time| time.is_regression);
        if is_worse || !self.counts.is_empty() { Outcome::Regression } else { Outcome::Success }
    }
}

/// Why two runs are of different experiments.
fn experiments(before: &RunData, after: &RunData) -> Vec<String> {
    let mut differ = Vec::new();
    match (&before.provenance, &after.provenance) {
        (Some(then), Some(now)) if then.seed != now.seed => {
            differ.push(format!("the seed is {} and {}", then.seed, now.seed));
        }
        (Some(_), Some(_)) => {}
        _ => differ.push("a provenance is lost".to_owned()),
    }
    match (decisive(before), decisive(after)) {
        (Some(then), Some(now)) => {
            let lines = |scenario: &Scenario| {
                let text = toml::to_string(scenario).unwrap_or_default();
                text.lines().map(str::to_owned).collect::<Vec<_>>()
            };
            let (then, now) = (lines(&then), lines(&now));
            if then != now {
                let new = now.iter().find(|line| !then.contains(line));
                let gone = then.iter().find(|line| !now.contains(line));
                let line =
                    |line: Option<&String>| line.map_or("nothing", String::as_str).to_owned();
                differ.push(format!("the scenario has `{}` and `{}`", line(gone), line(new)));
            }
        }
        _ => differ.push("a scenario is lost".to_owned()),
    }
    differ
}

/// The scenario of a run without what decides no count: how often and where it was run, and for which
/// fleets and strategies, which trials are paired by.
fn decisive(run: &RunData) -> Option<Scenario> {
    let scenario: Scenario = toml::from_str(run.scenario.as_ref()?).ok()?;
    let Scenario { run, replication, .. } = scenario.clone();
    let fleet = Fleet { crafts: None, ..Fleet::default() };
    let replication = Replication { strategies: None::<OneOrMany<_>>, ..replication };
    let Run { mode: _, turns, seed, rate_per_s, duration_s, .. } = run;
    let run = Run { turns, seed, rate_per_s, duration_s, ..Run::default() };
    Some(Scenario {
        name: String::new(),
        description: String::new(),
        fleet,
        replication,
        run,
        ..scenario
    })
}
