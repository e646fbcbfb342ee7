//! What a law needs of an adapter, and the few moves that all laws are written in.

use shared_types::ids::CraftId;
use shared_types::transport::{Destination, Endpoint, Peers, SendError};
use shared_types::wire::{Class, Header, Kind, Losses};

/// Crafts of a fleet under test, the centre included.
pub(crate) const CRAFTS: u32 = 5;

/// Run id of every fleet's samples is up to the fleet; this one is nobody's.
pub(crate) const FOREIGN_RUN: u64 = 0xdead_0000_0000_0001;

/// Five crafts and an orchestrator on one adapter.
pub(crate) trait Fleet {
    /// The run id that samples carry.
    fn run(&self) -> u64;
    fn craft(&mut self, craft: u32) -> &mut dyn Endpoint;
    fn orchestrator(&mut self) -> &mut dyn Endpoint;
    /// Lets everything that was sent arrive.
    fn settle(&mut self);
    /// Puts a sample into a craft's inbox as it is.
    fn inject(&mut self, receiver: u32, header: Header, payload: &[u8]);
}

/// A sample that was handed over.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Received {
    pub(crate) destination: Destination,
    pub(crate) header: Header,
    pub(crate) payload: Vec<u8>,
}

impl Received {
    /// The number that [`send_number`] wrote.
    pub(crate) fn number(&self) -> u32 {
        u32::from_le_bytes(self.payload[..4].try_into().expect("four bytes"))
    }
}

/// Everybody may send to everybody, in every way.
pub(crate) fn open_everything(fleet: &mut dyn Fleet) {
    let all = |own: u32| Peers {
        unicast: (0..CRAFTS).filter(|&craft| craft != own).map(CraftId).collect(),
        sends_multicast: true,
        receives_multicast: true,
    };
    for craft in 0..CRAFTS {
        fleet.craft(craft).open_ports(&all(craft)).expect("ports open");
    }
    fleet.orchestrator().open_ports(&all(u32::MAX)).expect("ports open");
    for craft in 0..CRAFTS {
        fleet.craft(craft).update_connections().expect("connections come up");
    }
    fleet.orchestrator().update_connections().expect("connections come up");
}

/// A header as a craft's core fills it.
pub(crate) fn delta() -> Header {
    Header::new(Class::Replication, Kind::Delta)
}

/// Sends a sample of four bytes that say `number`.
pub(crate) fn send_number(
    endpoint: &mut dyn Endpoint,
    to: Destination,
    number: u32,
) -> Result<(), SendError> {
    endpoint.send(to, delta(), 4, &mut |payload| payload.copy_from_slice(&number.to_le_bytes()))
}

pub(crate) fn to_craft(craft: u32) -> Destination {
    Destination::Craft(CraftId(craft))
}

/// Reads all that has arrived at `endpoint`.
pub(crate) fn drain(endpoint: &mut dyn Endpoint) -> Vec<Received> {
    let mut received = Vec::new();
    loop {
        let count = endpoint
            .drain(&mut |destination, header, payload| {
                received.push(Received { destination, header: *header, payload: payload.to_vec() });
            })
            .expect("drains");
        if count == 0 {
            return received;
        }
    }
}

/// Lets everything arrive and reads it at `craft`.
pub(crate) fn receive(fleet: &mut dyn Fleet, craft: u32) -> Vec<Received> {
    fleet.settle();
    drain(fleet.craft(craft))
}

pub(crate) fn numbers(received: &[Received]) -> Vec<u32> {
    received.iter().map(Received::number).collect()
}

/// Reads at every craft and retries at every sender until nothing waits any more.
pub(crate) fn drain_until_quiet(fleet: &mut dyn Fleet) -> Vec<Vec<Received>> {
    let mut received = vec![Vec::new(); CRAFTS as usize];
    loop {
        let mut moved = fleet.orchestrator().flush().expect("flushes");
        for craft in 0..CRAFTS {
            moved += fleet.craft(craft).flush().expect("flushes");
        }
        fleet.settle();
        for craft in 0..CRAFTS {
            let arrived = drain(fleet.craft(craft));
            moved += arrived.len();
            received[craft as usize].extend(arrived);
        }
        if moved == 0 {
            return received;
        }
    }
}

/// Losses of all endpoints together.
pub(crate) fn take_losses(fleet: &mut dyn Fleet) -> Losses {
    let mut losses = fleet.orchestrator().take_losses();
    for craft in 0..CRAFTS {
        losses += fleet.craft(craft).take_losses();
    }
    losses
}
