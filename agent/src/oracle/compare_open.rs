//! Holds the reports of an interval of open mode against what its trace alone demands.
//!
//! A craft plays a prefix of its part of the trace and says how long it is; the demands are those of
//! the prefixes. Counts are exact once the fleet is quiet; before that, and where only alterations are
//! sent, no count may exceed its demand. When quiet, a fact whose writes all come from one craft is
//! known from the trace, and where every link leads back all boards that share a fact agree on it. Of a
//! central strategy the conversation is held against itself: each request has one reply.

use super::compare::{Comparison, Discrepancy, Metric};
use super::held::{Held, differences_between_sharers};
use super::open::ExpectedOpen;
use shared_types::ids::CraftId;
use shared_types::knowledge::FleetView;
use shared_types::trace::TraceRecord;
use shared_types::wire::{
    Class, EpochSpec, HEADER_BYTES, OpenReport, StrategyKind, Traffic, TrialReport,
};

/// What a real or simulated interval showed.
#[derive(Clone, Copy, Debug)]
pub struct ObservedOpen<'a> {
    /// One report per process, in any order.
    pub reports: &'a [TrialReport],
    /// Whether nothing was under way any more when they were made.
    pub is_quiet: bool,
}

/// Every difference between `observed` and what the trace of `fleet` demands of `spec`; empty if there
/// is none. Holds for lossless intervals only.
#[must_use]
pub fn compare_open(
    spec: &EpochSpec,
    fleet: &FleetView<'_>,
    observed: &ObservedOpen<'_>,
) -> Vec<Discrepancy> {
    let comparison = Comparison { strategy: spec.strategy, trial: spec.trial, found: Vec::new() };
    let mut open = OpenComparison { spec, fleet, observed, comparison };
    open.compare();
    open.comparison.found
}

struct OpenComparison<'a> {
    spec: &'a EpochSpec,
    fleet: &'a FleetView<'a>,
    observed: &'a ObservedOpen<'a>,
    comparison: Comparison,
}

