//! Holds the reports of a trial against what the replay demands, and names every difference.

use super::expected::{Expected, ExpectedCounts};
use super::replay::Replay;
use crate::lockstep::Outcome;
use shared_types::ids::CraftId;
use shared_types::wire::{Class, Counters, StrategyKind, TrialReport};

/// What a real or simulated trial showed.
#[derive(Clone, Copy, Debug)]
pub struct Observed<'a> {
    /// Trial of the seed.
    pub trial: u32,
    /// Turns that were played.
    pub turns: u32,
    /// How it ended.
    pub outcome: Outcome,
    /// Digest of what was fired.
    pub path_digest: u64,
    /// One report per process, in any order.
    pub reports: &'a [TrialReport],
}

/// What is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[expect(missing_docs, reason = "the names say it; see `Metric::name`")]
pub enum Metric {
    Turns,
    Outcome,
    PathDigest,
    Reports,
    Requests,
    Transmissions,
    Deliveries,
    BytesSent,
    BytesReceived,
    Replies,
    ReplyTransmissions,
    ReplyDeliveries,
    ReplyBytesSent,
    ReplyBytesReceived,
    DeliveriesFromSender,
    Hops,
    Conflicts,
    Firings,
    BoundaryFirings,
    IdleTurns,
    BoardDigest,
    BoardReports,
    ReplicaDigest,
    Applications,
    FactsUnlikeTrace,
    FactsUnlikeSharers,
    Knowledge,
}

impl Metric {
    /// What the metric is called in messages.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Turns => "turns",
            Self::Outcome => "outcome (0 finished, 1 dropped, 2 stalled)",
            Self::PathDigest => "path digest",
            Self::Reports => "reports",
            Self::Requests => "requests",
            Self::Transmissions => "transmissions",
            Self::Deliveries => "deliveries",
            Self::BytesSent => "bytes sent",
            Self::BytesReceived => "bytes received",
            Self::Replies => "replies",
            Self::ReplyTransmissions => "transmissions of replies",
            Self::ReplyDeliveries => "deliveries of replies",
            Self::ReplyBytesSent => "bytes of replies sent",
            Self::ReplyBytesReceived => "bytes of replies received",
            Self::DeliveriesFromSender => "deliveries",
            Self::Hops => "hops",
            Self::Conflicts => "conflicts",
            Self::Firings => "firings",
            Self::BoundaryFirings => "boundary firings",
            Self::IdleTurns => "idle turns",
            Self::BoardDigest => "board digest",
            Self::BoardReports => "reports of the board's digest",
            Self::ReplicaDigest => "replica digest",
            Self::Applications => "changes applied",
            Self::FactsUnlikeTrace => "facts that are not as the trace left them",
            Self::FactsUnlikeSharers => "shared facts that differ",
            Self::Knowledge => "changes whose time to knowledge was counted",
        }
    }

    /// Whether it compares digests, of the path or of boards.
    #[must_use]
    pub const fn is_digest(self) -> bool {
        matches!(self, Self::PathDigest | Self::BoardDigest | Self::ReplicaDigest)
    }
}

/// One broken identity.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Discrepancy {
    /// Under which strategy.
    pub strategy: StrategyKind,
    /// In which trial.
    pub trial: u32,
    /// Who counted: the sending craft, or the receiver of a pair; `None` if it concerns all.
    pub craft: Option<CraftId>,
    /// The sender, where deliveries of a pair are compared.
    pub sender: Option<CraftId>,
    /// What.
    pub metric: Metric,
    /// By the replay.
    pub expected: u64,
    /// By the reports.
    pub found: u64,
}

impl std::fmt::Display for Discrepancy {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "strategy {}, trial {}", self.strategy, self.trial)?;
        match (self.sender, self.craft) {
            (Some(sender), Some(craft)) => write!(formatter, ", from {sender} to {craft}")?,
            (_, Some(craft)) => write!(formatter, ", craft {craft}")?,
            _ => {}
        }
        let name = self.metric.name();
        if self.metric.is_digest() {
            write!(formatter, ": {name} {:016x}, expected {:016x}", self.found, self.expected)
        } else {
            write!(formatter, ": {name} {}, expected {}", self.found, self.expected)
        }
    }
}

