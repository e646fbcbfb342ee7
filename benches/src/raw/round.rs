//! All-to-all rounds: every process sends one sample to all others and waits for theirs.
//!
//! Over iceoryx2 one service connects all; it delivers a process its own samples too, which a round
//! waits for like the others, so that they cannot pile up. Over datagrams a process sends one to each
//! other. No process can be more than one round ahead of another, because its next round needs a sample
//! of everybody. Child 0 reads the clock once a round; nobody else reads it.

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

/// What the processes exchange samples over; all poll.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Over {
    /// Shared memory
    #[default]
    Iceoryx2,
    /// Unix datagram sockets that do not block
    Datagrams,
}

/// The service of a fleet of `processes`.
fn service(processes: u32) -> ServicePlan {
    let processes = processes as usize;
    ServicePlan {
        name: "round".into(),
        publishers: processes,
        subscribers: processes,
        buffered_samples: TURN_BY_TURN_SAMPLES,
    }
}

/// Measures rounds of `processes` processes over `over` in `area`; returns the times in ns.
///
/// # Errors
/// If a child fails, a signal arrives, or the system refuses.
pub fn measure(area: &AreaName, over: Over, processes: u32) -> Result<Histogram<u64>, RawError> {
    measure_on(area, over, processes, &[service(processes)])
}

/// The same of what processes do on `services`, which datagrams need none of.
///
/// # Errors
/// As [`measure`].
pub(super) fn measure_on(
    area: &AreaName,
    over: Over,
    processes: u32,
    services: &[ServicePlan],
) -> Result<Histogram<u64>, RawError> {
    match over {
        Over::Iceoryx2 => {
            fleet::measure(area, processes, || Services::create(area, services).map(Shared::known))
        }
        Over::Datagrams => fleet::measure(area, processes, || Ok(Shared::known(()))),
    }
}

/// Takes part as child `index` of `processes`, and reports to the parent.
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
            let plan = service(processes);
            let ports = Ports::open(child.area(), &plan, &plan)?;
            child.await_peers()?;
            ports.connect()?;
            exchange(child, index, processes, ports, exchanges)
        }
        Over::Datagrams => {
            let mut link = DatagramLink::bind(child.area(), index, Waiting::Poll)?;
            child.await_peers()?;
            // Everybody starts with another peer, so that no queue is filled by all at once.
            let others = (1..processes).map(|step| (index + step) % processes);
            link.connect(child.area(), others)?;
            exchange(child, index, processes - 1, link, exchanges)
        }
    }
}

/// Plays rounds over `link`, which delivers `awaited` samples a round.
fn exchange(
    mut child: Child,
    index: u32,
    awaited: u32,
    mut link: impl Link,
    Exchanges { warm_up, measured }: Exchanges,
) -> Result<(), RawError> {
    child.await_start()?;
    let mut recorder = Recorder { times: super::empty_histogram(), skipped: warm_up, begun_ns: 0 };
    let mut arrived = [0_u32; 2];
    recorder.begun_ns = super::now_ns();
    for round in 0..warm_up + measured {
        link.send(SampleHeader { source: index, number: round, published_ns: 0 })?;
        let parity = (round % 2) as usize;
        while arrived[parity] < awaited {
            match link.receive()? {
                Some(header) if header.number == round || header.number == round + 1 => {
                    arrived[(header.number % 2) as usize] += 1;
                }
                Some(header) => {
                    return Err(RawError::Unexpected(format!("{header:?} in round {round}")));
                }
                None => std::thread::yield_now(),
            }
        }
        arrived[parity] = 0;
        if index == 0 {
            recorder.end_round();
        }
    }
    child.finish(&recorder.times)
}

/// Times of rounds: from the end of one to the end of the next.
struct Recorder {
    times: Histogram<u64>,
    skipped: u32,
    begun_ns: u64,
}

impl Recorder {
    fn end_round(&mut self) {
        let now_ns = super::now_ns();
        if self.skipped == 0 {
            self.times.saturating_record(now_ns - self.begun_ns);
        } else {
            self.skipped -= 1;
        }
        self.begun_ns = now_ns;
    }
}
