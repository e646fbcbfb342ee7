//! The most changes a second that each strategy bears, by fleet size.

use super::sizes::{At, over_sizes};
use crate::report::svg::number::Unit;
use crate::report::svg::picture::{Panel, Picture};
use crate::results::borne::Borne;
use crate::results::summary::Summary;
use std::collections::BTreeSet;

/// Name of the file.
const NAME: &str = "capacity";

/// The picture, `None` for a run without a search for capacity.
#[must_use]
pub fn capacity(summary: &Summary) -> Option<Picture> {
    let records = &summary.timing.capacities;
    if records.is_empty() {
        return None;
    }
    let borne = Borne::of(records);
    let bursts: BTreeSet<u32> = records.iter().map(|record| record.burst).collect();
    let panels = bursts.into_iter().map(|burst| {
        let title = if burst == 1 {
            "writes one by one".to_owned()
        } else {
            format!("{burst} writes of a craft due together")
        };
        let values: Vec<At> = borne.iter().filter(|row| row.burst == burst).map(at).collect();
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

fn at(row: &Borne) -> At {
    At {
        size: row.size,
        strategy: row.strategy,
        value: row.median(),
        interval: row.range(),
        is_reference: false,
    }
}
