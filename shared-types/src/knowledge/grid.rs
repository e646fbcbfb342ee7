//! The mission network of a surveyed grid (Straub 2016, chapter VIII), as a family of rules that are
//! computed from a cell's number, not stored: 6,000,101 facts and 5,000,100 rules at 1000 by 1000 cells
//! are seven numbers.
//!
//! A cell has six conditions. Orbital data for the first leads to an aerial survey, its presumed find
//! (the second condition) to a ground survey, whose presumed find is the third; likewise the fourth,
//! fifth and sixth. The third and sixth together make the cell a target; enough targets make its region
//! suitable, and a suitable region completes the mission. Not here: what a board holds of it
//! (`agent::blackboard::grid`).

use super::board::BoardNetwork;
use super::fact::Value;
use super::{Csr, Literal};
use crate::ids::{ActionId, FactId, RuleId};

/// Conditions of a cell.
pub const CONDITIONS: u32 = 6;

/// Rules of a cell: four surveys and the target.
pub const RULES_PER_CELL: u32 = 5;

/// Place of the target's rule among those of its cell.
const TARGET: u32 = 4;

/// By place among a cell's rules: the condition that a survey starts from; the next one is its find.
const STARTS: [u32; 4] = [1, 2, 4, 5];

/// Why there is no such grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GridError {
    /// No cells, or too many for ids of 32 bits.
    #[error("a grid of {width} by {height} cells: 1 to 100,000,000 cells are possible")]
    Size {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// Regions that do not cover the grid.
    #[error("regions of {region} by {region} cells do not cover a grid of {width} by {height}")]
    Region {
        /// Cells along a region's side.
        region: u32,
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// A region without targets would be suitable at once.
    #[error("a region needs at least 1 target to be suitable")]
    NoTargets,
}

/// Most cells of a grid.
const CELLS_MAX: u64 = 100_000_000;

/// A grid and what its regions need.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    width: u32,
    height: u32,
    region: u32,
    targets_needed: u32,
}

/// What a rule is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GridRule {
    /// A survey of a cell, by its place 0 to 3.
    Survey {
        /// The cell.
        cell: u32,
        /// Which of its surveys.
        place: u32,
    },
    /// The third and the sixth condition make the cell a target.
    Target {
        /// The cell.
        cell: u32,
    },
    /// A suitable region completes the mission.
    Complete {
        /// The region.
        region: u32,
    },
}

impl Grid {
    /// A grid of `width` by `height` cells, in square regions of `region` cells a side, each suitable
    /// with `targets_needed` targets.
    ///
    /// # Errors
    /// If there are no cells or too many, regions do not divide it, or need no target.
    pub const fn new(
        width: u32,
        height: u32,
        region: u32,
        targets_needed: u32,
    ) -> Result<Self, GridError> {
        let cells = width as u64 * height as u64;
        if cells == 0 || cells > CELLS_MAX {
            return Err(GridError::Size { width, height });
        }
        let divides = region > 0 && width.is_multiple_of(region) && height.is_multiple_of(region);
        if !divides {
            return Err(GridError::Region { region, width, height });
        }
        if targets_needed == 0 {
            return Err(GridError::NoTargets);
        }
        Ok(Self { width, height, region, targets_needed })
    }

    /// Cells.
    #[inline]
    #[must_use]
    pub const fn cells(&self) -> u32 {
        self.width * self.height
    }

    /// Regions.
    #[inline]
    #[must_use]
    pub const fn regions(&self) -> u32 {
        self.cells() / (self.region * self.region)
    }

    /// Targets that make a region suitable.
    #[inline]
    #[must_use]
    pub const fn targets_needed(&self) -> u32 {
        self.targets_needed
    }

    /// The cell in column `x` and row `y`.
    #[inline]
    #[must_use]
    pub const fn cell(&self, x: u32, y: u32) -> u32 {
        x * self.height + y
    }

    /// The region of `cell`.
    #[inline]
    #[must_use]
    pub const fn region_of(&self, cell: u32) -> u32 {
        let (x, y) = (cell / self.height, cell % self.height);
        x / self.region * (self.height / self.region) + y / self.region
    }

