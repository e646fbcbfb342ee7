//! Which processors the fleet may use, and which process runs where.
//!
//! Wake-ups cost about four times more across cores than on one, so placement matters more than the
//! product: processes are pinned by a random map that differs by at most one process between any two
//! processors, drawn from the run's seed and the same for all strategies of a block. A fleet confined to
//! N cores gets one logical processor on each of N physical ones, so that it is as crowded on every
//! machine. Not here: who redraws the map, and when.

use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};
use shared_types::ids::CraftId;
use shared_types::rng::Stream;
use shared_types::scenario::Pinning;
use std::collections::BTreeMap;
use std::io;

/// Why a fleet cannot be placed as asked.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PlacementError {
    /// More physical cores than this process may run on, or none.
    #[error("--cores {needed}: this process may run on {have} physical cores; give 1 to {have}")]
    Cores {
        /// What was asked for.
        needed: u32,
        /// What there is.
        have: usize,
    },
}

/// The logical processors that a fleet may use, by physical core.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Processors {
    cores: Vec<Vec<u32>>,
}

impl Processors {
    /// Those that this process may run on.
    ///
    /// # Errors
    /// If the kernel does not tell.
    pub fn of_this_process() -> io::Result<Self> {
        let allowed = sched_getaffinity(None)?;
        let mut cores: BTreeMap<(u32, u32), Vec<u32>> = BTreeMap::new();
        for logical in (0..u32::try_from(CpuSet::MAX_CPU).unwrap_or(u32::MAX))
            .filter(|&logical| allowed.is_set(logical as usize))
        {
            cores.entry(physical_core_of(logical)).or_default().push(logical);
        }
        Ok(Self { cores: cores.into_values().collect() })
    }

    /// The processors of a machine that is told: per physical core its logical processors.
    #[must_use]
    pub const fn of_cores(cores: Vec<Vec<u32>>) -> Self {
        Self { cores }
    }

    /// One logical processor on each of the first `core_count` physical cores.
    ///
    /// # Errors
    /// If there are fewer, or none is asked for.
    pub fn confined_to(&self, core_count: u32) -> Result<Self, PlacementError> {
        if core_count == 0 || core_count as usize > self.cores.len() {
            return Err(PlacementError::Cores { needed: core_count, have: self.cores.len() });
        }
        let first_of_each = self.cores[..core_count as usize].iter().map(|core| vec![core[0]]);
        Ok(Self { cores: first_of_each.collect() })
    }

    /// Physical cores.
    #[must_use]
    pub fn core_count(&self) -> usize {
        self.cores.len()
    }

    /// Logical processors, ascending.
    #[must_use]
    pub fn logical(&self) -> Vec<u32> {
        let mut logical = self.cores.concat();
        logical.sort_unstable();
        logical
    }

    /// Lets the calling thread, and what it starts, run on these processors only.
    ///
    /// # Errors
    /// If the kernel refuses.
    pub fn confine_this_thread(&self) -> io::Result<()> {
        let mut set = CpuSet::new();
        for logical in self.logical() {
            set.set(logical as usize);
        }
        Ok(sched_setaffinity(None, &set)?)
    }
}

/// The physical core of a logical processor: package and core, as the kernel numbers them. Where it
/// does not tell, each processor counts as a core of its own.
fn physical_core_of(logical: u32) -> (u32, u32) {
    let read = |file: &str| {
        let path = format!("/sys/devices/system/cpu/cpu{logical}/topology/{file}");
        std::fs::read_to_string(path).ok()?.trim().parse::<u32>().ok()
    };
    match (read("physical_package_id"), read("core_id")) {
        (Some(package), Some(core)) => (package, core),
        _ => (u32::MAX, logical),
    }
}

/// Where each process of a fleet runs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Placement {
    /// Per process (the centre last) the processors that it may run on.
    processors: Vec<Vec<u32>>,
}

impl Placement {
    /// Draws where `process_count` processes run on `allowed`.
    ///
    /// # Panics
    /// If no processor is allowed.
    #[must_use]
    pub fn draw(
        allowed: &Processors,
        pinning: Pinning,
        process_count: u32,
        stream: &mut Stream,
    ) -> Self {
        let mut logical = allowed.logical();
        assert!(!logical.is_empty(), "invariant: a process runs somewhere");
        let processors = match pinning {
            Pinning::Unpinned => vec![logical; process_count as usize],
            Pinning::Balanced => {
                // Shuffled twice: which processors get one more, and who goes where.
                stream.shuffle(&mut logical);
                let mut places: Vec<u32> =
                    logical.into_iter().cycle().take(process_count as usize).collect();
                stream.shuffle(&mut places);
                places.into_iter().map(|place| vec![place]).collect()
            }
        };
        Self { processors }
    }

