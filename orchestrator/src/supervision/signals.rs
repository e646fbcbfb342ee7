//! Requests to end the run: SIGINT, SIGTERM and SIGHUP, as something that a loop can look at.
//!
//! Each signal has its own pipe, to which the handler writes one byte, so that two Ctrl-C between two
//! looks are still two. The first request asks for an orderly end, the second SIGINT or SIGTERM for an
//! immediate one; a terminal that closes may send SIGHUP twice and means it once. A SIGHUP that was
//! ignored when the process started (`nohup`) stays ignored. Not here: telling the crafts, which ignore
//! the terminal's signals themselves.

use crate::outcome::Outcome;
use rustix::event::epoll::{self, CreateFlags, EventData, EventFlags};
use signal_hook::SigId;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use std::io::{self, PipeReader, Read as _, pipe};
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// How much time the run has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Urgency {
    /// Close the turn, keep the results, let the crafts end by themselves.
    Orderly,
    /// Keep the results and kill the crafts.
    Immediate,
}

/// Somebody wants the run to end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StopRequest {
    /// How fast.
    pub urgency: Urgency,
    /// How the invocation ends: interrupted or terminated, by the signal that came first.
    pub outcome: Outcome,
}

/// One signal, its pipe and its flag.
#[derive(Debug)]
struct Source {
    number: i32,
    pipe: PipeReader,
    handlers: [SigId; 2],
}

/// The signals of this process that ask for an end. Handlers go with it.
#[derive(Debug)]
pub struct Signals {
    sources: Vec<Source>,
    epoll: OwnedFd,
    any_came: Arc<AtomicBool>,
    request: Option<StopRequest>,
}

impl Signals {
    /// Takes over SIGINT, SIGTERM and SIGHUP.
    ///
    /// # Errors
    /// If the kernel refuses.
    pub fn install() -> io::Result<Self> {
        let epoll = epoll::create(CreateFlags::CLOEXEC)?;
        let any_came = Arc::new(AtomicBool::new(false));
        let mut signals = Self { sources: Vec::new(), epoll, any_came, request: None };
        for number in [SIGINT, SIGTERM, SIGHUP] {
            if number != SIGHUP || !is_ignored(number)? {
                signals.listen_to(number)?;
            }
        }
        Ok(signals)
    }

    /// Installs the handler of one signal: first the byte, then the flag, so that whoever sees the
    /// flag finds the byte.
    fn listen_to(&mut self, number: i32) -> io::Result<()> {
        let (reader, writer) = pipe()?;
        rustix::io::ioctl_fionbio(&reader, true)?;
        epoll::add(&self.epoll, &reader, EventData::new_u64(0), EventFlags::IN)?;
        let byte = signal_hook::low_level::pipe::register(number, writer)?;
        let flag = signal_hook::flag::register(number, Arc::clone(&self.any_came))?;
        self.sources.push(Source { number, pipe: reader, handlers: [byte, flag] });
        Ok(())
    }

    /// What has been asked for so far, `None` while nobody has. One load if nothing is new.
    ///
    /// # Errors
    /// If a pipe cannot be read.
    pub fn poll(&mut self) -> io::Result<Option<StopRequest>> {
        if self.any_came.swap(false, Ordering::Acquire) {
            for place in 0..self.sources.len() {
                for _ in 0..self.sources[place].take_count()? {
                    self.request = Some(after(self.request, self.sources[place].number));
                }
            }
        }
        Ok(self.request)
    }
}

impl AsFd for Signals {
    /// Readable when a signal has come that no look has taken yet.
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.epoll.as_fd()
    }
}

impl Drop for Signals {
    fn drop(&mut self) {
        for handler in self.sources.iter().flat_map(|source| source.handlers) {
            signal_hook::low_level::unregister(handler);
        }
    }
}

impl Source {
    /// How often the signal came since the last look.
    fn take_count(&mut self) -> io::Result<usize> {
        let mut bytes = [0; 64];
        match self.pipe.read(&mut bytes) {
            Ok(count) => Ok(count),
            Err(error)
                if matches!(
                    error.kind(),
                    io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted
                ) =>
            {
                Ok(0)
            }
            Err(error) => Err(error),
        }
    }
}

/// The request that stands after one more signal.
fn after(request: Option<StopRequest>, number: i32) -> StopRequest {
    match request {
        None => StopRequest {
            urgency: Urgency::Orderly,
            outcome: if number == SIGINT { Outcome::Interrupted } else { Outcome::Terminated },
        },
        Some(standing) if number == SIGHUP => standing,
        Some(standing) => StopRequest { urgency: Urgency::Immediate, ..standing },
    }
}

/// Whether the process was started with this signal ignored.
fn is_ignored(number: i32) -> io::Result<bool> {
    let status = std::fs::read_to_string("/proc/self/status")?;
    let mask = status
        .lines()
        .find_map(|line| line.strip_prefix("SigIgn:"))
        .and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    Ok(mask.is_some_and(|mask| mask >> (number - 1) & 1 == 1))
}

#[cfg(test)]
mod tests {
    use super::{Outcome, SIGHUP, SIGINT, SIGTERM, StopRequest, Urgency, after};

    fn after_all(numbers: &[i32]) -> Option<StopRequest> {
        numbers.iter().fold(None, |request, &number| Some(after(request, number)))
    }

    #[test]
    fn first_signal_decides_the_outcome_and_the_second_makes_it_immediate() {
        let request = |urgency, outcome| Some(StopRequest { urgency, outcome });
        assert_eq!(after_all(&[]), None);
        assert_eq!(after_all(&[SIGINT]), request(Urgency::Orderly, Outcome::Interrupted));
        assert_eq!(after_all(&[SIGTERM]), request(Urgency::Orderly, Outcome::Terminated));
        assert_eq!(
            after_all(&[SIGINT, SIGTERM]),
            request(Urgency::Immediate, Outcome::Interrupted)
        );
        assert_eq!(after_all(&[SIGHUP, SIGINT]), request(Urgency::Immediate, Outcome::Terminated));
    }

    #[test]
    fn a_closing_terminal_hangs_up_once_however_often_it_says_so() {
        assert_eq!(
            after_all(&[SIGHUP, SIGHUP, SIGHUP]).map(|request| request.urgency),
            Some(Urgency::Orderly)
        );
    }
}
