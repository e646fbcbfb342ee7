//! What a soaked fleet plays: shared facts, one strategy, the same load part after part and, unless it is
//! to be left in peace, the same faults in each of them.

use super::Soak;
use std::fmt::Write as _;

/// Share of what crafts send each other that links lose.
pub const LOSS: f64 = 0.01;

/// When what happens, as shares of a part.
const KILLED_AT: [f64; 2] = [0.2, 0.7];
const STOPPED_AT: f64 = 0.4;

/// Crafts that are killed in a part.
pub const KILLS: u64 = KILLED_AT.len() as u64;

/// How long one craft is stopped: this share of a part, and at most so many seconds.
const STOPPED_FOR: f64 = 0.1;
const STOPPED_S_MAX: f64 = 1.0;

/// Window of restarts, s: below the time between two deaths of one craft, so that a successor never waits.
const RESTART_WINDOW_S: u32 = 1;

impl Soak {
    /// Length of a part, s.
    #[must_use]
    pub fn part_s(&self) -> f64 {
        f64::from(self.seconds) / f64::from(self.parts())
    }

    /// How long a craft is stopped in each part, s; nobody is if there are no faults.
    #[must_use]
    pub fn stopped_s(&self) -> Option<f64> {
        self.has_faults.then(|| (STOPPED_FOR * self.part_s()).min(STOPPED_S_MAX))
    }

    /// The scenario as a file's text.
    #[must_use]
    pub fn scenario(&self) -> String {
        let Self { crafts, strategy, rate_per_s, .. } = self;
        let mut text = format!(
            "name = \"soak\"\n[fleet]\ncrafts = {crafts}\ncores = 2\n[topology]\ntree = \"binary\"\n\
             [network]\nlinking = \"shared\"\ninitial = 0\nboundary-fraction = 0.5\nsharers = 2\n\
             [replication]\nstrategies = [\"{strategy}\"]\n[trace]\nreads-per-s = 200\n\
             [run]\nmode = \"open\"\nduration-s = {}\n",
            self.part_s()
        );
        for part in 1..=self.parts() {
            // Writing to a string cannot fail.
            let _ = write!(text, "[[load]]\nname = \"{part}\"\nrate-per-s = {rate_per_s}\n");
        }
        text + &self.faults()
    }

    /// Two deaths, the first within the tree and the second at one of its ends, between them a pause of
    /// the tree's root, and losses all the while. All others live as long as the fleet.
    fn faults(&self) -> String {
        let Some(stopped_s) = self.stopped_s() else { return String::new() };
        let at_s = |share: f64| share * self.part_s();
        let mut text = format!(
            "[link]\nloss = {LOSS}\n[faults]\nrestart = \"on-failure\"\n\
             restart-window-s = {RESTART_WINDOW_S}\n[[faults.process]]\ncraft = \"craft-0\"\n\
             at-s = {}\ndo = \"stop\"\nfor-s = {stopped_s}\n",
            at_s(STOPPED_AT)
        );
        for (craft, share) in [1, self.crafts - 1].into_iter().zip(KILLED_AT) {
            let at_s = at_s(share);
            let _ = write!(text, "[[faults.process]]\ncraft = \"craft-{craft}\"\nat-s = {at_s}\n");
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::{KILLS, LOSS};
    use crate::soak::Soak;
    use orchestrator::scenario::load_text;
    use shared_types::scenario::Blow;

    fn soak(seconds: u32, has_faults: bool) -> Soak {
        Soak {
            slateswarm: "slateswarm".into(),
            crafts: 10,
            seconds,
            rate_per_s: 2000,
            strategy: "boundary".to_owned(),
            has_faults,
            set: Vec::new(),
            out: "runs".into(),
        }
    }

    #[test]
    fn the_scenario_is_one_and_its_parts_add_up() {
        for (seconds, parts) in [(30, 6), (60, 6), (3600, 60), (4 * 3600, 100)] {
            let scenario = load_text("soak", &soak(seconds, false).scenario(), &[]).unwrap();
            assert_eq!(scenario.craft_count(), 10);
            assert_eq!(scenario.scenario().load.len(), parts);
            let each = scenario.scenario().run.duration_s.unwrap();
            assert!((each * parts as f64 - f64::from(seconds)).abs() < 1e-6);
            assert!(scenario.scenario().faults.process.is_empty());
            assert!(scenario.open_recovery().is_none(), "what the trace demands is counted");
        }
    }

    #[test]
    fn faults_befall_every_part_and_the_fleet_recovers() {
        for seconds in [6, 30, 3600] {
            let soak = soak(seconds, true);
            let scenario = load_text("soak", &soak.scenario(), &[]).unwrap();
            assert!(scenario.open_recovery().is_some());
            let faults = &scenario.scenario().faults.process;
            let killed = faults.iter().filter(|fault| fault.what == Blow::Kill);
            assert_eq!(killed.count() as u64, KILLS);
            let ends = faults.iter().map(|fault| fault.at_s.unwrap() + fault.for_s.unwrap_or(0.0));
            assert!(ends.fold(0.0, f64::max) < soak.part_s());
            assert!((scenario.scenario().link.loss - LOSS).abs() < 1e-12);
        }
    }
}