    /// The fact that condition `condition` (1 to 6) holds in `cell`.
    #[inline]
    #[must_use]
    pub const fn condition(&self, cell: u32, condition: u32) -> FactId {
        FactId((condition - 1) * self.cells() + cell)
    }

    /// The fact that `region` is suitable.
    #[inline]
    #[must_use]
    pub const fn suitable(&self, region: u32) -> FactId {
        FactId(CONDITIONS * self.cells() + region)
    }

    /// The fact that the mission is complete.
    #[inline]
    #[must_use]
    pub const fn complete(&self) -> FactId {
        FactId(CONDITIONS * self.cells() + self.regions())
    }

    /// Facts.
    #[inline]
    #[must_use]
    pub const fn fact_count(&self) -> u32 {
        self.complete().0 + 1
    }

    /// Rules.
    #[inline]
    #[must_use]
    pub const fn rule_count(&self) -> u32 {
        RULES_PER_CELL * self.cells() + self.regions()
    }

    /// Actions: numbers 5 cell + 0 to 3 are surveys, 5 cell + 4 is none.
    #[inline]
    #[must_use]
    pub const fn action_count(&self) -> u32 {
        RULES_PER_CELL * self.cells()
    }

    /// Cell and condition (1 to 6) of a fact; `None` for those of regions and of the mission.
    #[inline]
    #[must_use]
    pub const fn cell_of(&self, fact: FactId) -> Option<(u32, u32)> {
        let cells = self.cells();
        if fact.0 < CONDITIONS * cells { Some((fact.0 % cells, fact.0 / cells + 1)) } else { None }
    }

    /// The rule that reads `fact`; none does when the mission is complete.
    #[inline]
    #[must_use]
    pub const fn reader(&self, fact: FactId) -> Option<RuleId> {
        let place = match self.cell_of(fact) {
            Some((_, 1)) => 0,
            Some((_, 2)) => 1,
            Some((_, 4)) => 2,
            Some((_, 5)) => 3,
            Some(_) => TARGET,
            None if fact.0 == self.complete().0 => return None,
            None => {
                let region = fact.0 - CONDITIONS * self.cells();
                return Some(RuleId(RULES_PER_CELL * self.cells() + region));
            }
        };
        Some(RuleId(RULES_PER_CELL * (fact.0 % self.cells()) + place))
    }

    /// What `rule` is about.
    #[inline]
    #[must_use]
    pub const fn rule(&self, rule: RuleId) -> GridRule {
        let (cell, place) = (rule.0 / RULES_PER_CELL, rule.0 % RULES_PER_CELL);
        if cell >= self.cells() {
            GridRule::Complete { region: rule.0 - RULES_PER_CELL * self.cells() }
        } else if place == TARGET {
            GridRule::Target { cell }
        } else {
            GridRule::Survey { cell, place }
        }
    }

    /// What survey `action` is presumed to find; `None` for the numbers that are no survey.
    #[inline]
    #[must_use]
    pub const fn find(&self, action: ActionId) -> Option<FactId> {
        let (cell, place) = (action.0 / RULES_PER_CELL, action.0 % RULES_PER_CELL);
        if place == TARGET || cell >= self.cells() {
            return None;
        }
        Some(self.condition(cell, STARTS[place as usize] + 1))
    }

    /// The fact that survey `place` of `cell` starts from.
    #[inline]
    #[must_use]
    pub const fn start(&self, cell: u32, place: u32) -> FactId {
        self.condition(cell, STARTS[place as usize])
    }

    /// Whether `cell` can still become a target where facts have the values that `value` says: no
    /// condition on either way to it is known absent.
    #[must_use]
    pub fn is_promising(&self, cell: u32, value: impl Fn(FactId) -> Value) -> bool {
        let can_hold = |condition| value(self.condition(cell, condition)) != Value::Absent;
        // A way is done for where its end is absent, or is unknown and an earlier condition is absent.
        let way_is_open = |conditions: [u32; 3]| {
            value(self.condition(cell, conditions[2])) == Value::Asserted
                || conditions.into_iter().all(can_hold)
        };
        way_is_open([1, 2, 3]) && way_is_open([4, 5, 6])
    }

