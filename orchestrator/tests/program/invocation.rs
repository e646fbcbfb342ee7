//! One invocation of the executable: where it keeps its files, what it runs, how it ended, and whether
//! anything of it is left.

use crate::shared::{machine_wide_lock, temporary_base, until, until_else};
use agent::process::startup::AgentArguments;
use orchestrator::results::event::Event;
use orchestrator::results::read::{RunData, read_run};
use rustix::process::{Pid, Signal, kill_process, kill_process_group};
use shared_types::transport::RunPaths;
use shared_types::transport::paths::BASE_VARIABLE;
use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fs::File;
use std::os::unix::ffi::OsStringExt as _;
use std::os::unix::process::{CommandExt as _, ExitStatusExt as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};

/// Variables that change what the executable prints or does.
const NOT_INHERITED: [&str; 6] =
    ["CARGO", "NO_COLOR", "COLUMNS", "CLICOLOR_FORCE", "RUST_BACKTRACE", "TERM"];

/// A place for invocations: shared memory below a base of its own, a working directory of its own.
/// Dropping it ends and removes what is left, as after a test that failed.
pub(crate) struct Place {
    /// Holds the base, which the executable makes and removes itself.
    shared_memory: tempfile::TempDir,
    files: tempfile::TempDir,
    _machine: Option<File>,
}

impl Place {
    /// A place for fleets: the machine is ours.
    pub(crate) fn for_fleets() -> Self {
        Self::with(Some(machine_wide_lock()))
    }

    /// A place for what starts no fleet.
    pub(crate) fn new() -> Self {
        Self::with(None)
    }

    fn with(machine: Option<File>) -> Self {
        let files = tempfile::tempdir().unwrap();
        Self { shared_memory: temporary_base(), files, _machine: machine }
    }

    /// Below it the executable keeps its runs.
    pub(crate) fn base(&self) -> PathBuf {
        self.shared_memory.path().join("b")
    }

    /// Where the executable works; results lie in `runs` there.
    pub(crate) fn files(&self) -> &Path {
        self.files.path()
    }

    /// Writes a file there.
    pub(crate) fn write(&self, name: &str, text: &str) {
        std::fs::write(self.files().join(name), text).unwrap();
    }

    /// The executable with these words, nothing on standard input, no terminal.
    pub(crate) fn command(&self, words: &[&str]) -> Command {
        let mut command = program(env!("CARGO_BIN_EXE_slateswarm"));
        command.args(words).current_dir(self.files());
        let ours = std::env::vars_os().map(|(name, _)| name);
        for name in ours.filter(|name| name.to_string_lossy().starts_with("SLATESWARM_")) {
            command.env_remove(name);
        }
        for name in NOT_INHERITED {
            command.env_remove(name);
        }
        command.env(BASE_VARIABLE, self.base()).stdin(Stdio::null());
        command
    }

    /// Starts the executable, in a process group of its own.
    pub(crate) fn start(&self, words: &[&str]) -> Invocation {
        self.start_command(self.command(words))
    }

    /// Starts what [`Self::command`] made.
    pub(crate) fn start_command(&self, mut command: Command) -> Invocation {
        static COUNT: AtomicU64 = AtomicU64::new(0);
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let [stdout, stderr] =
            ["out", "err"].map(|kind| self.shared_memory.path().join(format!("{number}.{kind}")));
        command.stdout(File::create(&stdout).unwrap()).stderr(File::create(&stderr).unwrap());
        command.process_group(0);
        let line = format!("{command:?}");
        Invocation { child: command.spawn().unwrap(), line, stdout, stderr }
    }

    /// Runs the executable to its end.
    pub(crate) fn run(&self, words: &[&str]) -> Finished {
        self.start(words).finish()
    }

    /// The craft processes of all runs below the base, by their command lines.
    pub(crate) fn crafts(&self) -> Vec<CraftSeen> {
        let base = self.base();
        let entries = std::fs::read_dir("/proc").unwrap();
        let pids = entries.filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok());
        let mut crafts: Vec<CraftSeen> = pids
            .filter_map(|pid: u32| {
                let line = std::fs::read(format!("/proc/{pid}/cmdline")).ok()?;
                let line = line.strip_suffix(b"\0")?;
                let words = line.split(|&byte| byte == 0);
                let mut words = words.map(|word| OsString::from_vec(word.to_vec())).skip(1);
                let is_craft = words.next().is_some_and(|verb| verb == "agent");
                let arguments = AgentArguments::from_command_line(words).ok()?;
                (is_craft && arguments.base == base).then_some(CraftSeen { pid, arguments })
            })
            .collect();
        crafts.sort_by_key(|craft| craft.arguments.craft);
        crafts
    }

    /// The runs below the base.
    pub(crate) fn runs(&self) -> Vec<RunPaths> {
        RunPaths::list(&self.base()).unwrap()
    }

    /// What the newest results directory says; `None` before there is one.
    pub(crate) fn results(&self) -> Option<RunData> {
        read_run(&self.files().join("runs/latest")).ok()
    }

    /// Waits until an epoch after the first `count` is done in the newest run.
    pub(crate) fn await_epochs(&self, count: usize) {
        until("an epoch to be done", || (self.epochs_done() > count).then_some(()));
    }

    /// Epochs that are done in the newest run.
    pub(crate) fn epochs_done(&self) -> usize {
        let events = self.results().map(|results| results.events).unwrap_or_default();
        events.iter().filter(|line| matches!(line.event, Event::EpochDone { .. })).count()
    }

    /// Fails if anything is left of `runs` or of any other run below the base.
    #[track_caller]
    pub(crate) fn assert_nothing_left(&self, runs: &[RunPaths]) {
        assert_eq!(self.crafts(), [], "crafts are left");
        let entries = std::fs::read_dir(self.base()).map(|entries| entries.count());
        assert_eq!(entries.unwrap_or(0), 0, "files are left in {}", self.base().display());
        for run in runs {
            assert_eq!(run.segments().unwrap(), [] as [PathBuf; 0]);
        }
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        // Segments outside the base are found through what lies in it.
        if self.base().exists() {
            let _cleaned_as_far_as_possible = self.command(&["clean"]).output();
        }
    }
}

