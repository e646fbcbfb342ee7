//! One-way latency: half a round trip between two processes, stamps on.
//!
//! Child 0 sends, child 1 sends back what it received; both write the time of sending into the
//! header, as every sample of the product carries it. iceoryx2 has two services, one a direction, so
//! that nobody receives its own samples.

use super::RawError;
use super::area::AreaName;
use super::child::Child;
use super::command::Exchanges;
use super::datagram::{DatagramLink, Waiting};
use super::fleet::{self, Shared};
use super::link::Link;
use super::port::{Ports, SampleHeader, ServicePlan, Services, TURN_BY_TURN_SAMPLES};
use clap::ValueEnum;
use hdrhistogram::Histogram;
use std::borrow::Cow;

/// From child 0 to child 1.
const THERE: ServicePlan = between_two("there");

/// From child 1 to child 0.
const BACK: ServicePlan = between_two("back");

const fn between_two(name: &'static str) -> ServicePlan {
    ServicePlan {
        name: Cow::Borrowed(name),
        publishers: 1,
        subscribers: 1,
        buffered_samples: TURN_BY_TURN_SAMPLES,
    }
}

/// What the two processes exchange samples over, and how they wait.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Over {
    /// Shared memory, polling
    #[default]
    Iceoryx2,
    /// Unix datagram sockets that do not block, polling
    Datagrams,
    /// Unix datagram sockets, sleeping in the kernel
    BlockingDatagrams,
}

/// Measures one-way latency over `over` in `area`; returns the times in ns.
///
/// # Errors
/// If a child fails, a signal arrives, or the system refuses.
pub fn measure(area: &AreaName, over: Over) -> Result<Histogram<u64>, RawError> {
    match over {
        Over::Iceoryx2 => {
            fleet::measure(area, 2, || Services::create(area, &[THERE, BACK]).map(Shared::known))
        }
        Over::Datagrams | Over::BlockingDatagrams => {
            fleet::measure(area, 2, || Ok(Shared::known(())))
        }
    }
}

/// Takes part as child `index` of two, and reports to the parent.
///
/// # Errors
/// If the parent, the peer or the transport fails.
pub fn take_part(
    mut child: Child,
    index: u32,
    over: Over,
    exchanges: Exchanges,
) -> Result<(), RawError> {
    child.await_opening()?;
    let waiting = match over {
        Over::Iceoryx2 => {
            let (sends_on, receives_on) = if index == 0 { (THERE, BACK) } else { (BACK, THERE) };
            let ports = Ports::open(child.area(), &sends_on, &receives_on)?;
            child.await_peers()?;
            ports.connect()?;
            return exchange(child, index, ports, exchanges);
        }
        Over::Datagrams => Waiting::Poll,
        Over::BlockingDatagrams => Waiting::Block,
    };
    let mut link = DatagramLink::bind(child.area(), index, waiting)?;
    child.await_peers()?;
    link.connect(child.area(), [1 - index])?;
    exchange(child, index, link, exchanges)
}

/// Sends there and back over `link`.
fn exchange(
    mut child: Child,
    index: u32,
    mut link: impl Link,
    Exchanges { warm_up, measured }: Exchanges,
) -> Result<(), RawError> {
    child.await_start()?;
    let mut times = super::empty_histogram();
    for number in 0..warm_up + measured {
        if index == 0 {
            let begun_ns = super::now_ns();
            link.send(SampleHeader { source: index, number, published_ns: begun_ns })?;
            await_sample(&mut link, number)?;
            let round_trip_ns = super::now_ns() - begun_ns;
            if number >= warm_up {
                times.saturating_record(round_trip_ns / 2);
            }
        } else {
            await_sample(&mut link, number)?;
            let published_ns = super::now_ns();
            link.send(SampleHeader { source: index, number, published_ns })?;
        }
    }
    child.finish(&times)
}

/// Polls until sample `number` has arrived.
fn await_sample(link: &mut impl Link, number: u32) -> Result<(), RawError> {
    loop {
        match link.receive()? {
            Some(header) if header.number == number => return Ok(()),
            Some(header) => {
                return Err(RawError::Unexpected(format!("{header:?} instead of {number}")));
            }
            None => std::thread::yield_now(),
        }
    }
}
