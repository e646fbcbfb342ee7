//! What the thinking of crafts came to and cost: planning, pruning, maintenance.
//!
//! Counts follow from seed and scenario, times do not; both stand apart from what is deterministic, where
//! no clock may be. A figure is a mean over the trials of one craft under one strategy.

use super::figure::Figures;
use super::record::TrialRecord;
use super::statistics::mean;
use serde::Serialize;
use shared_types::reasoning::ReasoningReport;
use shared_types::wire::StrategyKind;
use std::collections::BTreeMap;

/// The thinking of one craft under one strategy.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ReasoningCell {
    /// Crafts of the fleet.
    pub size: u32,
    /// How changes were replicated.
    pub strategy: StrategyKind,
    /// Its id.
    pub craft: u32,
    /// Its name in the scenario.
    pub name: String,
    /// By metric.
    pub figures: Figures,
}

/// Metric, value and unit of everything that `report` says.
#[must_use]
pub fn values(report: &ReasoningReport) -> [(&'static str, u64, &'static str); 19] {
    let [facts, rules, actions] = report.kept.map(u64::from);
    let [current, stale, unused, unlikely, used] = report.statuses;
    [
        ("reasoning-plans", report.plans, "plan"),
        ("reasoning-costs-changed", report.costs_changed, "fact"),
        ("reasoning-prunings", report.prunings, "pruning"),
        ("reasoning-changes-followed", report.changes_followed, "change"),
        ("reasoning-kept-facts", facts, "fact"),
        ("reasoning-kept-rules", rules, "rule"),
        ("reasoning-kept-actions", actions, "action"),
        ("reasoning-slices", report.slices, "slice"),
        ("reasoning-looked-at", report.statuses.iter().sum(), "item"),
        ("reasoning-current", current, "item"),
        ("reasoning-stale", stale, "item"),
        ("reasoning-unused", unused, "item"),
        ("reasoning-unlikely", unlikely, "item"),
        ("reasoning-used", used, "item"),
        ("reasoning-moved", report.moved, "item"),
        ("reasoning-do-not-collect", u64::from(report.do_not_collect), "fact"),
        ("reasoning-prune", report.prune_ns, "ns"),
        ("reasoning-maintain", report.maintain_ns, "ns"),
        ("reasoning-slice-max", report.slice_ns_max, "ns"),
    ]
}

/// One cell per (size, strategy, craft) that thought.
#[must_use]
pub fn reasoning_cells(trials: &[TrialRecord]) -> Vec<ReasoningCell> {
    let mut by_craft: BTreeMap<(u32, StrategyKind, u32), (&str, Vec<&ReasoningReport>)> =
        BTreeMap::new();
    for record in trials {
        let cell = record.deterministic.cell;
        for process in &record.timing.processes {
            if let Some(report) = &process.reasoning {
                let key = (cell.size, cell.strategy, process.craft);
                by_craft.entry(key).or_insert((&process.name, Vec::new())).1.push(report);
            }
        }
    }
    by_craft
        .into_iter()
        .map(|((size, strategy, craft), (name, reports))| {
            let mut figures = Figures::default();
            let rows: Vec<_> = reports.iter().map(|report| values(report)).collect();
            for (place, &(metric, _, unit)) in rows[0].iter().enumerate() {
                let value = mean(rows.iter().map(|row| row[place].1));
                figures.lockstep(metric, value, rows.len() as u64, unit, "mean a trial");
            }
            ReasoningCell { size, strategy, craft, name: name.to_owned(), figures }
        })
        .collect()
}
