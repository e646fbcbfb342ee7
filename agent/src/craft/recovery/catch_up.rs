//! Asking peers for their state: who is asked, when, and for which facts.
//!
//! A round asks one peer for all its facts, a range at a time. What it had sent when it answered the first
//! range is known with the last one, so that a life that joins need not ask for those samples.

use super::peer::NEVER;
use super::{About, Recovery, Said};
use shared_types::ids::CraftId;
use shared_types::time::Nanos;
use shared_types::wire::Header;

/// A question for a peer's state that is due.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::craft) struct Question {
    pub(in crate::craft) to: CraftId,
    pub(in crate::craft) number: u32,
    pub(in crate::craft) first_fact: u32,
}

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
            self.ask_from(craft, at);
        }
    }

    /// Asks `craft`, which knows something newer, for its state.
    pub(in crate::craft) fn ask(&mut self, craft: CraftId) {
        self.ask_from(craft, self.now);
    }

    fn ask_from(&mut self, craft: CraftId, at: Nanos) {
        let peer = &mut self.peers[craft.index()];
        if peer.is_gone || peer.pulling.is_on() {
            return;
        }
        peer.pulling.start(at);
        peer.question = peer.question.wrapping_add(1);
        peer.first_fact = 0;
        self.earliest = self.earliest.min(at);
    }

    /// Asks everybody once things have come to rest after a change of the fleet.
    pub(in crate::craft) fn ask_in_a_while(&mut self) {
        self.stir();
    }

    /// The questions that are due.
    pub(in crate::craft) fn questions(&mut self, now: Nanos, due: &mut Vec<Question>) {
        self.look(now);
        if self.idle_at <= now {
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
