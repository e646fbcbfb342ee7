//! What may become of a plan whose actions bring about what they presume with a likelihood each.
//!
//! Actions are independent. The likeliest outcome of all is the one in which each does what it is likelier
//! to do; every other turns some of them over, and is less likely by a factor for each. Those factors sum
//! up as logarithms, so the likeliest outcomes are the subsets of smallest sums, which are found one after
//! the other without looking at the rest.

use std::collections::BTreeSet;

/// One outcome of all actions.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// How likely it is.
    pub likelihood: f64,
    /// The actions, by place, that do not bring about what they presume; ascending.
    pub failing: Vec<usize>,
}

/// A set of turned actions, as places among those that can be turned over, cheapest first. Ordered by its
/// sum, whose bits are in its order because it is not below zero.
type Turned = (u64, Vec<usize>);

/// The `most` likeliest outcomes of actions of these `likelihoods` (above 0, at most 1), likeliest first.
#[must_use]
pub fn likeliest(likelihoods: &[f64], most: usize) -> Vec<Outcome> {
    // Certain actions cannot be turned over.
    let mut flips: Vec<(f64, usize)> = (0..)
        .zip(likelihoods)
        .filter(|&(_, &likelihood)| likelihood < 1.0)
        .map(|(place, &likelihood)| ((likelihood / (1.0 - likelihood)).ln().abs(), place))
        .collect();
    flips.sort_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)));
    let sum = |turned: &[usize]| turned.iter().map(|&at| flips[at].0).sum::<f64>();
    let mut open: BTreeSet<Turned> = BTreeSet::from([(0, Vec::new())]);
    let mut outcomes = Vec::new();
    while outcomes.len() < most
        && let Some((_, turned)) = open.pop_first()
    {
        outcomes.push(outcome(likelihoods, turned.iter().map(|&at| flips[at].1)));
        // Each set is made once: by moving its last member on, or by adding the one behind it.
        let next = turned.last().map_or(0, |&last| last + 1);
        if next < flips.len() {
            let mut more = turned.clone();
            more.push(next);
            open.insert((sum(&more).to_bits(), more));
            if let Some((_, others)) = turned.split_last() {
                let mut moved = others.to_vec();
                moved.push(next);
                open.insert((sum(&moved).to_bits(), moved));
            }
        }
    }
    outcomes
}

/// The outcome in which the actions `turned` do what they are less likely to do.
fn outcome(likelihoods: &[f64], turned: impl Iterator<Item = usize>) -> Outcome {
    let mut fails: Vec<bool> = likelihoods.iter().map(|&likelihood| likelihood < 0.5).collect();
    turned.for_each(|place| fails[place] = !fails[place]);
    let likelihood = likelihoods
        .iter()
        .zip(&fails)
        .map(|(&likelihood, &fails)| if fails { 1.0 - likelihood } else { likelihood })
        .product();
    let failing = (0..fails.len()).filter(|&place| fails[place]).collect();
    Outcome { likelihood, failing }
}

#[cfg(test)]
mod tests {
    use super::{Outcome, likeliest, outcome};
    use proptest::prelude::{ProptestConfig, prop_assert, prop_assert_eq, proptest};

    /// All outcomes, one after the other.
    fn exhaustive(likelihoods: &[f64]) -> Vec<Outcome> {
        let count = likelihoods.len();
        let sets = (0_u32..1 << count)
            .map(|set| (0..count).filter(|place| set >> place & 1 == 1).collect::<Vec<_>>());
        let mut outcomes: Vec<Outcome> =
            sets.map(|set| outcome(likelihoods, set.into_iter())).collect();
        outcomes.retain(|outcome| outcome.likelihood > 0.0);
        outcomes.sort_by(|one, other| other.likelihood.total_cmp(&one.likelihood));
        outcomes
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(1000))]

        #[test]
        fn the_likeliest_come_first(
            percents in proptest::collection::vec(1_u32..=100, 0..9),
            most in 0_usize..40,
        ) {
            let likelihoods: Vec<f64> =
                percents.iter().map(|&percent| f64::from(percent) / 100.0).collect();
            let (found, all) = (likeliest(&likelihoods, most), exhaustive(&likelihoods));
            prop_assert_eq!(found.len(), most.min(all.len()));
            for (one, other) in found.iter().zip(&all) {
                prop_assert!((one.likelihood - other.likelihood).abs() < 1e-12, "{one:?} {other:?}");
                prop_assert!(all.iter().any(|other| other.failing == one.failing));
            }
            let sets: std::collections::BTreeSet<_> =
                found.iter().map(|outcome| &outcome.failing).collect();
            prop_assert_eq!(sets.len(), found.len(), "each comes once");
        }
    }

    #[test]
    fn certain_actions_never_fail() {
        let found = likeliest(&[1.0, 0.9, 1.0], 9);
        let failing: Vec<_> = found.iter().map(|outcome| outcome.failing.clone()).collect();
        assert_eq!(failing, [vec![], vec![1]]);
        assert!((found[1].likelihood - 0.1).abs() < 1e-12);
        assert_eq!(likeliest(&[], 3), [Outcome { likelihood: 1.0, failing: vec![] }]);
    }
}