    /// The processors that `craft` may run on (the centre is craft N).
    #[must_use]
    pub fn of(&self, craft: CraftId) -> &[u32] {
        &self.processors[craft.index()]
    }

    /// The other processes that run on the one processor of `craft`; none if it has several.
    #[must_use]
    pub fn beside(&self, craft: CraftId) -> Vec<CraftId> {
        let own = self.of(craft);
        let others = (0..).map(CraftId).zip(&self.processors);
        let is_beside =
            |other: CraftId, theirs: &[u32]| own.len() == 1 && other != craft && theirs == own;
        others.filter(|(other, theirs)| is_beside(*other, theirs)).map(|(other, _)| other).collect()
    }

    /// Processes per processor, rounded up: what every row of times states.
    #[must_use]
    pub fn processes_per_processor(&self) -> usize {
        let used: std::collections::BTreeSet<u32> =
            self.processors.iter().flatten().copied().collect();
        self.processors.len().div_ceil(used.len().max(1))
    }
}

#[cfg(test)]
mod tests {
    use super::{CraftId, Pinning, Placement, PlacementError, Processors};
    use shared_types::rng::{Purpose, Stream};

    /// Four cores with two processors each, numbered as Linux does.
    fn machine() -> Processors {
        Processors::of_cores((0..4).map(|core| vec![core, core + 4]).collect())
    }

    fn draw(pinning: Pinning, process_count: u32, seed: u64) -> Placement {
        let mut stream = Stream::new(seed, 0, Purpose::Order, 0);
        Placement::draw(&machine(), pinning, process_count, &mut stream)
    }

    #[test]
    fn confined_fleet_gets_one_processor_on_each_core() {
        assert_eq!(machine().confined_to(2).unwrap().logical(), [0, 1]);
        for needed in [0, 5] {
            let refused = machine().confined_to(needed);
            assert_eq!(refused, Err(PlacementError::Cores { needed, have: 4 }));
        }
    }

    #[test]
    fn pinned_processes_are_balanced_and_drawn_from_the_seed() {
        for process_count in [1, 8, 11, 129] {
            let placement = draw(Pinning::Balanced, process_count, 7);
            let mut load = [0_usize; 8];
            for craft in 0..process_count {
                let [processor] = placement.of(CraftId(craft)) else { panic!("one processor") };
                load[*processor as usize] += 1;
            }
            let (least, most) = (load.iter().min().unwrap(), load.iter().max().unwrap());
            assert!(most - least <= 1, "{load:?}");
        }
        assert_eq!(draw(Pinning::Balanced, 10, 7), draw(Pinning::Balanced, 10, 7));
        assert_ne!(draw(Pinning::Balanced, 10, 7), draw(Pinning::Balanced, 10, 8));
        assert_eq!(draw(Pinning::Balanced, 20, 7).processes_per_processor(), 3);
    }

    #[test]
    fn unpinned_processes_may_run_on_all_that_is_allowed() {
        let placement = draw(Pinning::Unpinned, 3, 7);
        assert_eq!(placement.of(CraftId(2)), [0, 1, 2, 3, 4, 5, 6, 7]);
    }

    #[test]
    fn processes_on_one_processor_are_beside_each_other() {
        let placement = draw(Pinning::Balanced, 20, 7);
        for craft in (0..20).map(CraftId) {
            let beside = placement.beside(craft);
            assert!(beside.len() == 1 || beside.len() == 2, "{beside:?}");
            for &other in &beside {
                assert_eq!(placement.of(other), placement.of(craft));
                assert!(placement.beside(other).contains(&craft));
            }
            assert!(!beside.contains(&craft));
        }
        assert!(draw(Pinning::Unpinned, 3, 7).beside(CraftId(0)).is_empty());
    }

    #[test]
    fn this_process_runs_on_something() {
        let processors = Processors::of_this_process().unwrap();
        assert!(processors.core_count() >= 1);
        assert!(processors.logical().len() >= processors.core_count());
    }
}
