//! What can be seen of a fleet from outside: memory and descriptors of each process, and what lies in
//! shared memory.
//!
//! Crafts are the children of the orchestrator that say they are; one that is restarted is another
//! process. What has gone between two looks is not there in the second.

use agent::process::startup::AgentArguments;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::process::{Pid, PidfdFlags, pidfd_open};
use shared_types::ids::{CraftId, Incarnation};
use shared_types::transport::RunPaths;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::io;
use std::os::fd::OwnedFd;
use std::os::unix::ffi::OsStringExt as _;
use std::os::unix::fs::MetadataExt as _;
use std::path::Path;

/// One process at one time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// Resident memory, bytes.
    pub resident_bytes: u64,
    /// The same with shared pages divided among those who share them, bytes.
    pub proportional_bytes: u64,
    /// Open file descriptors.
    pub descriptors: u64,
}

/// Everything at one time.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Look {
    /// Of the orchestrator.
    pub orchestrator: Cost,
    /// By craft and life.
    pub crafts: BTreeMap<(CraftId, Incarnation), Cost>,
    /// Files of the run in shared memory: below its root, and segments of iceoryx2.
    pub shared_files: u64,
    /// What they take, bytes.
    pub shared_bytes: u64,
}

/// All looks, in order of time.
pub type Looks = Vec<Look>;

/// Somebody who watches an orchestrator.
pub struct Watch {
    orchestrator: u32,
    ends: OwnedFd,
}

impl Watch {
    /// Watches the process `orchestrator`, a child of this one.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn of(orchestrator: u32) -> io::Result<Self> {
        let pid = i32::try_from(orchestrator).ok().and_then(Pid::from_raw);
        let pid = pid.ok_or(io::ErrorKind::InvalidInput)?;
        Ok(Self { orchestrator, ends: pidfd_open(pid, PidfdFlags::empty())? })
    }

    /// Looks every `every_ms` ms until the orchestrator ends. Looks without a craft are left out.
    ///
    /// # Errors
    /// If the system refuses to say who runs.
    pub fn until_end(&self, every_ms: u64) -> io::Result<Looks> {
        let mut looks = Vec::new();
        while !self.ends_within(every_ms)? {
            looks.extend(self.look()?.filter(|look| !look.crafts.is_empty()));
        }
        Ok(looks)
    }

    fn ends_within(&self, wait_ms: u64) -> io::Result<bool> {
        let timeout = Timespec {
            tv_sec: (wait_ms / 1000).cast_signed(),
            tv_nsec: (wait_ms % 1000 * 1_000_000).cast_signed(),
        };
        match poll(&mut [PollFd::new(&self.ends, PollFlags::IN)], Some(&timeout)) {
            Err(Errno::INTR) => Ok(false),
            ready => Ok(ready? > 0),
        }
    }

    /// What is seen now; nothing if the orchestrator has gone.
    fn look(&self) -> io::Result<Option<Look>> {
        let own = Path::new("/proc").join(self.orchestrator.to_string());
        let Some(orchestrator) = cost_of(&own) else { return Ok(None) };
        let mut look = Look { orchestrator, ..Look::default() };
        let mut paths = None;
        for entry in std::fs::read_dir("/proc")?.flatten() {
            let process = entry.path();
            if entry.file_name().as_encoded_bytes()[0].is_ascii_digit()
                && parent_of(&process) == Some(self.orchestrator)
                && let Some(craft) = craft_at(&process)
                && let Some(cost) = cost_of(&process)
            {
                look.crafts.insert((craft.craft, craft.incarnation), cost);
                paths.get_or_insert_with(|| RunPaths::below(craft.base, craft.run));
            }
        }
        if let Some(paths) = paths {
            (look.shared_files, look.shared_bytes) = size_of_run(&paths)?;
        }
        Ok(Some(look))
    }
}

/// The parent of the process at `/proc/N`, if it still runs.
fn parent_of(process: &Path) -> Option<u32> {
    let status = std::fs::read_to_string(process.join("stat")).ok()?;
    // The name, in brackets, may hold anything; state and parent follow the last bracket.
    status.rsplit_once(')')?.1.split_whitespace().nth(1)?.parse().ok()
}

