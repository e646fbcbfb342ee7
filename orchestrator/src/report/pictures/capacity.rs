//! The most changes a second that each strategy bears, by fleet size.

use super::sizes::{At, over_sizes};
use crate::report::svg::number::Unit;
use crate::report::svg::picture::{Panel, Picture};
use crate::results::load::CapacityRecord;
use crate::results::summary::Summary;
use shared_types::wire::StrategyKind;
use std::collections::{BTreeMap, BTreeSet};

/// Name of the file.
const NAME: &str = "capacity";

/// The picture, `None` for a run without a search for capacity.
#[must_use]
pub fn capacity(summary: &Summary) -> Option<Picture> {
    let records = &summary.timing.capacities;
    if records.is_empty() {
        return None;
    }
    let bursts: BTreeSet<u32> = records.iter().map(|record| record.burst).collect();
    let panels = bursts.into_iter().map(|burst| {
        let title = if burst == 1 {
            "writes one by one".to_owned()
        } else {
            format!("{burst} writes of a craft due together")
        };
        let values = values(records.iter().filter(|record| record.burst == burst));
        let y_title = "changes applied a second, log scale";
        over_sizes(&title, y_title, Unit::PerSecond, &values).map_or_else(
            || Panel::Nothing(format!("{title}: no load that was tried was borne")),
            Panel::Lines,
        )
    });
    let blocks: BTreeSet<u32> = records.iter().map(|record| record.cell.block).collect();
    Some(Picture {
        name: NAME.to_owned(),
        title: "Capacity by strategy and fleet size".to_owned(),
        about:
            "The highest rate at which at least 99.9 % of the changes were known by the end, no \
                outbox was full and the schedule lagged by less than 1 ms at p99."
                .to_owned(),
        legend: Vec::new(),
        panels: panels.collect(),
        notes: vec![format!(
            "Changes applied at other boards, whole fleet; median of the blocks, bars from the lowest \
             block to the highest, n {} blocks. Of a central strategy the asking interval that bore \
             most.",
            blocks.len()
        )],
    })
}

/// Median and range over blocks, for each strategy and size.
fn values<'a>(records: impl Iterator<Item = &'a CapacityRecord>) -> Vec<At> {
    /// What was borne in each block, by asking interval.
    type ByInterval = BTreeMap<Option<u64>, Vec<f64>>;
    let mut cells: BTreeMap<(u32, StrategyKind), ByInterval> = BTreeMap::new();
    for record in records {
        let of_cell = cells.entry((record.cell.size, record.cell.strategy)).or_default();
        let blocks = of_cell.entry(record.asks_every_ns).or_default();
        blocks.extend(record.capacity().map(|probe| probe.applied_per_s));
    }
    cells
        .into_iter()
        .map(|((size, strategy), intervals)| {
            let mut sorted: Vec<Vec<f64>> = intervals.into_values().collect();
            sorted.iter_mut().for_each(|blocks| blocks.sort_by(f64::total_cmp));
            let best = sorted.iter().max_by(|one, other| middle(one).total_cmp(&middle(other)));
            let blocks = best.map_or(&[][..], Vec::as_slice);
            let interval = blocks.first().copied().zip(blocks.last().copied());
            At {
                size,
                strategy,
                value: (!blocks.is_empty()).then(|| middle(blocks)),
                interval: interval.filter(|_| blocks.len() > 1),
                is_reference: false,
            }
        })
        .collect()
}

/// The middle one of ascending values, of two the lower; 0 of none.
fn middle(ascending: &[f64]) -> f64 {
    ascending.get(ascending.len().saturating_sub(1) / 2).copied().unwrap_or(0.0)
}
