//! From a played trial to its record: what was counted, beside what the independent replay demands.

use super::backend::Played;
use crate::launch::craft_process::HowEnded;
use crate::outcome::Outcome as RunOutcome;
use crate::results::event::ProcessEnd;
use crate::results::record::{
    Cell, Counts, CraftFacts, Digest, FinalFact, Overhead, ProcessCost, TrialEnd, TrialFacts,
    TrialRecord, TrialTiming,
};
use crate::scenario::NameTable;
use crate::supervision::signals::StopRequest;
use agent::lockstep::Outcome;
use agent::oracle::{Discrepancy, Expected, ExpectedCounts, Observed, Replay, compare};
use rustix::process::Signal;
use shared_types::ids::CraftId;
use shared_types::knowledge::{FleetView, Value};
use shared_types::wire::{EpochSpec, Losses, StrategyKind, TrialReport};
use xxhash_rust::xxh3::Xxh3;

/// What a trial is judged by.
#[derive(Clone, Copy, Debug)]
pub struct Demands<'a> {
    /// The trial without any strategy.
    pub replay: &'a Replay,
    /// What the strategy must send.
    pub expected: &'a Expected,
    /// The networks.
    pub fleet: &'a FleetView<'a>,
    /// What things are called.
    pub names: &'a NameTable,
}

/// Every identity that a played trial breaks. Identities hold for lossless trials only; what was
/// lost is a loss and not a broken identity.
#[must_use]
pub fn judge(demands: &Demands<'_>, spec: &EpochSpec, played: &Played) -> Vec<Discrepancy> {
    let observed = Observed {
        trial: spec.trial,
        turns: played.turns,
        outcome: played.outcome,
        path_digest: played.path_digest,
        reports: &played.reports,
    };
    compare(demands.replay, demands.expected, &observed)
}

/// What all processes lost together.
#[must_use]
pub fn losses(reports: &[TrialReport]) -> Losses {
    let mut losses = Losses::default();
    for report in reports {
        losses += report.counters.losses;
    }
    losses
}

/// The record of a played trial.
#[must_use]
pub fn record(demands: &Demands<'_>, cell: Cell, spec: &EpochSpec, played: &Played) -> TrialRecord {
    let losses = losses(&played.reports);
    // Under `null` the replay says how the trial ended: no delivery can.
    let is_replayed = spec.strategy == StrategyKind::Null;
    let outcome = if is_replayed { demands.replay.outcome } else { played.outcome };
    let end = match outcome {
        _ if losses.is_partial() => TrialEnd::Partial,
        Outcome::Finished => TrialEnd::Finished,
        Outcome::Dropped => TrialEnd::Dropped,
        Outcome::Stalled => TrialEnd::Stalled,
    };
    let mut facts = TrialFacts {
        cell,
        trial: spec.trial,
        end,
        turns: played.turns,
        firings: 0,
        boundary_firings: 0,
        idle_turns: 0,
        final_fact: (outcome == Outcome::Finished).then(|| final_fact(demands)).flatten(),
        expected: Counts::default(),
        measured: Counts::default(),
        expected_hops: 0,
        hops: 0,
        conflicts: 0,
        path_digest: Digest(played.path_digest),
        board_digest: Digest(0),
        replica_digest: Digest(0),
        crafts: Vec::new(),
    };
    let mut timing = TrialTiming {
        epoch: spec.epoch,
        duration_ns: played.clock.duration_ns,
        turn_times_ns: played.clock.turn_times_ns.clone(),
        orchestrator_cpu_ns: played.clock.orchestrator_cpu_ns,
        losses,
        links: played.links,
        ..TrialTiming::default()
    };
    timing.overhead.control += played.clock.control;
    let homes = home_digests(&played.reports);
    for report in &played.reports {
        let expected = demands.expected.processes.get(report.craft as usize);
        add_process(&mut facts, report, expected, demands.names, &homes);
        timing.overhead += Overhead::from(&report.counters.traffic);
        timing.processes.push(ProcessCost {
            craft: report.craft,
            name: demands.names.craft(CraftId(report.craft)).to_owned(),
            cpu_ns: report.cpu_ns,
            resident_bytes: report.resident_bytes,
            reasoning: report.reasoning,
        });
    }
    facts.board_digest = Digest(digest_of(homes.iter().map(|&(_, digest)| digest)));
    let replicas = played.reports.iter().map(|report| report.replica_digest);
    if spec.strategy.keeps_replicas() {
        facts.replica_digest = Digest(digest_of(replicas));
    }
    TrialRecord { deterministic: facts, timing }
}