fn craft_at(process: &Path) -> Option<AgentArguments> {
    craft_of(&std::fs::read(process.join("cmdline")).ok()?)
}

/// The craft that a command line starts: executable, verb, options.
fn craft_of(line: &[u8]) -> Option<AgentArguments> {
    let words = line.strip_suffix(b"\0")?.split(|&byte| byte == 0);
    let mut words = words.map(|word| OsString::from_vec(word.to_vec()));
    words.nth(1).filter(|verb| verb == "agent")?;
    AgentArguments::from_command_line(words).ok()
}

fn cost_of(process: &Path) -> Option<Cost> {
    let rollup = std::fs::read_to_string(process.join("smaps_rollup")).ok()?;
    let kibibytes = |name: &str| {
        let line = rollup.lines().find_map(|line| line.strip_prefix(name))?;
        line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()
    };
    Some(Cost {
        resident_bytes: kibibytes("Rss:")? << 10,
        proportional_bytes: kibibytes("Pss:")? << 10,
        descriptors: std::fs::read_dir(process.join("fd")).ok()?.count() as u64,
    })
}

/// Files of a run in shared memory, and what they take in bytes.
fn size_of_run(paths: &RunPaths) -> io::Result<(u64, u64)> {
    let segments = paths.segments()?.into_iter().filter_map(|segment| segment.metadata().ok());
    let sizes = segments.map(|metadata| (1, metadata.blocks() * 512));
    Ok(sizes.fold(size_of_tree(&paths.root()), add))
}

const fn add(one: (u64, u64), other: (u64, u64)) -> (u64, u64) {
    (one.0 + other.0, one.1 + other.1)
}

/// Files below `directory`, and what they take in bytes.
fn size_of_tree(directory: &Path) -> (u64, u64) {
    let Ok(entries) = std::fs::read_dir(directory) else { return (0, 0) };
    let sizes = entries.flatten().map(|entry| match entry.metadata() {
        Ok(metadata) if metadata.is_dir() => size_of_tree(&entry.path()),
        Ok(metadata) => (1, metadata.blocks() * 512),
        Err(_) => (0, 0),
    });
    sizes.fold((0, 0), add)
}

#[cfg(test)]
mod tests {
    use super::{cost_of, craft_of, parent_of, size_of_tree};
    use agent::process::startup::AgentArguments;
    use shared_types::ids::{CraftId, Incarnation};
    use shared_types::transport::WakeMode;
    use std::os::unix::ffi::OsStrExt as _;
    use std::path::Path;

    #[test]
    fn a_craft_is_known_by_its_command_line() {
        let arguments = AgentArguments {
            run: 7,
            base: "/dev/shm/a place".into(),
            craft: CraftId(3),
            craft_count: 10,
            incarnation: Incarnation(2),
            parent_pid: 1,
            wake: WakeMode::Adaptive,
            cores: vec![0, 1],
            beside: Vec::new(),
            doom: None,
        };
        let line = |verb: &str| {
            let mut line = format!("slateswarm\0{verb}\0").into_bytes();
            for word in arguments.to_command_line() {
                line.extend([word.as_bytes(), b"\0"].concat());
            }
            line
        };
        assert_eq!(craft_of(&line("agent")).as_ref(), Some(&arguments));
        assert_eq!(craft_of(&line("run")), None);
        assert_eq!(craft_of(b""), None, "what has ended");
    }

    #[test]
    fn a_process_has_a_parent_memory_and_descriptors() {
        let own = Path::new("/proc/self");
        assert_eq!(parent_of(own), Some(std::os::unix::process::parent_id()));
        let cost = cost_of(own).unwrap();
        assert!(cost.proportional_bytes > 0 && cost.proportional_bytes <= cost.resident_bytes);
        assert!(cost.descriptors >= 3);
    }

    #[test]
    fn what_is_not_there_has_no_size() {
        assert_eq!(size_of_tree(Path::new("/proc/self/no-such")), (0, 0));
        let (files, _) =
            size_of_tree(Path::new(env!("CARGO_MANIFEST_DIR")).join("src/soak").as_path());
        assert!(files >= 4);
    }
}
