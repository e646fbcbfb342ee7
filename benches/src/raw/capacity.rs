//! How much a bare transport carries: every process sends to all others in turn as fast as they take
//! it, and takes in what comes.
//!
//! Each process sends as many samples as it receives, one by one to the next peer of its round, and
//! passes over a peer that has no room. Child 0 notes how long every [`SLICE`] samples took to arrive;
//! all processes do the same, so the fleet receives N times as many.

use super::RawError;
use super::area::AreaName;
use super::child::Child;
use super::command::Exchanges;
use super::datagram::{DatagramLink, Waiting};
use super::link::Peers;
use super::port::{Mesh, SampleHeader, ServicePlan};
use super::round::{self, Over};
use hdrhistogram::Histogram;

/// Samples that arrive between two looks at the clock.
pub const SLICE: u32 = 1_000;

/// Samples that a subscriber holds per publisher, as many as an inbox of the product.
const BUFFERED_SAMPLES: usize = 64;

/// Samples that are taken in between two that are sent: who receives faster than it sends would
/// otherwise never send.
const TAKEN_AT_ONCE: u32 = 64;

/// What process `index` of `processes` receives on.
fn inbox(index: u32, processes: u32) -> ServicePlan {
    ServicePlan {
        name: format!("inbox-{index}").into(),
        publishers: processes as usize - 1,
        subscribers: 1,
        buffered_samples: BUFFERED_SAMPLES,
    }
}

/// Everybody but `index`, beginning with the next: no inbox is filled by all at once.
fn others(index: u32, processes: u32) -> impl Iterator<Item = u32> {
    (1..processes).map(move |step| (index + step) % processes)
}

/// Measures how long [`SLICE`] samples take to arrive at one of `processes` processes that all send,
/// over `over` in `area`; returns the times in ns.
///
/// # Errors
/// If a child fails, a signal arrives, or the system refuses.
pub fn measure(area: &AreaName, over: Over, processes: u32) -> Result<Histogram<u64>, RawError> {
    let inboxes: Vec<_> = (0..processes).map(|index| inbox(index, processes)).collect();
    round::measure_on(area, over, processes, &inboxes)
}

/// Takes part as child `index` of `processes`, and reports to the parent. An exchange is [`SLICE`]
/// samples.
///
/// # Errors
/// If the parent, a peer or the transport fails.
pub fn take_part(
    mut child: Child,
    index: u32,
    processes: u32,
    over: Over,
    exchanges: Exchanges,
) -> Result<(), RawError> {
    child.await_opening()?;
    match over {
        Over::Iceoryx2 => {
            let peers: Vec<_> =
                others(index, processes).map(|peer| inbox(peer, processes)).collect();
            let mesh = Mesh::open(child.area(), &inbox(index, processes), &peers)?;
            child.await_peers()?;
            mesh.connect()?;
            stream(child, index, peers.len(), mesh, exchanges)
        }
        Over::Datagrams => {
            let mut link = DatagramLink::bind(child.area(), index, Waiting::Poll)?;
            child.await_peers()?;
            link.connect(child.area(), others(index, processes))?;
            stream(child, index, processes as usize - 1, link, exchanges)
        }
    }
}

/// Sends to `peers` peers until each has its part, and takes in as many.
fn stream(
    mut child: Child,
    index: u32,
    peers: usize,
    mut link: impl Peers,
    Exchanges { warm_up, measured }: Exchanges,
) -> Result<(), RawError> {
    child.await_start()?;
    let each = (u64::from(warm_up + measured) * u64::from(SLICE)).div_ceil(peers as u64);
    let total = each * peers as u64;
    let (mut left, mut sent, mut received) = (vec![each; peers], 0, 0);
    let mut times = super::empty_histogram();
    let (mut turn, mut slices, mut begun_ns) = (0, 0, super::now_ns());
    while sent < total || received < total {
        let mut is_idle = true;
        turn = (turn + 1) % peers;
        if left[turn] > 0 {
            let number = u32::try_from(left[turn] % u64::from(u32::MAX)).unwrap_or(0);
            let header = SampleHeader { source: index, number, published_ns: 0 };
            if link.try_send(turn, header)? {
                left[turn] -= 1;
                sent += 1;
                is_idle = false;
            }
        }
        for _ in 0..TAKEN_AT_ONCE {
            if link.receive()?.is_none() {
                break;
            }
            is_idle = false;
            received += 1;
            if received % u64::from(SLICE) == 0 {
                let now_ns = super::now_ns();
                if index == 0 && slices >= warm_up {
                    times.saturating_record(now_ns - begun_ns);
                }
                slices += 1;
                begun_ns = now_ns;
            }
        }
        if is_idle {
            std::thread::yield_now();
        }
    }
    child.finish(&times)
}
