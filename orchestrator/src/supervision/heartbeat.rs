//! Who is silent: a process that runs, and goes round its loop no more.
//!
//! A living process moves its counter at least every [`SLEEP_NS_MAX`]. Whose counter stands still for
//! longer is looked at in /proc, and from then on only time counts in which it could have moved it: CPU
//! time that it used, or time that it slept. A process that waits for a core is starved and not silent, one
//! that the kernel holds up (for a disk, or a lock of its own) is so as well, and a stopped one is paused and
//! begins anew when it goes on. While somebody is held up or stopped nobody else is judged, since who waits
//! for what it was making is not to blame. After [`SILENCE_NS`] what was never finished shall be swept, for
//! the process may be waiting on such a file; who does not move within [`GRACE_NS`] after that, longer than
//! anybody waits for a file, shall be killed.
//!
//! No clock, no file: times and counters are arguments. Not here: reading them, sweeping and killing
//! (`run::silence`).

use crate::launch::craft_process::Standing;
use shared_types::ids::{CraftId, Incarnation};
use shared_types::limits::{CREATION_PATIENCE_NS, SLEEP_NS_MAX};
use shared_types::time::Nanos;
use std::collections::BTreeMap;

/// How long a process may go on without a beat, ns: four of the longest sleeps.
pub const SILENCE_NS: u64 = 4 * SLEEP_NS_MAX;

/// The same until it has said that it is up: it opens all its ports without a beat.
pub const START_SILENCE_NS: u64 = 10 * SLEEP_NS_MAX;

/// How long it is given after the sweep, ns: it may have begun to wait for what another process makes
/// just before.
pub const GRACE_NS: u64 = CREATION_PATIENCE_NS + SLEEP_NS_MAX;

/// Between two looks at the least, ns. They are further apart while the orchestrator itself sleeps.
pub const LOOK_NS: u64 = 250_000_000;

/// What one look may count, ns: more has passed only if the orchestrator itself was held up, and what the
/// process did all that time nobody saw.
const COUNTED_NS_MAX: u64 = SLEEP_NS_MAX;

/// A process as one look finds it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seen {
    /// Which craft's.
    pub craft: CraftId,
    /// Which life of it.
    pub incarnation: Incarnation,
    /// Whether it has said that it is up.
    pub is_ready: bool,
    /// Its counter.
    pub beats: u64,
}

/// A process that has not moved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Silence {
    /// Which craft's.
    pub craft: CraftId,
    /// Which life of it.
    pub incarnation: Incarnation,
    /// Since when, ns; that it was starved of CPU in between is not taken off.
    pub silent_ns: u64,
}

/// What follows from a look.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Finding {
    /// It is silent: what was never finished is to be swept.
    Silent(Silence),
    /// It was, and moves again.
    Moves(Silence),
    /// The sweep has not helped: it is to be killed.
    Hopeless(Silence),
}

/// How far it has come with a process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Heard,
    /// Its silence was told and the sweep is under way.
    Told,
    /// The sweep was over when so much had been counted.
    Swept {
        counted_ns: u64,
    },
    Condemned,
}

#[derive(Clone, Copy, Debug)]
struct Pulse {
    incarnation: Incarnation,
    beats: u64,
    /// When the counter was seen to have moved.
    moved: Nanos,
    seen: Nanos,
    /// Time since then in which it could have moved again.
    counted_ns: u64,
    /// How it stood at the last look, once it is looked at.
    stood: Option<Standing>,
    /// Whether it was stopped then.
    is_paused: bool,
    stage: Stage,
}

impl Pulse {
    const fn new(seen: &Seen, now: Nanos) -> Self {
        Self {
            incarnation: seen.incarnation,
            beats: seen.beats,
            moved: now,
            seen: now,
            counted_ns: 0,
            stood: None,
            is_paused: false,
            stage: Stage::Heard,
        }
    }

    const fn silence(&self, craft: CraftId, now: Nanos) -> Silence {
        Silence { craft, incarnation: self.incarnation, silent_ns: now.since(self.moved) }
    }