    /// The same network written out, for a region that needs one target only: a rule that counts cannot
    /// be written out.
    ///
    /// # Panics
    /// If regions need more than one target.
    #[must_use]
    pub fn written_out(&self) -> BoardNetwork {
        assert_eq!(self.targets_needed, 1, "invariant: only single targets can be written out");
        let holds = |fact: FactId| Literal::holds(fact).0;
        let mut board = BoardNetwork { fact_count: self.fact_count(), ..BoardNetwork::default() };
        for rule in (0..self.rule_count()).map(RuleId) {
            match self.rule(rule) {
                GridRule::Survey { cell, place } => {
                    board.premises.push_row([holds(self.start(cell, place))]);
                    board.outputs.push_row([]);
                    board.queues.push_row([rule.0]);
                }
                GridRule::Target { cell } => {
                    let premises = [3, 6].map(|condition| holds(self.condition(cell, condition)));
                    board.premises.push_row(premises);
                    board.outputs.push_row([holds(self.suitable(self.region_of(cell)))]);
                    board.queues.push_row([]);
                }
                GridRule::Complete { region } => {
                    board.premises.push_row([holds(self.suitable(region))]);
                    board.outputs.push_row([holds(self.complete())]);
                    board.queues.push_row([]);
                }
            }
        }
        for action in (0..self.action_count()).map(ActionId) {
            board.action_outputs.push_row(self.find(action).map(holds));
        }
        board.links = Csr::from_pairs(board.fact_count as usize, &[]);
        board.finals = vec![self.complete().0];
        board.index_readers();
        board
    }
}

#[cfg(test)]
mod tests {
    use super::{Grid, GridError, GridRule};
    use crate::ids::{ActionId, FactId, RuleId};

    #[test]
    fn the_published_grid_has_the_published_numbers() {
        let grid = Grid::new(1000, 1000, 100, 5).unwrap();
        assert_eq!((grid.fact_count(), grid.rule_count()), (6_000_101, 5_000_100));
        assert_eq!(grid.regions(), 100);
        let cell = grid.cell(3, 7);
        assert_eq!(cell, 3007);
        assert_eq!(grid.condition(cell, 4), FactId(3_003_007));
        assert_eq!(grid.suitable(0), FactId(6_000_000));
        assert_eq!(grid.complete(), FactId(6_000_100));
        assert_eq!(grid.find(ActionId(5 * cell + 1)), Some(grid.condition(cell, 3)));
        assert_eq!(grid.find(ActionId(5 * cell + 4)), None);
    }

    #[test]
    fn the_readers_computed_are_those_written_out() {
        let grid = Grid::new(6, 4, 2, 1).unwrap();
        let board = grid.written_out();
        let view = board.view();
        assert!(view.is_valid(1));
        for fact in (0..grid.fact_count()).map(FactId) {
            let computed: Vec<u32> =
                grid.reader(fact).into_iter().map(|rule| rule.0 << 1).collect();
            assert_eq!(view.readers.row(fact.index()), computed, "{fact}");
        }
        let regions: Vec<u32> = (0..grid.cells()).map(|cell| grid.region_of(cell)).collect();
        assert!((0..grid.regions()).all(|r| regions.iter().filter(|&&one| one == r).count() == 4));
        assert_eq!(grid.rule(RuleId(5 * 24 + 2)), GridRule::Complete { region: 2 });
    }

    #[test]
    fn impossible_grids_are_refused() {
        let refused =
            |width, height, region, needed| Grid::new(width, height, region, needed).unwrap_err();
        assert_eq!(refused(0, 5, 1, 1), GridError::Size { width: 0, height: 5 });
        assert!(matches!(refused(100_000, 100_000, 1, 1), GridError::Size { .. }));
        assert!(matches!(refused(10, 10, 3, 1), GridError::Region { .. }));
        assert!(matches!(refused(10, 10, 0, 1), GridError::Region { .. }));
        assert_eq!(refused(10, 10, 5, 0), GridError::NoTargets);
    }
}
