//! How a process finds out what was lost, repeats it, and catches up with what it missed.
//!
//! Samples of numbered kinds are kept in a ring as they are sent. A receiver that sees a gap names it in
//! a receipt, and the sender repeats the very sample under its old number, so that the receiver's
//! numbering hands it over once, whatever comes twice. A sender that hears no receipt announces how far it
//! has counted, so that a loss at the end is seen too. All of this is asked again with growing pauses and
//! given up after a bound. What cannot be repeated is told as state: a process asks a peer with a digest of
//! the versions that it holds, and is told what it lacks. It asks everybody when its life begins after the
//! fleet's, when somebody is gone or back, when it has given something up, and once whenever it has been
//! idle for a while, so that whatever went wrong is healed. Not here: what a board is told and learns (the
//! roles), and how a sample travels (the endpoint).

mod authors;
mod catch_up;
mod membership;
mod peer;
mod pump;
mod ring;

pub(super) use authors::Authors;
pub(super) use catch_up::{Evidence, Question};

use peer::{NEVER, Numbers, Peer};
use ring::Ring;
use shared_types::ids::CraftId;
use shared_types::knowledge::Change;
use shared_types::limits::{RECEIPT_SAMPLES, REPEATS_MAX, REPEATS_PER_RECEIPT};
use shared_types::time::Nanos;
use shared_types::transport::{Destination, Numbered};
use shared_types::wire::{EpochSpec, Header, Recovered, Refusal, StrategyKind, read_receipt};
use std::collections::BTreeMap;

/// How long a process must be idle before it asks once for everybody's state, in patiences.
const IDLE_PATIENCES: u64 = 16;

/// A number that a peer asked for.
#[derive(Clone, Copy, Debug)]
struct Wanted {
    by: CraftId,
    service: Numbered,
    number: u64,
}

/// What a peer said about its own numbering.
#[derive(Clone, Copy, Debug)]
struct Said {
    by: CraftId,
    life: u32,
    what: About,
}

#[derive(Clone, Copy, Debug)]
enum About {
    /// It has sent everything below `next`, and cannot repeat what is below `kept_from`.
    Sent { next: Numbers, kept_from: Numbers },
    /// Everything below these numbers is known otherwise.
    Covered(Numbers),
}

/// Repair and catching up of one process in one epoch.
#[derive(Debug)]
pub(super) struct Recovery {
    own: CraftId,
    /// Which life of the craft this is.
    life: u32,
    /// The last life that was given out before the epoch.
    lives: u32,
    epoch: u32,
    patience_ns: u64,
    /// Whether states are told: in open mode. A lockstep turn waits for its samples instead.
    tells_states: bool,
    multicasts: bool,
    now: Nanos,
    /// Nothing is due before this.
    earliest: Nanos,
    /// When everybody is asked for the state because nothing happened for a while.
    idle_at: Nanos,
    peers: Vec<Peer>,
    /// Who may be asked for a state: everybody, or the centre, or (the centre) its clients.
    others: std::ops::Range<u32>,
    ring: Ring,
    multicast_next: Option<u64>,
    multicast_kept_from: u64,
    wanted: Vec<Wanted>,
    said: Vec<Said>,
    gone: Vec<CraftId>,
    /// Peers of whose samples something was given up since this was last asked.
    given_up: Vec<CraftId>,
    /// On what a peer was last asked for its facts from one on.
    evidence: BTreeMap<(CraftId, u32), Evidence>,
    counted: Recovered,
}

impl Recovery {
    /// The recovery of craft `own` in its life `life`, in no epoch yet.
    pub(super) fn new(own: CraftId) -> Self {
        Self {
            own,
            life: 0,
            lives: 0,
            epoch: 0,
            patience_ns: 1,
            tells_states: false,
            multicasts: false,
            now: Nanos(0),
            earliest: NEVER,
            idle_at: NEVER,
            peers: Vec::new(),
            others: 0..0,
            ring: Ring::default(),
            multicast_next: None,
            multicast_kept_from: 0,
            wanted: Vec::new(),
            said: Vec::new(),
            gone: Vec::new(),
            given_up: Vec::new(),
            evidence: BTreeMap::new(),
            counted: Recovered::default(),
        }
    }

