//! A round on a fleet: its crafts are killed one after the other, some are stopped for a while, and at the
//! end one dies while it drops its ports. After every recovery a whole trial must go as the replay says.
//!
//! A craft is doomed to a named point when its life is started, so kills come in pairs: a random craft at
//! a random instant, then its successor at the point that it was doomed to.

use super::defects;
use super::fate::{Fate, Lives, Setting, failure_of, left_behind};
use super::stage::Stage;
use super::{Campaign, Early};
use crate::launch::craft_process::HowEnded;
use crate::launch::placement::Placement;
use crate::results::faults::{Failure, FaultKind, FaultRecord, RANDOM, Step};
use crate::results::store::StoreError;
use crate::run::backend::{Backend as _, PlayError};
use crate::run::strike::{Blow, Strike};
use crate::run::{FleetOptions, RealFleet, Recovery};
use crate::scenario::ResolvedScenario;
use crate::supervision::restart::RestartPolicy;
use crate::supervision::watch::CraftEnded;
use agent::process::doom::Doom;
use rustix::process::Signal;
use shared_types::ids::CraftId;
use shared_types::time::Nanos;
use shared_types::transport::clock;
use shared_types::transport::reclaim::left_of_the_dead;
use std::collections::BTreeMap;

/// Draws of crafts that are doomed when the fleet is started; with the one at the end they make named kills
/// the majority.
const DOOMED_AT_LAUNCH: u32 = 2;

/// Kills at random instants in a round, each followed by that of the successor at a named point.
const PAIRS_PER_FLEET: u32 = 4;

/// Attempts at a kill after which files are planted: a life may end otherwise, or before it is connected.
const PLANTINGS_MAX: u32 = 5;

/// Trials in which a fault must have taken effect, once its instant has come.
const TRIALS_MAX: u32 = 400;

/// Restarts without a pause: how long recovery takes is what is measured. No craft is killed as often as this
/// in a round, so whoever needs more successors cannot come back.
const POLICY: RestartPolicy = RestartPolicy { limit: 24, window_ns: u64::MAX, pause_ns: 0 };

/// How long a turn may stay unbalanced, ns.
const TURN_LIMIT_NS: u64 = 5_000_000_000;

/// A fleet in whose round something is to happen.
struct Round<'a> {
    setting: Setting,
    fleet: RealFleet<'a>,
    stage: Stage<'a>,
    lives: Lives,
    records: Vec<FaultRecord>,
    /// After whose death files are planted, and the number of its process.
    to_plant: Option<(CraftId, u32, u32)>,
}

/// Why a round ends before its plan does.
enum Cut {
    /// Somebody asked for it, or the time is up.
    Asked(PlayError),
    /// The fleet did not do what is promised; it is told in the last record.
    Failed,
}

impl Campaign<'_> {
    /// Plays a round on a fresh fleet.
    pub(super) fn round_on_fleet(
        &mut self,
        scenario: &ResolvedScenario,
    ) -> Result<Early, StoreError> {
        let strategy = self.draws.strategy(scenario.strategies());
        let size = scenario.craft_count();
        let processes = size + u32::from(strategy.has_centre());
        let setting = Setting { size, strategy, wake: self.draws.wake() };
        let stage = Stage::new(scenario, strategy, self.draws.trial());
        let dooms: BTreeMap<CraftId, Doom> = (0..DOOMED_AT_LAUNCH)
            .map(|_| (self.draws.process(processes), self.draws.doom()))
            .collect();
        let pinning = scenario.scenario().fleet.pinning;
        let stream = self.draws.stream();
        let options = FleetOptions {
            crafts: size,
            has_centre: strategy.has_centre(),
            wake: setting.wake,
            placement: Placement::draw(&self.plan.processors, pinning, processes, stream),
            turn_limit_ns: TURN_LIMIT_NS,
            run_ends: self.ends,
            restart: Some(POLICY),
            dooms: dooms.clone(),
            janitor: self.plan.janitor,
            loss: None,
        };
        let fleet = match RealFleet::launch(options, self.launcher, self.signals) {
            Ok(fleet) => fleet,
            Err(error) => {
                if let Some(outcome) = self.early(&error)? {
                    return Ok(Some(outcome));
                }
                for (victim, doom) in dooms {
                    let mut record = setting.of_fate(Fate::Doomed(doom), victim);
                    record.failures.push(failure_of(&error));
                    self.keep(record)?;
                }
                return Ok(None);
            }
        };
        let lives: Lives =
            dooms.into_iter().map(|(victim, doom)| ((victim, 0), Fate::Doomed(doom))).collect();
        let mut round = Round { setting, fleet, stage, lives, records: Vec::new(), to_plant: None };
        let draws = &mut self.draws;
        let mut cut = round.settle().err();
        for _ in 0..PLANTINGS_MAX {
            if cut.is_some() || round.has_planted() {
                break;
            }
            cut = round.kill_and_plant(draws.process(processes), draws.instant_ns()).err();
        }
        for pair in 0..PAIRS_PER_FLEET {
            if cut.is_some() {
                break;
            }
            let is_last = pair + 1 == PAIRS_PER_FLEET;
            let next = if is_last { draws.last_doom() } else { draws.doom() };
            cut = round.kill_pair(draws.process(processes), draws.instant_ns(), next).err();
            if cut.is_none() && pair == 1 {
                let (stopped, begins) = (draws.up_to_half(processes), draws.instant_ns());
                cut = round.pause(&stopped, begins, draws.pause_ns()).err();
            }
        }
        let is_asked = matches!(cut, Some(Cut::Asked(_)));
        let records = round.end(is_asked);
        for record in records {
            self.keep(record)?;
        }
        match cut {
            Some(Cut::Asked(error)) => self.early(&error),
            Some(Cut::Failed) | None => Ok(None),
        }
    }
}

