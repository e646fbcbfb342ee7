//! Starts one operating-system process per craft, by executing `slateswarm agent` again.
//!
//! The executable is an argument, by default the one that is running, so that both sides are always of
//! one version. Processes are spawned without a hook between fork and exec: the standard library then
//! takes the fast path (`posix_spawn`, which shares memory until exec), and the craft does its own
//! set-up as its first acts. PDEATHSIG belongs to the *thread* that spawned: a [`Launcher`] cannot leave
//! the thread that made it, and that must be the main thread, or the fleet ends when the thread does.
//!
//! Standard input is empty, standard output and the environment are cut off; standard error is a pipe
//! that the supervisor reads, or the terminal's. Not here: watching and ending (`supervision`).

use super::craft_process::CraftProcess;
use agent::process::startup::AgentArguments;
use rustix::io::{Errno, FdFlags, fcntl_getfd, fcntl_setfd};
use shared_types::ids::{CraftId, Incarnation};
use std::ffi::{OsStr, OsString};
use std::io;
use std::marker::PhantomData;
use std::os::fd::{BorrowedFd, RawFd};
use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The environment that a craft keeps: where its libraries lie, how a panic reports and where a
/// coverage build writes. Everything else travels on its command line and in messages.
const KEPT_VARIABLES: [&str; 3] = ["LD_LIBRARY_PATH", "LLVM_PROFILE_FILE", "RUST_BACKTRACE"];

/// The first descriptor that is not a standard stream.
const FIRST_OWN_DESCRIPTOR: RawFd = 3;

/// Where a craft's standard error goes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CraftErrors {
    /// To the supervisor, which keeps a bounded part and shows it when the craft ends.
    #[default]
    Kept,
    /// To the orchestrator's own standard error (`--verbose`).
    Inherited,
}

/// Why a craft could not be started.
#[derive(Debug, thiserror::Error)]
pub enum LaunchError {
    /// The executable could not be run.
    #[error("cannot start craft {craft} from `{}`: {source}", executable.display())]
    Spawn {
        /// The craft.
        craft: CraftId,
        /// What was executed.
        executable: PathBuf,
        /// What the kernel said.
        source: io::Error,
    },
    /// The descriptors of this process could not be kept from its children.
    #[error("cannot keep descriptors from the crafts: {0}")]
    Descriptors(#[source] io::Error),
}

/// Starts crafts from one executable. Stays on the thread that made it.
#[derive(Debug)]
pub struct Launcher {
    executable: PathBuf,
    errors: CraftErrors,
    stays_on_its_thread: PhantomData<*const ()>,
}

impl Launcher {
    /// Starts crafts from `executable`. To be made on the main thread.
    #[must_use]
    pub fn new(executable: impl Into<PathBuf>, errors: CraftErrors) -> Self {
        Self { executable: executable.into(), errors, stays_on_its_thread: PhantomData }
    }

    /// Starts crafts from the executable that is running, also if its file was replaced meanwhile, as
    /// a build during a run does: the link names what runs and not a path.
    #[must_use]
    pub fn of_this_executable(errors: CraftErrors) -> Self {
        Self::new("/proc/self/exe", errors)
    }

    /// What is executed.
    #[must_use]
    pub fn executable(&self) -> &Path {
        &self.executable
    }

    /// Starts one process per item. If one fails, those already started are ended.
    ///
    /// # Errors
    /// If a process cannot be started.
    pub fn spawn_all(
        &self,
        crafts: impl IntoIterator<Item = AgentArguments>,
    ) -> Result<Vec<CraftProcess>, LaunchError> {
        keep_descriptors_from_children().map_err(LaunchError::Descriptors)?;
        crafts
            .into_iter()
            .map(|arguments| {
                let mut command = self.command();
                command.arg0("slateswarm").arg("agent").args(arguments.to_command_line());
                self.spawn(command, arguments.craft, arguments.incarnation)
            })
            .collect()
    }

    /// Starts the executable with any arguments in the place of a craft; what tests use.
    ///
    /// # Errors
    /// If the process cannot be started.
    pub fn spawn_program(
        &self,
        arguments: impl IntoIterator<Item = OsString>,
        craft: CraftId,
    ) -> Result<CraftProcess, LaunchError> {
        keep_descriptors_from_children().map_err(LaunchError::Descriptors)?;
        let mut command = self.command();
        command.args(arguments);
        self.spawn(command, craft, Incarnation(0))
    }

    /// Starts `executable` as an orchestrator of its own, for campaigns that kill orchestrators.
    ///
    /// # Errors
    /// If the process cannot be started.
    pub fn spawn_orchestrator<'e>(
        &self,
        executable: &Path,
        arguments: impl IntoIterator<Item = OsString>,
        environment: impl IntoIterator<Item = (&'e str, &'e OsStr)>,
    ) -> Result<CraftProcess, LaunchError> {
        keep_descriptors_from_children().map_err(LaunchError::Descriptors)?;
        let mut command = self.command_of(executable);
        command.args(arguments).envs(environment);
        self.spawn(command, CraftId::ORCHESTRATOR, Incarnation(0))
    }

    fn command(&self) -> Command {
        self.command_of(&self.executable)
    }

    /// An executable with streams and environment as every craft has them.
    #[expect(clippy::disallowed_methods, reason = "the one place that starts processes")]
    fn command_of(&self, executable: &Path) -> Command {
        let errors = match self.errors {
            CraftErrors::Kept => Stdio::piped(),
            CraftErrors::Inherited => Stdio::inherit(),
        };
        let mut command = Command::new(executable);
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(errors);
        command.env_clear();
        for name in KEPT_VARIABLES {
            command.envs(std::env::var_os(name).map(|value| (name, value)));
        }
        command
    }

    fn spawn(
        &self,
        mut command: Command,
        craft: CraftId,
        incarnation: Incarnation,
    ) -> Result<CraftProcess, LaunchError> {
        command.spawn().and_then(|child| CraftProcess::adopt(child, craft, incarnation)).map_err(
            |source| LaunchError::Spawn { craft, executable: self.executable.clone(), source },
        )
    }
}

/// Marks every descriptor of this process close-on-exec, so that no craft inherits one: neither what
/// the transport opens without the mark (one a service) nor what a terminal or a build system leaked
/// to us. Sound where closing by number in the child is not: nobody's descriptor is taken away.
fn keep_descriptors_from_children() -> io::Result<()> {
    for entry in std::fs::read_dir("/proc/self/fd")? {
        let name = entry?.file_name();
        let number = name.to_str().and_then(|name| name.parse::<RawFd>().ok());
        if let Some(number) = number.filter(|&number| number >= FIRST_OWN_DESCRIPTOR) {
            mark_close_on_exec(number)?;
        }
    }
    Ok(())
}

/// Marks one descriptor; one that was closed meanwhile is no error.
fn mark_close_on_exec(number: RawFd) -> io::Result<()> {
    #[expect(unsafe_code, reason = "a descriptor known by its number only")]
    // SAFETY: `number` is not -1, and the borrow is used for nothing but reading and setting a flag,
    // which the kernel refuses with EBADF should the owner have closed it; no owner relies on its
    // descriptor being inherited, because this file alone starts processes.
    let descriptor = unsafe { BorrowedFd::borrow_raw(number) };
    match fcntl_getfd(descriptor)
        .and_then(|flags| fcntl_setfd(descriptor, flags | FdFlags::CLOEXEC))
    {
        Ok(()) | Err(Errno::BADF) => Ok(()),
        Err(error) => Err(error.into()),
    }
}