    /// Starts an epoch of a fleet of `crafts` crafts.
    pub(super) fn begin_epoch(&mut self, spec: &EpochSpec, life: u32, crafts: u32) {
        self.life = life;
        self.lives = spec.recovery.map_or(0, |recovery| recovery.lives);
        self.epoch = spec.epoch;
        self.patience_ns = spec.recovery.map_or(1, |recovery| recovery.patience_ns.max(16));
        self.tells_states = spec.open.is_some();
        self.multicasts = spec.strategy.multicasts();
        (self.earliest, self.idle_at) = (NEVER, NEVER);
        let lives = |peer: Peer| Peer { is_gone: peer.is_gone, life: peer.life, ..Peer::default() };
        self.peers.iter_mut().for_each(|peer| *peer = lives(*peer));
        self.peers.resize_with(crafts as usize + 1, Peer::default);
        self.others = match (spec.strategy.has_centre(), self.own.0 == crafts) {
            // Who tells nobody anything has no state to tell either.
            _ if spec.strategy == StrategyKind::Null => 0..0,
            (true, false) => crafts..crafts + 1,
            (true, true) | (false, _) => 0..crafts,
        };
        self.ring.clear();
        (self.multicast_next, self.multicast_kept_from) = (None, 0);
        self.wanted.clear();
        self.said.clear();
        self.gone.clear();
        self.given_up.clear();
        self.evidence.clear();
        self.counted = Recovered::default();
    }

    /// Peers that the process exchanges states with.
    pub(super) fn others(&self) -> impl Iterator<Item = CraftId> + use<> {
        let own = self.own;
        self.others.clone().map(CraftId).filter(move |&craft| craft != own)
    }

    /// What was done.
    pub(super) const fn counted(&self) -> Recovered {
        self.counted
    }

    pub(super) const fn counted_mut(&mut self) -> &mut Recovered {
        &mut self.counted
    }

    /// It is `now`.
    #[inline]
    pub(super) fn look(&mut self, now: Nanos) {
        self.now = self.now.max(now);
    }

    /// When there is something to do without a message.
    #[inline]
    pub(super) fn next_due(&self) -> Option<Nanos> {
        (self.earliest != NEVER).then_some(self.earliest)
    }

    /// Things that are asked for or still to be asked for.
    pub(super) fn left(&self) -> usize {
        let busy = self.peers.iter().filter(|peer| !peer.is_gone && peer.is_busy()).count();
        busy + usize::from(self.idle_at != NEVER) + self.said.len() + self.wanted.len()
    }

    /// Whether samples to `craft` still make sense.
    #[inline]
    pub(super) fn reaches(&self, craft: CraftId) -> bool {
        self.peers.get(craft.index()).is_none_or(|peer| !peer.is_gone)
    }

    /// A numbered sample of `header` is sent to `to`. Called for each, in the order of sending.
    pub(super) fn sent(
        &mut self,
        to: Destination,
        header: &Header,
        changes: &[Change],
        intended: &[u64],
    ) {
        let receiver = match to {
            Destination::Craft(craft) => craft,
            Destination::Multicast => CraftId::NONE,
            _ => return,
        };
        let next = header.sequence + 1;
        let due = self.now.plus(self.patience_ns);
        if receiver == CraftId::NONE {
            if self.multicast_next.is_none() {
                self.multicast_kept_from = header.sequence;
            }
            self.multicast_next = Some(next);
            let others = self.others();
            for craft in others {
                let peer = &mut self.peers[craft.index()];
                if !peer.is_gone {
                    peer.announcing.start(due);
                }
            }
        } else if let Some(peer) = self.peers.get_mut(receiver.index()) {
            if peer.unicast_next.is_none() {
                peer.kept_from = header.sequence;
            }
            peer.unicast_next = Some(next);
            peer.announcing.start(due);
        }
        self.earliest = self.earliest.min(due);
        self.stir();
        let Some(forgotten) = self.ring.keep(receiver, header, changes, intended) else { return };
        match self.peers.get_mut(forgotten.receiver.index()) {
            Some(peer) => peer.kept_from = forgotten.number + 1,
            None => self.multicast_kept_from = forgotten.number + 1,
        }
    }

