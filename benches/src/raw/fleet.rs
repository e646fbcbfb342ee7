//! The parent's side: starts the program again once per process, leads everybody through the start
//! barrier, collects the times, and leaves nothing behind.
//!
//! One thread a child reads its lines and one waits for signals; all feed one channel, so that the
//! parent waits in one place and a child that dies ends the measurement at once. Children are spawned
//! before any service exists, hence inherit no descriptor of one, and sit in process groups of their
//! own: Ctrl-C reaches the parent alone, which then kills them.

use super::RawError;
use super::area::{Area, AreaName};
use super::child::{CONNECT, CONNECTED, FINISHED, GO, OPEN, READY, RECORDED};
use hdrhistogram::Histogram;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;
use std::io::{BufRead, BufReader, ErrorKind, Write};
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, Sender, channel};

/// What children share: the parent holds it while they run, and tells them what they must know.
#[derive(Debug)]
pub struct Shared<T> {
    /// Dropped when every child has ended.
    pub held: T,
    /// One line without an end; may be empty.
    pub knowledge: String,
}

impl<T> Shared<T> {
    /// Something that children find by themselves.
    #[must_use]
    pub const fn known(held: T) -> Self {
        Self { held, knowledge: String::new() }
    }
}

/// Runs one measurement in `area`: `processes` children of this program, each started with this
/// program's own arguments and `--child INDEX`. `prepare` makes what they share, once they have been
/// started. Returns the times that child 0 recorded, in ns.
///
/// # Errors
/// If a child fails, a signal arrives, or shared memory cannot be used; everything is cleaned first.
pub fn measure<T>(
    area: &AreaName,
    processes: u32,
    prepare: impl FnOnce() -> Result<Shared<T>, RawError>,
) -> Result<Histogram<u64>, RawError> {
    let _claim =
        Area::claim(area, || eprintln!("another raw measurement runs; waiting for its end"))?;
    let (sender, events) = channel();
    watch_signals(sender.clone())?;
    // Declared before the fleet: it goes after the children, also on an error.
    let shared;
    let mut fleet = Fleet { children: Vec::new(), events };
    for index in 0..processes as usize {
        fleet.spawn(index, sender.clone())?;
    }
    shared = prepare()?;
    fleet.tell_all(&format!("{OPEN} {}", shared.knowledge))?;
    fleet.hear_all(READY)?;
    fleet.tell_all(CONNECT)?;
    fleet.hear_all(CONNECTED)?;
    fleet.tell_all(GO)?;
    let times = fleet.hear_all(FINISHED)?;
    fleet.dismiss()?;
    Ok(times)
}

/// What the parent waits for.
enum Event {
    /// A child wrote a line.
    Line(usize, String),
    /// A child closed its output: it has ended or is about to.
    Ended(usize),
    /// A signal arrived.
    Signal(i32),
}

/// The running children; killed when dropped.
struct Fleet {
    children: Vec<Child>,
    events: Receiver<Event>,
}

impl Fleet {
    #[expect(clippy::disallowed_methods, reason = "a baseline starts its own processes")]
    fn spawn(&mut self, index: usize, events: Sender<Event>) -> Result<(), RawError> {
        let program =
            std::env::current_exe().map_err(RawError::process("find the own executable"))?;
        let mut child = Command::new(program)
            .args(std::env::args_os().skip(1))
            .args(["--child", &index.to_string()])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .process_group(0)
            .spawn()
            .map_err(RawError::process("start a child"))?;
        let output = child.stdout.take().expect("invariant: the child's output is a pipe");
        self.children.push(child);
        std::thread::spawn(move || {
            for line in BufReader::new(output).lines().map_while(Result::ok) {
                if events.send(Event::Line(index, line)).is_err() {
                    return;
                }
            }
            // Fails only if the parent is done and listens no more.
            let _ = events.send(Event::Ended(index));
        });
        Ok(())
    }

    fn tell_all(&mut self, line: &str) -> Result<(), RawError> {
        for index in 0..self.children.len() {
            let input = self.children[index].stdin.as_mut();
            let input = input.expect("invariant: the child's input is open");
            match writeln!(input, "{line}") {
                Err(error) if error.kind() == ErrorKind::BrokenPipe => {
                    return Err(self.ended(index));
                }
                written => written.map_err(RawError::process("speak to a child"))?,
            }
        }
        Ok(())
    }

    /// Waits until every child has said `expected`; returns the times that came before.
    fn hear_all(&mut self, expected: &str) -> Result<Histogram<u64>, RawError> {
        let mut times = super::empty_histogram();
        let mut awaited = self.children.len();
        while awaited > 0 {
            let event = self.events.recv().expect("invariant: the signal thread keeps a sender");
            match event {
                Event::Line(_, line) if line == expected => awaited -= 1,
                Event::Line(index, line) => {
                    let (time_ns, count) = parse_recorded(&line).ok_or_else(|| {
                        RawError::Unexpected(format!("line {line:?} of process {index}"))
                    })?;
                    times.saturating_record_n(time_ns, count);
                }
                Event::Ended(index) => return Err(self.ended(index)),
                Event::Signal(signal) => return Err(RawError::Signal(signal)),
            }
        }
        Ok(times)
    }

    /// The error of a child that ended too soon.
    fn ended(&mut self, index: usize) -> RawError {
        match self.children[index].wait() {
            Ok(status) => RawError::Ended { index, status },
            Err(source) => RawError::Process { operation: "wait for a child", source },
        }
    }

    /// Lets every child go and waits for its end.
    fn dismiss(&mut self) -> Result<(), RawError> {
        for child in &mut self.children {
            drop(child.stdin.take());
        }
        for (index, child) in self.children.iter_mut().enumerate() {
            let status = child.wait().map_err(RawError::process("wait for a child"))?;
            if !status.success() {
                return Err(RawError::Ended { index, status });
            }
        }
        Ok(())
    }
}

impl Drop for Fleet {
    fn drop(&mut self) {
        // Both fail only for a child that has ended and was waited for.
        for child in &mut self.children {
            let _ = child.kill();
        }
        for child in &mut self.children {
            let _ = child.wait();
        }
    }
}

/// From now on signals that ask to stop are events; the default would end the parent uncleaned.
fn watch_signals(events: Sender<Event>) -> Result<(), RawError> {
    let mut signals =
        Signals::new([SIGINT, SIGTERM, SIGHUP]).map_err(RawError::process("listen to signals"))?;
    std::thread::spawn(move || {
        for signal in signals.forever() {
            // The fleet is already gone if nobody listens; then the program is about to end.
            let _ = events.send(Event::Signal(signal));
        }
    });
    Ok(())
}

/// Time in ns and count of a line with a recorded time.
fn parse_recorded(line: &str) -> Option<(u64, u64)> {
    let (time_ns, count) = line.strip_prefix(RECORDED)?.trim_start().split_once(' ')?;
    Some((time_ns.parse().ok()?, count.parse().ok()?))
}

#[cfg(test)]
mod tests {
    use super::parse_recorded;

    #[test]
    fn a_recorded_time_is_read_back() {
        assert_eq!(parse_recorded("recorded 25087 312"), Some((25_087, 312)));
    }

    #[test]
    fn anything_else_is_refused() {
        for line in ["ready", "recorded", "recorded 7", "recorded seven 1", "recorded 7 1 2", ""] {
            assert_eq!(parse_recorded(line), None, "{line:?}");
        }
    }
}
