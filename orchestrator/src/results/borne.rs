//! The highest load that each strategy bore, over the blocks in which it was searched.
//!
//! The median of the blocks, with the lowest and the highest of them; of a central strategy the asking
//! interval that bore most stands for it. Not here: the search itself.

use super::load::{CapacityRecord, SearchEnd};
use shared_types::wire::StrategyKind;
use std::collections::BTreeMap;

/// What one strategy bore at one size and burst.
#[derive(Clone, Debug, PartialEq)]
pub struct Borne {
    /// Crafts, a centre not counted.
    pub size: u32,
    /// Writes of one craft that are due together.
    pub burst: u32,
    /// The strategy.
    pub strategy: StrategyKind,
    /// How often a client asks the centre, ns; `None` without a centre.
    pub asks_every_ns: Option<u64>,
    /// Changes applied at other boards a second, whole fleet, of every block in which some load was
    /// borne, ascending.
    pub per_s: Vec<f64>,
    /// Blocks in which not even the lowest load was borne.
    pub nothing: u32,
    /// Blocks in which the highest load that is tried was borne: what is above it is not known.
    pub ceilings: u32,
}

impl Borne {
    /// What was borne, by size, burst and strategy.
    #[must_use]
    pub fn of(records: &[CapacityRecord]) -> Vec<Self> {
        let mut rows: BTreeMap<(u32, u32, StrategyKind), BTreeMap<Option<u64>, Self>> =
            BTreeMap::new();
        for record in records {
            let (size, burst, strategy) = (record.cell.size, record.burst, record.cell.strategy);
            let asks_every_ns = record.asks_every_ns;
            let intervals = rows.entry((size, burst, strategy)).or_default();
            let row = intervals.entry(asks_every_ns).or_insert_with(|| Self {
                size,
                burst,
                strategy,
                asks_every_ns,
                per_s: Vec::new(),
                nothing: 0,
                ceilings: 0,
            });
            row.per_s.extend(record.capacity().map(|probe| probe.applied_per_s));
            row.nothing += u32::from(record.end() == SearchEnd::Nothing);
            row.ceilings += u32::from(record.end() == SearchEnd::Ceiling);
        }
        let best = |intervals: BTreeMap<Option<u64>, Self>| {
            intervals
                .into_values()
                .map(|mut row| {
                    row.per_s.sort_by(f64::total_cmp);
                    row
                })
                .max_by(|one, other| {
                    let [one, other] = [one, other].map(|row| row.median().unwrap_or(0.0));
                    one.total_cmp(&other)
                })
        };
        rows.into_values().filter_map(best).collect()
    }

    /// The block in the middle, of two the lower; `None` if no block bore any load.
    #[must_use]
    pub fn median(&self) -> Option<f64> {
        self.per_s.get(self.per_s.len().saturating_sub(1) / 2).copied()
    }

    /// From the lowest block to the highest, where there are several.
    #[must_use]
    pub fn range(&self) -> Option<(f64, f64)> {
        let range = self.per_s.first().copied().zip(self.per_s.last().copied());
        range.filter(|_| self.per_s.len() > 1)
    }
}

#[cfg(test)]
mod tests {
    use super::Borne;
    use crate::results::load::{CapacityRecord, Probe, Saturation};
    use crate::results::record::Cell;
    use shared_types::wire::StrategyKind;

    fn record(
        strategy: StrategyKind,
        block: u32,
        asks: Option<u64>,
        rates: &[f64],
    ) -> CapacityRecord {
        let probe = |(index, &applied_per_s): (usize, &f64)| Probe {
            offered_per_s: applied_per_s,
            applied_per_s,
            applied_share: 1.0,
            lag_p99_ns: None,
            fleet_cpu_ns: 1,
            saturated: (index + 1 == rates.len()).then_some(Saturation::Lag),
        };
        CapacityRecord {
            cell: Cell { block, size: 3, strategy },
            place: 0,
            asks_every_ns: asks,
            burst: 1,
            probes: rates.iter().enumerate().map(probe).collect(),
            borne: rates.len().checked_sub(2),
        }
    }

    #[test]
    fn blocks_have_a_median_and_a_centre_its_best_interval() {
        let (boundary, central) = (StrategyKind::Boundary, StrategyKind::Central);
        let borne = Borne::of(&[
            record(boundary, 0, None, &[10.0, 40.0, 80.0]),
            record(boundary, 1, None, &[10.0, 20.0, 40.0]),
            record(boundary, 2, None, &[10.0, 30.0, 40.0]),
            record(boundary, 3, None, &[10.0]),
            record(central, 0, Some(1), &[5.0, 9.0]),
            record(central, 0, Some(9), &[7.0, 9.0]),
        ]);
        let of = |strategy| borne.iter().find(|row| row.strategy == strategy).expect("searched");
        assert_eq!(of(boundary).median(), Some(30.0));
        assert_eq!(of(boundary).range(), Some((20.0, 40.0)));
        assert_eq!((of(boundary).nothing, of(boundary).ceilings), (1, 0));
        assert_eq!((of(central).asks_every_ns, of(central).median()), (Some(9), Some(7.0)));
        assert_eq!(of(central).range(), None, "one block has no range");
    }
}
