//! A board over a [`Grid`]: two bits a fact, a count a region, and what is pending.
//!
//! Nothing is kept per rule. A rule becomes pending at the moment at which the last of its premises
//! begins to hold, and leaves when it is run; whoever writes a premise again after it was taken back
//! makes it pending again. Blocks of the pending set exist only where something is pending, so a board
//! of six million facts takes 1.5 MB and what is going on.

use shared_types::ids::{ActionId, FactId, Firing, RuleId};
use shared_types::knowledge::Value;
use shared_types::knowledge::grid::{Grid, GridRule};

/// Facts of one word.
const FACTS_PER_WORD: u32 = 32;

/// Words of one block of the pending set.
const BLOCK_WORDS: usize = 32;
const BLOCK_BITS: u32 = 64 * 32;

/// What is pending: firings, rules before actions.
#[derive(Clone, Debug)]
struct Pending {
    blocks: Vec<Option<Box<[u64; BLOCK_WORDS]>>>,
    counts: Vec<u32>,
    total: u32,
}

impl Pending {
    fn new(bound: u32) -> Self {
        let blocks = bound.div_ceil(BLOCK_BITS) as usize;
        Self { blocks: vec![None; blocks], counts: vec![0; blocks], total: 0 }
    }

    fn insert(&mut self, member: u32) {
        let (block, bit) = ((member / BLOCK_BITS) as usize, member % BLOCK_BITS);
        let words = self.blocks[block].get_or_insert_with(|| Box::new([0; BLOCK_WORDS]));
        let (word, mask) = (&mut words[(bit / 64) as usize], 1_u64 << (bit % 64));
        if *word & mask == 0 {
            *word |= mask;
            self.counts[block] += 1;
            self.total += 1;
        }
    }

    fn remove(&mut self, member: u32) {
        let (block, bit) = ((member / BLOCK_BITS) as usize, member % BLOCK_BITS);
        let Some(words) = &mut self.blocks[block] else { return };
        let (word, mask) = (&mut words[(bit / 64) as usize], 1_u64 << (bit % 64));
        if *word & mask != 0 {
            *word &= !mask;
            self.counts[block] -= 1;
            self.total -= 1;
            if self.counts[block] == 0 {
                self.blocks[block] = None;
            }
        }
    }

    fn select(&self, rank: u32) -> u32 {
        assert!(rank < self.total, "invariant: a draw stays below the number of candidates");
        let (mut left, mut block) = (rank, 0);
        while self.counts[block] <= left {
            left -= self.counts[block];
            block += 1;
        }
        let words = self.blocks[block].as_ref().expect("invariant: counted members have a block");
        let mut number = u32::try_from(block).unwrap_or(u32::MAX) * BLOCK_BITS;
        for &word in words.iter() {
            if left < word.count_ones() {
                let mut rest = word;
                (0..left).for_each(|_| rest &= rest - 1);
                return number + rest.trailing_zeros();
            }
            left -= word.count_ones();
            number += 64;
        }
        unreachable!("invariant: a block holds as many members as it counts")
    }
}

/// The state of one board.
#[derive(Clone, Debug)]
pub struct GridBoard {
    grid: Grid,
    values: Vec<u64>,
    /// Cells that are targets, by region.
    targets: Vec<u32>,
    pending: Pending,
}

impl GridBoard {
    /// A board that knows nothing.
    #[must_use]
    pub fn new(grid: Grid) -> Self {
        Self {
            values: vec![0; grid.fact_count().div_ceil(FACTS_PER_WORD) as usize],
            targets: vec![0; grid.regions() as usize],
            pending: Pending::new(grid.rule_count() + grid.action_count()),
            grid,
        }
    }

