//! The records of a round on a fleet: what followed each death, what a trial or interval broke, how the
//! fleet ended.

use super::fate::{Fate, failure_of, left_behind};
use super::fleets::{Cut, Round};
use crate::launch::craft_process::HowEnded;
use crate::results::faults::{Failure, FaultKind, FaultRecord, RANDOM, Step};
use crate::run::Recovery;
use crate::run::backend::{Backend as _, PlayError};
use crate::run::silence::Relieved;
use crate::run::strike::Blow;
use crate::supervision::watch::CraftEnded;
use agent::process::doom::Doom;
use rustix::process::Signal;
use shared_types::time::Nanos;
use shared_types::transport::reclaim::left_of_the_dead;
use shared_types::wire::LinkCounts;

impl Round<'_> {
    /// What followed a death.
    pub(super) fn record_of(&mut self, recovery: &Recovery) -> FaultRecord {
        let CraftEnded { craft, incarnation, how, said } = &recovery.ended;
        let planned = self.lives.remove(&(*craft, incarnation.0));
        let doomed = Doom::died_at(said).map(Nanos);
        let struck = self.fleet.take_struck();
        let struck = struck
            .iter()
            .find(|blow| blow.strike.craft == *craft && blow.strike.blow == Blow::Kill)
            .map(|blow| blow.at);
        // A life that was to die by itself may have been struck before, or the other way round.
        let is_sure = doomed.is_some() || matches!(planned, Some(Fate::Planted));
        let fate = planned.filter(|_| is_sure).unwrap_or(Fate::Struck);
        let mut record = self.setting.of_fate(fate, *craft);
        let killed = doomed.or(struck);
        let is_killed = *how == HowEnded::Killed(Signal::KILL.as_raw());
        record.took_effect = is_killed && killed.is_some();
        if !record.took_effect {
            record.failures.push((Failure::Restart, format!("craft {craft} ended: {how}: {said}")));
        }
        match recovery.reclaimed.as_ref().map(|reclaimed| &reclaimed.result) {
            Some(Ok(removed)) if removed.refusals == 0 => {}
            Some(Ok(removed)) => record.failures.push((
                Failure::CleanUp,
                format!("iceoryx2 could not clean up in {} attempts", removed.refusals),
            )),
            Some(Err(error)) => record.failures.push((Failure::CleanUp, error.to_string())),
            None => record.failures.push((Failure::CleanUp, "the janitor never came".to_owned())),
        }
        let steps = [
            (Step::Noticed, Some(recovery.noticed)),
            (Step::PeersNoticed, recovery.peers_noticed),
            (Step::Reclaimed, recovery.reclaimed.as_ref().map(|reclaimed| reclaimed.done)),
            (Step::Known, recovery.known),
            (Step::Restarted, recovery.ready),
            (Step::Rejoined, recovery.rejoined),
            (Step::CaughtUp, recovery.caught_up),
        ];
        if let Some(killed) = killed {
            let times = steps.into_iter().filter_map(|(step, at)| Some((step, at?.since(killed))));
            record.times_ns = times.collect();
        }
        record
    }

    /// Looks what is there of the dead, at a time at which nobody can have died unnoticed.
    pub(super) fn look_for_remains(&mut self) {
        let remains = match left_of_the_dead(self.fleet.paths()) {
            Ok(files) if files.is_empty() => return,
            Ok(files) => format!("{files:?}"),
            Err(error) => error.to_string(),
        };
        self.blame(vec![(Failure::Left, remains)]);
    }

    /// Nobody is to fall silent or mute because another was killed, whether or not there was help.
    pub(super) fn blame_silences(&mut self) {
        let silences = self.fleet.take_relieved().into_iter().map(|relieved| {
            let Relieved { silence, helped, .. } = relieved;
            (Failure::Hang, format!("{silence:?} was ended by {helped:?}"))
        });
        let mute = self.fleet.take_mute().into_iter();
        let mute = mute.map(|mute| (Failure::Hang, format!("{mute:?} was ended by Kill")));
        let blamed = silences.chain(mute).collect();
        self.blame(blamed);
    }

    /// Puts what a trial broke down to the last fault.
    pub(super) fn blame(&mut self, failures: Vec<(Failure, String)>) {
        if failures.is_empty() {
            return;
        }
        if self.records.is_empty() {
            let record = self.setting.record(FaultKind::KillCraft, "before any fault", None);
            self.records.push(FaultRecord { took_effect: false, ..record });
        }
        if let Some(last) = self.records.last_mut() {
            last.failures.extend(failures);
        }
    }

    /// The round is over, because of `error`.
    pub(super) fn cut(&mut self, error: PlayError, lost: &[CraftEnded]) -> Cut {
        if matches!(error, PlayError::Stopped(_) | PlayError::TimeLimit) {
            return Cut::Asked(error);
        }
        let craft = lost.first().map(|ended| ended.craft);
        let mut record = self.setting.record(FaultKind::KillCraft, RANDOM, craft);
        if let Some(fate) =
            lost.first().and_then(|ended| self.lives.remove(&(ended.craft, ended.incarnation.0)))
        {
            record = self.setting.of_fate(fate, lost[0].craft);
        }
        record.failures.push(failure_of(&error));
        self.records.push(record);
        Cut::Failed
    }

    /// Ends the fleet, looks what is left of it, and returns all records of the round. Where somebody
    /// asked for the end, crafts may be stopped in the middle of a pause: these cannot end by themselves.
    pub(super) fn end(self, is_asked: bool) -> Vec<FaultRecord> {
        let Self { setting, mut fleet, lives, mut records, stage, .. } = self;
        if setting.links_fail {
            let record = setting.record(FaultKind::Links, RANDOM, None);
            let took_effect = stage.links() != LinkCounts::default();
            records.push(FaultRecord { took_effect, ..record });
        }
        let (paths, processes) = (fleet.paths().clone(), fleet.process_ids());
        fleet.take_recoveries(true);
        let end = fleet.end();
        let mut failures = Vec::new();
        failures.extend(end.trouble.into_iter().map(|what| (Failure::CleanUp, what)));
        let killed = end.report.killed.iter().filter(|_| !is_asked);
        failures.extend(killed.map(|craft| {
            (Failure::Hang, format!("craft {craft} did not end by itself and was killed"))
        }));
        let died = end.report.ended.iter().filter(|ended| {
            let is_planned = lives.contains_key(&(ended.craft, ended.incarnation.0));
            let is_told = end.report.killed.contains(&ended.craft);
            !(ended.how.is_orderly() || is_planned || is_told || is_asked)
        });
        failures.extend(died.map(|CraftEnded { craft, how, said, .. }| {
            (Failure::Restart, format!("craft {craft} ended: {how}: {said}"))
        }));
        failures.extend(left_behind(&paths, &processes));
        for ((craft, life), fate) in lives {
            let mut record = setting.of_fate(fate, craft);
            let ended = end
                .report
                .ended
                .iter()
                .find(|ended| (ended.craft, ended.incarnation.0) == (craft, life));
            let died = ended.and_then(|ended| Doom::died_at(&ended.said));
            record.took_effect = died.is_some();
            record.failures.append(&mut failures);
            records.push(record);
        }
        if !failures.is_empty() {
            let mut record = setting.record(FaultKind::KillCraft, "end of the fleet", None);
            record.took_effect = false;
            record.failures = failures;
            records.push(record);
        }
        records
    }
}
