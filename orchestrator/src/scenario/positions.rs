//! Who can hear whom, by the crafts' positions.
//!
//! Which pairs must be in range of each other is decided here: those that share a boundary fact, and,
//! where a strategy relays, those next to each other in its tree. That `full` and `limited` also send to
//! crafts that share nothing is no reason to refuse a fleet. Not here: what samples suffer on the way,
//! the time over the distance included (`stated_link`).

use super::draft::Shared;
use super::error::{Finding, Place, place};
use super::fleet::Craft;
use nalgebra::Point3;
use shared_types::ids::CraftId;
use shared_types::knowledge::Topology;
use shared_types::scenario::Scenario;
use shared_types::wire::StrategyKind;

/// Range of every pair of crafts, computed when asked for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LinkTable {
    geometry: Option<Geometry>,
}

#[derive(Clone, Debug, PartialEq)]
struct Geometry {
    positions: Vec<Point3<f64>>,
    range_m: f64,
}

impl LinkTable {
    /// The table of a fleet.
    pub(super) fn new(scenario: &Scenario, crafts: &[Craft]) -> Result<Self, Finding> {
        let Some(stated) = &scenario.link.from_positions else {
            return Ok(Self { geometry: None });
        };
        let position = |(index, craft): (usize, &Craft)| {
            craft.position.map(Point3::from).ok_or_else(|| {
                let place = if scenario.craft.is_empty() {
                    place!["link", "from-positions"]
                } else {
                    place!["craft", index, "name"]
                };
                Finding::at(place, format!("`{}` has no position", craft.name))
                    .help(
                        "`link.from-positions` needs one of every craft: `position = [x, y, z]` in \
                         metres",
                    )
                    .label("no position")
            })
        };
        let positions = crafts.iter().enumerate().map(position).collect::<Result<_, _>>()?;
        Ok(Self { geometry: Some(Geometry { positions, range_m: stated.range_m }) })
    }

    /// Whether the two are too far apart to hear each other.
    #[must_use]
    pub fn is_out_of_range(&self, from: CraftId, to: CraftId) -> bool {
        self.geometry
            .as_ref()
            .is_some_and(|geometry| geometry.distance_m(from, to) > geometry.range_m)
    }

    /// Refuses a fleet in which two crafts that must communicate are out of range.
    pub(super) fn check_range(
        &self,
        crafts: &[Craft],
        shared: &[Shared],
        topology: &Topology,
        strategies: &[StrategyKind],
    ) -> Result<(), Finding> {
        if self.geometry.is_none() {
            return Ok(());
        }
        for Shared { sharers, place } in shared {
            for (index, &(one, _)) in sharers.iter().enumerate() {
                for &(other, _) in &sharers[index + 1..] {
                    self.check_pair(crafts, (one, other), place, "share a boundary fact")?;
                }
            }
        }
        let trees = [
            (StrategyKind::Hierarchy, &topology.parent, "are neighbours in the tree"),
            (
                StrategyKind::Hybrid,
                &topology.leader_parent,
                "are neighbours in the tree of leaders",
            ),
        ];
        for (strategy, parents, why) in trees {
            if !strategies.contains(&strategy) {
                continue;
            }
            for (craft, &parent) in parents.iter().enumerate() {
                if parent != CraftId::NONE.0 {
                    let pair = (CraftId(parent), CraftId::from_index(craft));
                    self.check_pair(crafts, pair, &place!["craft", craft, "position"], why)?;
                }
            }
        }
        Ok(())
    }

    fn check_pair(
        &self,
        crafts: &[Craft],
        (one, other): (CraftId, CraftId),
        place: &Place,
        why: &str,
    ) -> Result<(), Finding> {
        let Some(geometry) = self.geometry.as_ref().filter(|_| self.is_out_of_range(one, other))
        else {
            return Ok(());
        };
        let distance_m = geometry.distance_m(one, other);
        let (one, other) = (&crafts[one.index()].name, &crafts[other.index()].name);
        Err(Finding::at(place.clone(), format!("`{one}` and `{other}` {why} but are out of range"))
            .help(format!(
                "they are {distance_m:.0} m apart, `link.from-positions.range-m` is {:.0}: move them \
                 together or raise it to {:.0}",
                geometry.range_m,
                distance_m.ceil()
            ))
            .label("out of range"))
    }
}

impl Geometry {
    fn distance_m(&self, from: CraftId, to: CraftId) -> f64 {
        let position =
            |craft: CraftId| self.positions.get(craft.index()).unwrap_or(&self.positions[0]);
        nalgebra::distance(position(from), position(to))
    }
}
