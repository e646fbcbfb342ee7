//! What became of an interval whose fleet recovers from deaths and losses.
//!
//! What a link or a full outbox dropped was repeated, or the state was told instead; neither is a loss. A
//! loss is what the strategy promises and no board holds: the oracle finds it once the fleet is quiet. Not
//! here: how a fleet recovers (the core, and `revival`).

use super::Runner;
use super::backend::PlayedOpen;
use super::loads::Bearing;
use super::measured::Measured;
use crate::outcome::Outcome;
use crate::results::load::LoadRecovery;
use crate::results::record::TrialEnd;
use crate::results::store::StoreError;
use agent::oracle::{ObservedOpen, compare_recovered};
use shared_types::ids::CraftId;
use shared_types::wire::{EpochSpec, Losses, Recovered};

/// What recovery did in `played`, and what of `losses` it could not mend: nothing else than samples that
/// cannot be read, or of another epoch.
pub(super) fn mended(played: &PlayedOpen, losses: Losses) -> (LoadRecovery, Losses) {
    let mut done = Recovered::default();
    let mut records_missed = 0;
    for report in &played.reports {
        done += report.counters.recovered;
        records_missed += report.open.as_ref().map_or(0, |open| open.records_missed);
    }
    let mut links = losses.links;
    links += played.links;
    let recovery = LoadRecovery {
        deaths: played.dead.len() as u64,
        records_missed,
        repeats: done.repeats,
        given_up: done.given_up,
        learnt: done.learnt,
        states_missed: done.states_missed,
        links,
        dropped: losses.full_outboxes,
    };
    let lost = Losses { gaps: 0, old_incarnation: 0, full_outboxes: 0, ..losses };
    (recovery, lost)
}

impl Runner<'_> {
    /// Keeps who died in an interval and how their successors came, holds boards against what the
    /// strategy promises, and says how the interval ended.
    pub(super) fn judge_recovered(
        &mut self,
        bearing: &Bearing<'_>,
        phase: &str,
        spec: &EpochSpec,
        played: &PlayedOpen,
        measured: &Measured,
    ) -> Result<TrialEnd, StoreError> {
        self.keep_losses(&played.dead, bearing.plan, phase)?;
        let observed = ObservedOpen { reports: &played.reports, is_quiet: played.is_quiet };
        let died: Vec<CraftId> = played.dead.iter().map(|ended| ended.craft).collect();
        let broken = compare_recovered(spec, &bearing.offer.network.view(), &observed, &died);
        self.keep_discrepancies(bearing.cell, spec, broken.iter().map(ToString::to_string))?;
        let missed = measured.recovery.map_or(0, |recovery| recovery.records_missed);
        if missed > 0 {
            self.note(format!(
                "{phase}: {missed} records of the trace were due before a successor came, which skips \
                 them; its earlier life made those before its death"
            ))?;
        }
        if played.is_quiet && !measured.losses.is_partial() {
            return Ok(TrialEnd::Finished);
        }
        self.outcome = self.outcome.worse(Outcome::Partial);
        self.note(if played.is_quiet {
            format!("{phase}: something was lost: {:?}", measured.losses)
        } else {
            format!("{phase}: the fleet did not come to rest; what was still asked for is lost")
        })?;
        Ok(TrialEnd::Partial)
    }
}
