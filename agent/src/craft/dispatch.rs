//! Publishes what a step planned: every record is written once, into the memory that is sent.

use super::{Counting, Craft, Outbox, Outgoing};
use shared_types::time::Nanos;
use shared_types::transport::{Endpoint, SendError};
use shared_types::wire::{Class, INTENDED_BYTES, Stage, write_deltas, write_intended};

/// Sends the planned samples in order and counts them; reports are left to the shell. Samples that
/// the transport refuses for good are counted by the transport and do not stop the others.
///
/// # Errors
/// The first failure that is not a full outbox.
pub fn dispatch(
    endpoint: &mut impl Endpoint,
    now: Nanos,
    out: &mut Outbox,
    counting: &mut Counting,
) -> Result<(), SendError> {
    send_all(endpoint, out, counting, &mut |_| now)
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
    if out.samples.is_empty() {
        return Ok(());
    }
    let (counting, measured) = craft.counting_and_measured();
    if !measured.is_staged() {
        let now = clock();
        return send_all(endpoint, out, counting, &mut |_| now);
    }
    send_all(endpoint, out, counting, &mut |sample| {
        let now = clock();
        // A question to the centre holds no record.
        if sample.header.class == Class::Replication as u8 && sample.header.record_count > 0 {
            measured.stage(Stage::RecordsPerSample, u64::from(sample.header.record_count));
        }
        if let Some(made) = made {
            measured.stage(Stage::Publish, now.since(made));
        }
        now
    })
}

/// Sends every sample with the time that `stamp` gives it.
fn send_all(
    endpoint: &mut impl Endpoint,
    out: &mut Outbox,
    counting: &mut Counting,
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
        match endpoint.send(to, header, length, &mut write) {
            Ok(()) => {
                let class = header.class().unwrap_or(Class::Replication);
                counting.sent(class, length);
            }
            Err(SendError::OutboxFull(_)) => {}
            Err(error) => return Err(error),
        }
    }
    out.changes.clear();
    out.intended.clear();
    Ok(())
}
