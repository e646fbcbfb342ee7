//! Capacity on a fleet: what a probe plays, and the loads at shares of what was found.
//!
//! Each probe is an interval on a trace of its own after an unmeasured part of it, judged like any cell
//! of open mode. A block begins its search where the last one of that size ended. Not here: how the
//! search goes on ([`super::capacity`]), and how a cell is played ([`super::loads`]).

use super::backend::{Backend, PlayError};
use super::capacity::{Found, Search};
use super::epoch;
use super::loads::Bearing;
use super::offer::Offer;
use super::plan::{CapacityPlan, FleetPlan, LoadLabel, LoadPlan, Offered, OpenPlan};
use super::{Ended, Runner};
use crate::results::load::{CapacityRecord, LoadHistograms, LoadRecord, Probe};
use crate::results::statistics::{Quantile, as_float};
use crate::results::store::StoreError;
use shared_types::wire::Stage;

/// Probes have networks and traces beyond those of this many blocks, so many for each block.
const FIRST_PROBE: u32 = 1 << 20;
const PROBES_OF_BLOCK: u32 = 1 << 12;

/// The same of loads at shares of capacity.
const FIRST_SHARE: u32 = 1 << 30;
const SHARES_OF_BLOCK: u32 = 1 << 8;

/// Why a search ends before it has found anything.
enum Cut {
    Store(StoreError),
    Ended(Ended),
}

/// One strategy in one block.
struct Candidate<'a> {
    plan: &'a FleetPlan,
    open: &'a OpenPlan,
    capacity: &'a CapacityPlan,
    block: u32,
    label: LoadLabel,
    place: u32,
}

impl Runner<'_> {
    /// Searches the capacity of every strategy of a fleet, and offers it shares of that.
    pub(super) fn search_capacities(
        &mut self,
        backend: &mut impl Backend,
        block: u32,
        plan: &FleetPlan,
        capacity: &CapacityPlan,
    ) -> Result<Ended, StoreError> {
        let open = &capacity.open;
        for (place, &label) in (0..).zip(&plan.searched) {
            let candidate = Candidate { plan, open, capacity, block, label, place };
            match self.examine(backend, &candidate) {
                Ok(()) => self.done += 1,
                Err(Cut::Ended(Ended::Epoch)) => {}
                Err(Cut::Ended(ended)) => return Ok(ended),
                Err(Cut::Store(error)) => return Err(error),
            }
        }
        Ok(Ended::Complete)
    }

    /// One search a burst, then the shares of what was borne at the first.
    fn examine(
        &mut self,
        backend: &mut impl Backend,
        candidate: &Candidate<'_>,
    ) -> Result<(), Cut> {
        let capacity = candidate.capacity;
        let mut own_per_s = None;
        for (number, &burst) in capacity.bursts.iter().enumerate() {
            let record = self.search(backend, candidate, burst)?;
            if number == 0 {
                own_per_s = record.capacity().map(|probe| probe.offered_per_s);
            }
            self.store.append_capacity(&record).map_err(Cut::Store)?;
        }
        let (Some(own_per_s), Some(&burst)) = (own_per_s, capacity.bursts.first()) else {
            return Ok(());
        };
        for (number, &percent) in (0..).zip(&capacity.percents) {
            let rate_per_s = own_per_s * f64::from(percent) / 100.0;
            let trial = FIRST_SHARE + candidate.block * SHARES_OF_BLOCK + number;
            let name = format!("{percent}%");
            let cell = self.offer(backend, candidate, (&name, burst, rate_per_s), trial)?;
            self.store.append_load(&cell.0, &cell.1).map_err(Cut::Store)?;
        }
        Ok(())
    }

    fn search(
        &mut self,
        backend: &mut impl Backend,
        candidate: &Candidate<'_>,
        burst: u32,
    ) -> Result<CapacityRecord, Cut> {
        let cell = epoch::cell(candidate.block, candidate.plan, candidate.label.label.strategy);
        let key = (cell.size, cell.strategy, burst);
        let search: Search =
            candidate.capacity.search.starting_at(self.capacities.get(&key).copied());
        let name = format!("capacity, burst {burst}");
        let mut trial = FIRST_PROBE + candidate.block * PROBES_OF_BLOCK;
        let found: Found = search.run(|rate_per_s| {
            trial += 1;
            let offered = (name.as_str(), burst, rate_per_s);
            let (record, _) = self.offer(backend, candidate, offered, trial)?;
            Ok(probe(rate_per_s, &record))
        })?;
        let Found { probes, borne } = found;
        let (asks_every_ns, place) = (candidate.label.asks_every_ns, candidate.place);
        let record = CapacityRecord { cell, place, asks_every_ns, burst, probes, borne };
        let borne_per_s = record.capacity().map(|probe| probe.offered_per_s);
        self.capacities.extend(borne_per_s.map(|rate| (key, rate)));
        Ok(record)
    }

    /// One interval at a rate, on the networks and the trace of `trial`.
    fn offer(
        &mut self,
        backend: &mut impl Backend,
        candidate: &Candidate<'_>,
        (name, burst, rate_per_s): (&str, u32, f64),
        trial: u32,
    ) -> Result<(LoadRecord, LoadHistograms), Cut> {
        let Candidate { plan, open, block, label, place, .. } = *candidate;
        let scenario = plan.scenario.with_burst(burst);
        let plan = FleetPlan { scenario, ..plan.clone() };
        let load = LoadPlan {
            name: name.to_owned(),
            offered: Offered::Drawn { rate_per_s },
            records: 0,
            order: Vec::new(),
        };
        let offer = match Offer::of(&plan, open, &load, self.plan.seed, trial) {
            Ok(offer) => offer,
            Err(error) => {
                let error = PlayError::Failed(error.to_string());
                return Err(self.end_early(&plan, name, error).map_or_else(Cut::Store, Cut::Ended));
            }
        };
        let cell = epoch::cell(block, &plan, label.label.strategy);
        let network = self.epoch;
        let bearing =
            Bearing { plan: &plan, open, load: &load, offer: &offer, cell, label, place, network };
        self.bear(backend, &bearing).map_err(Cut::Store)?.map_err(Cut::Ended)
    }
}

/// What a cell says of a rate.
fn probe(offered_per_s: f64, record: &LoadRecord) -> Probe {
    let lag = record.stages.get(&Stage::Schedule);
    Probe {
        offered_per_s,
        applied_per_s: as_float(record.applied_by_end) * 1e9 / as_float(record.duration_ns),
        applied_share: as_float(record.applied_by_end) / as_float(record.needed.max(1)),
        lag_p99_ns: lag.and_then(|lag| lag.quantile_ns(Quantile::P99)),
        fleet_cpu_ns: record.fleet_cpu_ns,
        saturated: record.saturated,
    }
}
