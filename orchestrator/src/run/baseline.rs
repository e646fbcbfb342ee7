//! Takes the raw hop of a host: a datagram of a Unix socket there and back between two threads that
//! sleep in the kernel while they wait.
//!
//! It holds nothing of ours on purpose, needs some tenths of a second, and leaves nothing behind. Both
//! ends stay on processors of the fleet; whoever waits longer than [`PATIENCE`] gives up, and the run
//! goes on without a baseline. What it is for: see `results::baseline`.

use crate::launch::placement::Placement;
use crate::results::baseline::{Baseline, RawHops};
use crate::results::statistics::{Quantile, time_histogram};
use hdrhistogram::Histogram;
use rustix::thread::{CpuSet, sched_setaffinity};
use shared_types::ids::CraftId;
use shared_types::transport::clock;
use std::collections::BTreeSet;
use std::io::{self, ErrorKind};
use std::os::unix::net::UnixDatagram;
use std::time::Duration;

/// Length of a datagram: that of the other raw programs.
const BYTES: usize = 128;
/// Round trips before those that count.
const WARM_UP: u32 = 500;
/// Round trips that count: the 99th percentile needs a thousand.
const MEASURED: u32 = 2_000;
/// How long an end waits for the other.
const PATIENCE: Duration = Duration::from_secs(1);

/// One measurement, and where it was taken.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hops {
    processors: [u32; 2],
    hops: RawHops,
}

impl Hops {
    /// Measures between two processors of a fleet of `crafts`, which must not run meanwhile.
    ///
    /// # Errors
    /// If the system refuses, or an end waits too long.
    pub(super) fn measure(placement: &Placement, crafts: u32) -> io::Result<Self> {
        let processors = two_of(placement, crafts);
        let times = exchange(processors)?;
        let quantile = |quantile: Quantile| quantile.of(&times).unwrap_or_default();
        let (p50_ns, p99_ns) = (quantile(Quantile::P50), quantile(Quantile::P99));
        Ok(Self { processors, hops: RawHops { n: times.len(), p50_ns, p99_ns } })
    }

    /// The baseline of a block whose fleet ran between this and `after`.
    #[expect(clippy::cast_possible_truncation, reason = "a datagram is short")]
    pub(super) const fn until(&self, after: &Self) -> Baseline {
        Baseline {
            processors: self.processors,
            bytes: BYTES as u32,
            warm_up: WARM_UP,
            before: self.hops,
            after: after.hops,
        }
    }
}

/// The first two processors that the fleet may use; the same twice where it has one.
fn two_of(placement: &Placement, crafts: u32) -> [u32; 2] {
    let processors: BTreeSet<u32> =
        (0..crafts).flat_map(|craft| placement.of(CraftId(craft))).copied().collect();
    let mut processors = processors.into_iter();
    let first = processors.next().unwrap_or(0);
    [first, processors.next().unwrap_or(first)]
}

/// Half of each round trip between the two processors, ns.
fn exchange(processors: [u32; 2]) -> io::Result<Histogram<u64>> {
    let (asks, answers) = UnixDatagram::pair()?;
    for end in [&asks, &answers] {
        end.set_read_timeout(Some(PATIENCE))?;
    }
    std::thread::scope(|threads| {
        let answering = threads.spawn(move || answer(&answers, processors[1]));
        let asking = threads.spawn(move || ask(&asks, processors[0]));
        let asked = asking.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        let answered = answering.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        answered.and(asked)
    })
}

fn ask(end: &UnixDatagram, processor: u32) -> io::Result<Histogram<u64>> {
    stay_on(processor)?;
    let (mut times, mut datagram) = (time_histogram(), [0; BYTES]);
    for number in 0..WARM_UP + MEASURED {
        let began = clock::now();
        end.send(&datagram)?;
        receive(end, &mut datagram)?;
        if number >= WARM_UP {
            times.saturating_record(clock::now().since(began) / 2);
        }
    }
    Ok(times)
}

fn answer(end: &UnixDatagram, processor: u32) -> io::Result<()> {
    stay_on(processor)?;
    let mut datagram = [0; BYTES];
    for _ in 0..WARM_UP + MEASURED {
        receive(end, &mut datagram)?;
        end.send(&datagram)?;
    }
    Ok(())
}

/// Sleeps until a datagram is there.
fn receive(end: &UnixDatagram, datagram: &mut [u8; BYTES]) -> io::Result<()> {
    loop {
        match end.recv(datagram) {
            Ok(_) => return Ok(()),
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
}

fn stay_on(processor: u32) -> io::Result<()> {
    let mut set = CpuSet::new();
    set.set(processor as usize);
    Ok(sched_setaffinity(None, &set)?)
}

#[cfg(test)]
mod tests {
    use super::{BYTES, Hops, MEASURED};
    use crate::launch::placement::{Placement, Processors};
    use shared_types::rng::{Purpose, Stream};
    use shared_types::scenario::Pinning;

    #[test]
    fn a_raw_hop_is_measured_on_processors_of_the_fleet_and_takes_time() {
        let allowed = Processors::of_this_process().unwrap();
        let mut stream = Stream::new(1, 0, Purpose::Order, 0);
        let placement = Placement::draw(&allowed, Pinning::Balanced, 4, &mut stream);
        let [before, after] = [(); 2].map(|()| Hops::measure(&placement, 4).unwrap());
        let baseline = before.until(&after);
        assert_eq!((baseline.before.n, baseline.bytes as usize), (u64::from(MEASURED), BYTES));
        assert!(baseline.processors.iter().all(|one| allowed.logical().contains(one)));
        assert!(baseline.before.p50_ns > 0 && baseline.after.p50_ns <= baseline.after.p99_ns);
        let (least, most) =
            (before.hops.p50_ns.min(after.hops.p50_ns), before.hops.p50_ns.max(after.hops.p50_ns));
        assert!(baseline.hop_ns() >= least as f64 && baseline.hop_ns() <= most as f64);
    }
}
