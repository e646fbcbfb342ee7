//! The living processes of a fleet, watched through one descriptor.
//!
//! Pidfds and standard-error pipes of all crafts hang on one epoll descriptor: a look whether anything
//! has happened is one system call for any number of crafts, cheap enough for every turn, and the
//! descriptor can be polled together with a bell. A stopped process never appears here; it is paused.
//! Not here: what follows from an end (the run's loop), and ending the fleet (`shutdown`).

use crate::launch::craft_process::{CraftProcess, HowEnded};
use rustix::event::epoll::{self, CreateFlags, Event, EventData, EventFlags};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use shared_types::ids::{CraftId, Incarnation};
use std::collections::BTreeMap;
use std::io;
use std::mem::MaybeUninit;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};

/// Events taken in one look; more are there at the next.
const EVENTS_PER_LOOK: usize = 64;

const NO_WAIT: Timespec = Timespec { tv_sec: 0, tv_nsec: 0 };

/// A craft's process has ended and is reaped.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CraftEnded {
    /// Which craft.
    pub craft: CraftId,
    /// Which life of it.
    pub incarnation: Incarnation,
    /// How.
    pub how: HowEnded,
    /// What it wrote to standard error, as far as it was kept.
    pub said: String,
}

/// The living processes of a fleet. Dropping it kills and reaps them all.
#[derive(Debug)]
pub struct Watch {
    epoll: OwnedFd,
    processes: BTreeMap<CraftId, CraftProcess>,
}

/// What an event of the epoll descriptor is about.
#[derive(Clone, Copy)]
enum Token {
    Ended(CraftId),
    Said(CraftId),
}

impl Token {
    const fn encode(self) -> EventData {
        match self {
            Self::Ended(craft) => EventData::new_u64((craft.0 as u64) << 1),
            Self::Said(craft) => EventData::new_u64(((craft.0 as u64) << 1) | 1),
        }
    }

    fn decode(data: EventData) -> Self {
        let code = data.u64();
        let craft = CraftId(u32::try_from(code >> 1).expect("invariant: tokens are made of ids"));
        if code & 1 == 0 { Self::Ended(craft) } else { Self::Said(craft) }
    }
}

impl Watch {
    /// Watches nobody yet.
    ///
    /// # Errors
    /// If no descriptor is left.
    pub fn new() -> io::Result<Self> {
        Ok(Self { epoll: epoll::create(CreateFlags::CLOEXEC)?, processes: BTreeMap::new() })
    }

    /// Watches `process` as well.
    ///
    /// # Errors
    /// If the kernel refuses; the process is then ended.
    ///
    /// # Panics
    /// If another process of the same craft is still watched.
    pub fn add(&mut self, process: CraftProcess) -> io::Result<()> {
        let craft = process.craft();
        assert!(
            !self.processes.contains_key(&craft),
            "invariant: a craft is one process at a time"
        );
        epoll::add(&self.epoll, &process, Token::Ended(craft).encode(), EventFlags::IN)?;
        if let Some(stderr) = process.stderr() {
            epoll::add(&self.epoll, stderr, Token::Said(craft).encode(), EventFlags::IN)?;
        }
        self.processes.insert(craft, process);
        Ok(())
    }

    /// The living processes, in order of their crafts.
    pub fn living(&self) -> impl Iterator<Item = &CraftProcess> {
        self.processes.values()
    }

    /// The process of `craft`, `None` if it has ended or never was.
    #[must_use]
    pub fn process(&self, craft: CraftId) -> Option<&CraftProcess> {
        self.processes.get(&craft)
    }

    /// Kills the process of `craft` for a reason that its end, which comes as every other, will tell as `how`.
    /// `false` if it is gone or was killed so before.
    ///
    /// # Errors
    /// If the kernel refuses.
    pub(crate) fn condemn(&mut self, craft: CraftId, how: HowEnded) -> io::Result<bool> {
        let process = self.processes.get_mut(&craft);
        process.map_or(Ok(false), |process| process.condemn(how))
    }

    /// Whether nobody is left.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.processes.is_empty()
    }

    /// Who has ended since the last look. Never waits; one system call if nothing has happened.
    ///
    /// # Errors
    /// If the kernel refuses.
    pub fn poll(&mut self) -> io::Result<Vec<CraftEnded>> {
        let mut ended = Vec::new();
        loop {
            let mut events = [MaybeUninit::<Event>::uninit(); EVENTS_PER_LOOK];
            let (taken, _) = match epoll::wait(&self.epoll, &mut events, Some(&NO_WAIT)) {
                Ok(taken) => taken,
                Err(Errno::INTR) => continue,
                Err(error) => return Err(error.into()),
            };
            for event in &*taken {
                match Token::decode(event.data) {
                    Token::Said(craft) => {
                        // A pipe that is at its end is closed, which takes it off the descriptor.
                        self.processes.get_mut(&craft).map(CraftProcess::listen);
                    }
                    Token::Ended(craft) => ended.extend(self.reap(craft)?),
                }
            }
            if taken.len() < EVENTS_PER_LOOK {
                return Ok(ended);
            }
        }
    }

    /// Waits until somebody ends, one of `others` is readable or `timeout_ns` has passed; returns who
    /// has ended. A signal to this process ends the wait as well.
    ///
    /// # Errors
    /// If the kernel refuses.
    pub fn wait(
        &mut self,
        others: &[BorrowedFd<'_>],
        timeout_ns: u64,
    ) -> io::Result<Vec<CraftEnded>> {
        let timeout = Timespec {
            tv_sec: (timeout_ns / 1_000_000_000).cast_signed(),
            tv_nsec: (timeout_ns % 1_000_000_000).cast_signed(),
        };
        let mut watched = vec![PollFd::new(&self.epoll, PollFlags::IN)];
        watched.extend(others.iter().map(|other| PollFd::new(other, PollFlags::IN)));
        match poll(&mut watched, Some(&timeout)) {
            Ok(_) | Err(Errno::INTR) => self.poll(),
            Err(error) => Err(error.into()),
        }
    }

    /// Takes `craft` off the watch if it has ended.
    fn reap(&mut self, craft: CraftId) -> io::Result<Option<CraftEnded>> {
        let Some(process) = self.processes.get_mut(&craft) else { return Ok(None) };
        let Some(how) = process.try_wait()? else { return Ok(None) };
        process.listen();
        let ended =
            CraftEnded { craft, incarnation: process.incarnation(), how, said: process.said() };
        epoll::delete(&self.epoll, &*process)?;
        self.processes.remove(&craft);
        Ok(Some(ended))
    }
}

impl AsFd for Watch {
    /// Readable when a look is due.
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.epoll.as_fd()
    }
}
