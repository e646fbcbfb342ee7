//! What a [`Craft`] does to repair losses and to catch up, whatever its role.
//!
//! Roles know what a board holds and what another one needs; [`Recovery`] knows when to ask and whom.

use super::open_client::newer_than;
use super::outbox::{Outbox, header};
use super::recovery::{Question, Recovery};
use super::{Craft, Role};
use shared_types::ids::{CraftId, FactId, Turn};
use shared_types::knowledge::{Change, FleetView};
use shared_types::limits::{INBOX_PAYLOAD_BYTES, LIVES_MAX, VERSIONS_PER_LIFE};
use shared_types::time::Nanos;
use shared_types::trace::TraceRecord;
use shared_types::transport::{Destination, Peers};
use shared_types::wire::{
    Class, Counters, DELTA_BYTES, DeltaReader, EpochSpec, Header, INTENDED_BYTES, Kind,
    MembershipChange, Refusal,
};
use std::ops::Range;

/// Hop count of a centre's question: news waits for its client, which is to ask for it.
const CALLS: u16 = 1;

impl Craft {
    /// The same process in its life `incarnation`.
    ///
    /// # Panics
    /// If the fleet had more lives than versions allow for.
    #[must_use]
    pub fn with_life(mut self, incarnation: u32) -> Self {
        self.begin_life(incarnation);
        self
    }

    /// Begins the life `incarnation`: nothing of an earlier one is known.
    ///
    /// # Panics
    /// As [`Self::with_life`].
    pub fn begin_life(&mut self, incarnation: u32) {
        assert!(incarnation <= LIVES_MAX, "invariant: lives are counted and bounded");
        self.life = incarnation;
        self.epoch = u32::MAX;
        self.counts_from = if incarnation > 0 { u32::MAX } else { 0 };
        self.role = Role::Absent;
        self.recovery = None;
    }

    /// Sets up repair for an epoch that wants it.
    pub(super) fn begin_recovery(&mut self, spec: &EpochSpec, fleet: &FleetView<'_>) {
        if spec.recovery.is_none() {
            self.recovery = None;
            return;
        }
        let own = self.craft;
        let recovery = self.recovery.get_or_insert_with(|| Box::new(Recovery::new(own)));
        recovery.begin_epoch(spec, self.life, fleet.craft_count());
        // Versions that no earlier life has given out.
        let floor = self.life.saturating_mul(VERSIONS_PER_LIFE);
        match &mut self.role {
            Role::Open(craft) => craft.begin_recovery(floor, fleet),
            Role::OpenClient(client) => client.begin_recovery(floor, fleet),
            Role::OpenCentre(centre) => centre.begin_recovery(self.life > 0, fleet),
            _ => {}
        }
    }

    /// As [`Self::go`], for a process that comes to an interval already begun, at `now`: what was due
    /// before is skipped and counted, and nothing is played until the process has caught up.
    pub fn join(&mut self, now: Nanos, started: Nanos, trace: &[TraceRecord]) {
        self.go(started, trace);
        match &mut self.role {
            Role::Open(craft) => craft.schedule_mut().skip_until(now, trace),
            Role::OpenClient(client) => client.join(now, trace),
            _ => {}
        }
        self.arrive(now);
        if let Some(recovery) = &mut self.recovery {
            recovery.join(now);
        }
    }

    /// Whether the process knows what the fleet knew before its life began, or has given up asking.
    /// Always so in a first life.
    #[must_use]
    pub fn is_caught_up(&self) -> bool {
        self.recovery.as_ref().is_none_or(|recovery| !recovery.is_catching_up())
    }

    /// Process `change.craft` is gone, or lives again, as the orchestrator saw it at `now`.
    pub fn member_changed(&mut self, now: Nanos, change: &MembershipChange, fleet: &FleetView<'_>) {
        let Some(recovery) = &mut self.recovery else { return };
        recovery.look(now);
        let craft = CraftId(change.craft);
        let is_news = if change.is_up == 0 {
            recovery.down(craft, change.incarnation)
        } else {
            recovery.up(craft, change.incarnation)
        };
        if is_news {
            self.take_member(craft, change.is_up == 0, fleet);
        }
    }

    /// What follows for the role from a change of the fleet.
    pub(super) fn take_member(&mut self, craft: CraftId, is_gone: bool, fleet: &FleetView<'_>) {
        let Some(recovery) = &mut self.recovery else { return };
        match &mut self.role {
            Role::Open(open) => open.reroute(craft, is_gone, fleet),
            Role::OpenClient(client) if craft.0 == fleet.craft_count() && !is_gone => {
                client.begin_again(self.arrived);
            }
            Role::OpenCentre(centre) => centre.member_changed(craft, is_gone),
            _ => {}
        }
        // What was under way through or from it may be lost without a gap at anybody.
        recovery.ask_in_a_while();
        self.tell_centre();
    }

