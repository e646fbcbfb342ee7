//! Faults that the fleet's own loop inflicts: a signal to one of its processes when its time has come,
//! and dooms for lives that are still to be started. Whether a fault took effect is seen, not assumed.
//! Not here: which faults there are (`campaign`), and what follows from a death (`recovery`).

use super::fleet::RealFleet;
use crate::launch::craft_process::CraftProcess;
use agent::process::doom::Doom;
use rustix::process::Signal;
use shared_types::ids::{CraftId, Incarnation};
use shared_types::time::Nanos;
use shared_types::transport::{RunPaths, clock};

/// What is done to a process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blow {
    /// SIGKILL.
    Kill,
    /// SIGSTOP.
    Stop,
    /// SIGCONT, after a look whether the process was stopped.
    Continue,
}

/// A blow at an instant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Strike {
    /// Not before.
    pub due: Nanos,
    /// Whom.
    pub craft: CraftId,
    /// What.
    pub blow: Blow,
}

/// A blow that was struck.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Struck {
    /// As it was planned.
    pub strike: Strike,
    /// When it was struck.
    pub at: Nanos,
    /// Whether the process was stopped (state T) just before.
    pub was_stopped: bool,
}

impl RealFleet<'_> {
    /// Plans blows, beside those that are planned already.
    pub fn strike(&mut self, strikes: impl IntoIterator<Item = Strike>) {
        self.strikes.extend(strikes);
        self.strikes.sort_by_key(|strike| std::cmp::Reverse(strike.due));
    }

    /// The blows that were struck since the last call.
    pub fn take_struck(&mut self) -> Vec<Struck> {
        std::mem::take(&mut self.struck)
    }

    /// Dooms the next life of `craft`.
    pub fn doom(&mut self, craft: CraftId, doom: Doom) {
        self.options.dooms.insert(craft, doom);
    }

    /// The number of the process that `craft` is at present.
    #[must_use]
    pub fn process_id(&self, craft: CraftId) -> Option<u32> {
        self.watch.process(craft).map(CraftProcess::pid)
    }

    /// Which life `craft` lives.
    #[must_use]
    pub fn incarnation(&self, craft: CraftId) -> Incarnation {
        self.lives[craft.index()].incarnation
    }

    /// The life that the next successor of anybody will live.
    #[must_use]
    pub const fn next_incarnation(&self) -> Incarnation {
        Incarnation(self.lives_given + 1)
    }

    /// Whether every process lives and has said so.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.lives.iter().all(|life| life.is_ready)
    }

    /// Where the fleet's files lie.
    #[must_use]
    pub const fn paths(&self) -> &RunPaths {
        self.root.paths()
    }

    /// Whether blows are planned that were not struck yet.
    #[must_use]
    pub const fn has_strikes(&self) -> bool {
        !self.strikes.is_empty()
    }

    /// When the next blow is due.
    pub(super) fn next_strike(&self) -> Option<Nanos> {
        self.strikes.last().map(|strike| strike.due)
    }

    /// Strikes what is due. A process that has gone meanwhile is not struck.
    pub(super) fn strike_when_due(&mut self) -> std::io::Result<()> {
        while let Some(&strike) = self.strikes.last().filter(|strike| strike.due <= clock::now()) {
            self.strikes.pop();
            let Some(process) = self.watch.process(strike.craft) else { continue };
            let was_stopped = strike.blow == Blow::Continue && process.is_stopped();
            process.signal(match strike.blow {
                Blow::Kill => Signal::KILL,
                Blow::Stop => Signal::STOP,
                Blow::Continue => Signal::CONT,
            })?;
            self.struck.push(Struck { strike, at: clock::now(), was_stopped });
        }
        Ok(())
    }
}
