//! One craft's process, held by a pidfd: how it is, what it said, how it ended.
//!
//! A pidfd names the process and never another that got its number later, so no signal can hit a
//! stranger. The process's standard error is a pipe of which the first part is kept: a panic's message
//! is then part of the report that the craft ended. A dropped [`CraftProcess`] leaves nothing behind:
//! what still runs is killed and reaped. Not here: starting it (`os_process`) and waiting for many
//! (`supervision::watch`).

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::process::{
    Pid, PidfdFlags, Signal, WaitId, WaitIdOptions, pidfd_open, pidfd_send_signal, waitid,
};
use shared_types::ids::{CraftId, Incarnation};
use std::fmt;
use std::io::{self, Read as _};
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::process::{Child, ChildStderr};

/// Bytes of a craft's standard error that are kept; what follows is counted and dropped.
pub const SAID_BYTES_MAX: usize = 16 * 1024;

/// How long a dropped process may take to be gone after SIGKILL, s.
const KILL_TIMEOUT_S: i64 = 2;

/// How a process ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HowEnded {
    /// It returned this exit code.
    Exited(i32),
    /// This signal killed it.
    Killed(i32),
    /// The supervisor killed it after so many ns without a heartbeat.
    Silent(u64),
    /// The supervisor killed it after so many ns without an answer, though it went round.
    Mute(u64),
}

impl HowEnded {
    /// Whether it ended by itself and reported no error.
    #[must_use]
    pub const fn is_orderly(self) -> bool {
        matches!(self, Self::Exited(0))
    }
}

impl fmt::Display for HowEnded {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Exited(code) => write!(formatter, "exit code {code}"),
            Self::Killed(signal) => match Signal::from_named_raw(*signal).and_then(name_of) {
                Some(name) => write!(formatter, "killed by signal {signal} ({name})"),
                None => write!(formatter, "killed by signal {signal}"),
            },
            Self::Silent(ns) => {
                write!(formatter, "killed after {:.1} s without a heartbeat", *ns as f64 / 1e9)
            }
            Self::Mute(ns) => {
                write!(formatter, "killed after {:.1} s without an answer", *ns as f64 / 1e9)
            }
        }
    }
}

/// The signals that end crafts in practice.
fn name_of(signal: Signal) -> Option<&'static str> {
    Some(match signal {
        Signal::KILL => "SIGKILL",
        Signal::TERM => "SIGTERM",
        Signal::INT => "SIGINT",
        Signal::HUP => "SIGHUP",
        Signal::ABORT => "SIGABRT",
        Signal::SEGV => "SIGSEGV",
        Signal::BUS => "SIGBUS: shared memory is full",
        Signal::ILL => "SIGILL",
        _ => return None,
    })
}

/// How a living process stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Standing {
    /// The state of its first thread: `R`, `S`, `T`, `Z` and so on.
    pub state: char,
    /// CPU time that it has used, ns, in steps of the kernel's tick.
    pub cpu_ns: u64,
    /// Time that its first thread waited for a core, ns, without a wait that still lasts; 0 where the kernel
    /// does not tell.
    pub starved_ns: u64,
}

impl Standing {
    /// Whether it runs or would if it got a core.
    #[must_use]
    pub const fn is_runnable(&self) -> bool {
        matches!(self.state, 'R')
    }

    /// Whether the kernel holds it up, so that it cannot even be killed: a page is read from disk, or a
    /// directory in which thousands of files are made at once is locked.
    #[must_use]
    pub const fn is_held_up(&self) -> bool {
        matches!(self.state, 'D')
    }

    /// Whether somebody stopped it.
    #[must_use]
    pub const fn is_stopped(&self) -> bool {
        matches!(self.state, 'T' | 't')
    }

