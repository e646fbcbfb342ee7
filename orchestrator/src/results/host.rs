//! Whether the host was quiet enough for times to name a winner.
//!
//! Steal time does not tell: a single foreign process doubles turn times with steal at 0. What tells
//! is the CPU time of the fleet's processors that was not ours, and a fixed loop before and after each
//! block. A noisy run keeps all its numbers. Limits are in `shared_types::limits`; how the numbers are
//! taken is in the run's guard.

use super::event::{Event, EventLine};
use super::statistics::as_float;
use serde::{Deserialize, Serialize};
use shared_types::limits::{FOREIGN_CORES_MAX, SPIN_DELAY_SHARE_MAX, SPIN_RATIO_MAX};

/// What was seen of the host around one block; all times in ns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct HostCheck {
    /// How long the timing cells of the block took, warm-up included.
    pub measured_ns: u64,
    /// How long the fleet's processors did not idle in that time, summed.
    pub busy_ns: u64,
    /// CPU time of the orchestrator and the fleet in that time.
    pub own_cpu_ns: u64,
    /// How long they waited for a CPU, mostly for each other.
    pub own_delay_ns: u64,
    /// The fixed loop before the fleet was started.
    pub spin_before_ns: u64,
    /// The same after it had ended.
    pub spin_after_ns: u64,
    /// How long both together waited for a CPU.
    pub spin_delay_ns: u64,
}

impl HostCheck {
    /// Processors that others kept busy, on average.
    #[must_use]
    pub fn foreign_cores(&self) -> f64 {
        let foreign_ns = self.busy_ns.saturating_sub(self.own_cpu_ns);
        as_float(foreign_ns) / as_float(self.measured_ns.max(1))
    }

    /// Share of its time that the fixed loop waited for a CPU.
    #[must_use]
    pub fn spin_delay_share(&self) -> f64 {
        let spun_ns = self.spin_before_ns.saturating_add(self.spin_after_ns);
        as_float(self.spin_delay_ns) / as_float(spun_ns.max(1))
    }
}

/// A word for a run's host.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum HostState {
    /// Nobody else was seen.
    Clean,
    /// Somebody was: no winner of times.
    Noisy,
}

/// One block's check.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BlockCheck {
    /// Which launch.
    pub block: u32,
    /// Crafts, a centre not counted.
    pub size: u32,
    /// As measured.
    #[serde(flatten)]
    pub check: HostCheck,
    /// Processors that others kept busy, on average.
    pub foreign_cores: f64,
    /// The slower of its two loops over the fastest of the run.
    pub spin_ratio: f64,
    /// What that means.
    pub state: HostState,
}

/// All checks of a run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HostReport {
    /// Noisy if any block was; absent if none was checked.
    pub state: Option<HostState>,
    /// In the order in which they were run.
    pub blocks: Vec<BlockCheck>,
}

impl HostReport {
    /// Judges the checks among `events`.
    #[must_use]
    pub fn of(events: &[EventLine]) -> Self {
        let checks = || {
            events.iter().filter_map(|line| match line.event {
                Event::HostChecked { block, size, check } => Some((block, size, check)),
                _ => None,
            })
        };
        let spins = checks().flat_map(|(_, _, check)| [check.spin_before_ns, check.spin_after_ns]);
        let fastest = spins.min().unwrap_or(0).max(1);
        let blocks: Vec<BlockCheck> = checks()
            .map(|(block, size, check)| {
                let slower = check.spin_before_ns.max(check.spin_after_ns);
                let spin_ratio = as_float(slower) / as_float(fastest);
                let foreign_cores = check.foreign_cores();
                let is_noisy = foreign_cores > FOREIGN_CORES_MAX
                    || spin_ratio > SPIN_RATIO_MAX
                    || check.spin_delay_share() > SPIN_DELAY_SHARE_MAX;
                let state = if is_noisy { HostState::Noisy } else { HostState::Clean };
                BlockCheck { block, size, check, foreign_cores, spin_ratio, state }
            })
            .collect();
        let is_noisy = blocks.iter().any(|block| block.state == HostState::Noisy);
        let state = if is_noisy { HostState::Noisy } else { HostState::Clean };
        Self { state: (!blocks.is_empty()).then_some(state), blocks }
    }

    /// Whether times may name a winner: somebody looked, and saw nobody else.
    #[must_use]
    pub fn is_clean(&self) -> bool {
        self.state == Some(HostState::Clean)
    }
}

#[cfg(test)]
mod tests {
    use super::{HostCheck, HostReport, HostState};
    use crate::results::event::{Event, EventLine};

    const QUIET: HostCheck = HostCheck {
        measured_ns: 1_000_000_000,
        busy_ns: 1_840_000_000,
        own_cpu_ns: 1_800_000_000,
        own_delay_ns: 900_000_000,
        spin_before_ns: 10_000_000,
        spin_after_ns: 10_100_000,
        spin_delay_ns: 1_000,
    };

    fn state(checks: &[HostCheck]) -> Option<HostState> {
        let event = |&check: &HostCheck| Event::HostChecked { block: 0, size: 2, check };
        let events: Vec<EventLine> =
            checks.iter().map(|check| EventLine { at_ns: 0, event: event(check) }).collect();
        HostReport::of(&events).state
    }

    #[test]
    fn a_run_is_as_noisy_as_its_noisiest_block() {
        assert_eq!(state(&[]), None, "nobody looked");
        assert_eq!(state(&[QUIET, QUIET]), Some(HostState::Clean));
        let foreign = HostCheck { busy_ns: 2_000_000_000, ..QUIET };
        assert_eq!(state(&[QUIET, foreign]), Some(HostState::Noisy));
        let slower = HostCheck { spin_after_ns: 16_000_000, ..QUIET };
        assert_eq!(state(&[QUIET, slower]), Some(HostState::Noisy));
        let kept_waiting = HostCheck { spin_delay_ns: 5_000_000, ..QUIET };
        assert_eq!(state(&[kept_waiting]), Some(HostState::Noisy));
    }

    #[test]
    fn own_time_beyond_what_ticks_show_is_nobody_elses() {
        let check = HostCheck { own_cpu_ns: 1_900_000_000, ..QUIET };
        assert!(check.foreign_cores().abs() < 1e-9);
    }
}