impl Round<'_> {
    /// Kills `victim` at an instant, and plants what a kill at a rare moment leaves before the janitor comes.
    fn kill_and_plant(&mut self, victim: CraftId, instant_ns: u64) -> Result<(), Cut> {
        let life = self.fleet.incarnation(victim).0;
        self.to_plant = self.fleet.process_id(victim).map(|process| (victim, life, process));
        self.lives.insert((victim, life), Fate::Struck);
        let due = clock::now().plus(instant_ns);
        self.fleet.strike([Strike { due, craft: victim, blow: Blow::Kill }]);
        self.settle()
    }

    fn has_planted(&self) -> bool {
        self.records.iter().any(FaultRecord::has_aged)
    }

    /// Plants it if one of `lost` is the one that it is planted for.
    fn plant_after(&mut self, lost: &[CraftEnded]) -> Result<(), PlayError> {
        let is_lost = |&(victim, life, _): &(CraftId, u32, u32)| {
            lost.iter().any(|ended| (ended.craft, ended.incarnation.0) == (victim, life))
        };
        let Some((victim, life, process)) = self.to_plant.take_if(|planned| is_lost(planned))
        else {
            return Ok(());
        };
        let planted = defects::plant(self.fleet.paths(), process).map_err(|error| {
            PlayError::Failed(format!("crash defects cannot be planted: {error}"))
        })?;
        if planted {
            self.lives.insert((victim, life), Fate::Planted);
        }
        Ok(())
    }

    /// Kills `victim` at an instant, and its successor where it is doomed to.
    fn kill_pair(&mut self, victim: CraftId, instant_ns: u64, next: Doom) -> Result<(), Cut> {
        let life = self.fleet.incarnation(victim).0;
        let successor = self.fleet.next_incarnation().0;
        self.lives.insert((victim, life), Fate::Struck);
        self.lives.insert((victim, successor), Fate::Doomed(next));
        self.fleet.doom(victim, next);
        let due = clock::now().plus(instant_ns);
        self.fleet.strike([Strike { due, craft: victim, blow: Blow::Kill }]);
        self.settle()
    }

    /// Plays until every life that is to end before the fleet has ended, and then one trial more.
    fn settle(&mut self) -> Result<(), Cut> {
        let mut trials_left = TRIALS_MAX;
        while trials_left > 0 {
            trials_left -= u32::from(!self.fleet.has_strikes());
            let played = match self.stage.play(&mut self.fleet) {
                Err(PlayError::Lost(lost)) => {
                    let who: Vec<CraftEnded> = lost.clone();
                    self.plant_after(&who)
                        .and_then(|()| self.fleet.recover(lost))
                        .map_err(|error| self.cut(error, &who))?;
                    None
                }
                Err(error) => return Err(self.cut(error, &[])),
                Ok(failures) => Some(failures),
            };
            for recovery in self.fleet.take_recoveries(false) {
                let record = self.record_of(&recovery);
                self.records.push(record);
            }
            if let Some(failures) = played {
                self.blame(failures);
                if self.lives.values().all(Fate::is_at_the_end) {
                    self.look_for_remains();
                    return Ok(());
                }
            }
        }
        // What has not happened by now is not waited for. A doom may still come; a blow that found nobody
        // will not, and proves nothing.
        for ((craft, life), fate) in std::mem::take(&mut self.lives) {
            match fate {
                Fate::Struck | Fate::Planted => {
                    let record = self.setting.of_fate(fate, craft);
                    self.records.push(FaultRecord { took_effect: false, ..record });
                }
                Fate::Doomed(_) | Fate::PutOff(_) => {
                    self.lives.insert((craft, life), fate.put_off());
                }
            }
        }
        Ok(())
    }

    /// Stops crafts for a while in which the others wait for nothing but them; nobody may be lost.
    fn pause(&mut self, who: &[CraftId], begins_ns: u64, lasts_ns: u64) -> Result<(), Cut> {
        let begins = clock::now().plus(begins_ns);
        let ends = begins.plus(lasts_ns);
        let blows = [(begins, Blow::Stop), (ends, Blow::Continue)];
        let strikes = blows
            .into_iter()
            .flat_map(|(due, blow)| who.iter().map(move |&craft| Strike { due, craft, blow }));
        self.fleet.strike(strikes);
        self.fleet.take_struck();
        let mut record = self.setting.record(FaultKind::Pause, RANDOM, None);
        let mut struck = Vec::new();
        for _ in 0..TRIALS_MAX {
            match self.stage.play(&mut self.fleet) {
                Ok(failures) => record.failures.extend(failures),
                Err(PlayError::Lost(lost)) => {
                    record.failures.extend(lost.iter().map(|ended| {
                        (Failure::Restart, format!("craft {} was lost: {}", ended.craft, ended.how))
                    }));
                    self.records.push(record);
                    self.fleet.recover(lost).map_err(|error| self.cut(error, &[]))?;
                    return Ok(());
                }
                Err(error) => {
                    self.records.push(record);
                    return Err(self.cut(error, &[]));
                }
            }
            struck.extend(self.fleet.take_struck());
            if clock::now() > ends && struck.len() >= 2 * who.len() {
                break;
            }
        }
        let continued = struck.iter().filter(|blow| blow.strike.blow == Blow::Continue);
        record.took_effect = continued.filter(|blow| blow.was_stopped).count() == who.len();
        self.records.push(record);
        Ok(())
    }

    /// What followed a death.
    fn record_of(&mut self, recovery: &Recovery) -> FaultRecord {
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
            (Step::Reclaimed, recovery.reclaimed.as_ref().map(|reclaimed| reclaimed.done)),
            (Step::Known, recovery.known),
            (Step::Restarted, recovery.ready),
            (Step::CaughtUp, recovery.rejoined),
        ];
        if let Some(killed) = killed {
            let times = steps.into_iter().filter_map(|(step, at)| Some((step, at?.since(killed))));
            record.times_ns = times.collect();
        }
        record
    }

    /// Looks what is there of the dead, at a time at which nobody can have died unnoticed.
    fn look_for_remains(&mut self) {
        let remains = match left_of_the_dead(self.fleet.paths()) {
            Ok(files) if files.is_empty() => return,
            Ok(files) => format!("{files:?}"),
            Err(error) => error.to_string(),
        };
        self.blame(vec![(Failure::Left, remains)]);
    }

    /// Puts what a trial broke down to the last fault.
    fn blame(&mut self, failures: Vec<(Failure, String)>) {
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
    fn cut(&mut self, error: PlayError, lost: &[CraftEnded]) -> Cut {
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
    fn end(self, is_asked: bool) -> Vec<FaultRecord> {
        let Self { setting, mut fleet, lives, mut records, .. } = self;
        let (paths, processes) = (fleet.paths().clone(), fleet.process_ids());
        fleet.take_recoveries(true);
        let end = fleet.end();
        let mut failures = Vec::new();
        failures.extend(end.trouble.into_iter().map(|what| (Failure::CleanUp, what)));
        let killed = end.report.killed.iter().filter(|_| !is_asked);
        failures.extend(killed.map(|craft| {
            (Failure::Hang, format!("craft {craft} did not end by itself and was killed"))
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