    /// What the files `stat` and `schedstat` below /proc say.
    fn read(stat: &str, schedstat: &str) -> Option<Self> {
        // The name in parentheses may hold anything, so the state is what follows the last one.
        let mut fields = stat.rsplit_once(')')?.1.split_whitespace();
        let state = fields.next()?.chars().next()?;
        // User and system time are fields 14 and 15; the state is the third.
        let ticks: u64 =
            fields.skip(10).take(2).filter_map(|ticks| ticks.parse::<u64>().ok()).sum();
        let tick_ns = 1_000_000_000 / rustix::param::clock_ticks_per_second().max(1);
        let starved =
            schedstat.split_whitespace().nth(1).and_then(|delay_ns| delay_ns.parse().ok());
        Some(Self { state, cpu_ns: ticks * tick_ns, starved_ns: starved.unwrap_or(0) })
    }
}

/// A craft's process.
#[derive(Debug)]
pub struct CraftProcess {
    craft: CraftId,
    incarnation: Incarnation,
    pid: Pid,
    pidfd: OwnedFd,
    how_ended: Option<HowEnded>,
    /// Why the supervisor killed it.
    condemned: Option<HowEnded>,
    stderr: Option<ChildStderr>,
    said: Vec<u8>,
    unkept_bytes: u64,
}

impl CraftProcess {
    /// Takes over a child that was just spawned and not yet waited for: its number is still its own.
    pub(super) fn adopt(
        mut child: Child,
        craft: CraftId,
        incarnation: Incarnation,
    ) -> io::Result<Self> {
        let opened = Pid::from_raw(child.id().cast_signed())
            .ok_or(Errno::SRCH)
            .and_then(|pid| Ok((pid, pidfd_open(pid, PidfdFlags::empty())?)));
        let (pid, pidfd) = match opened {
            Ok(opened) => opened,
            Err(error) => {
                // Without a pidfd it could not be watched; it must not stay either.
                child.kill()?;
                child.wait()?;
                return Err(error.into());
            }
        };
        let stderr = child.stderr.take();
        let process = Self {
            craft,
            incarnation,
            pid,
            pidfd,
            how_ended: None,
            condemned: None,
            stderr,
            said: Vec::new(),
            unkept_bytes: 0,
        };
        if let Some(stderr) = &process.stderr {
            rustix::io::ioctl_fionbio(stderr, true)?;
        }
        Ok(process)
    }

    /// Which craft it is.
    #[must_use]
    pub const fn craft(&self) -> CraftId {
        self.craft
    }

    /// Which life of the craft.
    #[must_use]
    pub const fn incarnation(&self) -> Incarnation {
        self.incarnation
    }

    /// Its process number, for people and for /proc.
    #[must_use]
    pub fn pid(&self) -> u32 {
        self.pid.as_raw_nonzero().get().unsigned_abs()
    }

