//! Craft processes that outlived their run.
//!
//! There should be none: crafts end within a second of their orchestrator's death. The exception is
//! one that somebody stopped (state T), which hears nothing until it is continued. They are found by
//! their command line, which names run and base, and ended through a pidfd, so that a number that was
//! given to somebody else meanwhile is never signalled. Not here: crafts of living runs (`supervision`).

use agent::process::startup::{ABRUPT_END_MS, AgentArguments};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::process::{Pid, PidfdFlags, Signal, pidfd_open, pidfd_send_signal};
use shared_types::time::Nanos;
use shared_types::transport::{RunPaths, clock};
use std::ffi::OsString;
use std::os::fd::{AsFd as _, OwnedFd};
use std::os::unix::ffi::OsStringExt as _;

/// How long crafts may take to end by themselves, ms: what they are given, and something for a busy
/// machine.
const END_MS: u64 = ABRUPT_END_MS + 300;

/// How long the kernel may take to remove what was killed, ms.
const KILL_MS: u64 = 2_000;

/// A craft process of a dead run.
#[derive(Debug)]
pub struct Leftover {
    pid: Pid,
    pidfd: OwnedFd,
}

impl Leftover {
    /// Its process number.
    #[must_use]
    pub fn pid(&self) -> u32 {
        self.pid.as_raw_nonzero().get().unsigned_abs()
    }

    /// Kills it; one that has ended by now is no error.
    pub fn kill(&self) {
        let _too_late = pidfd_send_signal(self.pidfd.as_fd(), Signal::KILL);
    }

    /// Waits until it has ended or `deadline` has come; says whether it has ended.
    fn ends_before(&self, deadline: Nanos) -> bool {
        loop {
            let left_ns = deadline.since(clock::now());
            let timeout = Timespec {
                tv_sec: (left_ns / 1_000_000_000).cast_signed(),
                tv_nsec: (left_ns % 1_000_000_000).cast_signed(),
            };
            match poll(&mut [PollFd::new(&self.pidfd, PollFlags::IN)], Some(&timeout)) {
                Err(Errno::INTR) => {}
                result => return result.is_ok_and(|ready| ready > 0),
            }
        }
    }
}

/// Ends what is left of the dead run at `paths` and waits for it; returns what had to be killed.
#[must_use]
pub fn end_all(paths: &RunPaths) -> Vec<Leftover> {
    let mut left = find(paths);
    let deadline = clock::now().plus(END_MS * 1_000_000);
    left.retain(|leftover| !leftover.ends_before(deadline));
    for leftover in &left {
        leftover.kill();
    }
    let deadline = clock::now().plus(KILL_MS * 1_000_000);
    for leftover in &left {
        leftover.ends_before(deadline);
    }
    left
}

/// The processes whose command line says that they are crafts of the run at `paths`.
#[must_use]
pub fn find(paths: &RunPaths) -> Vec<Leftover> {
    let Ok(entries) = std::fs::read_dir("/proc") else { return Vec::new() };
    entries
        .filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok())
        .filter_map(Pid::from_raw)
        .filter_map(|pid| {
            // First the descriptor, then the look: what is seen is what would be signalled.
            let pidfd = pidfd_open(pid, PidfdFlags::empty()).ok()?;
            is_craft_of(pid, paths).then_some(Leftover { pid, pidfd })
        })
        .collect()
}

/// Whether process `pid` is a craft of the run at `paths`. A zombie has no command line: it is dead.
fn is_craft_of(pid: Pid, paths: &RunPaths) -> bool {
    let file = format!("/proc/{}/cmdline", pid.as_raw_nonzero());
    let Ok(line) = std::fs::read(file) else { return false };
    let line = line.strip_suffix(b"\0").unwrap_or(&line);
    let mut words = line.split(|&byte| byte == 0).map(|word| OsString::from_vec(word.to_vec()));
    // The first word is the executable.
    if words.nth(1).is_none_or(|verb| verb != "agent") {
        return false;
    }
    AgentArguments::from_command_line(words)
        .is_ok_and(|craft| RunPaths::below(craft.base, craft.run).root() == paths.root())
}