/// A craft's process.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct CraftSeen {
    pub(crate) pid: u32,
    pub(crate) arguments: AgentArguments,
}

impl CraftSeen {
    /// Sends it a signal; one that comes too late is no error.
    pub(crate) fn signal(&self, signal: Signal) {
        send(self.pid, signal);
    }
}

/// The executable while it runs. Dropping it kills it; its crafts end by themselves.
pub(crate) struct Invocation {
    child: Child,
    line: String,
    stdout: PathBuf,
    stderr: PathBuf,
}

/// How an invocation ended and what it printed.
#[derive(Debug)]
pub(crate) struct Finished {
    line: String,
    status: ExitStatus,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Invocation {
    /// Its process number.
    pub(crate) fn pid(&self) -> u32 {
        self.child.id()
    }

    /// Sends a signal to the orchestrator alone.
    pub(crate) fn signal(&self, signal: Signal) {
        send(self.pid(), signal);
    }

    /// Sends a signal to the orchestrator and its crafts, as a terminal does.
    pub(crate) fn signal_group(&self, signal: Signal) {
        let group = Pid::from_raw(self.pid().cast_signed()).unwrap();
        kill_process_group(group, signal).unwrap();
    }

    /// What it has said on standard error so far.
    pub(crate) fn said(&self) -> String {
        std::fs::read_to_string(&self.stderr).unwrap()
    }

    /// Whether it has ended.
    pub(crate) fn has_ended(&mut self) -> bool {
        self.child.try_wait().unwrap().is_some()
    }

    /// Waits for its end, within bounds.
    pub(crate) fn finish(mut self) -> Finished {
        let line = self.line.clone();
        let pid = self.pid();
        let ended = || self.child.try_wait().unwrap();
        let status = until_else(ended, || format!("the end of {line}\n{}", group_of(pid)));
        let read = |path| String::from_utf8(std::fs::read(path).unwrap()).unwrap();
        Finished { line, status, stdout: read(&self.stdout), stderr: read(&self.stderr) }
    }
}

/// Whether process `pid` ignores `signal`, as every process does at first whose starter did: one below
/// `nohup` does so with SIGHUP, one that a script started in the background with SIGINT.
pub(crate) fn ignores(pid: u32, signal: Signal) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let ignored = ignored.map_or(0, |ignored| u64::from_str_radix(ignored.trim(), 16).unwrap());
    ignored >> (signal.as_raw() - 1) & 1 != 0
}

impl Drop for Invocation {
    fn drop(&mut self) {
        // Both do nothing if it was waited for already.
        let _ended = self.child.kill();
        let _reaped = self.child.wait();
    }
}

impl Finished {
    /// Its exit code, `None` if a signal ended it.
    pub(crate) fn code(&self) -> Option<i32> {
        self.status.code()
    }

    /// Fails with everything that was printed unless the exit code is `code`.
    #[track_caller]
    pub(crate) fn expect_code(self, code: i32) -> Self {
        assert_eq!(self.code(), Some(code), "{self}");
        self
    }

    /// Fails unless `signal` ended it.
    #[track_caller]
    pub(crate) fn expect_signal(self, signal: Signal) -> Self {
        assert_eq!(self.status.signal(), Some(signal.as_raw()), "{self}");
        self
    }
}

impl std::fmt::Display for Finished {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { line, status, stdout, stderr } = self;
        let stdout = stdout.get(..4000).unwrap_or(stdout);
        write!(formatter, "{line}\n{status}\nstdout: {stdout}\nstderr: {stderr}")
    }
}

/// A command that a test may start.
#[expect(clippy::disallowed_methods, reason = "a test starts the executable as a user does")]
pub(crate) fn program(path: &str) -> Command {
    Command::new(path)
}

/// Runs that are seen while something goes on, in order of their ids.
#[derive(Default)]
pub(crate) struct RunsSeen(BTreeSet<u64>);

impl RunsSeen {
    /// Notes the runs that are there now.
    pub(crate) fn look(&mut self, place: &Place) {
        self.0.extend(place.runs().iter().map(RunPaths::run));
    }

    /// All that were there at some look.
    pub(crate) fn paths(&self, place: &Place) -> Vec<RunPaths> {
        self.0.iter().map(|&run| RunPaths::below(place.base(), run)).collect()
    }
}

/// What the processes of group `group` are doing, a line each: for failures that do not come again.
fn group_of(group: u32) -> String {
    let mut all = String::new();
    for entry in std::fs::read_dir("/proc").unwrap().flatten() {
        let read = |file| std::fs::read_to_string(entry.path().join(file)).unwrap_or_default();
        let stat = read("stat");
        // Behind the name, which may hold anything: state, parent, group.
        let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split(' ').collect();
        if fields.get(3) == Some(&group.to_string().as_str()) {
            let (words, waits) = (read("cmdline").replace('\0', " "), read("wchan"));
            all.push_str(&format!("{stat} waits in {waits}: {words}\n", stat = stat.trim()));
        }
    }
    all
}

fn send(pid: u32, signal: Signal) {
    let pid = Pid::from_raw(pid.cast_signed()).unwrap();
    match kill_process(pid, signal) {
        Ok(()) | Err(rustix::io::Errno::SRCH) => {}
        Err(error) => panic!("cannot signal {pid:?}: {error}"),
    }
}
