//! What the host has to give: descriptors, shared memory, memory, processes.
//!
//! Read from the kernel before a run starts, and by `doctor`. A figure that the kernel does not tell is
//! `None` and limits nothing. Not here: what a run needs and whether that fits (`resources`).

use rustix::fs::{StatVfs, statvfs};
use rustix::process::{Resource, Rlimit, geteuid, getrlimit, setrlimit};
use shared_types::transport::paths::SHM;
use std::io;
use std::path::{Path, PathBuf};

/// What a host has left for a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Host {
    /// Descriptors that a process may have open now (soft limit).
    pub open_files: u64,
    /// Descriptors that a process may raise itself to (hard limit).
    pub open_files_max: u64,
    /// Free bytes of shared memory.
    pub shared_bytes: u64,
    /// Files that can still be made in shared memory.
    pub shared_files: u64,
    /// Memory that can be used without swapping, within the limits of this control group.
    pub memory_bytes: Option<u64>,
    /// Tasks (processes and threads) that this user can still start.
    pub tasks: Option<u64>,
}

impl Host {
    /// Reads what this host has.
    ///
    /// # Errors
    /// If shared memory is not there.
    pub fn read() -> io::Result<Self> {
        let Rlimit { current, maximum } = getrlimit(Resource::Nofile);
        let shared = shared_memory()?;
        Ok(Self {
            open_files: current.unwrap_or(u64::MAX),
            open_files_max: maximum.unwrap_or(u64::MAX),
            shared_bytes: shared.f_bavail.saturating_mul(shared.f_frsize),
            // A tmpfs without a limit on files says 0 of 0.
            shared_files: if shared.f_files == 0 { u64::MAX } else { shared.f_favail },
            memory_bytes: least([available_memory(), group_memory()]),
            tasks: least([user_tasks(), group_tasks(), system_tasks()]),
        })
    }
}

/// The state of the file system that holds shared memory.
///
/// # Errors
/// If there is none.
pub fn shared_memory() -> io::Result<StatVfs> {
    Ok(statvfs(SHM)?)
}

/// Raises the soft limit on open descriptors to `needed`, for this process and those that it starts.
///
/// # Errors
/// If `needed` is above the hard limit.
pub fn raise_open_files(needed: u64) -> io::Result<()> {
    let Rlimit { current, maximum } = getrlimit(Resource::Nofile);
    if current.is_none_or(|current| current >= needed) {
        return Ok(());
    }
    Ok(setrlimit(Resource::Nofile, Rlimit { current: Some(needed), maximum })?)
}

fn least<const COUNT: usize>(figures: [Option<u64>; COUNT]) -> Option<u64> {
    figures.into_iter().flatten().min()
}

fn number_in(path: impl Into<PathBuf>) -> Option<u64> {
    // A limit that is not set reads `max`, which is no number.
    std::fs::read_to_string(path.into()).ok()?.trim().parse().ok()
}

/// `MemAvailable` of the machine.
fn available_memory() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kilobytes| kilobytes * 1024)
}

/// What the control groups of this process leave of a limited quantity: the least over the group and
/// all groups above it, version 2 or the version 1 hierarchy called `controller`.
fn group_rest(controller: &str, limit: &str, used: &str) -> Option<u64> {
    let groups = std::fs::read_to_string("/proc/self/cgroup").ok()?;
    let mut least_rest: Option<u64> = None;
    for line in groups.lines() {
        let mut fields = line.splitn(3, ':').skip(1);
        let (controllers, path) = (fields.next()?, fields.next()?);
        let mount = match controllers {
            "" => PathBuf::from("/sys/fs/cgroup"),
            named if named.split(',').any(|name| name == controller) => {
                PathBuf::from("/sys/fs/cgroup").join(controller)
            }
            _ => continue,
        };
        let group = mount.join(path.trim_start_matches('/'));
        for ancestor in group.ancestors().take_while(|ancestor| ancestor.starts_with(&mount)) {
            let rest = number_in(ancestor.join(limit)).zip(number_in(ancestor.join(used))).map(
                |(limit, used)| limit.saturating_sub(used.saturating_sub(file_cache(ancestor))),
            );
            least_rest = least([least_rest, rest]);
        }
    }
    least_rest
}

/// What a control group counts as used memory but gives back on demand: cached files. After a build
/// that is nearly everything. 0 for groups of other controllers.
fn file_cache(group: &Path) -> u64 {
    let statistics = std::fs::read_to_string(group.join("memory.stat")).unwrap_or_default();
    let lines = statistics.lines().filter_map(|line| line.split_once(' '));
    // Version 1 counts the groups below apart, under names that begin with `total_`.
    let is_total = statistics.contains("total_inactive_file");
    let wanted = |name: &str| match is_total {
        true => matches!(name, "total_inactive_file" | "total_active_file"),
        false => matches!(name, "inactive_file" | "active_file"),
    };
    lines.filter(|(name, _)| wanted(name)).filter_map(|(_, bytes)| bytes.parse::<u64>().ok()).sum()
}

fn group_memory() -> Option<u64> {
    least([
        group_rest("memory", "memory.max", "memory.current"),
        group_rest("memory", "memory.limit_in_bytes", "memory.usage_in_bytes"),
    ])
}

fn group_tasks() -> Option<u64> {
    group_rest("pids", "pids.max", "pids.current")
}

/// What the system-wide limit leaves.
fn system_tasks() -> Option<u64> {
    let limit = number_in("/proc/sys/kernel/threads-max")?;
    let load = std::fs::read_to_string("/proc/loadavg").ok()?;
    let used = load.split(' ').nth(3)?.split('/').nth(1)?.parse().ok()?;
    Some(limit.saturating_sub(used))
}

/// What `RLIMIT_NPROC` leaves; it does not bind root.
fn user_tasks() -> Option<u64> {
    if geteuid().is_root() {
        return None;
    }
    let limit = getrlimit(Resource::Nproc).current?;
    Some(limit.saturating_sub(tasks_of_this_user()?))
}

/// Threads of all processes of this user.
fn tasks_of_this_user() -> Option<u64> {
    let own = format!("Uid:\t{}\t", rustix::process::getuid().as_raw());
    let mut tasks = 0;
    for entry in std::fs::read_dir("/proc").ok()?.flatten() {
        // A process that ends while it is looked at counts nothing.
        let status = std::fs::read_to_string(entry.path().join("status")).unwrap_or_default();
        if status.lines().any(|line| line.starts_with(&own)) {
            let threads = status.lines().find_map(|line| line.strip_prefix("Threads:"));
            tasks += threads.and_then(|threads| threads.trim().parse().ok()).unwrap_or(0);
        }
    }
    Some(tasks)
}

#[cfg(test)]
mod tests {
    use super::Host;

    #[test]
    fn this_host_has_something_of_everything() {
        let host = Host::read().unwrap();
        assert!(host.open_files > 0 && host.open_files <= host.open_files_max);
        assert!(host.shared_bytes > 0 && host.shared_files > 0);
        assert!(host.memory_bytes.is_some_and(|bytes| bytes > 0));
        assert!(host.tasks.is_some_and(|tasks| tasks > 0));
    }

    #[test]
    fn a_limit_that_holds_already_is_left_alone() {
        let before = Host::read().unwrap().open_files;
        super::raise_open_files(1).unwrap();
        assert_eq!(Host::read().unwrap().open_files, before);
    }
}
