//! What a run needs, computed before anything starts, and whether the host can carry it.
//!
//! A full tmpfs is not an error but a SIGBUS, and a craft without a descriptor left fails in the middle
//! of its start; so both are refused here, with need and have. The formulas are linear in what a fleet
//! opens: a fixed part per process, a part per unicast link, a part per multicast pair. The constants
//! were counted on running fleets of 2, 10 and 30 crafts (iceoryx2 0.10.0: descriptors in /proc, files
//! and blocks below the run's root and prefix) and rounded up. Not here: reading the host (`host`).

use super::host::{Host, raise_open_files};
use shared_types::limits::OPEN_FILES_MIN;
use shared_types::transport::Peers;
use std::io;

/// Tasks of one craft: its main thread and the guard.
const TASKS_PER_PROCESS: u64 = 2;

/// Private memory of one craft, bytes; promised are 20 MiB, measured 4 to 6.
const PRIVATE_BYTES_PER_PROCESS: u64 = 8 << 20;

/// The size of a page: the least that a touched sample occupies.
const PAGE_BYTES: u64 = 4096;

/// Copies of an epoch's networks that may exist at once: the newest, the one that crafts still read,
/// what a grown segment has left behind; rounded up to a power of two each.
const WORLD_COPIES: u64 = 6;

/// Samples that a strategy without a pipeline may have under way on one link: memory is used again as
/// soon as a sample is read, and a lockstep turn is closed only when all are.
pub const LOCKSTEP_SAMPLES_IN_FLIGHT: u64 = 4;

/// What one epoch opens.
#[derive(Clone, Copy, Debug)]
pub struct EpochPorts<'a> {
    /// The peers of every process, the centre last.
    pub peers: &'a [Peers],
    /// Samples that may be under way on one link: [`LOCKSTEP_SAMPLES_IN_FLIGHT`], or the depth of
    /// the pipeline.
    pub samples_in_flight: u64,
}

/// What one fleet opens at most; a fleet whose epochs differ has the largest of each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FleetShape {
    /// Crafts, the centre counted.
    pub process_count: u64,
    /// Descriptors of the craft that opens most.
    pub craft_open_files: u64,
    /// Unicast links, counted once per sender and receiver.
    pub links: u64,
    /// Samples that may be unread at the same time, on all links.
    pub samples_in_flight: u64,
    /// Whether an epoch multicasts.
    pub multicasts: bool,
}

impl FleetShape {
    /// The shape of a fleet that runs `epochs`.
    #[must_use]
    pub fn of_epochs<'a>(epochs: impl IntoIterator<Item = EpochPorts<'a>>) -> Self {
        epochs.into_iter().map(|epoch| Self::of_epoch(&epoch)).fold(Self::default(), Self::larger)
    }

    fn of_epoch(epoch: &EpochPorts<'_>) -> Self {
        let process_count = epoch.peers.len() as u64;
        let multicasts = epoch.peers.iter().any(|peers| peers.sends_multicast);
        let mut sources = vec![0_u64; epoch.peers.len()];
        for destination in epoch.peers.iter().flat_map(|peers| &peers.unicast) {
            sources[destination.index()] += 1;
        }
        let links = sources.iter().sum::<u64>();
        let open_files = epoch.peers.iter().zip(&sources).map(|(peers, &sources)| {
            let destinations = peers.unicast.len() as u64;
            // A unicast sender 10 (inbox, bell and their segments), a source 2. A multicast peer 4,
            // and its bell 5 where it is no unicast peer as well.
            let others = if multicasts { process_count - 1 } else { 0 };
            let standing = 48 + 10 * destinations + 3 * sources;
            standing + 4 * others + 5 * others.saturating_sub(destinations)
        });
        Self {
            process_count,
            craft_open_files: open_files.max().unwrap_or(0),
            links,
            // Every craft also sends to the orchestrator, and the orchestrator to all.
            samples_in_flight: links * epoch.samples_in_flight
                + (2 + u64::from(multicasts)) * process_count * LOCKSTEP_SAMPLES_IN_FLIGHT,
            multicasts,
        }
    }

    fn larger(self, other: Self) -> Self {
        Self {
            process_count: self.process_count.max(other.process_count),
            craft_open_files: self.craft_open_files.max(other.craft_open_files),
            links: self.links.max(other.links),
            samples_in_flight: self.samples_in_flight.max(other.samples_in_flight),
            multicasts: self.multicasts | other.multicasts,
        }
    }

    /// What the fleet needs, if its largest usual sample has `sample_bytes`, header included, and the
    /// networks of an epoch `world_bytes`.
    #[must_use]
    pub fn demand(&self, sample_bytes: u64, world_bytes: u64) -> Demand {
        let processes = self.process_count;
        let multicast_pairs = if self.multicasts { processes * processes } else { 0 };
        // Counted: 42 + 29 a process, 6 a link, 3 a multicast pair.
        let shared_files = 64 + 32 * processes + 7 * self.links + 3 * multicast_pairs;
        // Counted: 60 KiB a process and 1 KiB for each other process in its tables, 12 KiB a link,
        // 4.4 KiB a multicast pair, and the pages of samples that are under way at the same time.
        let standing_bytes = (1 << 20)
            + processes * (80 << 10)
            + processes * processes * (2 << 10)
            + self.links * (16 << 10)
            + multicast_pairs * (6 << 10);
        let shared_bytes = standing_bytes
            + self.samples_in_flight * sample_bytes.div_ceil(PAGE_BYTES) * PAGE_BYTES
            + WORLD_COPIES * world_bytes.next_power_of_two();
        Demand {
            // The orchestrator holds 8 a craft for services and connections, a pidfd and a pipe.
            open_files: self.craft_open_files.max(96 + 12 * processes),
            shared_bytes,
            shared_files,
            memory_bytes: shared_bytes + processes * PRIVATE_BYTES_PER_PROCESS,
            tasks: processes * TASKS_PER_PROCESS,
        }
    }
}

