//! The end of a fleet, bounded in time whatever its processes do.
//!
//! The caller has sent Stop and rung the bells. From there: a grace in which crafts end by themselves;
//! SIGTERM, with SIGCONT for those that somebody stopped, and a second grace; SIGKILL. Whoever ends is
//! reaped at once. A grace ends early when nobody is left, when only stopped crafts are left (they
//! cannot hear), and when the user asks again. Not here: what of the run stays behind, which is the
//! janitor's work (`launch::run_root`).

use super::signals::{Signals, Urgency};
use super::watch::{CraftEnded, Watch};
use rustix::process::Signal;
use shared_types::ids::CraftId;
use shared_types::time::Nanos;
use shared_types::transport::clock;
use std::io;
use std::os::fd::AsFd as _;

/// How long each step of the end may take, ms.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Graces {
    /// For crafts to drop their ports after Stop.
    pub orderly_ms: u64,
    /// For crafts to end after SIGTERM.
    pub terminate_ms: u64,
    /// For the kernel to remove what was killed.
    pub kill_ms: u64,
}

impl Graces {
    /// The end of a run whose crafts were told to stop. A hundred crafts with all ports open drop them
    /// in about a second on two cores.
    pub const ORDERLY: Self = Self { orderly_ms: 3_000, terminate_ms: 1_000, kill_ms: 5_000 };
}

/// How often a waiting shutdown looks whether only stopped crafts are left, ns.
const STOPPED_LOOK_NS: u64 = 50_000_000;

/// What became of the fleet.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ShutdownReport {
    /// Who ended, in the order of the ends.
    pub ended: Vec<CraftEnded>,
    /// Who was still there after the first grace and got SIGTERM.
    pub terminated: Vec<CraftId>,
    /// Who was still there after the second grace and got SIGKILL.
    pub killed: Vec<CraftId>,
    /// Who is still there after SIGKILL: a process that the kernel cannot interrupt.
    pub left: Vec<CraftId>,
}

impl ShutdownReport {
    /// Whether everybody ended by itself and without an error.
    #[must_use]
    pub fn is_orderly(&self) -> bool {
        self.terminated.is_empty() && self.nobody_died()
    }

    /// Whether everybody came to an end of its own, asked for by a signal or not.
    #[must_use]
    pub fn nobody_died(&self) -> bool {
        self.ended.iter().all(|ended| ended.how.is_orderly())
    }
}

/// Ends every process of `watch` and reaps it. `signals` are looked at meanwhile: an immediate request
/// cuts the graces.
///
/// # Errors
/// If the kernel refuses to watch or signal; processes that are left end when `watch` is dropped.
pub fn end_fleet(
    watch: &mut Watch,
    graces: Graces,
    signals: Option<&mut Signals>,
) -> io::Result<ShutdownReport> {
    let mut ending = FleetEnding { watch, signals, report: ShutdownReport::default() };
    ending.wait(graces.orderly_ms)?;
    if graces.terminate_ms > 0 && !ending.is_hurried()? {
        ending.report.terminated = ending.signal_all(&[Signal::TERM, Signal::CONT])?;
        ending.wait(graces.terminate_ms)?;
    }
    ending.report.killed = ending.signal_all(&[Signal::KILL])?;
    ending.wait_for_the_killed(graces.kill_ms)?;
    ending.report.left = ending.watch.living().map(|process| process.craft()).collect();
    Ok(ending.report)
}

struct FleetEnding<'a> {
    watch: &'a mut Watch,
    signals: Option<&'a mut Signals>,
    report: ShutdownReport,
}

impl FleetEnding<'_> {
    /// Whether the user wants the end at once.
    fn is_hurried(&mut self) -> io::Result<bool> {
        let Some(signals) = &mut self.signals else { return Ok(false) };
        Ok(signals.poll()?.is_some_and(|request| request.urgency == Urgency::Immediate))
    }

    /// Reaps for `grace_ms`, or until waiting longer has no point.
    fn wait(&mut self, grace_ms: u64) -> io::Result<()> {
        let deadline = clock::now().plus(grace_ms * 1_000_000);
        loop {
            self.reap_until(deadline)?;
            let is_pointless = self.watch.living().all(|process| process.is_stopped());
            if self.is_hurried()? || is_pointless || clock::now() >= deadline {
                return Ok(());
            }
        }
    }

    /// Reaps what SIGKILL ends; only the kernel can delay that.
    fn wait_for_the_killed(&mut self, grace_ms: u64) -> io::Result<()> {
        let deadline = clock::now().plus(grace_ms * 1_000_000);
        loop {
            self.reap_until(deadline)?;
            // Nothing is left to hurry, but a signal that nobody takes would end every wait at once.
            self.is_hurried()?;
            if self.watch.is_empty() || clock::now() >= deadline {
                return Ok(());
            }
        }
    }

    /// Waits once, for a process or a signal, and reaps who has ended.
    fn reap_until(&mut self, deadline: Nanos) -> io::Result<()> {
        let timeout_ns = deadline.since(clock::now()).min(STOPPED_LOOK_NS);
        let others: Vec<_> = self.signals.iter().map(|signals| signals.as_fd()).collect();
        let ended = self.watch.wait(&others, timeout_ns)?;
        self.report.ended.extend(ended);
        Ok(())
    }

    /// Sends `signals` to everybody who is left; says who that was.
    fn signal_all(&mut self, signals: &[Signal]) -> io::Result<Vec<CraftId>> {
        for process in self.watch.living() {
            for &signal in signals {
                process.signal(signal)?;
            }
        }
        Ok(self.watch.living().map(|process| process.craft()).collect())
    }
}
