//! Compressed sparse rows: a table of lists as two flat arrays, so that a row is one slice.

use rkyv::{Archive, Deserialize, Serialize};
use zerocopy::{FromBytes, IntoBytes};

/// Row `i` is `items[starts[i]..starts[i + 1]]`; `starts` has one entry more than there are rows.
#[derive(Clone, Debug, PartialEq, Eq, Archive, Serialize, Deserialize)]
pub struct Csr {
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl Default for Csr {
    fn default() -> Self {
        Self { starts: vec![0], items: Vec::new() }
    }
}

impl Csr {
    /// An empty table with room for `rows` rows of `items` entries together.
    #[must_use]
    pub fn with_capacity(rows: usize, items: usize) -> Self {
        let mut starts = Vec::with_capacity(rows + 1);
        starts.push(0);
        Self { starts, items: Vec::with_capacity(items) }
    }

    /// Removes all rows and keeps the memory.
    pub fn clear(&mut self) {
        self.starts.truncate(1);
        self.items.clear();
    }

    /// Appends one entry to the row that [`Self::finish_row`] will close.
    #[inline]
    pub fn push_item(&mut self, item: u32) {
        self.items.push(item);
    }

    /// Closes the row of all entries pushed since the last call.
    ///
    /// # Panics
    /// If the table holds more than 2^32 entries.
    #[inline]
    pub fn finish_row(&mut self) {
        let end = u32::try_from(self.items.len()).expect("invariant: tables stay below 2^32 rows");
        self.starts.push(end);
    }

    /// Appends a whole row.
    pub fn push_row(&mut self, row: impl IntoIterator<Item = u32>) {
        self.items.extend(row);
        self.finish_row();
    }

    /// Makes the table one of rows of `lengths`, whose entries are 0 until [`Self::items_mut`] sets
    /// them; for tables that are drawn, where pushing costs more than the draws.
    ///
    /// # Panics
    /// If the table would hold 2^32 entries or more.
    pub fn set_rows(&mut self, lengths: impl Iterator<Item = u32>) {
        self.starts.truncate(1);
        let mut end = 0_u32;
        self.starts.extend(lengths.map(|length| {
            end = end.checked_add(length).expect("invariant: tables stay below 2^32 rows");
            end
        }));
        self.items.clear();
        self.items.resize(end as usize, 0);
    }

    /// All entries, row after row.
    #[inline]
    pub fn items_mut(&mut self) -> &mut [u32] {
        &mut self.items
    }

    /// Builds the table of `rows` rows from (row, item) pairs, keeping the order of the pairs within
    /// a row (a counting sort: linear in rows and pairs).
    ///
    /// # Panics
    /// If a pair names a row that does not exist.
    #[must_use]
    pub fn from_pairs(rows: usize, pairs: &[(u32, u32)]) -> Self {
        let mut table = Self::default();
        table.refill(rows, pairs.iter().map(|&(row, _)| row), pairs.iter().copied());
        table
    }

    /// As [`Self::from_pairs`], in the memory that the table has. `named` are the rows of the pairs,
    /// in any order: they can often be told faster than the pairs.
    ///
    /// # Panics
    /// If a pair names a row that does not exist, or a row that `named` does not.
    pub fn refill(
        &mut self,
        rows: usize,
        named: impl Iterator<Item = u32>,
        pairs: impl Iterator<Item = (u32, u32)>,
    ) {
        self.starts.clear();
        self.starts.resize(rows + 1, 0);
        let mut pair_count = 0;
        let counts = &mut self.starts[..rows];
        named.for_each(|row| {
            counts[row as usize] += 1;
            pair_count += 1;
        });
        let mut sum = 0;
        for start in &mut self.starts {
            sum += std::mem::replace(start, sum);
        }
        self.items.clear();
        self.items.resize(pair_count, 0);
        // Each start moves through its row while the row fills, and ends where the next row starts.
        let (starts, items) = (&mut self.starts[..rows], &mut self.items[..]);
        pairs.for_each(|(row, item)| {
            let next = &mut starts[row as usize];
            items[*next as usize] = item;
            *next += 1;
        });
        self.starts.copy_within(..rows, 1);
        self.starts[0] = 0;
    }

