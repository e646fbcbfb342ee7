//! The part of recovery that needs the endpoint: numbers received, repeats, receipts.
//!
//! It runs after every step, once what the step planned is sent.

use super::peer::NEVER;
use super::ring::Sent;
use super::{About, Recovery, Said, Wanted};
use crate::craft::Counting;
use shared_types::ids::CraftId;
use shared_types::limits::MISSING_ROWS_MAX;
use shared_types::time::Nanos;
use shared_types::transport::{Destination, Endpoint, Numbered, SendError};
use shared_types::wire::{
    Class, Header, INTENDED_BYTES, Kind, MissingRow, Receipt, receipt_bytes, write_deltas,
    write_intended, write_receipt,
};

/// How long a gap may close by itself before it is named, as a part of the patience: what overtook
/// another is no loss.
const REORDER_PART: u64 = 8;

impl Recovery {
    /// Does what is due at `now`: takes over what peers said of their numbers, repeats what they want,
    /// sends receipts.
    ///
    /// # Errors
    /// If the transport fails. A sample that it drops is no error: it is asked for again.
    pub(in crate::craft) fn pump(
        &mut self,
        endpoint: &mut impl Endpoint,
        now: Nanos,
        counting: &mut Counting,
    ) -> Result<(), SendError> {
        self.look(now);
        for craft in std::mem::take(&mut self.gone) {
            self.counted.discarded += endpoint.discard(craft) as u64;
        }
        for index in 0..self.said.len() {
            let said = self.said[index];
            self.take_over(endpoint, said);
        }
        self.said.clear();
        for index in 0..self.wanted.len() {
            let wanted = self.wanted[index];
            self.repeat(endpoint, wanted, counting)?;
        }
        self.wanted.clear();
        self.notice_missing(endpoint);
        if self.now < self.earliest {
            return Ok(());
        }
        for index in 0..self.peers.len() {
            if !self.peers[index].is_gone && self.peers[index].next_due() <= self.now {
                self.attend(endpoint, CraftId::from_index(index), counting)?;
            }
        }
        self.forecast();
        Ok(())
    }

    /// Looks up when the next thing is due.
    fn forecast(&mut self) {
        let living = self.peers.iter().filter(|peer| !peer.is_gone);
        let next = living.map(super::Peer::next_due).min().unwrap_or(NEVER);
        self.earliest = next.min(self.idle_at);
    }

    fn take_over(&mut self, endpoint: &mut impl Endpoint, said: Said) {
        let Said { by, life, what } = said;
        match what {
            About::Sent { next, kept_from } => {
                let is_joining = self.peers[by.index()].is_joining;
                for service in Numbered::ALL {
                    let numbers = endpoint.numbers(service);
                    numbers.announce(by.0, life, next[service as usize]);
                    if is_joining {
                        // What was missed before this life began comes as state.
                        continue;
                    }
                    let given_up = numbers.give_up(by.0, kept_from[service as usize]);
                    self.give_up(by, given_up);
                }
            }
            About::Covered(numbers) => {
                for service in Numbered::ALL {
                    endpoint.numbers(service).cover(by.0, life, numbers[service as usize]);
                }
            }
        }
    }

    /// `count` samples of `craft` will not come any more: everybody is asked for the state.
    fn give_up(&mut self, craft: CraftId, count: u64) {
        if count > 0 {
            self.counted.given_up = self.counted.given_up.saturating_add(count);
            self.given_up.push(craft);
            self.ask_everybody(self.now);
        }
    }

    fn repeat(
        &mut self,
        endpoint: &mut impl Endpoint,
        wanted: Wanted,
        counting: &mut Counting,
    ) -> Result<(), SendError> {
        let Wanted { by, service, number } = wanted;
        let Some(sent) = self.ring.find(by, service, number) else { return Ok(()) };
        if !Self::may_repeat(sent.repeats) || self.peers[by.index()].is_gone {
            return Ok(());
        }
        sent.repeats += 1;
        self.counted.repeats += 1;
        let Sent { header, changes, intended, .. } = sent;
        let stride = counting.record_bytes + if intended.is_empty() { 0 } else { INTENDED_BYTES };
        let length = changes.len() * stride;
        let header = Header { class: Class::Repair as u8, ..*header };
        let mut write = |slot: &mut [u8]| {
            write_deltas(changes, stride, slot);
            write_intended(intended, stride, slot);
        };
        let result = endpoint.send_past_numbering(by, header, length, &mut write);
        counting.sent(Class::Repair, length);
        unless_dropped(result)
    }

    /// Begins to ask for what is missing.
    fn notice_missing(&mut self, endpoint: &mut impl Endpoint) {
        let due = self.now.plus(self.patience_ns / REORDER_PART);
        for service in Numbered::ALL {
            let numbers = endpoint.numbers(service);
            if !numbers.has_missing() {
                continue;
            }
            for debtor in numbers.debtors() {
                let Some(peer) = self.peers.get_mut(debtor as usize) else { continue };
                if !peer.is_gone && !peer.missing.is_on() {
                    peer.missing.start(due);
                    self.earliest = self.earliest.min(due);
                }
            }
        }
    }

