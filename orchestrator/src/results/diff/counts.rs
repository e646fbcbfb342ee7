//! Counts of the same experiment in two runs: equal, or a regression.

use crate::results::load::LoadRecord;
use crate::results::read::RunData;
use crate::results::record::{TrialEnd, TrialFacts};
use serde::Serialize;
use shared_types::wire::StrategyKind;
use std::collections::BTreeMap;

/// A trial, or a cell of open mode, whose counts differ.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct CountDifference {
    /// Crafts, a centre not counted.
    pub size: u32,
    /// How changes were replicated.
    pub strategy: StrategyKind,
    /// Which launch.
    pub block: u32,
    /// Trial of the seed, or name of the load.
    pub what: String,
    /// The first count that differs.
    pub metric: String,
    /// What it was.
    pub before: String,
    /// What it is.
    pub after: String,
}

/// How many were compared, and those that differ.
pub(super) fn differences(before: &RunData, after: &RunData) -> (u64, Vec<CountDifference>) {
    let (mut compared, mut differ) = (0, Vec::new());
    let (then, now) = (trials(before), trials(after));
    for (key, one) in &then {
        let Some(other) = now.get(key) else { continue };
        compared += 1;
        let first = counts(one).into_iter().zip(counts(other)).find(|(one, other)| one != other);
        differ.extend(first.map(|((metric, before), (_, after))| CountDifference {
            size: one.cell.size,
            strategy: one.cell.strategy,
            block: one.cell.block,
            what: format!("trial {}", one.trial),
            metric: metric.to_owned(),
            before,
            after,
        }));
    }
    let (then, now) = (loads(before), loads(after));
    for (key, one) in &then {
        let Some(other) = now.get(key) else { continue };
        compared += 1;
        let (was, is) = (one.counts.total().requests, other.counts.total().requests);
        if was != is {
            differ.push(CountDifference {
                size: one.cell.size,
                strategy: one.cell.strategy,
                block: one.cell.block,
                what: format!("load {}", one.load),
                metric: "requests".to_owned(),
                before: was.to_string(),
                after: is.to_string(),
            });
        }
    }
    (compared, differ)
}

/// Trials that came to an end of their own: a partial one was judged by its own run.
fn trials(run: &RunData) -> BTreeMap<(u32, StrategyKind, u32, u32), &TrialFacts> {
    let facts = run.trials.iter().map(|record| &record.deterministic);
    facts
        .filter(|facts| facts.end != TrialEnd::Partial)
        .map(|facts| ((facts.cell.size, facts.cell.strategy, facts.cell.block, facts.trial), facts))
        .collect()
}

type LoadKey = (u32, StrategyKind, u32, u32, String);

/// Cells of open mode whose counts the trace decides: not saturated, and foreseen by the replay.
fn loads(run: &RunData) -> BTreeMap<LoadKey, &LoadRecord> {
    let records = run.loads.iter().map(|cell| &cell.record);
    records
        .filter(|record| {
            record.saturated.is_none() && record.expected.is_some() && record.unplayed == 0
        })
        .map(|record| {
            let (cell, load) = (record.cell, record.load.clone());
            ((cell.size, cell.strategy, cell.block, record.again, load), record)
        })
        .collect()
}

/// Everything that a seed decides of a trial, the sums before the digests.
fn counts(facts: &TrialFacts) -> Vec<(&'static str, String)> {
    let (sent, reply) = (facts.measured.replication, facts.measured.reply);
    let numbers = [
        ("turns", u64::from(facts.turns)),
        ("firings", facts.firings),
        ("boundary firings", facts.boundary_firings),
        ("idle turns", facts.idle_turns),
        ("requests", sent.requests),
        ("transmissions", sent.transmissions),
        ("deliveries", sent.deliveries),
        ("bytes sent", sent.bytes_sent),
        ("bytes received", sent.bytes_received),
        ("replies", reply.transmissions),
        ("reply bytes", reply.bytes_sent),
        ("hops", facts.hops),
        ("conflicts", facts.conflicts),
    ];
    let mut counts = vec![("end", facts.end.name().to_owned())];
    counts.extend(numbers.map(|(metric, number)| (metric, number.to_string())));
    let fact = facts.final_fact.as_ref();
    let fact = fact.map(|fact| format!("{} on {}", fact.fact, fact.craft));
    counts.push(("final fact", fact.unwrap_or_else(|| "none".to_owned())));
    counts.push(("path digest", facts.path_digest.to_string()));
    counts.push(("board digest", facts.board_digest.to_string()));
    counts.push(("replica digest", facts.replica_digest.to_string()));
    counts
}
