//! Holds the reports of an interval that recovered from deaths and losses against its promise: once the
//! fleet is quiet, every board holds what the strategy promises, whoever died and whatever was lost.
//!
//! How much was sent for it depends on what went wrong, so no count is compared. What a craft that died
//! wrote is not known from the trace: sharers of such a fact must agree on it all the same. Every other
//! fact that one craft alone writes is known from the trace, as far as the craft says that it played it.
//! Versions are compared between sharers only: later lives count from higher numbers on.

use super::compare::{Comparison, Discrepancy, Metric};
use super::compare_open::ObservedOpen;
use super::held::{Held, differences_between_sharers};
use shared_types::ids::CraftId;
use shared_types::knowledge::FleetView;
use shared_types::trace::TraceRecord;
use shared_types::wire::{EpochSpec, OpenReport, StrategyKind};

/// Every promise that `observed` breaks of an interval of `spec` on `fleet` in which those in `died`
/// ended and were followed by successors; empty if there is none. A fleet that is not quiet has promised
/// nothing yet.
#[must_use]
pub fn compare_recovered(
    spec: &EpochSpec,
    fleet: &FleetView<'_>,
    observed: &ObservedOpen<'_>,
    died: &[CraftId],
) -> Vec<Discrepancy> {
    let mut comparison =
        Comparison { strategy: spec.strategy, trial: spec.trial, found: Vec::new() };
    let crafts = || (0..fleet.craft_count()).map(CraftId);
    let open = |craft: CraftId| -> Option<&OpenReport> {
        observed.reports.iter().find(|report| report.craft == craft.0)?.open.as_ref()
    };
    for craft in crafts() {
        comparison.check(Some(craft), Metric::Reports, 1, u64::from(open(craft).is_some()));
    }
    if !comparison.found.is_empty() || !observed.is_quiet || spec.sends_altered_only {
        return comparison.found;
    }
    let opens: Vec<&OpenReport> = crafts().filter_map(open).collect();
    let traces: Vec<&[TraceRecord]> = crafts()
        .zip(&opens)
        .map(|(craft, open)| {
            let trace = fleet.trace_of(craft);
            let played = usize::try_from(open.records_played).unwrap_or(usize::MAX);
            // A craft that died may have written any of it.
            if died.contains(&craft) { trace } else { &trace[..played.min(trace.len())] }
        })
        .collect();
    let is_replicated = spec.strategy != StrategyKind::Null;
    let held = Held::of_trace(fleet, &traces, is_replicated).without(fleet, &traces, died);
    let boards: Vec<_> = crafts()
        .zip(&opens)
        .map(|(craft, open)| Held::states(fleet.board(craft), &open.held))
        .collect();
    for (craft, states) in crafts().zip(&boards) {
        let differing = held.values_that_differ(craft, states);
        comparison.check(Some(craft), Metric::FactsUnlikeTrace, 0, differing);
    }
    if is_replicated {
        for ((sender, craft), facts) in differences_between_sharers(fleet, &boards) {
            comparison.check_pair(sender, craft, Metric::FactsUnlikeSharers, 0, facts);
        }
    }
    comparison.found
}