/// What a run needs of the host.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Demand {
    /// Descriptors of the process that opens most.
    pub open_files: u64,
    /// Bytes of shared memory.
    pub shared_bytes: u64,
    /// Files in shared memory.
    pub shared_files: u64,
    /// Bytes of memory, shared and private.
    pub memory_bytes: u64,
    /// Processes and threads.
    pub tasks: u64,
}

/// What the host cannot give.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ResourceError {
    /// Too few descriptors.
    #[error(
        "a process of this run opens up to {needed} descriptors, the hard limit allows {have}: \
         raise `ulimit -Hn` or run fewer crafts"
    )]
    OpenFiles {
        /// Descriptors needed.
        needed: u64,
        /// The hard limit.
        have: u64,
    },
    /// Too little shared memory.
    #[error(
        "this run needs up to {} MiB in /dev/shm, {} MiB are free: enlarge it (`mount -o \
         remount,size=...`, `docker run --shm-size=...`), run `slateswarm clean`, or run fewer crafts",
        mebibytes(*needed), have >> 20
    )]
    SharedMemory {
        /// Bytes needed.
        needed: u64,
        /// Bytes free.
        have: u64,
    },
    /// Too few files in shared memory.
    #[error(
        "this run makes up to {needed} files in /dev/shm, {have} are free: remount it with a larger \
         nr_inodes, or run fewer crafts"
    )]
    SharedFiles {
        /// Files needed.
        needed: u64,
        /// Files free.
        have: u64,
    },
    /// Too little memory.
    #[error(
        "this run needs up to {} MiB of memory, {} MiB are available: run fewer crafts",
        mebibytes(*needed), have >> 20
    )]
    Memory {
        /// Bytes needed.
        needed: u64,
        /// Bytes available.
        have: u64,
    },
    /// Too few processes.
    #[error(
        "this run starts {needed} processes and threads, {have} more are allowed: raise `ulimit -u` or \
         the control group's pids.max, or run fewer crafts"
    )]
    Tasks {
        /// Processes and threads needed.
        needed: u64,
        /// How many more are allowed.
        have: u64,
    },
    /// The host cannot be asked, or refuses a limit that it should grant.
    #[error("cannot find out what this host has: {0}")]
    Host(String),
}

const fn mebibytes(bytes: u64) -> u64 {
    bytes.div_ceil(1 << 20)
}

impl Demand {
    /// Whether `host` can give what is needed.
    ///
    /// # Errors
    /// Names the first thing that it cannot, with need and have.
    pub fn check(&self, host: &Host) -> Result<(), ResourceError> {
        let (needed, have) = (self.open_files, host.open_files_max);
        if needed > have {
            return Err(ResourceError::OpenFiles { needed, have });
        }
        let (needed, have) = (self.shared_bytes, host.shared_bytes);
        if needed > have {
            return Err(ResourceError::SharedMemory { needed, have });
        }
        let (needed, have) = (self.shared_files, host.shared_files);
        if needed > have {
            return Err(ResourceError::SharedFiles { needed, have });
        }
        match (host.memory_bytes, host.tasks) {
            (Some(have), _) if self.memory_bytes > have => {
                Err(ResourceError::Memory { needed: self.memory_bytes, have })
            }
            (_, Some(have)) if self.tasks > have => {
                Err(ResourceError::Tasks { needed: self.tasks, have })
            }
            _ => Ok(()),
        }
    }

    /// Checks this host and raises the soft limit on descriptors to what is needed, and to the least
    /// that a run asks for where the hard limit lets it.
    ///
    /// # Errors
    /// If the host cannot give what is needed.
    pub fn claim(&self) -> Result<(), ResourceError> {
        let failed = |error: io::Error| ResourceError::Host(error.to_string());
        let host = Host::read().map_err(failed)?;
        self.check(&host)?;
        let wanted = OPEN_FILES_MIN.max(self.open_files).min(host.open_files_max);
        raise_open_files(wanted).map_err(failed)
    }
}

#[cfg(test)]
mod tests {
    use super::{
        Demand, EpochPorts, FleetShape, Host, LOCKSTEP_SAMPLES_IN_FLIGHT, Peers, ResourceError,
    };
    use shared_types::ids::CraftId;

