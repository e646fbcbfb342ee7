//! Requests by strategy and fleet size, with the published means beside ours.

use super::sizes::{At, over_sizes, range_of_n};
use crate::report::compare::PublishedMean;
use crate::report::svg::legend::{Entry, Sign};
use crate::report::svg::look::Mark;
use crate::report::svg::number::Unit;
use crate::report::svg::picture::{Panel, Picture};
use crate::results::summary::Summary;
use shared_types::wire::StrategyKind;

/// Name of the file.
const NAME: &str = "requests";

/// The picture, `None` for a run without trials.
#[must_use]
pub fn requests(summary: &Summary, published: &[PublishedMean]) -> Option<Picture> {
    let cells = &summary.deterministic.cells;
    if cells.is_empty() {
        return None;
    }
    let title = "Requests a trial by strategy and fleet size";
    let figures = || {
        cells
            .iter()
            .filter_map(|cell| Some((cell.size, cell.strategy, cell.figures.get("requests")?)))
    };
    let mut values: Vec<At> =
        figures().map(|(size, strategy, figure)| At::of(size, strategy, figure)).collect();
    let is_shown = |mean: &&PublishedMean| summary.counted(mean.size, mean.strategy).is_some();
    let beside: Vec<&PublishedMean> = published.iter().filter(is_shown).collect();
    values.extend(
        beside.iter().map(|mean| At {
            is_reference: true,
            ..At::of(mean.size, mean.strategy, &mean.figure)
        }),
    );
    let Some(chart) = over_sizes("", "requests, mean a trial, log scale", Unit::Count, &values)
    else {
        return Some(Picture::of_nothing(NAME, title, "no strategy sent anything"));
    };
    let mut legend = Vec::new();
    let mut notes = vec![format!(
        "{} trials a mean. Counts are exact for these trials: every one is held against an independent \
         replay{}. {} sends nothing and is not shown.",
        range_of_n(figures().map(|(_, _, figure)| figure.n)),
        if summary.agrees_with_oracle() { ", and all agree" } else { ", AND SOME DIFFER" },
        StrategyKind::Null,
    )];
    if let Some(first) = beside.first() {
        legend.push(Entry::new(Sign::Line(Mark::of(StrategyKind::Boundary)), "filled: ours"));
        let name = "hollow: published mean (Straub 2016, Table 25)";
        legend.push(Entry::new(Sign::Hollow(Mark::of(StrategyKind::Boundary)), name));
        notes.push(format!(
            "Published means are of n {} runs with other random networks; `reproduce` says whether they \
             lie in the range of ours.",
            first.figure.n
        ));
        for mean in beside.iter().filter(|mean| !mean.is_explained) {
            notes.push(format!(
                "{} at {} crafts: source inconsistent, no rule explains the published mean.",
                mean.strategy, mean.size
            ));
        }
    }
    Some(Picture {
        name: NAME.to_owned(),
        title: title.to_owned(),
        about: "A request is all changes of one firing over one hop; a multicast is one."
            .to_owned(),
        legend,
        panels: vec![Panel::Lines(chart)],
        notes,
    })
}