fn add_process(
    facts: &mut TrialFacts,
    report: &TrialReport,
    expected: Option<&ExpectedCounts>,
    names: &NameTable,
    homes: &[(u32, u64)],
) {
    let counters = &report.counters;
    let measured = Counts::from(&counters.traffic);
    let (expected, expected_hops) = expected.map_or((Counts::default(), 0), |expected| {
        let counts = Counts { replication: expected.replication, reply: expected.reply };
        (counts, expected.hops)
    });
    facts.firings += counters.firings;
    facts.boundary_firings += counters.boundary_firings;
    facts.idle_turns += counters.idle_turns;
    facts.expected += expected;
    facts.measured += measured;
    facts.expected_hops += expected_hops;
    facts.hops += counters.hops;
    facts.conflicts += counters.conflicts;
    let home = homes.iter().find(|&&(craft, _)| craft == report.craft);
    facts.crafts.push(CraftFacts {
        craft: report.craft,
        name: names.craft(CraftId(report.craft)).to_owned(),
        firings: counters.firings,
        boundary_firings: counters.boundary_firings,
        expected,
        measured,
        hops: counters.hops,
        conflicts: counters.conflicts,
        board_digest: Digest(home.map_or(0, |&(_, digest)| digest)),
    });
}

/// Digest of every home board, wherever it lives, by craft.
pub(super) fn home_digests(reports: &[TrialReport]) -> Vec<(u32, u64)> {
    let mut homes: Vec<(u32, u64)> =
        reports.iter().flat_map(|report| report.board_digests.iter().copied()).collect();
    homes.sort_unstable();
    homes
}

/// One digest over `digests`.
pub(super) fn digest_of(digests: impl IntoIterator<Item = u64>) -> u64 {
    let mut hasher = Xxh3::new();
    for digest in digests {
        hasher.update(&digest.to_le_bytes());
    }
    hasher.digest()
}

/// The final fact that ended a finished trial: one newly asserted by a firing of the last turn, else
/// one that holds on a board that declares it. Of several, the first by craft.
fn final_fact(demands: &Demands<'_>) -> Option<FinalFact> {
    let Demands { replay, fleet, names, .. } = demands;
    let turn = replay.turns.checked_sub(1)?;
    let fired = replay.firings.iter().filter(|fired| fired.turn.0 == turn).find_map(|fired| {
        let board = fleet.board(fired.craft);
        let reached = replay.changes(fired).iter().find(|change| {
            change.altered && change.value == Value::Asserted && board.is_final(change.fact)
        });
        reached.map(|change| (fired.craft, change.fact))
    });
    let held = || {
        (0_u32..).map(CraftId).zip(&replay.boards).find_map(|(craft, states)| {
            let finals = fleet.board(craft).finals.iter();
            let mut reached =
                finals.filter(|&&fact| states[fact as usize].value == Value::Asserted);
            reached.next().map(|&fact| (craft, shared_types::ids::FactId(fact)))
        })
    };
    let (craft, fact) = fired.or_else(held)?;
    Some(FinalFact {
        craft: names.craft(craft).to_owned(),
        fact: names.fact(craft, fact).into_owned(),
        turn,
    })
}

/// How a process ended, for the record.
#[must_use]
pub fn process_end(how: HowEnded) -> ProcessEnd {
    match how {
        HowEnded::Exited(code) => ProcessEnd::Exit(code),
        HowEnded::Killed(signal) => ProcessEnd::Signal(signal),
        HowEnded::Silent(silent_ns) => ProcessEnd::Silent(silent_ns),
        HowEnded::Mute(waited_ns) => ProcessEnd::Mute(waited_ns),
    }
}

/// The number of the signal that a request stands for.
#[must_use]
pub fn signal_of(request: StopRequest) -> i32 {
    let signal =
        if request.outcome == RunOutcome::Interrupted { Signal::INT } else { Signal::TERM };
    signal.as_raw()
}

/// Between whom deliveries are missing or too many.
#[must_use]
pub fn suspects(expected: &Expected, reports: &[TrialReport], names: &NameTable) -> Vec<String> {
    let mut suspects = Vec::new();
    for report in reports {
        let receiver = CraftId(report.craft);
        for (sender, &found) in (0_u32..).map(CraftId).zip(&report.counters.deliveries_from) {
            let wanted = expected.deliveries.between(sender, receiver);
            if found != wanted {
                suspects.push(format!(
                    "from {} to {}: {found} deliveries, expected {wanted}",
                    names.craft(sender),
                    names.craft(receiver)
                ));
            }
        }
    }
    suspects
}
