//! Whether a block had the host for itself.
//!
//! Before a fleet is started and after it has ended, a fixed loop is run and timed; around the timing
//! cells the CPU time of the fleet's processors is set against that of our own processes. What others
//! used is foreign. All of it is kept as measured; what is too much is decided where results are
//! summed up. Own processes wait for each other, so their waiting is told and not judged; the wait of
//! the loop, which runs while the fleet does not, is.

use crate::launch::placement::Placement;
use crate::results::host::HostCheck;
use shared_types::ids::CraftId;
use shared_types::transport::clock;
use std::collections::BTreeSet;
use std::hint::black_box;

/// Passes of the loop. The time of the median pass counts, so that one interrupt or one preemption is not
/// taken for a slow host.
const SPIN_PASSES: usize = 5;

/// Rounds of one pass: some two milliseconds.
const SPIN_ROUNDS: u64 = 4_000_000;

/// Nanoseconds of a tick of `/proc/stat`, which the kernel fixes at 100 a second for its readers.
const TICK_NS: u64 = 10_000_000;

/// All passes of the loop.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Spin {
    /// What they would have taken if each were the median one.
    time_ns: u64,
    /// How long they waited for a processor.
    delay_ns: u64,
}

impl Spin {
    /// Runs the loop.
    pub(super) fn run() -> Self {
        let waited = schedule_of("/proc/thread-self/schedstat");
        let mut passes = [0; SPIN_PASSES];
        for time_ns in &mut passes {
            let began = clock::now();
            let mut value = 1_u64;
            for round in 0..SPIN_ROUNDS {
                value = black_box(value.rotate_left(5) ^ round);
            }
            black_box(value);
            *time_ns = clock::now().since(began);
        }
        passes.sort_unstable();
        let delay_ns =
            schedule_of("/proc/thread-self/schedstat").delay_ns.saturating_sub(waited.delay_ns);
        Self { time_ns: passes[SPIN_PASSES / 2] * SPIN_PASSES as u64, delay_ns }
    }
}

/// CPU time and waiting for a CPU.
#[derive(Clone, Copy, Debug, Default)]
struct Schedule {
    cpu_ns: u64,
    delay_ns: u64,
}

/// The state of the host at one moment.
#[derive(Clone, Debug)]
pub(super) struct Sample {
    at_ns: u64,
    busy_ns: u64,
    own: Schedule,
}

impl Sample {
    /// Reads the busy time of the processors of `placement`, and what this process and `processes`
    /// used.
    pub(super) fn take(placement: &Placement, crafts: u32, processes: &[u32]) -> Self {
        let processors: BTreeSet<u32> =
            (0..crafts).flat_map(|craft| placement.of(CraftId(craft))).copied().collect();
        let stat = std::fs::read_to_string("/proc/stat").unwrap_or_default();
        let mut own = Schedule::default();
        for process in processes.iter().copied().chain([std::process::id()]) {
            let used = schedule_of_process(process);
            own.cpu_ns += used.cpu_ns;
            own.delay_ns += used.delay_ns;
        }
        Self { at_ns: clock::now().0, busy_ns: busy_ns(&stat, &processors), own }
    }

    /// What happened from here to `after`, with the loop before and after the fleet.
    pub(super) fn until(&self, after: &Self, spins: (Spin, Spin)) -> HostCheck {
        let own_cpu_ns = after.own.cpu_ns.saturating_sub(self.own.cpu_ns);
        HostCheck {
            measured_ns: after.at_ns.saturating_sub(self.at_ns),
            busy_ns: after.busy_ns.saturating_sub(self.busy_ns),
            own_cpu_ns,
            own_delay_ns: after.own.delay_ns.saturating_sub(self.own.delay_ns),
            spin_before_ns: spins.0.time_ns,
            spin_after_ns: spins.1.time_ns,
            spin_delay_ns: spins.0.delay_ns + spins.1.delay_ns,
        }
    }
}

/// All threads of a process; 0 of one that is gone.
fn schedule_of_process(process: u32) -> Schedule {
    let mut sum = Schedule::default();
    let Ok(threads) = std::fs::read_dir(format!("/proc/{process}/task")) else { return sum };
    for thread in threads.flatten() {
        let one = schedule_of(&thread.path().join("schedstat").to_string_lossy());
        sum.cpu_ns += one.cpu_ns;
        sum.delay_ns += one.delay_ns;
    }
    sum
}

fn schedule_of(path: &str) -> Schedule {
    let text = std::fs::read_to_string(path).unwrap_or_default();
    let mut numbers = text.split_whitespace().map(|word| word.parse().unwrap_or(0));
    let mut next = || numbers.next().unwrap_or(0);
    Schedule { cpu_ns: next(), delay_ns: next() }
}

/// Time that `processors` did not idle, by the text of `/proc/stat`: all columns but idle, waiting for
/// a disk, and guests, which are in user time already.
fn busy_ns(stat: &str, processors: &BTreeSet<u32>) -> u64 {
    let lines = stat.lines().filter_map(|line| {
        let (name, columns) = line.split_once(' ')?;
        let number: u32 = name.strip_prefix("cpu")?.parse().ok()?;
        processors.contains(&number).then_some(columns)
    });
    let busy_ticks = |columns: &str| -> u64 {
        let ticks = columns.split_whitespace().map(|ticks| ticks.parse::<u64>().unwrap_or(0));
        let is_busy = |place: &usize| !matches!(place, 3 | 4) && *place < 8;
        ticks.enumerate().filter(|(place, _)| is_busy(place)).map(|(_, ticks)| ticks).sum()
    };
    lines.map(busy_ticks).sum::<u64>() * TICK_NS
}

#[cfg(test)]
mod tests {
    use super::{Spin, busy_ns, schedule_of_process};
    use std::collections::BTreeSet;

    #[test]
    fn busy_is_what_is_neither_idle_nor_waiting_nor_counted_twice() {
        let stat = "cpu  99 99 99 99 99 99 99 99 99 99\ncpu0 1 2 4 1000 1000 8 16 32 500 500\n\
                    cpu1 100 0 0 0 0 0 0 0 0 0\nintr 5\n";
        assert_eq!(busy_ns(stat, &BTreeSet::from([0])), 63 * 10_000_000);
        assert_eq!(busy_ns(stat, &BTreeSet::from([0, 1])), 163 * 10_000_000);
        assert_eq!(busy_ns("", &BTreeSet::from([0])), 0);
    }

    #[test]
    fn the_loop_takes_time_that_is_seen_as_our_own() {
        let before = schedule_of_process(std::process::id()).cpu_ns;
        let spin = Spin::run();
        let used = schedule_of_process(std::process::id()).cpu_ns - before;
        assert!(spin.time_ns > 0);
        assert!(used + spin.delay_ns > 0, "{used}");
        assert_eq!(schedule_of_process(u32::MAX).cpu_ns, 0, "no such process");
    }
}
