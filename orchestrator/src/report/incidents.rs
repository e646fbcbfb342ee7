//! What a reader must know before believing a table: losses, broken identities, missing files.

use super::table::{Colour, wrap};
use crate::outcome::Outcome;
use crate::results::event::{Event, Relief};
use crate::results::record::TrialFacts;
use crate::results::summary::Summary;
use shared_types::wire::Losses;

/// Lines of one kind that are printed before the rest is only counted.
const LINES_MAX: usize = 5;

/// Sentences about everything out of the ordinary; empty for a clean run.
pub(super) fn incidents(summary: &Summary, all: bool, colour: Colour) -> String {
    let limit = if all { usize::MAX } else { LINES_MAX };
    let mut text = String::new();
    let told: Vec<String> =
        summary.timing.incidents.iter().filter_map(|line| sentence(&line.event)).collect();
    list(&mut text, &told, limit);
    // A discrepancy that the run loop reported as an event is not said twice.
    let is_told =
        summary.timing.incidents.iter().any(|line| matches!(line.event, Event::Discrepancy { .. }));
    if !is_told {
        list(&mut text, &discrepancies(summary), limit);
    }
    list(&mut text, &unsteady(summary), limit);
    let losses = losses(summary);
    if losses.is_partial() {
        text += &wrap("! ", &format!("lost or refused: {}", loss_text(&losses)));
    }
    for missing in &summary.timing.missing {
        text += &wrap("! ", &format!("{}: {}", missing.file, missing.what));
    }
    if let Some(outcome) = summary.timing.outcome.filter(|&outcome| outcome != Outcome::Success) {
        text += &wrap("! ", &format!("exit code {}: {}", outcome.code(), outcome.sentence()));
    }
    if text.is_empty() { text } else { paint(&text, colour) }
}

fn paint(text: &str, colour: Colour) -> String {
    text.lines().map(|line| colour.alarm(line) + "\n").collect()
}

fn list(text: &mut String, lines: &[String], limit: usize) {
    for line in lines.iter().take(limit) {
        *text += &wrap("! ", line);
    }
    if lines.len() > limit {
        *text += &wrap("! ", &format!("... and {} more: see `--all`", lines.len() - limit));
    }
}

fn sentence(event: &Event) -> Option<String> {
    match event {
        Event::CraftLost { size, name, end, phase } => {
            Some(format!("craft `{name}` of the fleet of {size} was lost ({end}) in {phase}"))
        }
        Event::CraftSilent { size, name, silent_ns, helped, swept, .. } => {
            let seconds = *silent_ns as f64 / 1e9;
            let end = match helped {
                Relief::Kill => "and was killed".to_owned(),
                Relief::Sweep => format!("and went on after a sweep of {swept} unfinished files"),
            };
            Some(format!(
                "craft `{name}` of the fleet of {size} gave no heartbeat for {seconds:.1} s {end}"
            ))
        }
        Event::CraftMute { size, name, answer, waited_ns, standing, .. } => {
            let seconds = *waited_ns as f64 / 1e9;
            Some(format!(
                "craft `{name}` of the fleet of {size} gave no answer ({answer}) for {seconds:.1} s and was \
                 killed ({standing})"
            ))
        }
        Event::CraftRestarted { size, name, rejoined_ns, caught_up_ns, .. } => {
            let ms = |ns: u64| ns as f64 / 1e6;
            let caught_up = caught_up_ns.map_or_else(String::new, |caught_up_ns| {
                format!(" and had caught up after {:.0} ms", ms(caught_up_ns))
            });
            let after = ms(*rejoined_ns);
            Some(format!(
                "craft `{name}` of the fleet of {size} lived again after {after:.0} ms{caught_up}"
            ))
        }
        Event::Discrepancy { cell, trial, what } => {
            Some(format!("{} crafts, {}, trial {trial}: {what}", cell.size, cell.strategy))
        }
        Event::Interrupted { signal } => Some(format!("signal {signal} asked the run to end")),
        Event::Note { what } => Some(what.clone()),
        Event::Resumed { fleets } => {
            Some(format!("the run was cut off and resumed after {fleets} complete fleets"))
        }
        Event::FleetStarted { .. }
        | Event::FleetReady { .. }
        | Event::FleetDone { .. }
        | Event::HostChecked { .. }
        | Event::BaselineMeasured { .. }
        | Event::EpochDone { .. }
        | Event::Ended { .. } => None,
    }
}

/// Where counts are not those of the independent replay.
fn discrepancies(summary: &Summary) -> Vec<String> {
    let broken = summary
        .deterministic
        .trials
        .iter()
        .filter(|facts| facts.end != crate::results::record::TrialEnd::Partial)
        .filter(|facts| !facts.agrees_with_oracle());
    broken.map(discrepancy).collect()
}

fn discrepancy(facts: &TrialFacts) -> String {
    let crafts = facts
        .crafts
        .iter()
        .filter(|craft| craft.measured != craft.expected)
        .map(|craft| craft.name.as_str())
        .collect::<Vec<_>>();
    let (measured, expected) = (facts.measured.total(), facts.expected.total());
    format!(
        "{} crafts, {}, trial {}: measured and expected: requests {} and {}, transmissions {} and \
         {}, deliveries {} and {}, bytes {} and {}, hops {} and {}; crafts that differ: {}",
        facts.cell.size,
        facts.cell.strategy,
        facts.trial,
        measured.requests,
        expected.requests,
        measured.transmissions,
        expected.transmissions,
        measured.deliveries,
        expected.deliveries,
        measured.bytes_sent,
        expected.bytes_sent,
        facts.hops,
        facts.expected_hops,
        if crafts.is_empty() { "none".to_owned() } else { crafts.join(", ") },
    )
}

fn unsteady(summary: &Summary) -> Vec<String> {
    let cells = summary.timing.cells.iter().filter(|cell| cell.is_stationary == Some(false));
    cells
        .map(|cell| {
            let ratio = cell.figures.value("second-half-ratio").unwrap_or(f64::NAN);
            format!(
                "{} crafts, {}: turn times not stationary (second half {ratio:.2} times the first)",
                cell.size, cell.strategy
            )
        })
        .collect()
}

/// Losses of all trials and timing cells together.
pub(super) fn losses(summary: &Summary) -> Losses {
    let trials = summary.timing.trials.iter().map(|trial| trial.timing.losses);
    let cells = summary.timing.records.iter().map(|record| record.losses);
    trials.chain(cells).fold(Losses::default(), |mut sum, one| {
        sum += one;
        sum
    })
}

/// What is not zero of `losses`, in words.
pub(super) fn loss_text(losses: &Losses) -> String {
    let Losses {
        late,
        refused,
        old_incarnation,
        gaps,
        repeats,
        full_inboxes,
        full_outboxes,
        missed_multicasts,
        links,
    } = *losses;
    let parts: Vec<String> = [
        (late, "late"),
        (refused, "refused"),
        (old_incarnation, "of an older life"),
        (gaps, "missing"),
        (repeats, "repeated"),
        (full_inboxes, "held back by a full inbox"),
        (full_outboxes, "dropped by a full outbox"),
        (missed_multicasts, "multicasts repaired by unicast"),
        (links.lost, "lost on links and made up for"),
        (links.cut_off, "cut off and made up for"),
        (links.doubled, "doubled on links"),
        (links.delayed, "held up on links"),
        (links.overtaken, "overtaken on links"),
    ]
    .into_iter()
    .filter(|&(count, _)| count > 0)
    .map(|(count, what)| format!("{count} {what}"))
    .collect();
    if parts.is_empty() { "nothing".to_owned() } else { parts.join(", ") }
}
