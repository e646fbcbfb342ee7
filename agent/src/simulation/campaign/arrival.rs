//! What has arrived at a process: handed to its craft, and held against the laws on the way.

use super::laws::{Laws, Violation};
use super::play::failed;
use crate::craft::{Craft, Outbox};
use shared_types::ids::CraftId;
use shared_types::knowledge::FleetView;
use shared_types::transport::Endpoint;
use shared_types::wire::{Class, Header};

/// Hands `craft` everything that has arrived at its `endpoint`. Returns a line a sample if somebody
/// watches, and the first law that was broken; what came after that was handed over as well.
pub(super) fn take_in(
    endpoint: &mut impl Endpoint,
    craft: &mut Craft,
    fleet: &FleetView<'_>,
    laws: &mut Laws,
    out: &mut Outbox,
    is_witnessed: bool,
) -> (Vec<String>, Result<(), Violation>) {
    let (mut lines, mut verdict) = (Vec::new(), Ok(()));
    let drained = endpoint.drain(&mut |_, header, payload| {
        let (Some(class), Some(kind)) = (header.class(), header.kind()) else { return };
        if kind.is_numbered() && verdict.is_ok() {
            verdict = laws.hand(craft.id(), header);
        }
        if is_witnessed {
            lines.push(line_of(craft.id(), header));
        }
        // A refusal is counted by the craft and changes nothing.
        let _refusal = craft.receive(class, kind, header, payload, fleet, out);
    });
    (lines, drained.map_err(failed).and(verdict))
}

/// What is handed over, in a line.
fn line_of(receiver: CraftId, header: &Header) -> String {
    let kind = header.kind().map_or_else(String::new, |kind| format!("{kind:?}"));
    let number = match header.kind() {
        Some(kind) if kind.is_numbered() => format!(" {}", header.sequence),
        _ => String::new(),
    };
    let again =
        if header.class == Class::Repair as u8 && !number.is_empty() { " again" } else { "" };
    let (source, records) = (header.source, header.record_count);
    format!("{} gets {kind}{number} of {source}{again}, {records} records", receiver.0)
}
