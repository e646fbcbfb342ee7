//! The table of a diff: counts first, then what the clocks say.

use super::table::{Table, column, exact, short, wrap};
use super::{Look, Report};
use crate::results::diff::{Diff, TimeDifference, Uncompared};
use crate::results::inference::Verdict;
use serde::Serialize;

/// Lines of one kind that are printed before the rest is only counted.
const LINES_MAX: usize = 8;

/// Two runs beside each other.
#[derive(Clone, Debug)]
pub struct Difference {
    /// What was found.
    pub diff: Diff,
    /// The two directories, as typed.
    pub names: [String; 2],
}

#[derive(Serialize)]
struct Document<'a> {
    report: &'static str,
    before: &'a str,
    after: &'a str,
    outcome: crate::outcome::Outcome,
    #[serde(flatten)]
    diff: &'a Diff,
}

impl Difference {
    fn counts(&self, look: Look) -> String {
        let Diff { common, counts_compared, counts, .. } = &self.diff;
        if !common.experiments.is_empty() {
            let why = common.experiments.join("; ");
            return wrap(
                "counts    ",
                &format!("not compared, the runs are of different experiments: {why}"),
            );
        }
        if counts.is_empty() {
            return wrap(
                "counts    ",
                &format!("equal in all {counts_compared} trials and cells of both"),
            );
        }
        let (differ, compared) = (counts.len(), counts_compared);
        let head = wrap("! ", &format!("counts differ in {differ} of {compared} trials and cells"));
        let mut text = look.colour.alarm(head.trim_end()) + "\n";
        let shown = if look.all { counts.len() } else { LINES_MAX };
        for one in counts.iter().take(shown) {
            let line = format!(
                "{} crafts, {}, {}: {} {} -> {}",
                one.size, one.strategy, one.what, one.metric, one.before, one.after
            );
            text += &wrap("  ", &line);
        }
        if counts.len() > shown {
            text += &format!("  ... and {} more: see `--all`\n", counts.len() - shown);
        }
        text
    }

    fn hosts(&self) -> String {
        let common = &self.diff.common;
        let mut text = String::new();
        if !common.hosts.is_empty() {
            let differ: Vec<String> = common
                .hosts
                .iter()
                .map(|(what, before, after)| format!("{what} ({before}; {after})"))
                .collect();
            let what = format!(
                "differ in {}: no absolute verdict; turns and CPU are over those of `null` of their own \
                 run, time to knowledge over the raw hop of its own block",
                differ.join(", ")
            );
            text += &wrap("hosts     ", &what);
        }
        if !common.is_clean {
            text += &wrap(
                "hosts     ",
                "noisy in one of the runs, or unobserved: no regression of times is named",
            );
        }
        text
    }

    fn times(&self, look: Look) -> String {
        let mut table = Table::new(&[
            column("", "strategy"),
            column("", "load"),
            column("", "measured"),
            column("after / before", "ratio"),
            column("after / before", "low"),
            column("after / before", "high"),
            column("", "floor"),
            column("", "n"),
            column("", "verdict"),
        ]);
        let is_shown = |time: &&TimeDifference| {
            look.all || time.is_regression || !time.metric.ends_with("p99")
        };
        let mut size = None;
        for time in self.diff.times.iter().filter(is_shown) {
            if size != Some(time.size) {
                table.section(format!("{} crafts", time.size));
                size = Some(time.size);
            }
            let comparison = &time.comparison;
            let (low, high) = comparison.interval.unzip();
            table.row(vec![
                time.strategy.to_string(),
                time.load.clone(),
                time.metric.to_owned(),
                exact(Some(comparison.ratio), 3),
                exact(low, 3),
                exact(high, 3),
                exact(comparison.floor, 3),
                short(Some(crate::results::statistics::as_float(comparison.blocks)), 4),
                verdict(time).to_owned(),
            ]);
        }
        if table.is_empty() {
            return wrap("times     ", "none that both runs measured");
        }
        table.render(look.colour)
    }

    /// What both measured and is not compared, a line each.
    fn uncompared(&self) -> String {
        let mut text = String::new();
        for same in self
            .diff
            .uncompared
            .chunk_by(|one, other| (one.metric, one.why) == (other.metric, other.why))
        {
            let sizes: Vec<String> = same.iter().map(|one| one.size.to_string()).collect();
            let Uncompared { metric, why, .. } = &same[0];
            let what = format!("{metric}, {} crafts: {why}", sizes.join(", "));
            text += &wrap("not compared  ", &what);
        }
        text
    }
}

/// What is said of a ratio of two runs, in a word.
fn verdict(time: &TimeDifference) -> &'static str {
    match time.comparison.verdict {
        Verdict::Winner if time.is_regression => "WORSE",
        Verdict::Winner => "better",
        Verdict::Tie => "same",
        Verdict::TooFewBlocks => "few",
        Verdict::Noisy => "noisy",
    }
}

impl Report for Difference {
    fn table(&self, look: Look) -> String {
        let mut text = format!("before    {}\nafter     {}\n", self.names[0], self.names[1]);
        text += &self.counts(look);
        text += &self.hosts();
        text += "\n";
        text += &self.times(look);
        text += &self.uncompared();
        text += "\n";
        let legend = "WORSE and better: the interval excludes 1, the ratio is beyond the distance of a strategy from \
                      itself (floor), and p, corrected, is below 0.05; few: too few blocks for that; \
                      ratios are of medians of n blocks";
        text += &wrap("verdict   ", legend);
        let outcome = self.diff.outcome();
        text + &format!("exit code {}: {}\n", outcome.code(), outcome.sentence())
    }

    fn json(&self) -> String {
        let document = Document {
            report: "diff",
            before: &self.names[0],
            after: &self.names[1],
            outcome: self.diff.outcome(),
            diff: &self.diff,
        };
        let text =
            serde_json::to_string_pretty(&document).expect("invariant: documents are plain data");
        text + "\n"
    }

    fn csv(&self) -> String {
        let mut writer = csv::Writer::from_writer(Vec::new());
        let mut write = |row: [String; 13]| {
            writer.write_record(row).expect("invariant: every row has the header's length");
        };
        write(
            [
                "part",
                "size",
                "strategy",
                "load",
                "asks_every_ns",
                "metric",
                "before",
                "after",
                "ratio",
                "low",
                "high",
                "n",
                "verdict",
            ]
            .map(str::to_owned),
        );
        let none = String::new;
        for one in &self.diff.counts {
            write([
                "counts".to_owned(),
                one.size.to_string(),
                one.strategy.to_string(),
                one.what.clone(),
                none(),
                one.metric.clone(),
                one.before.clone(),
                one.after.clone(),
                none(),
                none(),
                none(),
                "1".to_owned(),
                "differs".to_owned(),
            ]);
        }
        for time in &self.diff.times {
            let (low, high) = time.comparison.interval.unzip();
            let number = |value: Option<f64>| value.map_or_else(none, |value| value.to_string());
            write([
                time.over.map_or_else(
                    || "times".to_owned(),
                    |what| format!("times over {}", what.name()),
                ),
                time.size.to_string(),
                time.strategy.to_string(),
                time.load.clone(),
                time.asks_every_ns.map_or_else(none, |ns| ns.to_string()),
                time.metric.to_owned(),
                none(),
                none(),
                time.comparison.ratio.to_string(),
                number(low),
                number(high),
                time.comparison.blocks.to_string(),
                verdict(time).to_owned(),
            ]);
        }
        let bytes = writer.into_inner().expect("invariant: memory takes every row");
        String::from_utf8(bytes).expect("invariant: rows are made of text")
    }
}