    /// Counts what has passed since the last look of a process that `stands` as it does.
    fn count(&mut self, stands: &Standing, passed_ns: u64) {
        let before = self.stood.replace(*stands);
        let since = |of: fn(&Standing) -> u64| {
            before.map_or(0, |before| of(stands).saturating_sub(of(&before)))
        };
        self.counted_ns += if stands.is_runnable() {
            // It may wait for a core, for how long is not told yet: what it used of one is all that counts.
            since(|at| at.cpu_ns).min(passed_ns)
        } else {
            passed_ns.saturating_sub(since(|at| at.starved_ns))
        };
    }

    /// What has become of the process now that time was counted.
    fn judge(&mut self, seen: &Seen, now: Nanos) -> Option<Finding> {
        let limit_ns = if seen.is_ready { SILENCE_NS } else { START_SILENCE_NS };
        let silence = self.silence(seen.craft, now);
        match self.stage {
            Stage::Heard if self.counted_ns >= limit_ns => {
                self.stage = Stage::Told;
                Some(Finding::Silent(silence))
            }
            Stage::Swept { counted_ns } if self.counted_ns >= counted_ns + GRACE_NS => {
                self.stage = Stage::Condemned;
                Some(Finding::Hopeless(silence))
            }
            _ => None,
        }
    }
}

/// The counters of a fleet as they were last seen.
#[derive(Debug, Default)]
pub struct Vigil {
    pulses: BTreeMap<CraftId, Pulse>,
}

impl Vigil {
    /// Looks at every process that lives, in order of the crafts, at `now`; `standing` says how one
    /// stands, and is asked of those alone that have not moved for longer than a sleep.
    pub fn look(
        &mut self,
        now: Nanos,
        living: &[Seen],
        mut standing: impl FnMut(CraftId) -> Option<Standing>,
    ) -> Vec<Finding> {
        self.pulses.retain(|craft, _| living.iter().any(|seen| seen.craft == *craft));
        let mut findings = Vec::new();
        let mut suspects = Vec::new();
        for seen in living {
            let pulse = self.pulses.entry(seen.craft).or_insert_with(|| Pulse::new(seen, now));
            if (pulse.incarnation, pulse.beats) != (seen.incarnation, seen.beats) {
                let is_told = matches!(pulse.stage, Stage::Told | Stage::Swept { .. });
                if is_told && pulse.incarnation == seen.incarnation {
                    findings.push(Finding::Moves(pulse.silence(seen.craft, now)));
                }
                *pulse = Pulse::new(seen, now);
                continue;
            }
            let passed_ns = now.since(pulse.seen).min(COUNTED_NS_MAX);
            pulse.seen = now;
            if !pulse.is_paused && pulse.counted_ns + passed_ns <= SLEEP_NS_MAX {
                // It may well be asleep.
                pulse.counted_ns += passed_ns;
            } else {
                suspects.push((seen, standing(seen.craft), passed_ns));
            }
        }
        let is_anybody_kept = suspects
            .iter()
            .any(|(_, stands, _)| stands.is_some_and(|at| at.is_stopped() || at.is_held_up()));
        for (seen, stands, passed_ns) in suspects {
            let pulse = self.pulses.get_mut(&seen.craft).expect("invariant: it was just looked at");
            match stands {
                Some(at) if at.is_stopped() => {
                    *pulse = Pulse { is_paused: true, ..Pulse::new(seen, now) };
                }
                _ if pulse.is_paused => *pulse = Pulse::new(seen, now),
                // It has ended, which its pidfd tells.
                None => {}
                Some(at) if is_anybody_kept => pulse.stood = Some(at),
                Some(at) => {
                    pulse.count(&at, passed_ns);
                    findings.extend(pulse.judge(seen, now));
                }
            }
        }
        findings
    }

    /// The sweep for all whose silence was told is over.
    pub fn swept(&mut self) {
        for pulse in self.pulses.values_mut().filter(|pulse| pulse.stage == Stage::Told) {
            pulse.stage = Stage::Swept { counted_ns: pulse.counted_ns };
        }
    }
}

#[cfg(test)]
mod tests;
