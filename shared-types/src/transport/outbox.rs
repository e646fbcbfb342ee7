//! Samples that a full inbox did not take, kept until it does: a bounded queue per receiver.
//!
//! While anything waits for a receiver, whatever follows waits behind it, so order is kept. Memory is
//! taken at the first back-pressure towards a receiver and reused from then on. Not here: who decides
//! that an inbox is full (the adapters).

use super::{Destination, SendError};
use crate::limits::OUTBOX_SAMPLES;
use crate::wire::Header;
use std::collections::VecDeque;

/// All that one sender still has to deliver.
#[derive(Debug, Default)]
pub(super) struct Outbox {
    queues: Vec<Queue>,
    spare: Vec<Vec<u8>>,
    waiting: usize,
}

#[derive(Debug)]
struct Queue {
    to: Destination,
    parcels: VecDeque<Parcel>,
}

#[derive(Debug)]
struct Parcel {
    header: Header,
    payload: Vec<u8>,
}

impl Outbox {
    /// How many samples wait.
    pub(super) const fn waiting(&self) -> usize {
        self.waiting
    }

    /// Whether anything waits for `to`.
    #[inline]
    pub(super) fn holds_back(&self, to: Destination) -> bool {
        self.waiting > 0
            && self.queues.iter().any(|queue| queue.to == to && !queue.parcels.is_empty())
    }

    /// Keeps a copy of a sealed sample.
    ///
    /// # Errors
    /// If as many as allowed already wait for this receiver.
    pub(super) fn keep(
        &mut self,
        to: Destination,
        header: &Header,
        payload: &[u8],
    ) -> Result<(), SendError> {
        let queue = match self.queues.binary_search_by_key(&to, |queue| queue.to) {
            Ok(index) => &mut self.queues[index],
            Err(index) => {
                let parcels = VecDeque::with_capacity(OUTBOX_SAMPLES);
                self.queues.insert(index, Queue { to, parcels });
                &mut self.queues[index]
            }
        };
        if queue.parcels.len() == OUTBOX_SAMPLES {
            return Err(SendError::OutboxFull(to));
        }
        let mut copy = self.spare.pop().unwrap_or_default();
        copy.clear();
        copy.extend_from_slice(payload);
        queue.parcels.push_back(Parcel { header: *header, payload: copy });
        self.waiting += 1;
        Ok(())
    }

    /// Forgets what waits for `to`; returns how many samples that were.
    pub(super) fn discard(&mut self, to: Destination) -> usize {
        let Some(queue) = self.queues.iter_mut().find(|queue| queue.to == to) else { return 0 };
        let discarded = queue.parcels.len();
        self.spare.extend(queue.parcels.drain(..).map(|parcel| parcel.payload));
        self.waiting -= discarded;
        discarded
    }

    /// Offers what waits to `offer`, oldest first per receiver, until it refuses (`Ok(false)`).
    /// Returns how many samples still wait.
    ///
    /// # Errors
    /// The first error of `offer`; that sample keeps waiting.
    pub(super) fn retry(
        &mut self,
        mut offer: impl FnMut(Destination, &Header, &[u8]) -> Result<bool, SendError>,
    ) -> Result<usize, SendError> {
        if self.waiting == 0 {
            return Ok(0);
        }
        for queue in &mut self.queues {
            while let Some(parcel) = queue.parcels.front() {
                if !offer(queue.to, &parcel.header, &parcel.payload)? {
                    break;
                }
                if let Some(taken) = queue.parcels.pop_front() {
                    self.spare.push(taken.payload);
                }
                self.waiting -= 1;
            }
        }
        Ok(self.waiting)
    }
}
