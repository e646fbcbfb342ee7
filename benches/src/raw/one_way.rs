//! One-way latency: half a round trip between two processes, stamps on.
//!
//! Child 0 sends, child 1 sends back what it received; both write the time of sending into the
//! header, as every sample of the product carries it. Two services, one a direction, so that nobody
//! receives its own samples.

use super::RawError;
use super::child::Child;
use super::port::{Receiver, SampleHeader, Sender, ServicePlan, create_node};

/// From child 0 to child 1.
pub const THERE: ServicePlan = ServicePlan { name: "there", publishers: 1, subscribers: 1 };

/// From child 1 to child 0.
pub const BACK: ServicePlan = ServicePlan { name: "back", publishers: 1, subscribers: 1 };

/// Takes part as child `index` of two, and reports to the parent.
///
/// # Errors
/// If the parent, the peer or iceoryx2 fails.
pub fn take_part(
    mut child: Child,
    index: u32,
    warm_up: u32,
    measured: u32,
) -> Result<(), RawError> {
    child.await_services()?;
    let node = create_node(child.area())?;
    let (sends_on, receives_on) = if index == 0 { (THERE, BACK) } else { (BACK, THERE) };
    let (sender, receiver) =
        (Sender::open(&node, &sends_on)?, Receiver::open(&node, &receives_on)?);
    child.await_peers()?;
    sender.connect()?;
    receiver.connect()?;
    child.await_start()?;
    let mut times = super::empty_histogram();
    for number in 0..warm_up + measured {
        if index == 0 {
            let begun_ns = super::now_ns();
            sender.send(SampleHeader { source: index, number, published_ns: begun_ns })?;
            await_sample(&receiver, number)?;
            let round_trip_ns = super::now_ns() - begun_ns;
            if number >= warm_up {
                times.saturating_record(round_trip_ns / 2);
            }
        } else {
            await_sample(&receiver, number)?;
            let published_ns = super::now_ns();
            sender.send(SampleHeader { source: index, number, published_ns })?;
        }
    }
    child.finish(&times)
}

/// Polls until sample `number` has arrived.
fn await_sample(receiver: &Receiver, number: u32) -> Result<(), RawError> {
    loop {
        match receiver.receive()? {
            Some(header) if header.number == number => return Ok(()),
            Some(header) => {
                return Err(RawError::Unexpected(format!("{header:?} instead of {number}")));
            }
            None => std::thread::yield_now(),
        }
    }
}
