//! Publishes what a step planned: every record is written once, into the memory that is sent.
//!
//! What is numbered is handed to recovery as it is sent, so that it can be repeated; what recovery itself
//! has to send goes out behind it.

use super::recovery::Recovery;
use super::{Counting, Craft, Outbox, Outgoing};
use shared_types::ids::CraftId;
use shared_types::time::Nanos;
use shared_types::transport::{Destination, Endpoint, SendError};
use shared_types::wire::{
    Class, Header, INTENDED_BYTES, Kind, Stage, write_deltas, write_intended,
};

/// Sends the planned samples in order and counts them; reports are left to the shell. Samples that
/// the transport refuses for good are counted by the transport and do not stop the others.
///
/// # Errors
/// The first failure that is not a full outbox.
pub fn dispatch(
    endpoint: &mut impl Endpoint,
    now: Nanos,
    out: &mut Outbox,
    craft: &mut Craft,
) -> Result<(), SendError> {
    let (counting, _, mut recovery) = craft.books();
    send_all(endpoint, out, counting, recovery.as_deref_mut(), &mut |_| now)?;
    recovery.map_or(Ok(()), |recovery| recovery.pump(endpoint, now, counting))
}

/// The same in open mode, where `clock` stamps every sample as it is sent and the craft counts how long
/// after its changes that was.
///
/// # Errors
/// As [`dispatch`].
pub fn dispatch_stamped(
    endpoint: &mut impl Endpoint,
    clock: &mut impl FnMut() -> Nanos,
    out: &mut Outbox,
    craft: &mut Craft,
) -> Result<(), SendError> {
    let made = out.made.take();
    let (counting, measured, mut recovery) = craft.books();
    if out.samples.is_empty() {
        // Nothing to send.
    } else if measured.is_staged() {
        send_all(endpoint, out, counting, recovery.as_deref_mut(), &mut |sample| {
            let now = clock();
            // A question to the centre holds no record.
            if sample.header.class == Class::Replication as u8 && sample.header.record_count > 0 {
                measured.stage(Stage::RecordsPerSample, u64::from(sample.header.record_count));
            }
            if let Some(made) = made {
                measured.stage(Stage::Publish, now.since(made));
            }
            now
        })?;
    } else {
        let now = clock();
        send_all(endpoint, out, counting, recovery.as_deref_mut(), &mut |_| now)?;
    }
    recovery.map_or(Ok(()), |recovery| recovery.pump(endpoint, clock(), counting))
}

/// Sends every sample with the time that `stamp` gives it.
fn send_all(
    endpoint: &mut impl Endpoint,
    out: &mut Outbox,
    counting: &mut Counting,
    mut recovery: Option<&mut Recovery>,
    stamp: &mut impl FnMut(&Outgoing) -> Nanos,
) -> Result<(), SendError> {
    let is_timed = !out.intended.is_empty();
    let stride = counting.record_bytes + if is_timed { INTENDED_BYTES } else { 0 };
    for sample in out.samples.drain(..) {
        let published = stamp(&sample);
        let Outgoing { to, mut header, changes } = sample;
        let intended = if is_timed { &out.intended[changes.clone()] } else { &[] };
        let changes = &out.changes[changes];
        let length = changes.len() * stride;
        header.published_ns = published.0;
        let mut write = |slot: &mut [u8]| {
            write_deltas(changes, stride, slot);
            write_intended(intended, stride, slot);
        };
        let class = header.class().unwrap_or(Class::Replication);
        let sent = match (&mut recovery, to) {
            (Some(recovery), Destination::Craft(receiver)) if !recovery.reaches(receiver) => {
                recovery.counted_mut().discarded += 1;
                continue;
            }
            (_, Destination::Craft(receiver)) if !is_numbered(&header) => {
                header = announcing(endpoint, receiver, header);
                endpoint.send_past_numbering(receiver, header, length, &mut write)
            }
            (Some(recovery), _) => {
                recovery.look(published);
                let (sequence, destination) = (endpoint.next_number(to), to.address().0);
                let numbered = Header { sequence, destination, ..header };
                recovery.sent(to, &numbered, changes, intended);
                endpoint.send(to, header, length, &mut write)
            }
            (None, _) => endpoint.send(to, header, length, &mut write),
        };
        match sent {
            Ok(()) => counting.sent(class, length),
            Err(SendError::OutboxFull(_)) => {}
            Err(error) => return Err(error),
        }
    }
    out.changes.clear();
    out.intended.clear();
    Ok(())
}

fn is_numbered(header: &Header) -> bool {
    header.kind().is_none_or(Kind::is_numbered)
}

/// The header of an unnumbered sample: it says instead how far this process has counted.
fn announcing(endpoint: &impl Endpoint, receiver: CraftId, mut header: Header) -> Header {
    header.destination = receiver.0;
    header.sequence = endpoint.next_number(Destination::Craft(receiver));
    header.intended_ns = endpoint.next_number(Destination::Multicast);
    header
}
