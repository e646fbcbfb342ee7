//! What is timed in a block, and in which order.
//!
//! A host drifts within a block, and a cell runs warmer after some neighbours than after others. So
//! the order is drawn, and balanced over blocks after Williams (1949): in as many blocks as there are
//! labels each label stands once at every place, and, where their number is even, follows every other
//! label once; where it is odd, in twice as many. Not here: who draws placement (`crate::launch`).

use crate::results::pairs::base_of;
use crate::results::record::Label;
use shared_types::rng::Stream;
use shared_types::wire::StrategyKind;

/// What is timed: every strategy, and where there is something to compare and more than one of
/// `blocks`, which alone carry a comparison, the one that all others are
/// compared with once more, under a second label; with `controls` also as [`Label::CONTROLS`].
#[must_use]
pub fn labels(strategies: &[StrategyKind], blocks: u32, controls: bool) -> Vec<Label> {
    let mut labels: Vec<Label> = strategies.iter().copied().map(Label::first).collect();
    let candidates = strategies.iter().filter(|&&strategy| strategy != StrategyKind::Null);
    if candidates.count() > 1
        && blocks > 1
        && let Some(strategy) = base_of(strategies)
    {
        let controls = if controls { &Label::CONTROLS[..] } else { &[] };
        let entries = std::iter::once(1).chain(controls.iter().copied());
        labels.extend(entries.map(|again| Label { strategy, again }));
    }
    labels
}

/// The order of `labels` in each of `blocks` blocks.
#[must_use]
pub fn balanced_orders<T: Copy>(labels: &[T], blocks: u32, stream: &mut Stream) -> Vec<Vec<T>> {
    let count = labels.len();
    let (mut drawn, mut shifts) = (labels.to_vec(), Vec::new());
    stream.shuffle(&mut drawn);
    (0..blocks as usize)
        .map(|block| {
            if block.is_multiple_of(count.max(1)) {
                shifts = (0..count).collect();
                stream.shuffle(&mut shifts);
            }
            let is_mirrored = (block / count.max(1)) % 2 == 1;
            let place_of = |place: usize| if is_mirrored { count - 1 - place } else { place };
            let of_place =
                |place| drawn[(zigzag(place_of(place), count) + shifts[block % count]) % count];
            (0..count).map(of_place).collect()
        })
        .collect()
}

/// 0, 1, n - 1, 2, n - 2, ...: all distances between neighbours differ.
const fn zigzag(place: usize, count: usize) -> usize {
    if place.is_multiple_of(2) { (count - place / 2) % count } else { place.div_ceil(2) }
}

#[cfg(test)]
mod tests {
    use super::{balanced_orders, labels};
    use crate::results::record::Label;
    use shared_types::rng::{Purpose, Stream};
    use shared_types::wire::StrategyKind;
    use std::collections::BTreeMap;

    fn orders(count: usize, blocks: u32) -> Vec<Vec<Label>> {
        let labels: Vec<Label> =
            StrategyKind::ALL[..count].iter().copied().map(Label::first).collect();
        balanced_orders(&labels, blocks, &mut Stream::new(7, 0, Purpose::Order, 3))
    }

    #[test]
    fn every_label_stands_at_every_place_and_follows_every_other_equally_often() {
        for (count, blocks, follows) in [(8, 8, 1), (7, 14, 2), (2, 2, 1)] {
            let (mut places, mut pairs) = (BTreeMap::new(), BTreeMap::new());
            for order in orders(count, blocks) {
                for (place, &label) in order.iter().enumerate() {
                    *places.entry((place, label)).or_insert(0) += 1;
                }
                for pair in order.windows(2) {
                    *pairs.entry((pair[0], pair[1])).or_insert(0) += 1;
                }
            }
            let at_each_place = blocks as usize / count;
            assert_eq!(places.len(), count * count);
            assert!(places.values().all(|&times| times == at_each_place), "{places:?}");
            assert_eq!(pairs.len(), count * (count - 1));
            assert!(pairs.values().all(|&times| times == follows), "{count}: {pairs:?}");
        }
    }

    #[test]
    fn orders_differ_between_blocks_and_come_from_the_seed() {
        let three = orders(8, 3);
        assert_eq!(three, orders(8, 9)[..3]);
        assert!(three[0] != three[1] && three[1] != three[2] && three[0] != three[2]);
        assert_eq!(orders(1, 2), vec![vec![Label::first(StrategyKind::ALL[0])]; 2]);
        assert_eq!(orders(0, 1), [Vec::new()]);
    }

    #[test]
    fn the_one_that_others_are_compared_with_enters_twice() {
        use StrategyKind::{Boundary, Full, Limited, Null};
        let again = |strategy| Label { strategy, again: 1 };
        assert_eq!(labels(&[Null, Full, Boundary], 2, false).last(), Some(&again(Boundary)));
        assert_eq!(labels(&[Limited, Full], 2, false).last(), Some(&again(Limited)));
        assert_eq!(labels(&[Null, Full, Boundary], 1, true).len(), 3, "one block compares nothing");
        assert_eq!(labels(&[Null, Full], 2, true).len(), 2, "nothing to compare with");
        let controls = labels(&[Null, Full, Boundary], 2, true);
        assert_eq!(controls.len(), 7);
        assert_eq!(controls.last().unwrap().planted_slowdown_percent(), 20);
        let slowed = controls.iter().filter(|label| label.planted_slowdown_percent() > 0);
        assert_eq!(slowed.count(), 1);
    }
}
