//! Successors for crafts that die in an interval of open mode, which goes on meanwhile.
//!
//! As in [`super::recovery`] the dead are reaped, freed by the janitor and followed by new lives. But
//! nobody gives anything up: those who live are told who is gone, play on without it, and repair between
//! themselves what it leaves unclear (decision 0014). A successor is brought into the epoch that is under
//! way as everybody was, then told when the trace has begun: it skips what was due before, asks those who
//! live what it missed, and plays from then on. Not here: what it asks (the core), and whether anything was
//! lost for good (the run's loop).

use super::backend::PlayError;
use super::fleet::RealFleet;
use super::play::taking_part;
use crate::supervision::watch::CraftEnded;
use shared_types::ids::CraftId;
use shared_types::knowledge::FleetNetwork;
use shared_types::time::Nanos;
use shared_types::transport::{Endpoint as _, clock};
use shared_types::wire::{Class, EpochSpec, GO_JOINING, Header, Kind, TrialReport};

/// How often an interval is begun anew because somebody died before it began.
const BEGINNINGS_MAX: u32 = 64;

impl RealFleet<'_> {
    /// Brings every process to the point before the trace begins, as often as one of them dies on the way
    /// in an epoch that recovers. Returns who did.
    pub(super) fn begin_lastingly(
        &mut self,
        spec: &EpochSpec,
        network: &FleetNetwork,
    ) -> Result<Vec<CraftEnded>, PlayError> {
        let mut lost_before = Vec::new();
        for _ in 0..BEGINNINGS_MAX {
            match self.begin(spec, network) {
                Err(PlayError::Lost(lost)) if self.revives(spec) => {
                    lost_before.extend(lost.iter().cloned());
                    // Nothing was played yet: the epoch is given up and begins again.
                    self.replace(lost)?;
                }
                ended => return ended.map(|()| lost_before),
            }
        }
        Err(PlayError::Failed(format!("crafts died in {BEGINNINGS_MAX} beginnings of an interval")))
    }

    /// Does `step`, again whenever somebody died in it and a successor plays on; adds who did to `dead`.
    /// The trace of `spec` began at `started`.
    pub(super) fn lastingly<T>(
        &mut self,
        spec: &EpochSpec,
        started: Nanos,
        dead: &mut Vec<CraftEnded>,
        mut step: impl FnMut(&mut Self) -> Result<T, PlayError>,
    ) -> Result<T, PlayError> {
        loop {
            match step(self) {
                Err(PlayError::Lost(lost)) if self.revives(spec) => {
                    self.revive(lost, spec, started, dead)?;
                }
                ended => return ended,
            }
        }
    }

    /// Takes from the reports of an interval when others heard of each death, and when successors had
    /// caught up.
    pub(super) fn note_reported(&mut self, reports: &[TrialReport]) {
        for recovery in &mut self.recoveries {
            let (craft, life) = (recovery.ended.craft.0, recovery.ended.incarnation.0);
            let opens =
                || reports.iter().filter_map(|report| Some((report.craft, report.open.as_ref()?)));
            let heard = opens().flat_map(|(_, open)| &open.ends_heard);
            let heard = heard.filter(|heard| (heard.craft, heard.incarnation) == (craft, life));
            recovery.peers_noticed = heard.map(|heard| Nanos(heard.at_ns)).max();
            let is_living = self.lives[craft as usize].incarnation == recovery.successor;
            let own = opens().find(|&(reporter, _)| reporter == craft && is_living);
            recovery.caught_up =
                own.map(|(_, open)| Nanos(open.caught_up_ns)).filter(|at| at.0 > 0);
        }
    }

    const fn revives(&self, spec: &EpochSpec) -> bool {
        spec.recovery.is_some() && self.restarts.is_some()
    }

    /// Brings successors of `lost` into the interval.
    fn revive(
        &mut self,
        lost: Vec<CraftEnded>,
        spec: &EpochSpec,
        started: Nanos,
        dead: &mut Vec<CraftEnded>,
    ) -> Result<(), PlayError> {
        dead.extend(lost.iter().cloned());
        self.mourn(lost)?;
        loop {
            match self.bring_in(spec, started) {
                Err(PlayError::Lost(more)) => {
                    dead.extend(more.iter().cloned());
                    self.mourn(more)?;
                }
                ended => return ended,
            }
        }
    }

    /// From the deaths that are known to successors that play.
    fn bring_in(&mut self, spec: &EpochSpec, started: Nanos) -> Result<(), PlayError> {
        self.bury()?;
        self.tell_ends()?;
        let now = clock::now();
        for recovery in self.recoveries.iter_mut().filter(|recovery| recovery.is_awaited()) {
            recovery.known.get_or_insert(now);
        }
        self.start_successors()?;
        self.await_up()?;
        self.note_up(clock::now());
        // The networks of the epoch are handed to whoever connects.
        self.endpoint.update_connections()?;
        let processes = taking_part(self, spec);
        let awaited = self.recoveries.iter().filter(|recovery| recovery.is_awaited());
        let joining: Vec<CraftId> = awaited
            .map(|recovery| recovery.ended.craft)
            .filter(|craft| craft.0 < processes)
            .collect();
        let archive = rkyv::to_bytes::<rkyv::rancor::Error>(spec)
            .expect("invariant: memory takes every archive");
        self.tell(spec, Kind::EpochBegin, &archive)?;
        self.await_lives(Kind::EpochReady, spec.epoch, &joining)?;
        self.endpoint.update_connections()?;
        self.tell(spec, Kind::Connect, &[])?;
        self.await_lives(Kind::Connected, spec.epoch, &joining)?;
        for &craft in &joining {
            self.tell_membership(craft, self.lives[craft.index()].incarnation, true)?;
        }
        let mut go = Header::new(Class::Control, Kind::Go);
        (go.intended_ns, go.argument) = (started.0, GO_JOINING);
        self.tell_with(spec, go, &[])?;
        self.note_rejoined(clock::now());
        Ok(())
    }

    /// Waits until the present life of everybody in `crafts` has sent a message of `kind` in `epoch`.
    fn await_lives(&mut self, kind: Kind, epoch: u32, crafts: &[CraftId]) -> Result<(), PlayError> {
        let lives: Vec<u32> =
            crafts.iter().map(|craft| self.lives[craft.index()].incarnation.0).collect();
        self.await_from(kind, crafts.iter().copied(), &mut |source, header, _| {
            let place = crafts.iter().position(|&craft| craft == source);
            let is_living = place.is_some_and(|place| lives[place] == header.incarnation);
            is_living && header.epoch == epoch
        })
    }
}