    /// Reads the table in place.
    #[inline]
    #[must_use]
    pub fn view(&self) -> CsrView<'_> {
        CsrView { starts: &self.starts, items: &self.items }
    }
}

impl ArchivedCsr {
    /// Reads the archived table in place.
    #[inline]
    #[must_use]
    pub fn view(&self) -> CsrView<'_> {
        CsrView { starts: numbers(&self.starts), items: numbers(&self.items) }
    }
}

/// The numbers of an archive as native ones. The archive is little-endian; so is every 64-bit Linux
/// that this crate builds for, hence the bytes are the numbers.
#[inline]
pub(super) fn numbers(archived: &[rend::u32_le]) -> &[u32] {
    const { assert!(cfg!(target_endian = "little"), "archives are read in place") };
    <[u32]>::ref_from_bytes(archived.as_bytes()).expect("invariant: u32_le has the layout of u32")
}

/// As [`numbers`], of 64 bits.
#[inline]
pub(super) fn words(archived: &[rend::u64_le]) -> &[u64] {
    <[u64]>::ref_from_bytes(archived.as_bytes()).expect("invariant: u64_le has the layout of u64")
}

/// A table of lists, read in place.
#[derive(Clone, Copy, Debug)]
pub struct CsrView<'a> {
    starts: &'a [u32],
    items: &'a [u32],
}

impl<'a> CsrView<'a> {
    /// How many rows there are.
    #[inline]
    #[must_use]
    pub fn row_count(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// How many entries all rows have together.
    #[inline]
    #[must_use]
    pub fn item_count(&self) -> usize {
        self.items.len()
    }

    /// All entries, row after row.
    #[inline]
    #[must_use]
    pub fn items(&self) -> &'a [u32] {
        self.items
    }

    /// Every row in order.
    #[inline]
    pub fn rows(&self) -> impl Iterator<Item = &'a [u32]> + use<'a> {
        let items = self.items;
        self.starts.windows(2).map(move |ends| &items[ends[0] as usize..ends[1] as usize])
    }

    /// How many entries each row has, in order.
    #[inline]
    pub fn lengths(&self) -> impl ExactSizeIterator<Item = u32> + use<'a> {
        self.starts.windows(2).map(|ends| ends[1] - ends[0])
    }

    /// Row `index`.
    ///
    /// # Panics
    /// If there is no such row.
    #[inline]
    #[must_use]
    pub fn row(&self, index: usize) -> &'a [u32] {
        &self.items[self.starts[index] as usize..self.starts[index + 1] as usize]
    }

    /// Whether the arrays form a table of `rows` rows whose entries all pass `item_is_valid`.
    #[must_use]
    pub fn is_valid(&self, rows: usize, item_is_valid: impl Fn(u32) -> bool) -> bool {
        self.starts.len() == rows + 1
            && self.starts.first() == Some(&0)
            && self.starts.windows(2).all(|pair| pair[0] <= pair[1])
            && self.starts.last().is_some_and(|&end| end as usize == self.items.len())
            && self.items.iter().all(|&item| item_is_valid(item))
    }
}

#[cfg(test)]
mod tests {
    use super::Csr;

    #[test]
    fn pairs_keep_their_order_within_a_row() {
        let table = Csr::from_pairs(4, &[(2, 7), (0, 1), (2, 5), (3, 9), (2, 7)]);
        let rows: Vec<&[u32]> = table.view().rows().collect();
        assert_eq!(rows, [&[1][..], &[], &[7, 5, 7], &[9]]);
        assert_eq!(table.view().row(2), [7, 5, 7]);
    }

    #[test]
    fn refilled_table_holds_nothing_of_what_it_held() {
        let mut table = Csr::from_pairs(4, &[(2, 7), (0, 1), (2, 5)]);
        table.set_rows([2, 0, 1].into_iter());
        table.items_mut().copy_from_slice(&[4, 5, 6]);
        assert_eq!(table.view().rows().collect::<Vec<_>>(), [&[4, 5][..], &[], &[6]]);
        table.refill(2, [1].into_iter(), [(1, 3)].into_iter());
        assert_eq!(table, Csr::from_pairs(2, &[(1, 3)]));
        table.clear();
        assert_eq!(table, Csr::default());
        table.refill(0, std::iter::empty(), std::iter::empty());
        assert_eq!(table, Csr::default());
    }
}
