//! How long a run will take, said before it starts.
//!
//! The numbers are of a small machine (two cores of a virtual machine, release build); a run that goes
//! on replaces them by what it has seen. An estimate decides nothing.

use super::plan::{CapacityPlan, FleetPlan, OpenPlan, RunPlan, TimingPlan};
use shared_types::wire::StrategyKind;

/// From the first spawn to GO, and the end of the fleet, s: a part for the fleet and one a process.
const START_S: (f64, f64) = (0.1, 0.012);

/// Around each epoch, s: networks, replay, reports; a part for the epoch and one a craft.
const EPOCH_S: (f64, f64) = (0.002, 0.0012);

/// One turn, s a craft.
const fn turn_s(strategy: StrategyKind) -> f64 {
    match strategy {
        StrategyKind::Null => 2e-6,
        StrategyKind::Boundary => 3e-6,
        StrategyKind::Full => 6e-6,
        StrategyKind::Limited | StrategyKind::Hierarchy | StrategyKind::Hybrid => 7e-6,
        StrategyKind::CentralBatched => 8e-6,
        // A hundred round trips a craft and turn.
        StrategyKind::Central | StrategyKind::Pipelined => 2e-4,
    }
}

/// Turns of a trial on average, near enough for every size.
const TRIAL_TURNS: f64 = 4.0;

/// Seconds that `plan` takes, about.
#[must_use]
pub fn seconds(plan: &RunPlan) -> f64 {
    let of_fleet = |(index, fleet): (usize, &FleetPlan)| {
        let crafts = f64::from(fleet.scenario.craft_count());
        let epoch_s = EPOCH_S.0 + EPOCH_S.1 * crafts;
        let trials = f64::from(plan.trials_of(plan.block_of(index)));
        let trial_s = |&strategy: &StrategyKind| epoch_s + TRIAL_TURNS * crafts * turn_s(strategy);
        let trials_s = trials * fleet.strategies.iter().map(trial_s).sum::<f64>();
        let start_s = if plan.is_simulated { 0.0 } else { START_S.0 + START_S.1 * crafts };
        let timing_s = plan.timing.map_or(0.0, |timing| timing_s(fleet, &timing, epoch_s));
        // On a virtual clock an interval takes what its events take, which no length says.
        let played_open = plan.open.filter(|_| !plan.is_simulated);
        let loads_s = played_open.map_or(0.0, |open| loads_s(fleet, &open));
        let capacity_s = plan.capacity.as_ref().map_or(0.0, |capacity| capacity_s(fleet, capacity));
        start_s + trials_s + timing_s + loads_s + capacity_s
    };
    plan.fleets.iter().enumerate().map(of_fleet).sum()
}

fn timing_s(fleet: &FleetPlan, timing: &TimingPlan, epoch_s: f64) -> f64 {
    let crafts = f64::from(fleet.scenario.craft_count());
    let cells = fleet.order.iter().map(|label| {
        let turns = f64::from(timing.turns_of(label.strategy));
        let played_s = epoch_s + turns * crafts * turn_s(label.strategy);
        // A warm-up ends with the epoch that passes its time.
        #[expect(clippy::cast_precision_loss, reason = "an estimate")]
        let warm_up_s = timing.warm_up_ns as f64 / 1e9 + played_s / 2.0;
        warm_up_s + f64::from(timing.epochs) * played_s
    });
    cells.sum()
}

/// Around each interval of open mode, s: ports, the word to begin, quiet, reports.
const INTERVAL_S: f64 = 0.06;

fn loads_s(fleet: &FleetPlan, open: &OpenPlan) -> f64 {
    let cells = fleet.loads.iter().map(|load| load.order.len() as u64).sum::<u64>();
    #[expect(clippy::cast_precision_loss, reason = "an estimate")]
    let (cells, played_s) = (cells as f64, (open.warm_up_ns + open.duration_ns) as f64 / 1e9);
    cells * (played_s + 2.0 * INTERVAL_S)
}

/// Probes of one search, most of them failed ones twice.
const PROBES: f64 = 11.0;

/// What a probe takes beyond its length: a trace of a million records is drawn and published, and a
/// fleet above its capacity needs a while to come to rest.
const PROBE_S: f64 = 1.0;

fn capacity_s(fleet: &FleetPlan, capacity: &CapacityPlan) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "an estimate")]
    let (strategies, bursts, shares, played_s) = (
        fleet.searched.len() as f64,
        capacity.bursts.len() as f64,
        capacity.percents.len() as f64,
        (capacity.open.warm_up_ns + capacity.open.duration_ns) as f64 / 1e9,
    );
    strategies * (bursts * PROBES + shares) * (played_s + PROBE_S)
}

/// `seconds` in words: `about 4 min`.
#[must_use]
pub fn in_words(seconds: f64) -> String {
    if seconds < 1.0 {
        "less than a second".to_owned()
    } else if seconds < 100.0 {
        format!("about {seconds:.0} s")
    } else if seconds < 6000.0 {
        format!("about {:.0} min", seconds / 60.0)
    } else {
        format!("about {:.1} h", seconds / 3600.0)
    }
}

#[cfg(test)]
mod tests {
    use super::in_words;

    #[test]
    fn lengths_are_told_in_the_unit_that_fits() {
        for (seconds, words) in [
            (0.2, "less than a second"),
            (42.4, "about 42 s"),
            (240.0, "about 4 min"),
            (9000.0, "about 2.5 h"),
        ] {
            assert_eq!(in_words(seconds), words);
        }
    }
}
