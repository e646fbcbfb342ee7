//! Faults of processes that a scenario states: when in a trial or interval they befall whom.
//!
//! They are given to the fleet before each trial and each measured interval, and become blows of the
//! fleet's loop ([`super::strike`]) once it is known when that began. Not here: what follows from them.

use super::fleet::RealFleet;
use super::strike::{Blow, Strike};
use crate::scenario::ResolvedScenario;
use shared_types::ids::{CraftId, Turn};
use shared_types::scenario::Blow as Stated;
use shared_types::time::Nanos;
use std::time::Duration;

/// One fault of one process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Infliction {
    /// Whom.
    pub craft: CraftId,
    /// When.
    pub at: When,
    /// How long it is stopped, ns; `None` if it is killed.
    pub stopped_ns: Option<u64>,
}

/// When a fault befalls a process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum When {
    /// As this turn of a trial opens.
    Turn(Turn),
    /// So many ns after an interval began.
    After(u64),
}

impl Infliction {
    /// What `scenario` states.
    #[must_use]
    pub fn all_of(scenario: &ResolvedScenario) -> Vec<Self> {
        let ns = |seconds: f64| {
            let duration = Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX);
            u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
        };
        let faults = &scenario.scenario().faults.process;
        let inflictions = faults.iter().filter_map(|fault| {
            let craft = scenario.crafts().iter().position(|craft| craft.name == fault.craft)?;
            let at = match (fault.at_turn, fault.at_s) {
                (Some(turn), _) => When::Turn(Turn(turn)),
                (None, at_s) => When::After(ns(at_s?)),
            };
            let stopped_ns = match fault.what {
                Stated::Kill => None,
                Stated::Stop => Some(ns(fault.for_s?)),
            };
            Some(Self { craft: CraftId::from_index(craft), at, stopped_ns })
        });
        inflictions.collect()
    }

    /// The blows that it is made of, the first at `due`.
    fn blows(self, due: Nanos) -> impl Iterator<Item = Strike> {
        let Self { craft, stopped_ns, .. } = self;
        let first = if stopped_ns.is_some() { Blow::Stop } else { Blow::Kill };
        let goes_on = stopped_ns.map(|stopped_ns| Strike {
            due: due.plus(stopped_ns),
            craft,
            blow: Blow::Continue,
        });
        [Strike { due, craft, blow: first }].into_iter().chain(goes_on)
    }
}

impl RealFleet<'_> {
    /// What befalls the fleet in the next epoch, in place of what was planned before.
    pub(super) fn plan_faults(&mut self, inflictions: Vec<Infliction>) {
        self.inflictions = inflictions;
    }

    /// The interval of the epoch under way begins at `started`.
    pub(super) fn plan_blows(&mut self, started: Nanos) {
        let inflictions = std::mem::take(&mut self.inflictions);
        for infliction in inflictions {
            if let When::After(after_ns) = infliction.at {
                self.strike(infliction.blows(started.plus(after_ns)));
            }
        }
    }

    /// Turn `turn` of the trial under way opened at `now`: strikes those whose time has come.
    pub(super) fn strike_in_turn(&mut self, turn: Turn, now: Nanos) -> std::io::Result<()> {
        let (due, later): (Vec<_>, Vec<_>) = std::mem::take(&mut self.inflictions)
            .into_iter()
            .partition(|infliction| infliction.at == When::Turn(turn));
        self.inflictions = later;
        self.strike(due.into_iter().flat_map(|infliction| infliction.blows(now)));
        self.strike_when_due()
    }
}

#[cfg(test)]
mod tests {
    use super::{Infliction, When};
    use crate::run::strike::{Blow, Strike};
    use crate::scenario::{Base, Override, load};
    use shared_types::ids::{CraftId, Turn};
    use shared_types::time::Nanos;

    #[test]
    fn what_a_scenario_states_becomes_blows() {
        let faults = "faults.process=[{ craft = \"aerial\", at-turn = 2 }, \
                      { craft = \"orbiter\", at-turn = 3, do = \"stop\", for-s = 0.5 }]";
        let setting = Override::set(faults).expect("a setting");
        let scenario =
            load(&Base::Preset("two-craft".to_owned()), [], &[setting]).expect("a preset");
        let [kill, stop] = Infliction::all_of(&scenario)[..] else { panic!("two faults") };
        assert_eq!((kill.at, kill.stopped_ns), (When::Turn(Turn(2)), None));
        assert_eq!((stop.at, stop.stopped_ns), (When::Turn(Turn(3)), Some(500_000_000)));
        assert_ne!(kill.craft, stop.craft);
        let craft = CraftId(1);
        let blows: Vec<Strike> = Infliction { craft, ..stop }.blows(Nanos(7)).collect();
        let continued = Nanos(500_000_007);
        let expected = [
            Strike { due: Nanos(7), craft, blow: Blow::Stop },
            Strike { due: continued, craft, blow: Blow::Continue },
        ];
        assert_eq!(blows, expected);
        assert_eq!(kill.blows(Nanos(1)).count(), 1);
    }
}