impl OpenComparison<'_> {
    fn compare(&mut self) {
        let processes = self.fleet.craft_count() + u32::from(self.spec.strategy.has_centre());
        for craft in (0..processes).map(CraftId) {
            let reports = self.observed.reports.iter().filter(|report| report.craft == craft.0);
            let with_open = reports.filter(|report| report.open.is_some()).count() as u64;
            self.comparison.check(Some(craft), Metric::Reports, 1, with_open);
        }
        if !self.comparison.found.is_empty() {
            return;
        }
        let played: Vec<&[TraceRecord]> = (0..self.fleet.craft_count())
            .map(CraftId)
            .map(|craft| {
                let (trace, played) = (self.fleet.trace_of(craft), self.open(craft).records_played);
                &trace[..usize::try_from(played).unwrap_or(usize::MAX).min(trace.len())]
            })
            .collect();
        let expected = ExpectedOpen::of(self.spec, self.fleet, &played);
        for craft in (0..self.fleet.craft_count()).map(CraftId) {
            self.check_craft(craft, &expected);
        }
        if self.spec.strategy.has_centre() {
            self.check_conversations();
        }
        if self.observed.is_quiet && !self.spec.sends_altered_only {
            self.check_boards(&played);
        }
    }

    /// The report of `craft`; all are there once [`Self::compare`] has looked.
    fn report(&self, craft: CraftId) -> &TrialReport {
        let mut reports = self.observed.reports.iter();
        reports.find(|report| report.craft == craft.0).expect("invariant: every process reported")
    }

    fn open(&self, craft: CraftId) -> &OpenReport {
        self.report(craft).open.as_ref().expect("invariant: every process reported")
    }

    fn check_craft(&mut self, craft: CraftId, expected: &ExpectedOpen) {
        let index = craft.index();
        let counters = self.report(craft).counters.clone();
        let open = self.open(craft).clone();
        self.comparison.check(
            Some(craft),
            Metric::Firings,
            expected.writes[index],
            counters.firings,
        );
        let (wanted, found) = (expected.boundary_writes[index], counters.boundary_firings);
        self.bounded(craft, Metric::BoundaryFirings, wanted, found);
        if !self.spec.strategy.has_centre() {
            let traffic = &counters.traffic[Class::Replication as usize];
            let bytes = |samples, records| {
                samples * HEADER_BYTES as u64 + records * u64::from(self.spec.record_bytes)
            };
            let (requests, samples) = (expected.requests[index], expected.transmissions[index]);
            let sent = bytes(samples, requests);
            let crafts = (0..self.fleet.craft_count()).map(CraftId);
            let deliveries: u64 =
                crafts.map(|sender| expected.deliveries.between(sender, craft)).sum();
            let received = bytes(deliveries, expected.received_records[index]);
            self.bounded(craft, Metric::Requests, requests, traffic.requests);
            self.bounded(craft, Metric::Transmissions, samples, traffic.transmissions);
            self.bounded(craft, Metric::BytesSent, sent, traffic.bytes_sent);
            self.bounded(craft, Metric::Deliveries, deliveries, traffic.deliveries);
            self.bounded(craft, Metric::BytesReceived, received, traffic.bytes_received);
        }
        for sender in (0..self.fleet.craft_count()).map(CraftId) {
            if !self.spec.strategy.has_centre() {
                let wanted = expected.deliveries.between(sender, craft);
                let found = counters.deliveries_from.get(sender.index()).copied().unwrap_or(0);
                self.bounded_pair(sender, craft, Metric::DeliveriesFromSender, wanted, found);
            }
            let wanted = expected.applied.between(sender, craft);
            let found = open.applied_from.get(sender.index()).copied().unwrap_or(0);
            self.bounded_pair(sender, craft, Metric::Applications, wanted, found);
        }
        let applied = open.applied_from.iter().copied().fold(0, u64::saturating_add);
        let known = open.applied_by_end + open.applied_after_end;
        self.comparison.check(Some(craft), Metric::Knowledge, applied, known);
    }

    /// Each request of a client of the centre has arrived and has one reply, which has arrived.
    fn check_conversations(&mut self) {
        if !self.observed.is_quiet {
            return;
        }
        let centre = CraftId(self.fleet.craft_count());
        let traffic = |report: &TrialReport, class: Class| -> Traffic {
            report.counters.traffic[class as usize]
        };
        let mut asked = 0;
        for craft in (0..centre.0).map(CraftId) {
            let (client, at_centre) = (self.report(craft), self.report(centre));
            let requests = traffic(client, Class::Replication).transmissions;
            let from = |report: &TrialReport, sender: CraftId| {
                report.counters.deliveries_from.get(sender.index()).copied().unwrap_or(0)
            };
            let (arrived, replies) = (from(at_centre, craft), from(client, centre));
            asked += requests;
            let delivered = Metric::DeliveriesFromSender;
            self.comparison.check_pair(craft, centre, delivered, requests, arrived);
            self.comparison.check_pair(centre, craft, delivered, requests, replies);
        }
        let replied = traffic(self.report(centre), Class::Reply).transmissions;
        self.comparison.check(Some(centre), Metric::Replies, asked, replied);
    }

    /// What the boards hold, and under a central strategy that a craft knows what the centre holds.
    fn check_boards(&mut self, played: &[&[TraceRecord]]) {
        let is_replicated = self.spec.strategy != StrategyKind::Null;
        let held = Held::of_trace(self.fleet, played, is_replicated);
        let boards: Vec<_> = (0..self.fleet.craft_count())
            .map(CraftId)
            .map(|craft| Held::states(self.fleet.board(craft), &self.open(craft).held))
            .collect();
        for (craft, states) in (0..).map(CraftId).zip(&boards) {
            let differing = held.differences(craft, states);
            self.comparison.check(Some(craft), Metric::FactsUnlikeTrace, 0, differing);
        }
        if is_replicated {
            for ((sender, craft), facts) in differences_between_sharers(self.fleet, &boards) {
                self.comparison.check_pair(sender, craft, Metric::FactsUnlikeSharers, 0, facts);
            }
        }
        if self.spec.strategy.has_centre() {
            let centre = self.report(CraftId(self.fleet.craft_count())).board_digests.clone();
            for (craft, states) in (0..).map(CraftId).zip(&boards) {
                let own = super::board_digest(states);
                let at_centre = centre.iter().find(|&&(home, _)| home == craft.0);
                let found = at_centre.map_or(0, |&(_, digest)| digest);
                self.comparison.check(Some(craft), Metric::BoardDigest, own, found);
            }
        }
    }

    /// Equal when the fleet is quiet and everything was sent, else at most.
    fn bounded(&mut self, craft: CraftId, metric: Metric, expected: u64, found: u64) {
        if self.is_exact() || found > expected {
            self.comparison.check(Some(craft), metric, expected, found);
        }
    }

    fn bounded_pair(
        &mut self,
        sender: CraftId,
        craft: CraftId,
        metric: Metric,
        expected: u64,
        found: u64,
    ) {
        if self.is_exact() || found > expected {
            self.comparison.check_pair(sender, craft, metric, expected, found);
        }
    }

    const fn is_exact(&self) -> bool {
        self.observed.is_quiet && !self.spec.sends_altered_only
    }
}
