//! Silent processes of a fleet: its heartbeats are looked at now and then, and the rule is carried out.
//!
//! A look costs a load for every process, at most every [`LOOK_NS`]; a process that has not moved for
//! longer than a sleep costs a look into /proc as well. The sweep is the janitor's first step alone, on
//! a thread of its own: this loop may be waiting on the very file that it removes. Who is killed is from
//! there on a death like every other (`recovery`, `revival`). Not here: the rule
//! (`supervision::heartbeat`).

use super::fleet::RealFleet;
use crate::launch::craft_process::{CraftProcess, HowEnded};
use crate::launch::janitor::Janitor;
use crate::results::event::Relief;
use crate::supervision::heartbeat::{Finding, LOOK_NS, Seen, Silence, Vigil};
use shared_types::ids::CraftId;
use shared_types::time::Nanos;
use shared_types::transport::heartbeat::Heartbeats;
use shared_types::transport::reclaim::Steps;
use shared_types::transport::{RunPaths, clock};
use std::io;

/// A silence that is over.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Relieved {
    /// Who, and for how long.
    pub silence: Silence,
    /// What helped.
    pub helped: Relief,
    /// Unfinished files that were removed, or why they could not be.
    pub swept: Result<u64, String>,
}

/// What a fleet knows of its heartbeats.
#[derive(Debug)]
pub(super) struct Hearts {
    beats: Heartbeats,
    vigil: Vigil,
    next_look: Nanos,
    sweep: Option<Janitor>,
    /// What the last sweep came to.
    swept: Result<u64, String>,
    relieved: Vec<Relieved>,
}

impl Hearts {
    /// Those of a run with `processes` processes, none of which lives yet.
    pub(super) fn create(paths: &RunPaths, processes: u32) -> io::Result<Self> {
        Ok(Self {
            beats: Heartbeats::create(paths, processes)?,
            vigil: Vigil::default(),
            next_look: clock::now(),
            sweep: None,
            swept: Ok(0),
            relieved: Vec::new(),
        })
    }

    /// Begins to sweep, unless that is under way.
    fn begin_sweep(&mut self, paths: &RunPaths, steps: Steps) -> io::Result<()> {
        if self.sweep.is_none() {
            let first = Steps { tags: false, places: false, by_hand: false, ..steps };
            self.sweep = Some(Janitor::start(paths, first)?);
            self.swept = Ok(0);
        }
        Ok(())
    }

    /// Takes note of a sweep that is over.
    fn end_sweep(&mut self) {
        let Some(janitor) = self.sweep.take_if(|janitor| janitor.is_done()) else { return };
        let reclaimed = janitor.finish();
        let result = reclaimed.and_then(|done| done.result.map_err(|error| error.to_string()));
        self.swept = result.map(|removed| (removed.segments + removed.files) as u64);
        self.vigil.swept();
    }

    /// How often the process of `craft` has gone round, in all its lives.
    pub(super) fn beats_of(&self, craft: CraftId) -> u64 {
        self.beats.of(craft)
    }

    fn relieve(&mut self, silence: Silence, helped: Relief) {
        self.relieved.push(Relieved { silence, helped, swept: self.swept.clone() });
    }
}

impl RealFleet<'_> {
    /// Looks who is silent if that is due, and does what follows.
    pub(super) fn look_for_silence(&mut self) -> io::Result<()> {
        let now = clock::now();
        let Self { hearts, watch, lives, root, options, .. } = self;
        if now < hearts.next_look {
            return Ok(());
        }
        hearts.next_look = now.plus(LOOK_NS);
        hearts.end_sweep();
        let seen = |process: &CraftProcess| Seen {
            craft: process.craft(),
            incarnation: process.incarnation(),
            is_ready: lives[process.craft().index()].is_ready,
            beats: hearts.beats.of(process.craft()),
        };
        let living: Vec<Seen> = watch.living().map(seen).collect();
        let standing = |craft| watch.process(craft).and_then(CraftProcess::standing);
        for finding in hearts.vigil.look(now, &living, standing) {
            match finding {
                Finding::Silent(_) => hearts.begin_sweep(root.paths(), options.janitor)?,
                Finding::Moves(silence) => hearts.relieve(silence, Relief::Sweep),
                Finding::Hopeless(silence) => {
                    watch.condemn(silence.craft, HowEnded::Silent(silence.silent_ns))?;
                    hearts.relieve(silence, Relief::Kill);
                }
            }
        }
        Ok(())
    }

    /// Silences that are over since the last call.
    pub(super) fn relieved(&mut self) -> Vec<Relieved> {
        std::mem::take(&mut self.hearts.relieved)
    }
}