    /// Ports beyond those of the strategy: receipts and states go straight to whom they concern.
    pub(super) fn add_recovery_peers(&self, peers: &mut Peers) {
        let Some(recovery) = &self.recovery else { return };
        peers.unicast.extend(recovery.others());
        peers.unicast.sort_unstable();
        peers.unicast.dedup();
    }

    /// What the process counted, recovery included.
    #[must_use]
    pub fn counters(&self) -> Counters {
        let mut counters = self.counting.counters.clone();
        if let Some(recovery) = &self.recovery {
            counters.recovered += recovery.counted();
        }
        counters
    }

    /// When recovery has something to do without a message.
    #[must_use]
    pub fn next_recovery(&self) -> Option<Nanos> {
        self.recovery.as_ref().and_then(|recovery| recovery.next_due())
    }

    /// Asks what is due to be asked at `now`; says whether anything was due. What does not need a
    /// board is done when the step is dispatched.
    pub fn tend(&mut self, now: Nanos, fleet: &FleetView<'_>, out: &mut Outbox) -> bool {
        self.resume_conversations(fleet);
        let Some(recovery) = &mut self.recovery else { return false };
        if recovery.next_due().is_none_or(|due| due > now) {
            return false;
        }
        let mut questions = std::mem::take(&mut self.questions);
        let is_idle = recovery.questions(now, &mut questions);
        if let Role::OpenClient(client) = &mut self.role
            && is_idle
        {
            // Whatever became of the answer, it does not come any more.
            client.stop_waiting(now);
        }
        for question in questions.drain(..) {
            self.ask_state(question, fleet, out);
        }
        self.questions = questions;
        // A question may have been given up.
        self.tell_centre();
        true
    }

    /// Takes a sample of recovery itself. [`Self::receive`] has looked at its epoch.
    pub(super) fn take_recovery(
        &mut self,
        kind: Kind,
        header: &Header,
        payload: &[u8],
        fleet: &FleetView<'_>,
        out: &mut Outbox,
    ) -> Result<(), Refusal> {
        let Some(recovery) = &mut self.recovery else { return Err(Refusal::Kind) };
        if kind == Kind::Receipt {
            return recovery.take_receipt(header, payload);
        }
        self.read_changes(header, payload, fleet, kind == Kind::Digest)?;
        if kind == Kind::Digest {
            return self.tell_state(header, fleet, out);
        }
        let changes = std::mem::take(&mut self.received);
        let from = CraftId(header.source);
        let learnt = match &mut self.role {
            Role::Open(craft) => craft.learn(&changes, fleet),
            Role::OpenClient(client) => client.learn(&changes, fleet),
            Role::OpenCentre(centre) => centre.learn(from, &changes, fleet),
            _ => 0,
        };
        self.received = changes;
        let Some(recovery) = &mut self.recovery else { return Ok(()) };
        recovery.counted_mut().learnt += learnt;
        let next = recovery.take_state(header);
        if let Some(question) = next {
            self.ask_state(question, fleet, out);
        } else {
            self.tell_centre();
        }
        Ok(())
    }

    /// Calls clients back that a centre dismissed before it knew everything.
    pub(super) fn call_back(&mut self) {
        if let (Role::OpenCentre(centre), Some(recovery)) = (&self.role, &mut self.recovery) {
            for client in centre.dismissed_too_early() {
                let _is_new = recovery.ask_from(client, self.arrived);
            }
        }
    }

    /// Tells a centre whether it has caught up.
    fn tell_centre(&mut self) {
        let is_caught_up = self.is_caught_up();
        if let Role::OpenCentre(centre) = &mut self.role {
            centre.is_caught_up = is_caught_up;
        }
    }

    /// The epoch ends before it is over: somebody died. What of it is still under way is no loss.
    pub fn abandon_epoch(&mut self) {
        self.counts_from = self.epoch.saturating_add(1);
    }

    /// Counts a sample of `epoch`, which is not the present one. A repeat or a receipt that comes so late
    /// was not needed any more, nor is anything of an epoch that was given up.
    pub(super) fn count_late(&mut self, class: Class, epoch: u32) {
        let counters = &mut self.counting.counters;
        if matches!(class, Class::Repair | Class::Ack) || epoch < self.counts_from {
            counters.recovered.stale += 1;
        } else {
            counters.losses.late += 1;
        }
    }