    /// Bytes that the board takes, what is pending included.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let blocks = self.pending.blocks.iter().flatten().count();
        size_of::<Self>()
            + size_of_val(self.values.as_slice())
            + size_of_val(self.targets.as_slice())
            + size_of_val(self.pending.blocks.as_slice())
            + size_of_val(self.pending.counts.as_slice())
            + blocks * size_of::<[u64; BLOCK_WORDS]>()
    }

    /// What the board holds of `fact`.
    #[inline]
    #[must_use]
    pub fn value(&self, fact: FactId) -> Value {
        let word = self.values[(fact.0 / FACTS_PER_WORD) as usize];
        match word >> (2 * (fact.0 % FACTS_PER_WORD)) & 3 {
            0 => Value::Unknown,
            1 => Value::Asserted,
            _ => Value::Absent,
        }
    }

    /// Writes `fact`; returns whether that altered its value. A condition that is found absent takes
    /// back what was pending on it.
    pub fn write(&mut self, fact: FactId, value: Value) -> bool {
        let before = self.value(fact);
        if before == value {
            return false;
        }
        let shift = 2 * (fact.0 % FACTS_PER_WORD);
        let word = &mut self.values[(fact.0 / FACTS_PER_WORD) as usize];
        *word = *word & !(3 << shift) | (value as u64) << shift;
        if let Some(rule) = self.grid.reader(fact) {
            if value == Value::Asserted && self.can_run(rule) {
                self.pending.insert(rule.0);
            } else if before == Value::Asserted {
                self.pending.remove(rule.0);
            }
        }
        true
    }

    /// How many rules and actions could be run now.
    #[inline]
    #[must_use]
    pub const fn candidate_count(&self) -> u32 {
        self.pending.total
    }

    /// The candidate of rank `rank`, rules before actions.
    ///
    /// # Panics
    /// If there are not that many.
    #[must_use]
    pub fn candidate(&self, rank: u32) -> Firing {
        Firing(self.pending.select(rank))
    }

    /// Runs a candidate: a survey's rule makes the survey pending, a survey finds what is presumed, a
    /// target counts for its region. Returns the fact that it wrote, if any.
    pub fn fire(&mut self, firing: Firing) -> Option<FactId> {
        self.pending.remove(firing.0);
        let rules = self.grid.rule_count();
        if firing.0 >= rules {
            let found = self.grid.find(ActionId(firing.0 - rules))?;
            self.write(found, Value::Asserted);
            return Some(found);
        }
        match self.grid.rule(RuleId(firing.0)) {
            GridRule::Survey { .. } => {
                self.pending.insert(rules + firing.0);
                None
            }
            GridRule::Target { cell } => {
                let region = self.grid.region_of(cell);
                self.targets[region as usize] += 1;
                if self.targets[region as usize] < self.grid.targets_needed() {
                    return None;
                }
                let suitable = self.grid.suitable(region);
                self.write(suitable, Value::Asserted);
                Some(suitable)
            }
            GridRule::Complete { .. } => {
                self.write(self.grid.complete(), Value::Asserted);
                Some(self.grid.complete())
            }
        }
    }

    /// Whether `firing` can still lead to the mission's end, worked backwards from it: the mission is
    /// open, and the cell that it is about can still become a target.
    #[must_use]
    pub fn is_relevant(&self, firing: Firing) -> bool {
        if self.value(self.grid.complete()) == Value::Asserted {
            return false;
        }
        let rules = self.grid.rule_count();
        let rule = if firing.0 >= rules { firing.0 - rules } else { firing.0 };
        match self.grid.rule(RuleId(rule)) {
            GridRule::Survey { cell, .. } | GridRule::Target { cell } => {
                self.grid.is_promising(cell, |fact| self.value(fact))
            }
            GridRule::Complete { .. } => true,
        }
    }

    fn can_run(&self, rule: RuleId) -> bool {
        match self.grid.rule(rule) {
            GridRule::Survey { .. } | GridRule::Complete { .. } => true,
            GridRule::Target { cell } => [3, 6].into_iter().all(|condition| {
                self.value(self.grid.condition(cell, condition)) == Value::Asserted
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Grid, GridBoard};
    use crate::blackboard::Blackboard;
    use proptest::prelude::{ProptestConfig, any, proptest};
    use proptest::prop_assert_eq;
    use shared_types::ids::{CraftId, Firing};
    use shared_types::knowledge::{Literal, Value};
    use shared_types::rng::{Purpose, Stream};

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]

        #[test]
        fn a_family_fires_what_the_network_written_out_fires(seed in any::<u64>()) {
            let grid = Grid::new(6, 4, 2, 1).unwrap();
            let network = grid.written_out();
            let view = network.view();
            let (mut written_out, mut family) = (Blackboard::default(), GridBoard::new(grid));
            written_out.reset(&view);
            let mut stream = Stream::new(seed, 0, Purpose::Test, 4);
            let mut changes = Vec::new();
            for _ in 0..200 {
                if stream.below(3) == 0 {
                    // Orbital data: the first and the fourth condition of some cell.
                    let cell = stream.below(grid.cells());
                    let fact = grid.condition(cell, [1, 4][stream.below(2) as usize]);
                    written_out.write(&view, CraftId(0), Literal::holds(fact));
                    family.write(fact, Value::Asserted);
                }
                prop_assert_eq!(family.candidate_count(), written_out.candidate_count());
                if family.candidate_count() == 0 {
                    continue;
                }
                let rank = stream.below(family.candidate_count());
                let firing = family.candidate(rank);
                prop_assert_eq!(firing, written_out.candidate(rank));
                written_out.fire(&view, CraftId(0), firing, &mut changes);
                let wrote = family.fire(firing);
                prop_assert_eq!(wrote, changes.first().map(|change| change.fact));
            }
            for fact in (0..grid.fact_count()).map(shared_types::ids::FactId) {
                prop_assert_eq!(family.value(fact), written_out.state(fact).value);
            }
        }
    }

    /// Runs everything that is pending and relevant, lowest first.
    fn run(board: &mut GridBoard) {
        let mut rank = 0;
        while rank < board.candidate_count() {
            let firing = board.candidate(rank);
            if board.is_relevant(firing) {
                board.fire(firing);
                rank = 0;
            } else {
                rank += 1;
            }
        }
    }

    #[test]
    fn a_region_needs_its_number_of_targets() {
        let grid = Grid::new(4, 4, 2, 2).unwrap();
        let mut board = GridBoard::new(grid);
        let survey = |board: &mut GridBoard, cell| {
            for condition in [1, 4] {
                board.write(grid.condition(cell, condition), Value::Asserted);
            }
            run(board);
        };
        survey(&mut board, grid.cell(0, 0));
        survey(&mut board, grid.cell(3, 3));
        assert_eq!(board.value(grid.suitable(0)), Value::Unknown, "one target each");
        survey(&mut board, grid.cell(1, 1));
        assert_eq!(board.value(grid.suitable(0)), Value::Asserted);
        assert_eq!(board.value(grid.complete()), Value::Asserted);
        assert_eq!(board.candidate_count(), 0);
    }

    #[test]
    fn what_rests_on_an_absent_condition_is_tasked_no_more() {
        let grid = Grid::new(4, 4, 2, 1).unwrap();
        let mut board = GridBoard::new(grid);
        for condition in [1, 4] {
            board.write(grid.condition(5, condition), Value::Asserted);
        }
        assert_eq!(board.candidate_count(), 2);
        board.write(grid.condition(5, 2), Value::Absent);
        assert!(!board.is_relevant(board.candidate(0)), "the other way cannot make it a target");
        board.write(grid.condition(5, 1), Value::Absent);
        assert_eq!(board.candidate_count(), 1);
        assert!(!board.is_relevant(Firing(board.candidate(0).0)));
        run(&mut board);
        assert_eq!(board.value(grid.complete()), Value::Unknown);
    }

    #[test]
    fn a_board_of_six_million_facts_fits_two_megabytes() {
        let grid = Grid::new(1000, 1000, 100, 5).unwrap();
        let mut board = GridBoard::new(grid);
        board.write(grid.condition(grid.cell(999, 999), 1), Value::Asserted);
        assert!(board.bytes() <= 2 << 20, "{} bytes", board.bytes());
        assert_eq!(board.candidate_count(), 1);
    }
}
