//! What pruner and solvers made of many random networks: means, by condition.
//!
//! Not here: how networks are drawn and measured (`crate::networks`), and what the figures say of a
//! published mean (`crate::report::networks`).

use super::statistics::as_float;
use agent::reasoning::prune::Kinds;

/// Networks of one kind. Associations bound the lists of rules and actions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Condition {
    /// Rules of a network.
    pub rules: u32,
    /// Facts of a network.
    pub facts: u32,
    /// Actions of a network.
    pub actions: u32,
    /// One more than the longest list.
    pub associations: u32,
    /// Which kinds of elements the pruner takes away: facts, rules, actions.
    pub prunes: [bool; 3],
}

impl Condition {
    /// The condition that the others vary: a thousand of each, lists of up to two.
    pub const BASE: Self =
        Self { rules: 1000, facts: 1000, actions: 1000, associations: 3, prunes: [true; 3] };

    /// The kinds that are pruned.
    #[must_use]
    pub const fn kinds(&self) -> Kinds {
        let [facts, rules, actions] = self.prunes;
        Kinds { facts, rules, actions }
    }
}

/// A mean over networks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mean {
    sum: f64,
    sum_of_squares: f64,
    n: u64,
}

impl Mean {
    /// Adds a value.
    pub fn add(&mut self, value: f64) {
        self.sum += value;
        self.sum_of_squares += value * value;
        self.n += 1;
    }

    /// How many values there are.
    #[must_use]
    pub const fn n(&self) -> u64 {
        self.n
    }

    /// The mean; `None` of nothing.
    #[must_use]
    pub fn value(&self) -> Option<f64> {
        (self.n > 0).then(|| self.sum / as_float(self.n))
    }

    /// Where 95 % of means of as many values lie (normal approximation); `None` of less than two.
    #[must_use]
    pub fn range(&self) -> Option<(f64, f64)> {
        let (mean, n) = (self.value()?, as_float(self.n));
        let squares = (self.sum_of_squares - n * mean * mean).max(0.0);
        let error = 1.96 * (squares / (n - 1.0) / n).sqrt();
        (self.n > 1).then_some((mean - error, mean + error))
    }
}

/// What the solvers made of networks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Solved {
    /// Sweeps until nothing changes.
    pub iterations: Mean,
    /// Time of all sweeps, ns.
    pub populate_ns: Mean,
    /// Time to follow the path back, ns; of networks with a goal.
    pub solve_ns: Mean,
    /// Facts, rules and actions on the path; of networks with a goal.
    pub path_length: Mean,
    /// Loops of the naive solver.
    pub naive_loops: Mean,
    /// Rules that it ran.
    pub naive_rules: Mean,
    /// Actions that it ran.
    pub naive_actions: Mean,
    /// Its time, ns.
    pub naive_ns: Mean,
    /// Networks that it did not solve, those without any goal included.
    pub unsolved: u64,
}

/// Everything that was measured of one condition.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Of which networks.
    pub condition: Condition,
    /// Time of the pruner, ns.
    pub prune_ns: Mean,
    /// Time of each of three passes of the published loops, ns; the third changes nothing.
    pub pass_ns: [Mean; 3],
    /// Facts, rules and actions that it left.
    pub kept: [Mean; 3],
    /// The same by the pruner that the text describes.
    pub kept_by_text: [Mean; 3],
    /// The solvers on the networks as drawn.
    pub unpruned: Solved,
    /// The solvers on what the pruner left.
    pub pruned: Solved,
}

impl Measured {
    /// Nothing yet of `condition`.
    #[must_use]
    pub fn new(condition: Condition) -> Self {
        Self {
            condition,
            prune_ns: Mean::default(),
            pass_ns: [Mean::default(); 3],
            kept: [Mean::default(); 3],
            kept_by_text: [Mean::default(); 3],
            unpruned: Solved::default(),
            pruned: Solved::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Mean;

    #[test]
    fn a_range_is_two_errors_wide() {
        let mut mean = Mean::default();
        assert_eq!((mean.value(), mean.range()), (None, None));
        [2.0, 4.0, 6.0].into_iter().for_each(|value| mean.add(value));
        assert_eq!((mean.value(), mean.n()), (Some(4.0), 3));
        let (low, high) = mean.range().unwrap();
        let error = 1.96 * (4.0_f64 / 3.0).sqrt();
        assert!((low - (4.0 - error)).abs() < 1e-9 && (high - (4.0 + error)).abs() < 1e-9);
    }
}
