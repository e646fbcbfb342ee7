//! Figures craft by craft: sums over the trials that are in the means.

use super::figure::Figures;
use super::record::{CraftFacts, TrialFacts};
use super::statistics::as_float;
use serde::Serialize;
use shared_types::wire::StrategyKind;
use std::collections::BTreeMap;

/// Counts of one craft (or the centre) under one strategy.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CraftCell {
    /// Crafts of the fleet, a centre not counted.
    pub size: u32,
    /// How changes were replicated.
    pub strategy: StrategyKind,
    /// Its id; the centre is craft N.
    pub craft: u32,
    /// Its name in the scenario.
    pub name: String,
    /// Whether all its counts are those of the independent replay.
    pub agrees_with_oracle: bool,
    /// By metric.
    pub figures: Figures,
}

/// A count of one craft in one trial.
type CountOf = fn(&CraftFacts) -> u64;

/// Metric, unit, label and source of every sum.
const SUMS: [(&str, &str, &str, CountOf); 10] = [
    ("firings", "firing", "firings", |craft| craft.firings),
    ("boundary-firings", "firing", "firings that changed a boundary fact", |craft| {
        craft.boundary_firings
    }),
    ("requests", "request", "requests sent", |craft| craft.measured.replication.requests),
    ("requests-expected", "request", "requests by the independent replay", |craft| {
        craft.expected.replication.requests
    }),
    ("transmissions", "sample", "samples published", |craft| craft.measured.total().transmissions),
    ("deliveries", "sample", "samples received", |craft| craft.measured.total().deliveries),
    ("deliveries-expected", "sample", "deliveries by the independent replay", |craft| {
        craft.expected.total().deliveries
    }),
    ("bytes", "byte", "records and headers published", |craft| craft.measured.total().bytes_sent),
    ("hops", "hop", "hop counts over what it received finally", |craft| craft.hops),
    ("conflicts", "merge", "merges decided by the craft id", |craft| craft.conflicts),
];

/// One cell per (size, strategy, craft).
#[must_use]
pub fn craft_cells(trials: &[TrialFacts]) -> Vec<CraftCell> {
    let mut by_craft: BTreeMap<(u32, StrategyKind, u32), Vec<&CraftFacts>> = BTreeMap::new();
    for facts in trials.iter().filter(|facts| facts.end.is_in_means()) {
        for craft in &facts.crafts {
            let key = (facts.cell.size, facts.cell.strategy, craft.craft);
            by_craft.entry(key).or_default().push(craft);
        }
    }
    by_craft
        .into_iter()
        .map(|((size, strategy, craft), records)| {
            let mut figures = Figures::default();
            for (metric, unit, label, count_of) in SUMS {
                let sum: u64 = records.iter().map(|record| count_of(record)).sum();
                let label = format!("{label}, all trials");
                figures.count(metric, Some(as_float(sum)), records.len() as u64, unit, &label);
            }
            let agrees_with_oracle =
                records.iter().all(|record| record.measured == record.expected);
            let name = records[0].name.clone();
            CraftCell { size, strategy, craft, name, agrees_with_oracle, figures }
        })
        .collect()
}