    /// Reads the records of a sample: changes in their writers' ids or, of a digest, in this board's.
    pub(super) fn read_changes<'a>(
        &mut self,
        header: &Header,
        payload: &'a [u8],
        fleet: &FleetView<'_>,
        is_digest: bool,
    ) -> Result<DeltaReader<'a>, Refusal> {
        let reader = DeltaReader::new(payload, header.record_count).ok_or(Refusal::Length)?;
        self.received.clear();
        for change in reader.changes() {
            let change = change.ok_or(Refusal::Record)?;
            let writer = fleet.boards.get(change.version.writer.index()).ok_or(Refusal::Record)?;
            if !is_digest && change.fact.0 >= writer.fact_count {
                return Err(Refusal::Record);
            }
            self.received.push(change);
        }
        Ok(reader)
    }

    /// Starts a conversation again whose sample was given up.
    pub(super) fn resume_conversations(&mut self, fleet: &FleetView<'_>) {
        let Some(recovery) = &mut self.recovery else { return };
        while let Some(craft) = recovery.take_given_up() {
            if let Role::OpenClient(client) = &mut self.role
                && craft.0 == fleet.craft_count()
            {
                client.begin_again(self.arrived);
            }
        }
    }

    /// Facts that one question is about: their versions, and what is told of them, fit a sample.
    fn facts_per_question(&self) -> u32 {
        let record_bytes = self.counting.record_bytes.max(DELTA_BYTES) + INTENDED_BYTES;
        CraftId::from_index((INBOX_PAYLOAD_BYTES / record_bytes / 3).max(1)).0
    }

    fn ask_state(&mut self, question: Question, fleet: &FleetView<'_>, out: &mut Outbox) {
        let facts =
            question.first_fact..question.first_fact.saturating_add(self.facts_per_question());
        let mut header = header(Class::Ack, Kind::Digest, self.craft, self.epoch, Turn(facts.end));
        (header.argument, header.firing_number) = (question.number, facts.start);
        let start = out.changes.len();
        header.hop_count = match &self.role {
            Role::OpenCentre(centre) if centre.has_news_for(question.to) => CALLS,
            _ => 0,
        };
        match &self.role {
            Role::Open(craft) => craft.digest(question.to, facts, fleet, &mut out.changes),
            Role::OpenClient(client) => client.digest(facts, &mut out.changes),
            Role::OpenCentre(centre) => centre.digest(question.to, facts, &mut out.changes),
            _ => return,
        }
        self.put_state(question.to, header, start, out);
    }

    fn tell_state(
        &mut self,
        asked: &Header,
        fleet: &FleetView<'_>,
        out: &mut Outbox,
    ) -> Result<(), Refusal> {
        let asker = CraftId(asked.source);
        let facts = asked.firing_number..asked.turn;
        let is_served = match &self.role {
            Role::Open(_) | Role::OpenCentre(_) => asker.0 < fleet.craft_count(),
            _ => asker.0 == fleet.craft_count(),
        };
        if !is_served || facts.len() > self.facts_per_question() as usize {
            return Err(Refusal::Record);
        }
        let mut header =
            header(Class::Repair, Kind::State, self.craft, self.epoch, Turn(facts.end));
        (header.argument, header.firing_number) = (asked.argument, facts.start);
        let (start, end, known) = (out.changes.len(), facts.end, &self.received[..]);
        let most = |own: Option<u32>| {
            let of_asker = fleet.boards.get(asker.index()).map_or(0, |board| board.fact_count);
            own.unwrap_or(0).max(of_asker)
        };
        let own = fleet.boards.get(self.craft.index()).map(|board| board.fact_count);
        let newer = match &mut self.role {
            Role::Open(craft) => craft.newer_at(asker, known, fleet),
            Role::OpenClient(client) => {
                client.stop_waiting(self.arrived);
                if asked.hop_count == CALLS && client.is_finished() {
                    client.begin_again(self.arrived);
                }
                newer_than(client.mirror(), known)
            }
            Role::OpenCentre(centre) => centre.newer_at(asker, known),
            _ => None,
        };
        match &self.role {
            Role::Open(craft) => craft.tell(asker, facts, known, fleet, &mut out.changes),
            Role::OpenClient(client) => client.tell(facts, known, &mut out.changes),
            Role::OpenCentre(centre) => centre.tell(asker, facts, known, &mut out.changes),
            _ => return Err(Refusal::Kind),
        }
        header.hop_count = u16::from(end < most(own));
        if let Some(recovery) = &mut self.recovery {
            recovery.counted_mut().states += 1;
            if let Some(evidence) = newer {
                recovery.ask_on(asker, header.firing_number, evidence);
            }
        }
        self.put_state(asker, header, start, out);
        Ok(())
    }

    /// Plans a sample with the changes from `start` on.
    fn put_state(&self, to: CraftId, header: Header, start: usize, out: &mut Outbox) {
        let range = start..out.changes.len();
        if matches!(self.role, Role::OpenClient(_) | Role::OpenCentre(_)) {
            // Of what is learnt as state nobody knows when it was meant to be made.
            out.intended.resize(range.end, 0);
        }
        out.put_sample(Destination::Craft(to), header, range);
    }
}

/// What of `told` is newer than what `known` (ascending by fact) says of `fact`.
pub(super) fn is_news(told: &Change, fact: FactId, known: &[Change]) -> bool {
    let held = known.binary_search_by_key(&fact, |held| held.fact);
    held.map_or(true, |index| {
        let held = &known[index];
        told.version > held.version
    })
}

/// `facts`, as far as a board of `count` facts has them.
pub(super) fn within(facts: Range<u32>, count: u32) -> impl Iterator<Item = FactId> {
    (facts.start..facts.end.min(count)).map(FactId)
}

#[cfg(test)]
mod tests;