    /// Its standard error, if it is a pipe that is still open.
    pub(crate) fn stderr(&self) -> Option<BorrowedFd<'_>> {
        self.stderr.as_ref().map(AsFd::as_fd)
    }

    /// How it ended, `None` if it has not; reaps it. Never waits.
    ///
    /// # Errors
    /// If the kernel refuses to tell.
    pub fn try_wait(&mut self) -> io::Result<Option<HowEnded>> {
        if self.how_ended.is_none() {
            let options = WaitIdOptions::EXITED | WaitIdOptions::NOHANG;
            let status =
                rustix::io::retry_on_intr(|| waitid(WaitId::PidFd(self.pidfd.as_fd()), options))?;
            let killed = |signal| match self.condemned {
                Some(how) if signal == Signal::KILL.as_raw() => how,
                _ => HowEnded::Killed(signal),
            };
            self.how_ended = status.and_then(|status| {
                let exited = status.exit_status().map(HowEnded::Exited);
                exited.or_else(|| status.terminating_signal().map(killed))
            });
        }
        Ok(self.how_ended)
    }

    /// Sends a signal; one that comes too late is no error.
    ///
    /// # Errors
    /// If the kernel refuses.
    pub fn signal(&self, signal: Signal) -> io::Result<()> {
        match pidfd_send_signal(&self.pidfd, signal) {
            Ok(()) | Err(Errno::SRCH) => Ok(()),
            Err(error) => Err(error.into()),
        }
    }

    /// How it stands as /proc tells it, `None` once it is reaped.
    #[must_use]
    pub fn standing(&self) -> Option<Standing> {
        if self.how_ended.is_some() {
            return None;
        }
        let read = |file| std::fs::read_to_string(format!("/proc/{}/{file}", self.pid()));
        Standing::read(&read("stat").ok()?, &read("schedstat").unwrap_or_default())
    }

    /// Whether somebody stopped it (SIGSTOP, a terminal, a debugger): it is paused, not dead.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.standing().is_some_and(|standing| standing.is_stopped())
    }

    /// Kills it for a reason that will be told as `how` it ended. `false` if that was done before.
    ///
    /// # Errors
    /// If the kernel refuses.
    pub(crate) fn condemn(&mut self, how: HowEnded) -> io::Result<bool> {
        if self.condemned.is_some() {
            return Ok(false);
        }
        self.condemned = Some(how);
        self.signal(Signal::KILL).map(|()| true)
    }

    /// Takes in what the process wrote to standard error since the last call; says whether more can
    /// come. Must be called when the pipe is readable: a full one would make the craft wait.
    pub(crate) fn listen(&mut self) -> bool {
        let Some(stderr) = &mut self.stderr else { return false };
        let mut buffer = [0; 4096];
        loop {
            match stderr.read(&mut buffer) {
                Ok(0) => break,
                Ok(length) => {
                    let kept = length.min(SAID_BYTES_MAX - self.said.len());
                    self.said.extend_from_slice(&buffer[..kept]);
                    self.unkept_bytes += (length - kept) as u64;
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => return true,
                Err(_) => break,
            }
        }
        self.stderr = None;
        false
    }

    /// What the process has written to standard error, as far as it was kept.
    #[must_use]
    pub fn said(&self) -> String {
        let mut said = String::from_utf8_lossy(&self.said).into_owned();
        if self.unkept_bytes > 0 {
            said.push_str(&format!("\n[{} more bytes were dropped]\n", self.unkept_bytes));
        }
        said
    }

    /// Kills and reaps the process if it still runs, and waits for that, within bounds.
    fn end_now(&mut self) -> io::Result<()> {
        if self.try_wait()?.is_some() {
            return Ok(());
        }
        self.signal(Signal::KILL)?;
        let timeout = Timespec { tv_sec: KILL_TIMEOUT_S, tv_nsec: 0 };
        let mut watched = [PollFd::new(&self.pidfd, PollFlags::IN)];
        rustix::io::retry_on_intr(|| poll(&mut watched, Some(&timeout)))?;
        self.try_wait().map(drop)
    }
}

impl AsFd for CraftProcess {
    /// The pidfd: readable once the process has ended.
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.pidfd.as_fd()
    }
}

impl Drop for CraftProcess {
    fn drop(&mut self) {
        // Nobody is left to hear of a failure; the process also ends when this one does.
        let _ends_with_us = self.end_now();
    }
}

#[cfg(test)]
mod tests {
    use super::{HowEnded, Standing};

    #[test]
    fn standing_is_read_behind_a_name_that_holds_anything() {
        let stat = "41 (a ) R b) S 1 41 41 0 -1 4194560 181 0 0 0 25 17 9 9 20 0 2 0";
        let standing = Standing::read(stat, "10050205 180981008 17\n").expect("lines of /proc");
        let Standing { state, cpu_ns, starved_ns } = standing;
        assert_eq!((state, cpu_ns, starved_ns), ('S', 420_000_000, 180_981_008));
        assert_eq!(Standing::read(stat, "").map(|standing| standing.starved_ns), Some(0));
        assert_eq!(Standing::read("", ""), None);
    }

    #[test]
    fn a_silent_process_is_told_with_its_silence() {
        let said = HowEnded::Silent(2_640_000_000).to_string();
        assert_eq!(said, "killed after 2.6 s without a heartbeat");
    }
}
