//! What `doctor` asks the machine.

use crate::launch::host::{Host, shared_memory};
use crate::launch::placement::Processors;
use agent::process::startup::run_is_alive;
use rustix::fs::statfs;
use rustix::process::{PidfdFlags, getpid, parent_process_death_signal, pidfd_open};
use shared_types::transport::RunPaths;
use shared_types::transport::paths::SHM;

/// What the kernel calls a tmpfs (`TMPFS_MAGIC` in linux/magic.h).
const TMPFS: u64 = 0x0102_1994;

/// The file system of shared memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SharedMemory {
    /// Whether it lies in memory.
    pub is_tmpfs: bool,
    /// Its size.
    pub total_bytes: u64,
    /// What is free of it.
    pub free_bytes: u64,
}

/// A machine, as far as fleets care.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Facts {
    /// Kernel release.
    pub kernel: String,
    /// Width of an address.
    pub pointer_bits: u32,
    /// Byte order; what lies in shared memory is little-endian.
    pub is_little_endian: bool,
    /// Whether processes can be held by descriptors.
    pub has_pidfd: bool,
    /// Whether a craft can be ended with its orchestrator.
    pub has_death_signal: bool,
    /// `None` if there is none.
    pub shared_memory: Option<SharedMemory>,
    /// What is free; `None` if there is no shared memory.
    pub host: Option<Host>,
    /// Physical cores that this process may use.
    pub core_count: usize,
    /// Logical processors that this process may use.
    pub processor_count: usize,
    /// What the kernel tells the time by.
    pub clock_source: Option<String>,
    /// Runs whose orchestrator lives.
    pub living_runs: usize,
    /// Runs that were left behind.
    pub dead_runs: usize,
}

impl Facts {
    /// Asks this machine. What it does not tell is taken for missing.
    #[must_use]
    pub fn gather() -> Self {
        let processors = Processors::of_this_process().ok();
        // A base that cannot be read holds nothing that this user could clean.
        let runs = RunPaths::list(RunPaths::new(0).base()).unwrap_or_default();
        let living_runs = runs.iter().filter(|paths| run_is_alive(paths)).count();
        Self {
            kernel: line_of("/proc/sys/kernel/osrelease").unwrap_or_else(|| "unknown".into()),
            pointer_bits: usize::BITS,
            is_little_endian: cfg!(target_endian = "little"),
            has_pidfd: pidfd_open(getpid(), PidfdFlags::empty()).is_ok(),
            has_death_signal: parent_process_death_signal().is_ok(),
            shared_memory: gather_shared_memory(),
            host: Host::read().ok(),
            core_count: processors.as_ref().map_or(0, Processors::core_count),
            processor_count: processors.map_or(0, |processors| processors.logical().len()),
            clock_source: line_of(
                "/sys/devices/system/clocksource/clocksource0/current_clocksource",
            ),
            living_runs,
            dead_runs: runs.len() - living_runs,
        }
    }
}

fn gather_shared_memory() -> Option<SharedMemory> {
    let space = shared_memory().ok()?;
    Some(SharedMemory {
        is_tmpfs: statfs(SHM).is_ok_and(|kind| kind.f_type.cast_unsigned() == TMPFS),
        total_bytes: space.f_blocks.saturating_mul(space.f_frsize),
        free_bytes: space.f_bavail.saturating_mul(space.f_frsize),
    })
}

fn line_of(path: &str) -> Option<String> {
    Some(std::fs::read_to_string(path).ok()?.trim().to_owned())
}