    /// Sends `craft` the receipt that is due for one reason or another.
    fn attend(
        &mut self,
        endpoint: &mut impl Endpoint,
        craft: CraftId,
        counting: &mut Counting,
    ) -> Result<(), SendError> {
        let (now, patience_ns) = (self.now, self.patience_ns);
        let peer = &mut self.peers[craft.index()];
        let mut is_due = peer.receipt_at.is_some_and(|at| at <= now);
        let mut asks = false;
        if peer.missing.at <= now {
            let missing: u64 = Numbered::ALL
                .into_iter()
                .flat_map(|service| endpoint.numbers(service).missing(craft.0).collect::<Vec<_>>())
                .map(|range| range.end - range.start)
                .fold(0, u64::saturating_add);
            if missing == 0 || peer.is_joining {
                peer.missing.stop();
            } else {
                if missing != peer.missing_before {
                    peer.missing.encourage();
                }
                peer.missing_before = missing;
                is_due = true;
                if !peer.missing.asked(now, patience_ns) {
                    peer.missing.stop();
                    let given_up = Numbered::ALL
                        .into_iter()
                        .map(|service| endpoint.numbers(service).give_up(craft.0, u64::MAX))
                        .fold(0, u64::saturating_add);
                    self.give_up(craft, given_up);
                }
            }
        }
        let peer = &mut self.peers[craft.index()];
        if peer.announcing.at <= now {
            (is_due, asks) = (true, true);
            if !peer.announcing.asked(now, patience_ns) {
                peer.announcing.stop();
                let next = [peer.unicast_next.unwrap_or(0), self.multicast_next.unwrap_or(0)];
                let behind = next.iter().zip(peer.confirmed);
                self.counted.unconfirmed +=
                    behind.map(|(next, has)| next.saturating_sub(has)).sum::<u64>();
                peer.confirmed = next;
                self.given_up.push(craft);
            }
        }
        if is_due {
            self.send_receipt(endpoint, craft, asks, counting)?;
        }
        Ok(())
    }

    fn send_receipt(
        &mut self,
        endpoint: &mut impl Endpoint,
        craft: CraftId,
        asks: bool,
        counting: &mut Counting,
    ) -> Result<(), SendError> {
        let peer = &mut self.peers[craft.index()];
        (peer.receipt_at, peer.unreceipted) = (None, 0);
        // Numbers of an earlier life must not be told as those of this one, which may be announced only.
        for service in Numbered::ALL {
            endpoint.numbers(service).meet(craft.0, peer.life);
        }
        let mut rows = [MissingRow::default(); MISSING_ROWS_MAX];
        let mut count = 0;
        if !peer.is_joining {
            for service in Numbered::ALL {
                for range in endpoint.numbers(service).missing(craft.0) {
                    let Some(row) = rows.get_mut(count) else { break };
                    let is_multicast = service as u64;
                    *row = MissingRow { is_multicast, first: range.start, end: range.end };
                    count += 1;
                }
            }
        }
        let unicast = endpoint.next_number(Destination::Craft(craft));
        // Who listens to no multicasts in this epoch has missed none of an earlier one's.
        let multicast =
            if self.multicasts { endpoint.next_number(Destination::Multicast) } else { 0 };
        let receipt = Receipt {
            life: peer.life,
            asks: u32::from(asks),
            unicast_next: endpoint.numbers(Numbered::Unicast).next(craft.0),
            multicast_next: endpoint.numbers(Numbered::Multicast).next(craft.0),
            // Before the first sample of the epoch nothing is kept at all.
            unicast_kept_from: peer.unicast_next.map_or(unicast, |_| peer.kept_from),
            multicast_kept_from: self
                .multicast_next
                .map_or(multicast, |_| self.multicast_kept_from),
        };
        let mut header = Header::new(Class::Ack, Kind::Receipt);
        (header.origin, header.destination) = (self.own.0, craft.0);
        (header.epoch, header.published_ns) = (self.epoch, self.now.0);
        (header.sequence, header.intended_ns) = (unicast, multicast);
        header.record_count = u16::try_from(count).expect("invariant: rows are bounded");
        self.counted.receipts += 1;
        self.counted.asked_again += u64::from(count > 0);
        let length = receipt_bytes(count);
        let result = endpoint.send_past_numbering(craft, header, length, &mut |slot| {
            write_receipt(&receipt, &rows[..count], slot);
        });
        counting.sent(Class::Ack, length);
        unless_dropped(result)
    }
}

/// A sample that found no room is asked for again; anything else is a failure.
fn unless_dropped(result: Result<(), SendError>) -> Result<(), SendError> {
    match result {
        Err(SendError::OutboxFull(_)) => Ok(()),
        result => result,
    }
}