/// Every difference between `observed` and what `replay` and `expected` demand; empty if there is
/// none. Holds for lossless trials only.
#[must_use]
pub fn compare(replay: &Replay, expected: &Expected, observed: &Observed<'_>) -> Vec<Discrepancy> {
    let mut comparison =
        Comparison { strategy: expected.strategy, trial: observed.trial, found: Vec::new() };
    comparison.check_trial(replay, observed);
    let board_digests = replay.board_digests();
    let mut board_reports = vec![0_u64; board_digests.len()];
    for craft in (0..expected.processes.len()).map(CraftId::from_index) {
        let mut reports = observed.reports.iter().filter(|report| report.craft == craft.0);
        let Some(report) = reports.next() else {
            comparison.check(Some(craft), Metric::Reports, 1, 0);
            continue;
        };
        comparison.check(Some(craft), Metric::Reports, 1, 1 + reports.count() as u64);
        comparison.check_counters(craft, &expected.processes[craft.index()], &report.counters);
        comparison.check_senders(craft, expected, &report.counters);
        comparison.check(
            Some(craft),
            Metric::ReplicaDigest,
            expected.replica_digest(craft),
            report.replica_digest,
        );
        for &(home, digest) in &report.board_digests {
            if let Some(&wanted) = board_digests.get(home as usize) {
                board_reports[home as usize] += 1;
                comparison.check_board(CraftId(home), wanted, digest);
            }
        }
    }
    if expected.strategy != StrategyKind::Null {
        for (home, &reports) in board_reports.iter().enumerate() {
            comparison.check(Some(CraftId::from_index(home)), Metric::BoardReports, 1, reports);
        }
    }
    comparison.found
}

pub(super) struct Comparison {
    pub(super) strategy: StrategyKind,
    pub(super) trial: u32,
    pub(super) found: Vec<Discrepancy>,
}

impl Comparison {
    fn check_trial(&mut self, replay: &Replay, observed: &Observed<'_>) {
        self.check(None, Metric::Turns, u64::from(replay.turns), u64::from(observed.turns));
        // Under `null` no delivery can end a trial, so the run is told how many turns to play.
        if self.strategy != StrategyKind::Null {
            self.check(None, Metric::Outcome, code(replay.outcome), code(observed.outcome));
        }
        self.check(None, Metric::PathDigest, replay.path_digest(), observed.path_digest);
    }

    fn check_counters(&mut self, craft: CraftId, expected: &ExpectedCounts, found: &Counters) {
        let replication = &found.traffic[Class::Replication as usize];
        let reply = &found.traffic[Class::Reply as usize];
        let wanted = &expected.replication;
        let answered = &expected.reply;
        let rows = [
            (Metric::Requests, wanted.requests, replication.requests),
            (Metric::Transmissions, wanted.transmissions, replication.transmissions),
            (Metric::Deliveries, wanted.deliveries, replication.deliveries),
            (Metric::BytesSent, wanted.bytes_sent, replication.bytes_sent),
            (Metric::BytesReceived, wanted.bytes_received, replication.bytes_received),
            (Metric::Replies, answered.requests, reply.requests),
            (Metric::ReplyTransmissions, answered.transmissions, reply.transmissions),
            (Metric::ReplyDeliveries, answered.deliveries, reply.deliveries),
            (Metric::ReplyBytesSent, answered.bytes_sent, reply.bytes_sent),
            (Metric::ReplyBytesReceived, answered.bytes_received, reply.bytes_received),
            (Metric::Hops, expected.hops, found.hops),
            (Metric::Conflicts, expected.conflicts, found.conflicts),
            (Metric::Firings, expected.firings, found.firings),
            (Metric::IdleTurns, expected.idle_turns, found.idle_turns),
        ];
        for (metric, expected, found) in rows {
            self.check(Some(craft), metric, expected, found);
        }
        // Under `null` nothing is merged, so what alters a value there may not alter it elsewhere.
        if self.strategy != StrategyKind::Null {
            let (wanted, found) = (expected.boundary_firings, found.boundary_firings);
            self.check(Some(craft), Metric::BoundaryFirings, wanted, found);
        }
    }

    fn check_senders(&mut self, receiver: CraftId, expected: &Expected, found: &Counters) {
        let senders = expected.processes.len().max(found.deliveries_from.len());
        for sender in (0..senders).map(CraftId::from_index) {
            let wanted = expected.deliveries.between(sender, receiver);
            let counted = found.deliveries_from.get(sender.index()).copied().unwrap_or(0);
            self.check_pair(sender, receiver, Metric::DeliveriesFromSender, wanted, counted);
        }
    }

    fn check_board(&mut self, home: CraftId, expected: u64, found: u64) {
        if self.strategy != StrategyKind::Null {
            self.check(Some(home), Metric::BoardDigest, expected, found);
        }
    }

    pub(super) fn check_pair(
        &mut self,
        sender: CraftId,
        receiver: CraftId,
        metric: Metric,
        expected: u64,
        found: u64,
    ) {
        if expected != found {
            self.found.push(Discrepancy {
                strategy: self.strategy,
                trial: self.trial,
                craft: Some(receiver),
                sender: Some(sender),
                metric,
                expected,
                found,
            });
        }
    }

    pub(super) fn check(
        &mut self,
        craft: Option<CraftId>,
        metric: Metric,
        expected: u64,
        found: u64,
    ) {
        if expected != found {
            self.found.push(Discrepancy {
                strategy: self.strategy,
                trial: self.trial,
                craft,
                sender: None,
                metric,
                expected,
                found,
            });
        }
    }
}

const fn code(outcome: Outcome) -> u64 {
    match outcome {
        Outcome::Finished => 0,
        Outcome::Dropped => 1,
        Outcome::Stalled => 2,
    }
}