    /// Every craft sends to the `destinations` that follow it.
    fn ring(process_count: u32, destinations: u32, multicasts: bool) -> Vec<Peers> {
        let next =
            |craft| (1..=destinations).map(move |step| CraftId((craft + step) % process_count));
        (0..process_count)
            .map(|craft| Peers {
                unicast: next(craft).collect(),
                sends_multicast: multicasts,
                receives_multicast: multicasts,
            })
            .collect()
    }

    fn demand(process_count: u32, destinations: u32, multicasts: bool) -> Demand {
        let peers = ring(process_count, destinations, multicasts);
        let ports = EpochPorts { peers: &peers, samples_in_flight: LOCKSTEP_SAMPLES_IN_FLIGHT };
        FleetShape::of_epochs([ports]).demand(200, 100_000)
    }

    /// Counted on running fleets: descriptors of one craft, files, bytes with one sample a link.
    const COUNTED: [(u32, u32, bool, u64, u64, u64); 6] = [
        (2, 1, false, 44, 112, 274_432),
        (10, 9, false, 140, 872, 2_015_232),
        (10, 9, true, 177, 1_012, 2_506_752),
        (30, 2, false, 56, 1_272, 3_551_232),
        (30, 2, true, 288, 3_912, 7_483_392),
        (30, 29, true, 477, 7_152, 17_436_672),
    ];

    #[test]
    fn demand_covers_what_running_fleets_were_counted_to_use_and_is_not_absurd() {
        for (processes, destinations, multicasts, descriptors, files, bytes) in COUNTED {
            let peers = ring(processes, destinations, multicasts);
            let ports = EpochPorts { peers: &peers, samples_in_flight: LOCKSTEP_SAMPLES_IN_FLIGHT };
            let shape = FleetShape::of_epochs([ports]);
            let demand = shape.demand(200, 0);
            let within =
                |needed: u64, counted: u64| counted <= needed && needed <= 2 * counted + 64;
            assert!(within(shape.craft_open_files, descriptors), "{shape:?}");
            assert!(within(demand.shared_files, files), "{demand:?}");
            assert!(demand.shared_bytes >= bytes, "{demand:?}");
            assert!(demand.shared_bytes <= 4 * bytes + (2 << 20), "{demand:?}");
        }
    }

    #[test]
    fn largest_real_fleet_fits_the_usual_hard_limits() {
        let demand = demand(129, 128, true);
        assert!(demand.open_files < 4096, "{demand:?}");
        assert!(demand.shared_bytes < 1 << 30, "{demand:?}");
    }

    #[test]
    fn epochs_of_one_fleet_share_what_the_largest_needs() {
        let (narrow, wide) = (ring(10, 1, true), ring(10, 9, false));
        let ports = |peers| EpochPorts { peers, samples_in_flight: 1 };
        let both = FleetShape::of_epochs([ports(&narrow), ports(&wide)]);
        let first = FleetShape::of_epochs([ports(&narrow)]);
        let second = FleetShape::of_epochs([ports(&wide)]);
        assert!(both.multicasts && !second.multicasts);
        assert_eq!(both.links, 90);
        assert_eq!(both.craft_open_files, first.craft_open_files.max(second.craft_open_files));
    }

    const PLENTY: Host = Host {
        open_files: 1024,
        open_files_max: 1 << 20,
        shared_bytes: 1 << 40,
        shared_files: 1 << 30,
        memory_bytes: Some(1 << 40),
        tasks: Some(1 << 20),
    };

    #[test]
    fn what_is_missing_is_refused_with_need_and_have() {
        let demand = demand(10, 9, true);
        assert_eq!(demand.check(&PLENTY), Ok(()));
        let unlimited = Host { memory_bytes: None, tasks: None, ..PLENTY };
        assert_eq!(demand.check(&unlimited), Ok(()));
        let Demand { open_files, shared_bytes, shared_files, memory_bytes, tasks } = demand;
        let rows = [
            (
                Host { open_files_max: open_files - 1, ..PLENTY },
                ResourceError::OpenFiles { needed: open_files, have: open_files - 1 },
            ),
            (
                Host { shared_bytes: shared_bytes - 1, ..PLENTY },
                ResourceError::SharedMemory { needed: shared_bytes, have: shared_bytes - 1 },
            ),
            (
                Host { shared_files: shared_files - 1, ..PLENTY },
                ResourceError::SharedFiles { needed: shared_files, have: shared_files - 1 },
            ),
            (
                Host { memory_bytes: Some(memory_bytes - 1), ..PLENTY },
                ResourceError::Memory { needed: memory_bytes, have: memory_bytes - 1 },
            ),
            (
                Host { tasks: Some(tasks - 1), ..PLENTY },
                ResourceError::Tasks { needed: tasks, have: tasks - 1 },
            ),
        ];
        for (host, refused) in rows {
            assert_eq!(demand.check(&host), Err(refused));
        }
    }

    #[test]
    fn refusal_names_the_numbers_in_words() {
        let error = ResourceError::SharedMemory { needed: (64 << 20) + 1, have: 64 << 20 };
        assert!(
            error
                .to_string()
                .starts_with("this run needs up to 65 MiB in /dev/shm, 64 MiB are free")
        );
    }
}
