//! Turn time by strategy and fleet size, with the floor that `null` sets.

use super::sizes::{At, over_sizes, range_of_n};
use crate::report::compare::tail_quantile;
use crate::report::svg::number::Unit;
use crate::report::svg::picture::{Panel, Picture};
use crate::results::figure::Figure;
use crate::results::summary::Summary;
use shared_types::wire::StrategyKind;

/// Name of the file.
const NAME: &str = "turn-time";

/// The picture, `None` for a run without timing cells.
#[must_use]
pub fn turn_time(summary: &Summary) -> Option<Picture> {
    if summary.timing.records.is_empty() {
        return None;
    }
    let title = "Turn time by strategy and fleet size";
    let tail = tail_quantile(summary);
    let panels: Vec<Panel> = [("p50", "median"), (tail.name, tail.name)]
        .into_iter()
        .filter_map(|(quantile, words)| {
            let metric = format!("turn-time-{quantile}");
            let heading = format!("{words} turn time");
            let values: Vec<At> = figures(summary, &metric)
                .map(|(size, kind, one)| At::of(size, kind, one))
                .collect();
            let y_title = format!("{words}, log scale");
            over_sizes(&heading, &y_title, Unit::Time, &values).map(Panel::Lines)
        })
        .collect();
    if panels.is_empty() {
        let why = "no cell has enough turns for a median";
        return Some(Picture::of_nothing(NAME, title, why));
    }
    let turns = range_of_n(figures(summary, "turn-time-p50").map(|(_, _, figure)| figure.n));
    let blocks = range_of_n(summary.timing.records.iter().map(|record| {
        let same = summary.timing.records.iter().filter(|other| {
            (other.cell.size, other.cell.strategy, other.again)
                == (record.cell.size, record.cell.strategy, record.again)
        });
        same.count() as u64
    }));
    let has_intervals =
        figures(summary, "turn-time-p50").any(|(_, _, figure)| figure.low.is_some());
    let mut notes = vec![format!(
        "{turns} turns a point, from {} fresh fleets. A lockstep turn holds firing, replication and the \
         ledger that closes it.",
        blocks.trim_start_matches("n ")
    )];
    notes.push(if has_intervals {
        "Whiskers: 95 % interval over blocks, epochs within them. Strategies stand a few pixels apart so \
         that whiskers can be told apart."
            .to_owned()
    } else {
        "No intervals: they need several blocks (`--blocks`).".to_owned()
    });
    if !summary.timing.host.is_clean() {
        notes
            .push("The host was noisy, or was not watched: these times name no winner.".to_owned());
    }
    Some(Picture {
        name: NAME.to_owned(),
        title: title.to_owned(),
        about:
            "What a strategy costs is its distance above null, which plays the same firings and \
                sends nothing."
                .to_owned(),
        legend: Vec::new(),
        panels,
        notes,
    })
}

fn figures<'a>(
    summary: &'a Summary,
    metric: &'a str,
) -> impl Iterator<Item = (u32, StrategyKind, &'a Figure)> {
    let cells = summary.timing.cells.iter();
    cells.filter_map(move |cell| Some((cell.size, cell.strategy, cell.figures.get(metric)?)))
}
