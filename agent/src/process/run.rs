//! A craft's process from its first act to its last.

use super::doom::{Doomed, Point};
use super::session::{Rest, Session, SessionError, Surroundings, Usage};
use super::startup::{self, AgentArguments, Ending, StartupError};
use crate::craft::Craft;
use shared_types::ids::CraftId;
use shared_types::time::Nanos;
use shared_types::transport::heartbeat::Heart;
use shared_types::transport::iceoryx::{EndpointOptions, IceoryxEndpoint, IdleWait, OpenError};
use shared_types::transport::{Endpoint, RunPaths, SendError, WakeMode, clock};
use std::os::fd::AsFd;

/// How often a centre without a part in the epoch looks up in wake mode `poll`, in which nobody
/// rings, ns.
const LOOK_UP_NS: u64 = 5_000_000;

/// Why a craft's process ends with an error.
#[derive(Debug, thiserror::Error)]
pub enum ProcessError {
    /// It could not take its first steps.
    #[error(transparent)]
    Startup(#[from] StartupError),
    /// The run that it belongs to is not there.
    #[error(
        "there is no live run at `{}`: `agent` is started by the orchestrator, never by hand",
        .0.display()
    )]
    NoRun(std::path::PathBuf),
    /// The run has no counter for its heartbeat.
    #[error(
        "no heartbeat in `{}`: {source}; both sides must be of one version: start the run again",
        path.display()
    )]
    NoHeart {
        /// The file of counters.
        path: std::path::PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Its ports could not be opened.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// Its session failed.
    #[error(transparent)]
    Session(#[from] SessionError),
}

/// Lives as the craft that `arguments` name, until it is told to end.
///
/// # Errors
/// If the process cannot start, or its transport fails.
pub fn run(arguments: &AgentArguments) -> Result<(), ProcessError> {
    let doom = arguments.doom;
    if let Some(doom) = doom {
        doom.strike_at(Point::StartUp);
    }
    let ending = startup::take_first_steps(arguments)?;
    let paths = RunPaths::below(&arguments.base, arguments.run);
    if !paths.lock_file().exists() {
        return Err(ProcessError::NoRun(paths.root()));
    }
    let heart = Heart::open(&paths, arguments.craft)
        .map_err(|source| ProcessError::NoHeart { path: paths.beats_file(), source })?;
    heart.beat();
    // Room for a centre, whether or not the fleet has one.
    let options = EndpointOptions {
        hears_turns: arguments.craft != CraftId(arguments.craft_count),
        ..EndpointOptions::new(arguments.craft_count + 1, arguments.wake)
    };
    if let Some(doom) = doom {
        doom.strike_soon_after(Point::Opening);
    }
    let endpoint = IceoryxEndpoint::open(&paths, arguments.craft, arguments.incarnation, options)?;
    let surroundings = System {
        ending: &ending,
        heart,
        wake: arguments.wake,
        idle: IdleWait::new(arguments.wake),
        page_bytes: rustix::param::page_size() as u64,
    };
    let craft = Craft::new(arguments.craft)
        .with_neighbours(arguments.beside.clone())
        .with_life(arguments.incarnation.0);
    let ended = match doom {
        None => Session::new(craft, endpoint, surroundings).run(),
        Some(doom) => Session::new(craft, Doomed::new(endpoint, doom), surroundings).run(),
    };
    Ok(ended?)
}

/// An endpoint with one of iceoryx2 inside, which a process can sleep on.
trait Real: Endpoint {
    /// The endpoint of iceoryx2.
    fn real(&mut self) -> &mut IceoryxEndpoint;
}

impl Real for IceoryxEndpoint {
    fn real(&mut self) -> &mut IceoryxEndpoint {
        self
    }
}

impl Real for Doomed<IceoryxEndpoint> {
    fn real(&mut self) -> &mut IceoryxEndpoint {
        self.inner_mut()
    }
}

/// The process's clock, memory and waiting.
struct System<'a> {
    ending: &'a Ending,
    heart: Heart,
    wake: WakeMode,
    idle: IdleWait,
    page_bytes: u64,
}

impl Drop for System<'_> {
    /// The session is over and its ports are dropped next: from here on the end is bounded.
    fn drop(&mut self) {
        self.ending.begin();
    }
}

impl<E: Real> Surroundings<E> for System<'_> {
    fn now(&self) -> Nanos {
        clock::now()
    }

    fn cpu_ns(&self) -> u64 {
        clock::process_cpu().0
    }

    fn resident_bytes(&self) -> u64 {
        let pages = std::fs::read_to_string("/proc/self/statm")
            .ok()
            .and_then(|statm| statm.split(' ').nth(1)?.parse::<u64>().ok());
        pages.unwrap_or(0) * self.page_bytes
    }

    fn proportional_bytes(&self) -> u64 {
        let rollup = std::fs::read_to_string("/proc/self/smaps_rollup").unwrap_or_default();
        let line = rollup.lines().find_map(|line| line.strip_prefix("Pss:"));
        let kilobytes = line.and_then(|line| line.trim().strip_suffix("kB")?.trim().parse().ok());
        kilobytes.unwrap_or(0) * 1024
    }

    fn usage(&self) -> Usage {
        // The first thread does everything; the guard beside it only sleeps.
        let schedule = std::fs::read_to_string("/proc/self/schedstat").unwrap_or_default();
        let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        let sleeps = status.lines().find_map(|line| line.strip_prefix("voluntary_ctxt_switches:"));
        Usage {
            run_delay_ns: schedule
                .split_whitespace()
                .nth(1)
                .and_then(|delay_ns| delay_ns.parse().ok())
                .unwrap_or(0),
            sleeps: sleeps.and_then(|sleeps| sleeps.trim().parse().ok()).unwrap_or(0),
        }
    }

    fn must_end(&self) -> bool {
        self.ending.is_requested()
    }

    fn stay_awake(&mut self) {
        self.idle.reset();
    }

    fn beat(&self) {
        self.heart.beat();
    }

    fn rest(&mut self, endpoint: &mut E, rest: Rest) -> Result<(), SendError> {
        // Every loop of the session comes by here once a round.
        Surroundings::<E>::beat(self);
        let endpoint = endpoint.real();
        let others = [self.ending.as_fd()];
        match rest {
            Rest::Yield => rustix::thread::sched_yield(),
            Rest::Wait { takes_part: true, until } => {
                self.idle.wait(endpoint, until, &others)?;
            }
            Rest::Wait { takes_part: false, .. } => {
                let is_unheard = self.wake == WakeMode::Poll;
                let until = is_unheard.then(|| clock::now().plus(LOOK_UP_NS));
                endpoint.wait(until, &others)?;
            }
        }
        Ok(())
    }
}
