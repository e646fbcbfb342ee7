//! Asking peers for their state: who is asked, when, and for which facts.
//!
//! A round asks one peer for all its facts, a range at a time. What it had sent when it answered the first
//! range is known with the last one, so that a life that joins need not ask for those samples.

use super::peer::NEVER;
use super::{About, Recovery, Said};
use shared_types::ids::CraftId;
use shared_types::knowledge::Change;
use shared_types::time::Nanos;
use shared_types::wire::Header;

/// A question for a peer's state that is due.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::craft) struct Question {
    pub(in crate::craft) to: CraftId,
    pub(in crate::craft) number: u32,
    pub(in crate::craft) first_fact: u32,
}

/// What of a peer's digest was newer than the own board, as one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::craft) struct Evidence(u64);

impl Evidence {
    /// That of `newer`; `None` if there is nothing.
    pub(in crate::craft) fn of<'a>(newer: impl Iterator<Item = &'a Change>) -> Option<Self> {
        newer.fold(None, |all, change| {
            let Change { fact, version, .. } = change;
            let parts = [fact.0, version.count, version.writer.0].map(u64::from);
            let Self(all) = all.unwrap_or(Self(FNV_OFFSET));
            Some(Self(parts.iter().fold(all, |all, part| (all ^ part).wrapping_mul(FNV_PRIME))))
        })
    }
}

/// The constants of the hash FNV-1a, 64 bits.
const FNV_OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
const FNV_PRIME: u64 = 0x0000_0100_0000_01b3;

impl Recovery {
    /// Whether this life still asks what it missed before it began.
    pub(in crate::craft) fn is_catching_up(&self) -> bool {
        self.life > 0 && self.peers.iter().any(|peer| peer.is_joining)
    }

    /// A life that began after the fleet's asks everybody for the state before it plays.
    pub(in crate::craft) fn join(&mut self, now: Nanos) {
        self.look(now);
        for craft in self.others() {
            let peer = &mut self.peers[craft.index()];
            if !peer.is_gone {
                peer.is_joining = true;
            }
        }
        self.ask_everybody(now);
    }

    /// Asks every living peer for its state from `at` on.
    pub(in crate::craft) fn ask_everybody(&mut self, at: Nanos) {
        if !self.tells_states {
            return;
        }
        for craft in self.others() {
            let _is_new = self.ask_from(craft, at);
        }
    }

    /// Asks `craft` for its state, of whose facts from `first_fact` on it has said something newer. On one and
    /// the same `evidence` it is asked once: what did not come then is not for this board, and each
    /// question shows the other what this one knows, so that two of them would never end.
    pub(in crate::craft) fn ask_on(&mut self, craft: CraftId, first_fact: u32, evidence: Evidence) {
        let last = self.evidence.get(&(craft, first_fact));
        if last != Some(&evidence) && self.ask_from(craft, self.now) {
            self.evidence.insert((craft, first_fact), evidence);
        }
    }

    /// Begins a round with `craft` at `at`; says whether it does: not while one is under way.
    pub(in crate::craft) fn ask_from(&mut self, craft: CraftId, at: Nanos) -> bool {
        let peer = &mut self.peers[craft.index()];
        if peer.is_gone || peer.pulling.is_on() {
            return false;
        }
        peer.pulling.start(at);
        peer.question = peer.question.wrapping_add(1);
        peer.first_fact = 0;
        self.earliest = self.earliest.min(at);
        true
    }

    /// Asks everybody once things have come to rest after a change of the fleet.
    pub(in crate::craft) fn ask_in_a_while(&mut self) {
        self.stir();
    }

    /// The questions that are due; says whether the process has been idle for a while, once each time.
    pub(in crate::craft) fn questions(&mut self, now: Nanos, due: &mut Vec<Question>) -> bool {
        self.look(now);
        let is_idle = self.idle_at <= now;
        if is_idle {
            self.idle_at = NEVER;
            self.ask_everybody(now);
        }
        for craft in self.others() {
            let peer = &mut self.peers[craft.index()];
            if peer.is_gone || peer.pulling.at > now {
                continue;
            }
            if peer.pulling.asked(now, self.patience_ns) {
                let (number, first_fact) = (peer.question, peer.first_fact);
                due.push(Question { to: craft, number, first_fact });
            } else {
                peer.pulling.stop();
                peer.is_joining = false;
                self.counted.states_missed += 1;
            }
        }
        self.counted.digests += due.len() as u64;
        is_idle
    }

    /// A state arrived: says which question comes next, if it does not end the round.
    pub(in crate::craft) fn take_state(&mut self, header: &Header) -> Option<Question> {
        let by = CraftId(header.source);
        let peer = self.peers.get_mut(by.index())?;
        if !peer.pulling.is_on() || header.argument != peer.question {
            return None;
        }
        if peer.first_fact == 0 {
            peer.covered = [header.sequence, header.intended_ns];
        }
        if header.hop_count > 0 {
            peer.question = peer.question.wrapping_add(1);
            peer.first_fact = header.turn;
            peer.pulling.encourage();
            peer.pulling.asked(self.now, self.patience_ns);
            self.earliest = self.earliest.min(peer.pulling.at);
            self.counted.digests += 1;
            return Some(Question { to: by, number: peer.question, first_fact: peer.first_fact });
        }
        peer.pulling.stop();
        if peer.is_joining {
            peer.is_joining = false;
            let what = About::Covered(peer.covered);
            self.said.push(Said { by, life: header.incarnation, what });
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::super::Peer;
    use super::{CraftId, Evidence, Header, Nanos, Question, Recovery};
    use shared_types::ids::FactId;
    use shared_types::knowledge::{Change, Value, Version};
    use shared_types::wire::{Class, Kind};

    fn evidence(fact: u32, count: u32) -> Evidence {
        let version = Version { count, writer: CraftId(2) };
        let change = Change { fact: FactId(fact), value: Value::Asserted, version, altered: false };
        Evidence::of([change].iter()).expect("one change")
    }

    /// What is asked at `at`, each question answered at once.
    fn asked(recovery: &mut Recovery, at: u64) -> Vec<Question> {
        let mut due = Vec::new();
        assert!(!recovery.questions(Nanos(at), &mut due), "it never was idle");
        for question in &due {
            let mut answer = Header::new(Class::Repair, Kind::State);
            (answer.source, answer.argument) = (question.to.0, question.number);
            answer.hop_count = 0;
            assert_eq!(recovery.take_state(&answer), None);
        }
        due
    }

    #[test]
    fn on_one_evidence_a_peer_is_asked_once() {
        let mut recovery = Recovery::new(CraftId(0));
        recovery.peers.resize_with(3, Peer::default);
        recovery.others = 0..2;
        recovery.look(Nanos(10));
        recovery.ask_on(CraftId(1), 0, evidence(4, 9));
        // While a round is under way nothing is noted: its answer may have been on its way before.
        recovery.ask_on(CraftId(1), 0, evidence(5, 1));
        assert_eq!(asked(&mut recovery, 10).len(), 1);
        recovery.ask_on(CraftId(1), 0, evidence(4, 9));
        assert_eq!(asked(&mut recovery, 11), []);
        recovery.ask_on(CraftId(1), 0, evidence(5, 1));
        assert_eq!(asked(&mut recovery, 12).len(), 1);
        // Another range of facts, or newer ones, are another evidence.
        recovery.ask_on(CraftId(1), 64, evidence(5, 1));
        assert_eq!(asked(&mut recovery, 13).len(), 1);
        recovery.ask_on(CraftId(1), 0, evidence(5, 2));
        assert_eq!(asked(&mut recovery, 14).len(), 1);
    }
}
