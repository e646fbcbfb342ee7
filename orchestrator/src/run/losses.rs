//! What the loop keeps of crafts that died: who, how, and how their successors came.

use super::answers::Mute;
use super::backend::{Backend, PlayError};
use super::plan::FleetPlan;
use super::recovery::Recovery;
use super::silence::Relieved;
use super::verdict;
use super::{Ended, Runner};
use crate::outcome::Outcome;
use crate::results::event::{Event, Relief};
use crate::results::record::{Cell, TrialEnd};
use crate::results::store::StoreError;
use crate::supervision::watch::CraftEnded;
use shared_types::time::Nanos;
use shared_types::wire::EpochSpec;

impl Runner<'_> {
    /// Keeps who was lost, and goes on with successors where the plan wants them: the epoch is lost then,
    /// and the run partial. Else the fleet's part of the run is over.
    pub(super) fn go_on_without(
        &mut self,
        lost: Vec<CraftEnded>,
        backend: &mut impl Backend,
        plan: &FleetPlan,
        (cell, spec, phase): (Cell, &EpochSpec, &str),
    ) -> Result<Ended, StoreError> {
        if self.plan.restart.is_none() {
            return self.end_early(plan, phase, PlayError::Lost(lost));
        }
        self.keep_losses(&lost, plan, phase)?;
        match backend.recover(lost) {
            Ok(()) => {}
            Err(PlayError::Lost(_)) => {
                self.note(format!("{phase}: the restarts of a craft are used up"))?;
                return Ok(Ended::Early(Outcome::Partial));
            }
            Err(error) => return self.end_early(plan, &format!("restarting in {phase}"), error),
        }
        self.outcome = self.outcome.worse(Outcome::Partial);
        let (epoch, trial, end) = (spec.epoch, spec.trial, TrialEnd::Partial);
        self.store.event(Event::EpochDone { cell, epoch, trial, end })?;
        Ok(Ended::Epoch)
    }

    /// Keeps who was lost, and how.
    pub(super) fn keep_losses(
        &mut self,
        lost: &[CraftEnded],
        plan: &FleetPlan,
        phase: &str,
    ) -> Result<(), StoreError> {
        for craft in lost {
            let name = plan.scenario.names().craft(craft.craft).to_owned();
            let said = craft.said.trim();
            let (colon, said) = if said.is_empty() { ("", "") } else { (": ", said) };
            self.progress.say(&format!("{name} was lost ({}) in {phase}{colon}{said}", craft.how));
            self.store.event(Event::CraftLost {
                size: plan.scenario.craft_count(),
                name,
                end: verdict::process_end(craft.how),
                phase: phase.to_owned(),
            })?;
        }
        Ok(())
    }

    /// Keeps who was silent, and what helped.
    fn keep_silence(&mut self, relieved: Relieved, plan: &FleetPlan) -> Result<(), StoreError> {
        let Relieved { silence, helped, swept } = relieved;
        let name = plan.scenario.names().craft(silence.craft).to_owned();
        let what = match helped {
            Relief::Sweep => "went on after what nobody finished was swept",
            Relief::Kill => "was killed",
        };
        let seconds = silence.silent_ns as f64 / 1e9;
        self.progress.say(&format!("{name} gave no heartbeat for {seconds:.1} s and {what}"));
        if let Err(error) = &swept {
            self.note(format!("what nobody finished could not be swept: {error}"))?;
        }
        self.store.event(Event::CraftSilent {
            size: plan.scenario.craft_count(),
            name,
            incarnation: silence.incarnation.0,
            silent_ns: silence.silent_ns,
            helped,
            swept: swept.unwrap_or(0),
        })
    }

    /// Keeps who was killed because it did not answer.
    fn keep_mute(&mut self, mute: Mute, plan: &FleetPlan) -> Result<(), StoreError> {
        let Mute { craft, incarnation, answer, waited_ns, standing } = mute;
        let name = plan.scenario.names().craft(craft).to_owned();
        let (answer, seconds) = (format!("{answer:?}"), waited_ns as f64 / 1e9);
        self.progress.say(&format!(
            "{name} gave no answer ({answer}) for {seconds:.1} s and was killed ({standing})"
        ));
        let (size, incarnation) = (plan.scenario.craft_count(), incarnation.0);
        self.store.event(Event::CraftMute { size, name, incarnation, answer, waited_ns, standing })
    }

    /// Keeps silences that are over, and how lost crafts came back, as far as that is known by now; with
    /// `all`, of a fleet that is about to end, those that did not as well.
    pub(super) fn keep_recoveries(
        &mut self,
        backend: &mut impl Backend,
        plan: &FleetPlan,
        all: bool,
    ) -> Result<(), StoreError> {
        for relieved in backend.take_relieved() {
            self.keep_silence(relieved, plan)?;
        }
        for mute in backend.take_mute() {
            self.keep_mute(mute, plan)?;
        }
        for recovery in backend.take_recoveries(all) {
            let name = plan.scenario.names().craft(recovery.ended.craft).to_owned();
            if let Some(Err(error)) = recovery.reclaimed.as_ref().map(|done| &done.result) {
                self.note(format!("what {name} held could not be freed: {error}"))?;
            }
            match restarted(&recovery, plan.scenario.craft_count(), &name) {
                Some(event) => self.store.event(event)?,
                None if recovery.is_cut_short => {
                    self.note(format!("{name} was lost again before it was back"))?;
                }
                None => self.note(format!("the fleet ended before {name} was back"))?,
            }
        }
        Ok(())
    }
}

/// The event of a recovery that came to its end.
fn restarted(recovery: &Recovery, size: u32, name: &str) -> Option<Event> {
    let since = |then: Nanos| then.since(recovery.noticed);
    Some(Event::CraftRestarted {
        size,
        name: name.to_owned(),
        incarnation: recovery.successor.0,
        reclaimed_ns: since(recovery.reclaimed.as_ref()?.done),
        known_ns: since(recovery.known?),
        ready_ns: since(recovery.ready?),
        rejoined_ns: since(recovery.rejoined?),
        peers_noticed_ns: recovery.peers_noticed.map(since),
        caught_up_ns: recovery.caught_up.map(since),
    })
}
