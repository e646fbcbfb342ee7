//! What does not add up in the results of a soak.
//!
//! Without faults, every part sends what its trace demands, and delivers it. With faults, every death that
//! was stated, and no other, is followed by a successor that caught up; links lose their share, and all of
//! it is made up for; whoever is to be stopped is. That boards then hold what the strategy promises is for
//! the run itself to say.

use super::Soak;
use super::scenario::{KILLS, LOSS};
use super::verdict::Drift;
use orchestrator::outcome::Outcome;
use orchestrator::results::event::Event;
use orchestrator::results::load::{LoadRecord, LoadRecovery};
use orchestrator::results::read::RunData;
use orchestrator::results::statistics::as_float;
use shared_types::wire::Stage;

/// Fewest samples that links are expected to lose in a part before their share of it is judged. By
/// chance half or twice as many are then lost less often than once in a million parts.
const EXPECTED_MIN: f64 = 100.0;

/// Everything that does not add up.
#[must_use]
pub fn lacks(soak: &Soak, run: &RunData) -> Vec<Drift> {
    let mut lacks = Vec::new();
    for load in &run.loads {
        let record = &load.record;
        let mut found = of_part(record);
        match soak.stopped_s() {
            Some(stopped_s) => found.extend(of_faults(record, stopped_s)),
            None => found.extend(of_peace(record)),
        }
        let part = |what: String| Drift::new(format!("part {}: {what}", record.load));
        lacks.extend(found.into_iter().map(part));
    }
    lacks.extend(of_run(soak, run).into_iter().map(Drift::new));
    lacks
}

/// The complaints that are so.
fn so<const N: usize>(complaints: [(bool, String); N]) -> Vec<String> {
    complaints.into_iter().filter(|(is_so, _)| *is_so).map(|(_, what)| what).collect()
}

fn of_part(record: &LoadRecord) -> Vec<String> {
    let losses = record.losses;
    so([(losses.is_partial(), format!("something was lost: {losses:?}"))])
}

/// Of a fleet that nothing befell.
fn of_peace(record: &LoadRecord) -> Vec<String> {
    let total = record.counts.total();
    // What a host that was too busy for the load left undone is counted, and no drift.
    let kept_up = record.saturated.is_none();
    so([
        (
            record.expected.is_some_and(|expected| expected != record.counts),
            "the counts are not those that the trace demands".to_owned(),
        ),
        (
            record.expected.is_none() && total.transmissions != total.deliveries,
            format!("{} samples sent, {} delivered", total.transmissions, total.deliveries),
        ),
        (kept_up && record.censored > 0, format!("{} changes never arrived", record.censored)),
        (kept_up && record.unplayed > 0, format!("{} writes were not made", record.unplayed)),
    ])
}

/// Of a fleet that was to recover, and one of whose crafts was to be stopped for `stopped_s`.
fn of_faults(record: &LoadRecord, stopped_s: f64) -> Vec<String> {
    let Some(recovery) = record.recovery else { return vec!["nothing was to recover".to_owned()] };
    let LoadRecovery { deaths, states_missed, links, .. } = recovery;
    let lost_on_link = links.lost;
    let expected = LOSS * as_float(lost_on_link + received(record));
    let is_odd = expected >= EXPECTED_MIN
        && !(expected / 2.0..=expected * 2.0).contains(&as_float(lost_on_link));
    // Who is stopped makes its writes when it goes on: the earliest of them as late as the stop was long.
    let late_ns = record.stages.get(&Stage::Schedule).map_or(0, |lateness| lateness.max_ns);
    so([
        (deaths != KILLS, format!("{deaths} deaths where {KILLS} were stated")),
        (lost_on_link == 0 || is_odd, format!("links lost {lost_on_link}, not {expected:.0}")),
        (recovery.repeats == 0, "nothing was sent again".to_owned()),
        (states_missed > 0, format!("{states_missed} questions for a state had no answer")),
        (as_float(late_ns) < stopped_s / 2.0 * 1e9, "nobody was stopped".to_owned()),
    ])
}

/// Samples between crafts that arrived, whatever they were for.
pub(super) fn received(record: &LoadRecord) -> u64 {
    let overhead = &record.overhead;
    let besides = overhead.repair.deliveries + overhead.ack.deliveries;
    record.counts.total().deliveries + besides
}

/// Of the run as a whole: its end, and its successors.
fn of_run(soak: &Soak, run: &RunData) -> Vec<String> {
    let stated = if soak.has_faults { KILLS * u64::from(soak.parts()) } else { 0 };
    let lost = run.events.iter().filter(|line| matches!(line.event, Event::CraftLost { .. }));
    let lost = lost.count() as u64;
    let parts = run.loads.len();
    let mut lacks = so([
        (parts as u64 != u64::from(soak.parts()), format!("{parts} of {} parts", soak.parts())),
        (lost != stated, format!("{lost} crafts were lost, {stated} deaths stated")),
        (
            run.outcome() != Some(Outcome::Success),
            format!("the run ended with {:?}", run.outcome()),
        ),
    ]);
    let caught_up = successors(run).filter(|successor| successor.caught_up_ns.is_some()).count();
    if caught_up as u64 != lost {
        lacks.push(format!("{caught_up} successors of {lost} caught up"));
    }
    lacks.extend(run.events.iter().filter_map(|line| match &line.event {
        Event::Discrepancy { what, .. } => Some(what.clone()),
        _ => None,
    }));
    lacks
}

/// How a successor came, ns from when the death was noticed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Successor {
    pub(super) reclaimed_ns: u64,
    pub(super) peers_noticed_ns: Option<u64>,
    pub(super) ready_ns: u64,
    pub(super) rejoined_ns: u64,
    pub(super) caught_up_ns: Option<u64>,
}

/// All successors, in the order in which they came.
pub(super) fn successors(run: &RunData) -> impl Iterator<Item = Successor> {
    run.events.iter().filter_map(|line| match line.event {
        Event::CraftRestarted {
            reclaimed_ns,
            peers_noticed_ns,
            ready_ns,
            rejoined_ns,
            caught_up_ns,
            ..
        } => {
            Some(Successor { reclaimed_ns, peers_noticed_ns, ready_ns, rejoined_ns, caught_up_ns })
        }
        _ => None,
    })
}

#[cfg(test)]
mod tests;
