//! The child's side: its first acts, its core, and its conversation with the parent.
//!
//! The conversation is lines over pipes: `open`, `connect` and `go` come from the parent, `ready`,
//! `connected` and at the end the recorded times and `finished` go back. The end of the child's
//! standard input means "you may leave"; nobody leaves while others still measure.

use super::RawError;
use super::area::AreaName;
use hdrhistogram::Histogram;
use rustix::process::Signal;
use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};
use std::io::{self, BufRead, Write};

/// Parent to child, before what children must know: what they share is prepared.
pub(super) const OPEN: &str = "open";
/// Child to parent: my ports are open.
pub(super) const READY: &str = "ready";
/// Parent to child: everybody's ports are open.
pub(super) const CONNECT: &str = "connect";
/// Child to parent: my connections are up.
pub(super) const CONNECTED: &str = "connected";
/// Parent to child: everybody's connections are up.
pub(super) const GO: &str = "go";
/// Child to parent, before a time in ns and how often it was recorded.
pub(super) const RECORDED: &str = "recorded";
/// Child to parent: nothing more comes.
pub(super) const FINISHED: &str = "finished";

/// Which cores the children may use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Placement {
    /// How many of the cores that this process may use, the first ones.
    pub cores: usize,
    /// Whether child i is pinned to core i modulo `cores`, else it may move among them.
    pub is_pinned: bool,
}

/// A child that has been placed.
#[derive(Debug)]
pub struct Child {
    area: AreaName,
    input: io::StdinLock<'static>,
}

impl Child {
    /// The first acts of child `index` in `area`: it dies with the parent and moves to its core.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn begin(index: u32, placement: Placement, area: AreaName) -> Result<Self, RawError> {
        rustix::process::set_parent_process_death_signal(Some(Signal::KILL))
            .map_err(RawError::process("tie the child to its parent"))?;
        let allowed = sched_getaffinity(None).map_err(RawError::process("read the cores"))?;
        let cores: Vec<usize> = (0..CpuSet::MAX_CPU)
            .filter(|&core| allowed.is_set(core))
            .take(placement.cores)
            .collect();
        let mut chosen = CpuSet::new();
        if placement.is_pinned {
            chosen.set(cores[index as usize % cores.len()]);
        } else {
            cores.iter().for_each(|&core| chosen.set(core));
        }
        sched_setaffinity(None, &chosen).map_err(RawError::process("move to a core"))?;
        Ok(Self { area, input: io::stdin().lock() })
    }

    /// Where the measurement takes place.
    #[must_use]
    pub const fn area(&self) -> &AreaName {
        &self.area
    }

    /// Waits until the parent has prepared what the children share; returns what they must know.
    ///
    /// # Errors
    /// If the parent is gone or says something else.
    pub fn await_opening(&mut self) -> Result<String, RawError> {
        let line = self.listen()?;
        match line.trim_end().strip_prefix(OPEN) {
            Some(knowledge) => Ok(knowledge.trim_start().to_owned()),
            None => Err(unexpected(&line, OPEN)),
        }
    }

    /// Says that the own ports are open and waits until everybody's are.
    ///
    /// # Errors
    /// If the parent is gone or says something else.
    pub fn await_peers(&mut self) -> Result<(), RawError> {
        say(READY)?;
        self.hear(CONNECT)
    }

    /// Says that the own connections are up and waits until everybody's are.
    ///
    /// # Errors
    /// If the parent is gone or says something else.
    pub fn await_start(&mut self) -> Result<(), RawError> {
        say(CONNECTED)?;
        self.hear(GO)
    }

    /// Hands `times` to the parent and waits until it lets go.
    ///
    /// # Errors
    /// If the parent is gone or says something else.
    pub fn finish(&mut self, times: &Histogram<u64>) -> Result<(), RawError> {
        let mut report = String::new();
        for recorded in times.iter_recorded() {
            let (time_ns, count) = (recorded.value_iterated_to(), recorded.count_at_value());
            report.push_str(&format!("{RECORDED} {time_ns} {count}\n"));
        }
        report.push_str(FINISHED);
        say(&report)?;
        self.hear("")
    }

    /// Waits for `expected`; the empty line is the end of the input.
    fn hear(&mut self, expected: &str) -> Result<(), RawError> {
        let line = self.listen()?;
        if line.trim_end() == expected { Ok(()) } else { Err(unexpected(&line, expected)) }
    }

    fn listen(&mut self) -> Result<String, RawError> {
        let mut line = String::new();
        self.input.read_line(&mut line).map_err(RawError::process("listen to the parent"))?;
        Ok(line)
    }
}

fn unexpected(line: &str, expected: &str) -> RawError {
    RawError::Unexpected(format!("line {line:?} instead of {expected:?}"))
}

/// Writes one line to the parent.
fn say(line: &str) -> Result<(), RawError> {
    let mut output = io::stdout().lock();
    writeln!(output, "{line}")
        .and_then(|()| output.flush())
        .map_err(RawError::process("speak to the parent"))
}
