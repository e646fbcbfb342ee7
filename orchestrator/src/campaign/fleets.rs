//! A round on a fleet: its crafts are killed one after the other, some are stopped for a while, and at the
//! end one dies while it drops its ports. After every recovery a whole trial must go as the replay says, or
//! an interval of open mode must end with the boards that its strategy promises.
//!
//! A craft is doomed to a named point when its life is started, so kills come in pairs: a random craft at
//! a random instant, then its successor at the point that it was doomed to. Not here: the records that are
//! made of it (`accounts`).

use super::defects;
use super::draw::Draws;
use super::fate::{Fate, Lives, Setting, failure_of};
use super::interval::INTERVAL_NS;
use super::stage::Stage;
use super::{Campaign, Early};
use crate::launch::placement::Placement;
use crate::outcome::Outcome;
use crate::results::faults::{Failure, FaultKind, FaultRecord, RANDOM};
use crate::results::store::StoreError;
use crate::run::answers::ANSWER_LIMIT_NS;
use crate::run::backend::{Backend as _, PlayError};
use crate::run::strike::{Blow, Strike};
use crate::run::{FleetOptions, RealFleet};
use crate::scenario::ResolvedScenario;
use crate::supervision::restart::RestartPolicy;
use crate::supervision::watch::CraftEnded;
use agent::process::doom::Doom;
use shared_types::ids::CraftId;
use shared_types::transport::clock;
use shared_types::wire::StrategyKind;
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
pub(super) struct Round<'a> {
    pub(super) setting: Setting,
    pub(super) fleet: RealFleet<'a>,
    pub(super) stage: Stage<'a>,
    pub(super) lives: Lives,
    pub(super) records: Vec<FaultRecord>,
    /// After whose death files are planted, and the number of its process.
    to_plant: Option<(CraftId, u32, u32)>,
}

/// Why a round ends before its plan does.
pub(super) enum Cut {
    /// Somebody asked for it, or the time is up.
    Asked(PlayError),
    /// The fleet did not do what is promised; it is told in the last record.
    Failed,
}

impl Campaign<'_> {
    /// Plays a round on a fresh fleet: intervals of open mode if `is_open` and a strategy plays them, else
    /// trials.
    pub(super) fn round_on_fleet(
        &mut self,
        scenario: &ResolvedScenario,
        is_open: bool,
    ) -> Result<Early, StoreError> {
        let playing = scenario.strategies().iter().filter(|strategy| strategy.plays_traces());
        let playing: Vec<StrategyKind> = playing.copied().collect();
        let is_open = is_open && !playing.is_empty();
        let strategies = if is_open { &playing } else { scenario.strategies() };
        let strategy = self.draws.strategy(strategies);
        let size = scenario.craft_count();
        let processes = size + u32::from(strategy.has_centre());
        // Links that the scenario states fail in every interval; nobody draws others beside them.
        let is_stated = scenario.link_spec().is_some();
        let is_drawn = is_open && !is_stated && self.draws.links_fail();
        let link = is_drawn.then(|| self.draws.link(processes, INTERVAL_NS));
        let links_fail = is_open && (is_stated || is_drawn);
        let setting = Setting { size, strategy, wake: self.draws.wake(), is_open, links_fail };
        let stage = match Stage::new(scenario, strategy, self.draws.trial(), is_open, link) {
            Ok(stage) => stage,
            Err(error) => {
                let mut record = setting.record(FaultKind::KillCraft, "before any fault", None);
                record.took_effect = false;
                record.failures.push((Failure::Hang, error.to_string()));
                self.keep(record)?;
                return Ok(Some(Outcome::Broken));
            }
        };
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
            answer_limit_ns: ANSWER_LIMIT_NS,
            run_ends: self.ends,
            restart: Some(POLICY),
            dooms: dooms.clone(),
            janitor: self.plan.janitor,
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
        let cut = round.play(&mut self.draws, processes);
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
    /// Kills and stops what `draws` say of `processes` processes; says why, if the round ends before.
    fn play(&mut self, draws: &mut Draws, processes: u32) -> Option<Cut> {
        let is_open = self.setting.is_open;
        let mut cut = self.settle().err();
        // In an interval the janitor comes by itself: there is no time to plant anything.
        let plantings = if is_open { 0 } else { PLANTINGS_MAX };
        for _ in 0..plantings {
            if cut.is_some() || self.has_planted() {
                break;
            }
            cut = self.kill_and_plant(draws.process(processes), draws.instant_ns(is_open)).err();
        }
        for pair in 0..PAIRS_PER_FLEET {
            if cut.is_some() {
                break;
            }
            let is_last = pair + 1 == PAIRS_PER_FLEET;
            let next = if is_last { draws.last_doom() } else { draws.doom() };
            let (victim, instant_ns) = (draws.process(processes), draws.instant_ns(is_open));
            cut = self.kill_pair(victim, instant_ns, next).err();
            if cut.is_none() && pair == 1 {
                let (stopped, begins) = (draws.up_to_half(processes), draws.instant_ns(is_open));
                cut = self.pause(&stopped, begins, draws.pause_ns()).err();
            }
        }
        cut
    }

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
            self.blame_silences();
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
}
