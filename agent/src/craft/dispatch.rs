//! Publishes what a step planned: every record is written once, into the memory that is sent.

use super::{Counting, Outbox, Outgoing};
use shared_types::time::Nanos;
use shared_types::transport::{Endpoint, SendError};
use shared_types::wire::{Class, write_deltas};

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
    let stride = counting.record_bytes;
    for Outgoing { to, header, changes } in out.samples.drain(..) {
        let changes = &out.changes[changes];
        let length = changes.len() * stride;
        let mut header = header;
        header.published_ns = now.0;
        match endpoint.send(to, header, length, &mut |slot| write_deltas(changes, stride, slot)) {
            Ok(()) => {
                let class = header.class().unwrap_or(Class::Replication);
                counting.sent(class, length);
            }
            Err(SendError::OutboxFull(_)) => {}
            Err(error) => return Err(error),
        }
    }
    out.changes.clear();
    Ok(())
}
