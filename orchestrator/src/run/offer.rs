//! What one load offers to a fleet, whatever the strategy: networks, trace, and which applications that
//! needs.

use super::plan::{FleetPlan, LoadPlan, Offered, OpenPlan};
use crate::scenario::compile;
use crate::workload::{TraceError, draw_at};
use shared_types::ids::{CraftId, FactId};
use shared_types::knowledge::FleetNetwork;
use shared_types::trace::{TraceRecord, to_words};
use std::collections::BTreeMap;

/// Trial numbers of loads start here, apart from trials and from the epochs that measure turn time:
/// every block has networks and a trace of its own.
const FIRST_LOAD_TRIAL: u32 = 1 << 31;

/// The trial whose networks and trace `block` is offered.
#[must_use]
pub const fn load_trial(block: u32) -> u32 {
    FIRST_LOAD_TRIAL.wrapping_add(block)
}

/// What one load offers in one block.
#[derive(Debug)]
pub struct Offer {
    /// The networks, with the trace.
    pub network: FleetNetwork,
    /// Per craft its records that are due within the interval.
    pub trace: Vec<Vec<TraceRecord>>,
    /// Which trial of the seed this is.
    pub trial: u32,
    /// Length of the interval, ns.
    pub duration_ns: u64,
    /// By (origin, receiver) the due times of the writes that the receiver shares, in their order.
    needs: BTreeMap<(CraftId, CraftId), Vec<u64>>,
}

/// Writes of a fact by others, as one board numbers it: their due times, ascending.
pub type Foreign = BTreeMap<(CraftId, FactId), Vec<u64>>;

impl Offer {
    /// What `load` offers to the fleet of `plan` in `block`.
    ///
    /// # Errors
    /// If nothing of a kind that shall be written is there.
    pub fn of(
        plan: &FleetPlan,
        open: &OpenPlan,
        load: &LoadPlan,
        seed: u64,
        block: u32,
    ) -> Result<Self, TraceError> {
        let trial = load_trial(block);
        let mut network = FleetNetwork::default();
        compile(&plan.scenario, seed, trial, &mut network);
        let trace = match &load.offered {
            Offered::Drawn { rate_per_s } => {
                let scenario = plan.scenario.scenario();
                let duration_s = seconds(open.duration_ns);
                draw_at(scenario, (*rate_per_s, duration_s), &network.view(), trial)?.crafts
            }
            Offered::Given(trace) => trace.crafts.clone(),
        };
        Ok(Self::new(network, trace, trial, open.duration_ns))
    }

    /// What `trace` offers on `network` for `duration_ns`; records that are due later are left out.
    #[must_use]
    pub fn new(
        mut network: FleetNetwork,
        mut trace: Vec<Vec<TraceRecord>>,
        trial: u32,
        duration_ns: u64,
    ) -> Self {
        for records in &mut trace {
            records.truncate(records.partition_point(|record| record.at_ns < duration_ns));
        }
        network.trace = trace.iter().map(|records| to_words(records)).collect();
        let mut needs: BTreeMap<(CraftId, CraftId), Vec<u64>> = BTreeMap::new();
        let fleet = network.view();
        for (origin, records) in (0..).map(CraftId).zip(&trace) {
            for record in records.iter().filter(|record| record.holds().is_some()) {
                for target in fleet.board(origin).targets(record.fact()) {
                    if target.craft != origin {
                        needs.entry((origin, target.craft)).or_default().push(record.at_ns);
                    }
                }
            }
        }
        Self { network, trace, trial, duration_ns, needs }
    }

    /// Applications at other boards that the trace needs.
    #[must_use]
    pub fn needed(&self) -> u64 {
        self.needs.values().map(|due| due.len() as u64).sum()
    }

    /// Of these, those of writes that are due before `until_ns`.
    #[must_use]
    pub fn needed_before(&self, until_ns: u64) -> u64 {
        let before = |due: &Vec<u64>| due.partition_point(|&at_ns| at_ns < until_ns) as u64;
        self.needs.values().map(before).sum()
    }

    /// The due times of what `receiver` has not applied of the writes of `origin`, of which it has
    /// applied the first `applied`: changes of a pair keep their order.
    pub fn missing(&self, origin: CraftId, receiver: CraftId, applied: u64) -> &[u64] {
        let due = self.needs.get(&(origin, receiver)).map_or(&[][..], Vec::as_slice);
        let applied = usize::try_from(applied).unwrap_or(usize::MAX);
        due.get(applied..).unwrap_or_default()
    }

    /// Writes of the trace, and those of them that are of boundary facts.
    #[must_use]
    pub fn writes(&self) -> (u64, u64) {
        let fleet = self.network.view();
        let (mut writes, mut boundary) = (0, 0);
        for (craft, records) in (0..).map(CraftId).zip(&self.trace) {
            for record in records.iter().filter(|record| record.holds().is_some()) {
                writes += 1;
                boundary += u64::from(fleet.board(craft).is_boundary(record.fact()));
            }
        }
        (writes, boundary)
    }

    /// The writes by others that each board shares.
    #[must_use]
    pub fn foreign(&self) -> Foreign {
        let fleet = self.network.view();
        let mut foreign = Foreign::new();
        for (origin, records) in (0..).map(CraftId).zip(&self.trace) {
            for record in records.iter().filter(|record| record.holds().is_some()) {
                let targets = fleet.board(origin).targets(record.fact());
                for target in targets.filter(|target| target.craft != origin) {
                    foreign.entry((target.craft, target.fact)).or_default().push(record.at_ns);
                }
            }
        }
        foreign.values_mut().for_each(|due| due.sort_unstable());
        foreign
    }
}

/// ns as seconds.
#[expect(clippy::cast_precision_loss, reason = "intervals stay below 2^53 ns, a hundred days")]
fn seconds(duration_ns: u64) -> f64 {
    duration_ns as f64 / 1e9
}
