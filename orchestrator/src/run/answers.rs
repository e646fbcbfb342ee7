//! Answers to commands, and what follows where one does not come.
//!
//! A process that goes round its loop and does not answer is as useless as a silent one (`silence`), and no
//! heartbeat tells of it: something of what it sends or shall hear is lost in a way that the transport does
//! not see. Once its time is up it is killed, and from there on it is a death like every other. How it stood
//! then is kept, for whoever looks for the reason. Not here: what is commanded.

use super::backend::PlayError;
use super::fleet::RealFleet;
use super::patience::{Hindrance, Patience};
use crate::launch::craft_process::{CraftProcess, HowEnded, Standing};
use shared_types::ids::{CraftId, Incarnation};
use shared_types::time::Nanos;
use shared_types::transport::clock;
use shared_types::wire::{Header, Kind};
use std::collections::BTreeSet;

/// How long crafts may take to come up, to open their ports, or to report, ns. Generous: a fleet of
/// 128 on two busy cores takes seconds, and a craft that ends meanwhile is noticed at once.
pub const ANSWER_LIMIT_NS: u64 = 30_000_000_000;

/// How long a killed process may take to be gone, ns.
const DEATH_LIMIT_NS: u64 = 10_000_000_000;

/// Takes a message: its header and payload, and from whom. Says whether it is the one that is waited for.
pub(super) type Take<'a> = dyn FnMut(CraftId, &Header, &[u8]) -> bool + 'a;

/// Somebody who did not answer in time and was killed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mute {
    /// Which craft.
    pub craft: CraftId,
    /// Which life of it.
    pub incarnation: Incarnation,
    /// What was waited for.
    pub answer: Kind,
    /// For how long, ns.
    pub waited_ns: u64,
    /// How the process stood in the end, in words.
    pub standing: String,
}

impl RealFleet<'_> {
    /// Waits until each of `expected` processes has sent a message of `kind` for `epoch`.
    pub(super) fn await_all(
        &mut self,
        kind: Kind,
        epoch: u32,
        expected: u32,
    ) -> Result<(), PlayError> {
        self.await_each(kind, expected, &mut |_, header, _| header.epoch == epoch)
    }

    /// Waits until `take` has accepted a message of `kind` from each of `expected` processes.
    pub(super) fn await_each(
        &mut self,
        kind: Kind,
        expected: u32,
        take: &mut Take<'_>,
    ) -> Result<(), PlayError> {
        self.await_from(kind, (0..expected).map(CraftId), take)
    }

    /// The same of those in `crafts`.
    pub(super) fn await_from(
        &mut self,
        kind: Kind,
        crafts: impl IntoIterator<Item = CraftId>,
        take: &mut Take<'_>,
    ) -> Result<(), PlayError> {
        let began = clock::now();
        self.be_patient(self.options.answer_limit_ns, began);
        let mut missing: BTreeSet<CraftId> = crafts.into_iter().collect();
        while !missing.is_empty() {
            self.pump(&mut |source, arrived, header, payload| {
                let is_meant = arrived == kind && missing.contains(&source);
                if is_meant && take(source, header, payload) {
                    missing.remove(&source);
                }
            })?;
            if !missing.is_empty() && self.is_overdue() {
                self.give_up_on(&missing, kind, began)?;
            }
        }
        Ok(())
    }

    /// Waits until every process has said that its present life is up.
    pub(super) fn await_up(&mut self) -> Result<(), PlayError> {
        let began = clock::now();
        self.be_patient(self.options.answer_limit_ns, began);
        while self.lives.iter().any(|life| !life.is_ready) {
            self.pump(&mut |_, _, _, _| {})?;
            if self.is_overdue() {
                let lives = (0..).map(CraftId).zip(&self.lives).filter(|(_, life)| !life.is_ready);
                let missing = lives.map(|(craft, _)| craft).collect();
                self.give_up_on(&missing, Kind::Ready, began)?;
            }
        }
        Ok(())
    }

    /// From `now` on an answer may take `limit_ns`.
    pub(super) fn be_patient(&mut self, limit_ns: u64, now: Nanos) {
        self.patience = Patience::new(limit_ns, now);
    }

    /// Whether the answer has taken too long. While a process is stopped nobody can expect one, nor while the
    /// kernel holds one up.
    pub(super) fn is_overdue(&mut self) -> bool {
        let Self { patience, watch, .. } = self;
        let hindrance = |standing: Standing| {
            if standing.is_stopped() {
                Hindrance::Stopped
            } else if standing.is_held_up() {
                Hindrance::HeldUp
            } else {
                Hindrance::None
            }
        };
        patience.is_over(clock::now(), || {
            let standings = watch.living().filter_map(CraftProcess::standing);
            standings.map(hindrance).max().unwrap_or(Hindrance::None)
        })
    }

    /// Kills those in `missing`, who owe `answer` since `began`; that they ended is then told by the watch.
    fn give_up_on(
        &mut self,
        missing: &BTreeSet<CraftId>,
        answer: Kind,
        began: Nanos,
    ) -> Result<(), PlayError> {
        let now = clock::now();
        let mut is_anybody_killed = false;
        for &craft in missing {
            let mute = Mute {
                craft,
                incarnation: self.lives[craft.index()].incarnation,
                answer,
                waited_ns: now.since(began),
                standing: self.standing_of(craft),
            };
            let killed = self.watch.condemn(craft, HowEnded::Mute(mute.waited_ns));
            if killed.map_err(|error| PlayError::Failed(error.to_string()))? {
                is_anybody_killed = true;
                self.mute.push(mute);
            }
        }
        if !is_anybody_killed {
            let standing = |&craft| format!("{craft} ({})", self.standing_of(craft));
            let silent: Vec<String> = missing.iter().map(standing).collect();
            return Err(PlayError::Failed(format!(
                "no {answer:?} from process {}",
                silent.join(", ")
            )));
        }
        self.be_patient(DEATH_LIMIT_NS, now);
        Ok(())
    }

    /// How a process stands, in words that tell one that loops from one that waits and from one that got no
    /// core.
    fn standing_of(&self, craft: CraftId) -> String {
        let beats = self.hearts.beats_of(craft);
        match self.watch.process(craft).and_then(CraftProcess::standing) {
            Some(Standing { state, cpu_ns, .. }) => {
                let cpu_ms = cpu_ns / 1_000_000;
                format!("state {state}, {cpu_ms} ms of CPU, {beats} rounds of the craft's lives")
            }
            None => "gone".to_owned(),
        }
    }
}
