//! The clocks of a real process. Core code is handed times; only shells read them here.

use crate::time::Nanos;
use rustix::time::{ClockId, clock_gettime};

/// Now, on a clock that all processes of the host share and that never steps (`CLOCK_MONOTONIC`).
#[must_use]
pub fn now() -> Nanos {
    read(ClockId::Monotonic)
}

/// CPU time of this process so far, all threads, user and system.
#[must_use]
pub fn process_cpu() -> Nanos {
    read(ClockId::ProcessCPUTime)
}

fn read(clock: ClockId) -> Nanos {
    const NANOS_PER_SECOND: u64 = 1_000_000_000;
    let time = clock_gettime(clock);
    // Both parts are non-negative on these clocks, which start at zero.
    Nanos(time.tv_sec.unsigned_abs() * NANOS_PER_SECOND + time.tv_nsec.unsigned_abs())
}

#[cfg(test)]
mod tests {
    #[test]
    fn time_never_goes_back() {
        let (first_cpu, first) = (super::process_cpu(), super::now());
        assert!(first.0 > 0);
        let (second_cpu, second) = (super::process_cpu(), super::now());
        assert!(first <= second && first_cpu <= second_cpu);
    }
}
