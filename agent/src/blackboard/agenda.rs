//! Sets of rules and actions as bits; the agenda also finds its k-th member quickly.

/// Words of one block of the agenda: 2,048 members share one counter.
const BLOCK_WORDS: usize = 32;

/// A set of small numbers.
#[derive(Clone, Debug, Default)]
pub struct BitSet {
    words: Vec<u64>,
}

impl BitSet {
    /// Empties the set and makes room for the numbers `0..bound`.
    pub fn reset(&mut self, bound: usize) {
        self.words.clear();
        self.words.resize(bound.div_ceil(64), 0);
    }

    /// Whether `member` is in the set.
    #[inline]
    #[must_use]
    pub fn contains(&self, member: usize) -> bool {
        self.words[member / 64] & (1 << (member % 64)) != 0
    }

    /// Adds `member`; returns whether it was missing.
    #[inline]
    pub fn insert(&mut self, member: usize) -> bool {
        let (word, bit) = (&mut self.words[member / 64], 1_u64 << (member % 64));
        let is_new = *word & bit == 0;
        *word |= bit;
        is_new
    }

    /// Removes `member`; returns whether it was there.
    #[inline]
    pub fn remove(&mut self, member: usize) -> bool {
        let (word, bit) = (&mut self.words[member / 64], 1_u64 << (member % 64));
        let was_there = *word & bit != 0;
        *word &= !bit;
        was_there
    }
}

/// The candidates: a set that knows its size and its k-th member in id order.
#[derive(Clone, Debug, Default)]
pub struct Agenda {
    members: BitSet,
    /// Members per block.
    counts: Vec<u32>,
    total: u32,
}

impl Agenda {
    /// Empties the agenda and makes room for the numbers `0..bound`.
    pub fn reset(&mut self, bound: usize) {
        self.members.reset(bound);
        self.counts.clear();
        self.counts.resize(bound.div_ceil(64 * BLOCK_WORDS), 0);
        self.total = 0;
    }

    /// How many members there are.
    #[inline]
    #[must_use]
    pub const fn len(&self) -> u32 {
        self.total
    }

    /// Whether there is none.
    #[inline]
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.total == 0
    }

    /// Adds a member, if it is missing.
    #[inline]
    pub fn insert(&mut self, member: usize) {
        if self.members.insert(member) {
            self.counts[member / (64 * BLOCK_WORDS)] += 1;
            self.total += 1;
        }
    }

    /// Removes a member, if it is there.
    #[inline]
    pub fn remove(&mut self, member: usize) {
        if self.members.remove(member) {
            self.counts[member / (64 * BLOCK_WORDS)] -= 1;
            self.total -= 1;
        }
    }

    /// Whether `member` is there.
    #[inline]
    #[must_use]
    pub fn contains(&self, member: usize) -> bool {
        self.members.contains(member)
    }

    /// The first member from `from` on.
    #[must_use]
    pub fn next(&self, from: usize) -> Option<u32> {
        let words = self.members.words.iter().enumerate().skip(from / 64);
        let ones = words.map(|(index, &word)| {
            let is_first = index == from / 64;
            (index, if is_first { word & (u64::MAX << (from % 64)) } else { word })
        });
        let (index, word) = ones.into_iter().find(|&(_, word)| word != 0)?;
        u32::try_from(index * 64 + word.trailing_zeros() as usize).ok()
    }

    /// The member that has `rank` smaller ones.
    ///
    /// # Panics
    /// If there are not that many members.
    #[must_use]
    pub fn select(&self, rank: u32) -> u32 {
        assert!(rank < self.total, "invariant: a draw stays below the number of candidates");
        let mut left = rank;
        let mut block = 0;
        while self.counts[block] <= left {
            left -= self.counts[block];
            block += 1;
        }
        let mut index = block * BLOCK_WORDS;
        loop {
            let word = self.members.words[index];
            let ones = word.count_ones();
            if left < ones {
                let number = index * 64 + nth_one(word, left);
                return u32::try_from(number).expect("invariant: tables stay below 2^32 rows");
            }
            left -= ones;
            index += 1;
        }
    }
}

/// The position of the one that has `rank` lower ones in `word`.
fn nth_one(word: u64, rank: u32) -> usize {
    let mut rest = word;
    for _ in 0..rank {
        rest &= rest - 1;
    }
    rest.trailing_zeros() as usize
}
