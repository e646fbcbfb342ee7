//! The links of a simulated fleet: what `[link]` loses, and how long the rest takes.
//!
//! Loss is drawn from the seed, sample by sample, repeats and receipts included. Fleets whose links lose
//! something repair it (docs/decisions/0014), so that a trial takes the path that it takes without loss.
//! Not here: delay and range of a pair (`positions`).

use super::positions::LinkTable;
use super::resolve::ResolvedScenario;
use shared_types::ids::CraftId;
use shared_types::scenario::{Link as Stated, RunMode};
use shared_types::time::Nanos;
use shared_types::transport::link::{Link, Lossy, Verdict};
use shared_types::wire::{Header, RecoverySpec};

/// What a process waits beyond the way there and back before it asks again, ns.
const PATIENCE_NS: u64 = 100_000;

/// Loses a share of what crafts send each other and delays the rest.
#[derive(Clone, Debug)]
pub struct SimulatedLink {
    table: LinkTable,
    lossy: Option<Lossy>,
}

impl SimulatedLink {
    /// The links of `scenario`, losses drawn from `seed`; `None` if they neither lose nor delay.
    #[must_use]
    pub fn of(scenario: &ResolvedScenario, seed: u64) -> Option<Self> {
        let loss = scenario.scenario().link.loss;
        let table = scenario.links().clone();
        let lossy = (loss > 0.0).then(|| Lossy::new(seed, loss, 0.0));
        (lossy.is_some() || !table.is_instant()).then_some(Self { table, lossy })
    }
}

impl Link for SimulatedLink {
    fn judge(&mut self, now: Nanos, receiver: CraftId, header: &Header) -> Verdict {
        let is_radio = ![header.source, receiver.0].contains(&CraftId::ORCHESTRATOR.0);
        let lost = self.lossy.as_mut().filter(|_| is_radio);
        match lost.map(|lossy| lossy.judge(now, receiver, header)) {
            Some(Verdict::Drop) => Verdict::Drop,
            _ => self.table.judge(now, receiver, header),
        }
    }
}

/// How fleets of `mode` repair what `link` loses; `None` where nothing is lost on purpose.
pub(super) fn recovery(link: &Stated, mode: RunMode) -> Option<RecoverySpec> {
    let propagation_s = link
        .from_positions
        .as_ref()
        .map_or(0.0, |stated| stated.range_m / stated.propagation_m_per_s);
    let way = std::time::Duration::try_from_secs_f64(link.delay_ms / 1e3 + propagation_s);
    let way_ns = way.map_or(u64::MAX, |way| u64::try_from(way.as_nanos()).unwrap_or(u64::MAX));
    let patience_ns = way_ns.saturating_mul(4).saturating_add(PATIENCE_NS);
    (mode == RunMode::Simulated && link.loss > 0.0).then_some(RecoverySpec { patience_ns })
}

#[cfg(test)]
mod tests {
    use super::{RecoverySpec, RunMode, Stated, recovery};

    #[test]
    fn only_simulated_fleets_that_lose_something_repair_it() {
        let lossy = Stated { loss: 0.5, delay_ms: 2.0, ..Stated::default() };
        let patience_ns = 8_100_000;
        assert_eq!(recovery(&lossy, RunMode::Simulated), Some(RecoverySpec { patience_ns }));
        assert_eq!(recovery(&lossy, RunMode::Lockstep), None);
        assert_eq!(recovery(&Stated { loss: 0.0, ..lossy }, RunMode::Simulated), None);
    }
}
