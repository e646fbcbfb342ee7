//! Heartbeats: one counter a process, in a small file of the run that all its processes map.
//!
//! A process moves its own counter once a round of its loop; the orchestrator reads them all now and then.
//! Each counter has a cache line of its own and one writer, so a beat is a load and a store that stay in
//! the writer's cache: no message, no system call, no look at a clock (docs/decisions/0019). The file
//! outlives whoever writes into it and goes with the run's root. Not here: mapping it (`mapping`, the only
//! unsafe code), and what follows from a counter that stands still (the orchestrator's supervision).

mod mapping;

use super::paths::RunPaths;
use crate::ids::CraftId;
use mapping::{LINE_BYTES, Mapping};
use std::fs::File;
use std::io::{self, Write as _};
use std::sync::atomic::Ordering;

/// The counters of all processes of a run.
#[derive(Debug)]
pub struct Heartbeats(Mapping);

impl Heartbeats {
    /// Makes the file of a run with `processes` processes, every counter at zero.
    ///
    /// # Errors
    /// If the file is there already, or no memory is left.
    pub fn create(paths: &RunPaths, processes: u32) -> io::Result<Self> {
        let lines = processes as usize;
        let mut file =
            File::options().read(true).write(true).create_new(true).open(paths.beats_file())?;
        // Written, not only sized: full shared memory is an error here and no SIGBUS later.
        file.write_all(&vec![0; lines * LINE_BYTES])?;
        Mapping::of(&file, lines).map(Self)
    }

    /// How often the process of `craft`, in any of its lives, has gone round.
    ///
    /// # Panics
    /// If the run has no such process.
    #[must_use]
    pub fn of(&self, craft: CraftId) -> u64 {
        self.0.counter(craft.index()).load(Ordering::Relaxed)
    }
}

/// The counter of one process.
#[derive(Debug)]
pub struct Heart {
    beats: Mapping,
    place: usize,
}

impl Heart {
    /// That of `craft` in the run at `paths`.
    ///
    /// # Errors
    /// If there is no such file, or it has no place for the craft.
    pub fn open(paths: &RunPaths, craft: CraftId) -> io::Result<Self> {
        let file = File::options().read(true).write(true).open(paths.beats_file())?;
        let place = craft.index();
        Ok(Self { beats: Mapping::of(&file, place + 1)?, place })
    }

    /// The process has gone round once more.
    #[inline]
    pub fn beat(&self) {
        let counter = self.beats.counter(self.place);
        // One writer: no need to lock the line for an addition.
        counter.store(counter.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::{Heart, Heartbeats, RunPaths};
    use crate::ids::CraftId;

    #[test]
    fn each_process_moves_its_own_counter_and_its_successor_goes_on() {
        let base = tempfile::tempdir().expect("a folder");
        let paths = RunPaths::below(base.path(), 5);
        std::fs::create_dir(paths.root()).expect("made");
        let all = Heartbeats::create(&paths, 3).expect("made");
        let hearts: Vec<Heart> =
            (0..3).map(|craft| Heart::open(&paths, CraftId(craft)).expect("there")).collect();
        for (times, heart) in hearts.iter().enumerate() {
            (0..times).for_each(|_| heart.beat());
        }
        assert_eq!([0, 1, 2].map(|craft| all.of(CraftId(craft))), [0, 1, 2]);
        drop(hearts);
        Heart::open(&paths, CraftId(2)).expect("there").beat();
        assert_eq!(all.of(CraftId(2)), 3);
    }

    #[test]
    fn a_file_without_a_place_for_the_craft_is_refused() {
        let base = tempfile::tempdir().expect("a folder");
        let paths = RunPaths::below(base.path(), 6);
        std::fs::create_dir(paths.root()).expect("made");
        assert!(Heart::open(&paths, CraftId(0)).is_err(), "no file");
        let _all = Heartbeats::create(&paths, 2).expect("made");
        let refused = Heart::open(&paths, CraftId(2)).expect_err("too short");
        assert!(refused.to_string().contains("128 bytes"), "{refused}");
        assert!(Heartbeats::create(&paths, 2).is_err(), "one a run");
    }
}