    /// A sample of `header` came from a peer. Says whether the peer lives a life that was not known.
    pub(super) fn heard(&mut self, header: &Header) -> bool {
        let source = CraftId(header.source);
        // What one that is gone had sent before may still arrive; only a later life brings it back.
        let known = self.peers.get(source.index()).map_or(0, |peer| peer.life);
        let is_new = header.incarnation > known && self.up(source, header.incarnation);
        let is_numbered = header.kind().is_some_and(shared_types::wire::Kind::is_numbered);
        let Some(peer) = self.peers.get_mut(source.index()).filter(|_| is_numbered) else {
            return is_new;
        };
        peer.unreceipted += 1;
        let due = if peer.unreceipted >= RECEIPT_SAMPLES {
            self.now
        } else {
            peer.receipt_at.unwrap_or_else(|| self.now.plus(self.patience_ns / 2))
        };
        peer.receipt_at = Some(due);
        self.earliest = self.earliest.min(due);
        self.stir();
        is_new
    }

    /// Something happened: the process is not idle.
    fn stir(&mut self) {
        if self.tells_states {
            self.idle_at = self.now.plus(self.patience_ns.saturating_mul(IDLE_PATIENCES));
            self.earliest = self.earliest.min(self.idle_at);
        }
    }

    /// Reads a receipt: what is confirmed, what is wanted again, how far its sender has counted.
    pub(super) fn take_receipt(&mut self, header: &Header, payload: &[u8]) -> Result<(), Refusal> {
        let (receipt, rows) = read_receipt(payload, header.record_count).ok_or(Refusal::Length)?;
        let by = CraftId(header.source);
        let peer = self.peers.get_mut(by.index()).ok_or(Refusal::Record)?;
        if receipt.asks != 0 {
            peer.receipt_at = Some(self.now);
            self.earliest = self.earliest.min(self.now);
        }
        let what = About::Sent {
            next: [header.sequence, header.intended_ns],
            kept_from: [receipt.unicast_kept_from, receipt.multicast_kept_from],
        };
        self.said.push(Said { by, life: header.incarnation, what });
        if receipt.life != self.life {
            return Ok(());
        }
        let mut confirmed = [receipt.unicast_next, receipt.multicast_next];
        let mut wanted = 0;
        for row in rows {
            let service =
                if row.is_multicast == 0 { Numbered::Unicast } else { Numbered::Multicast };
            let below = &mut confirmed[service as usize];
            *below = row.first.min(*below);
            let repeated = row.end.min(row.first.saturating_add(REPEATS_PER_RECEIPT - wanted));
            for number in row.first..repeated {
                wanted += 1;
                self.wanted.push(Wanted { by, service, number });
            }
        }
        let peer = &mut self.peers[by.index()];
        for (known, told) in peer.confirmed.iter_mut().zip(confirmed) {
            if told > *known {
                *known = told;
                peer.announcing.encourage();
            }
        }
        let is_behind = peer.unicast_next.is_some_and(|next| peer.confirmed[0] < next)
            || (self.multicasts
                && self.multicast_next.is_some_and(|next| peer.confirmed[1] < next));
        if !is_behind {
            peer.announcing.stop();
        }
        Ok(())
    }

    /// Peers of whose samples, or of samples to whom, something was given up since the last call.
    pub(super) fn take_given_up(&mut self) -> Option<CraftId> {
        self.given_up.pop()
    }

    /// Whether a sample may be repeated once more.
    const fn may_repeat(repeats: u32) -> bool {
        repeats < REPEATS_MAX
    }
}
