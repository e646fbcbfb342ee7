//! All-to-all rounds: every process sends one sample to all others and waits for theirs.
//!
//! One service connects all; iceoryx2 delivers a process its own samples too, which are received and
//! not counted. No process can be more than one round ahead of another, because its next round needs
//! a sample of everybody. Child 0 reads the clock once a round; nobody else reads it.

use super::RawError;
use super::child::Child;
use super::port::{Receiver, SampleHeader, Sender, ServicePlan, create_node};
use hdrhistogram::Histogram;

/// The service of a fleet of `processes`.
#[must_use]
pub fn service(processes: usize) -> ServicePlan {
    ServicePlan { name: "round", publishers: processes, subscribers: processes }
}

/// Takes part as child `index` of `processes`, and reports to the parent.
///
/// # Errors
/// If the parent, a peer or iceoryx2 fails.
pub fn take_part(
    mut child: Child,
    index: u32,
    processes: u32,
    warm_up: u32,
    measured: u32,
) -> Result<(), RawError> {
    child.await_services()?;
    let plan = service(processes as usize);
    let node = create_node(child.area())?;
    let (sender, receiver) = (Sender::open(&node, &plan)?, Receiver::open(&node, &plan)?);
    child.await_peers()?;
    sender.connect()?;
    receiver.connect()?;
    child.await_start()?;
    let mut recorder = Recorder { times: super::empty_histogram(), skipped: warm_up, begun_ns: 0 };
    let mut arrived = [0_u32; 2];
    recorder.begun_ns = super::now_ns();
    for round in 0..warm_up + measured {
        sender.send(SampleHeader { source: index, number: round, published_ns: 0 })?;
        let parity = (round % 2) as usize;
        while arrived[parity] < processes - 1 {
            match receiver.receive()? {
                Some(header) if header.source == index => {}
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
