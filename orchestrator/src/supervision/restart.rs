//! When a successor is started for a craft that died: how often, and after which pause.
//!
//! Every craft has a budget: so many restarts within a window, the first at once, each further one after a
//! pause twice as long as the one before. A craft that uses it up is lost for good, and the run with it.
//! Not here: how a successor comes into its place (`run::recovery`).

use shared_types::ids::CraftId;
use shared_types::time::Nanos;
use std::collections::BTreeMap;

/// How often a craft is restarted, and after which pauses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RestartPolicy {
    /// Restarts of one craft within the window.
    pub limit: u32,
    /// Length of the window, ns.
    pub window_ns: u64,
    /// Pause before the second restart within the window, ns; doubled for each further one.
    pub pause_ns: u64,
}

/// Longest pause before a restart, ns.
const PAUSE_NS_MAX: u64 = 10_000_000_000;

/// The restarts of a fleet so far.
#[derive(Debug)]
pub struct Restarts {
    policy: RestartPolicy,
    recent: BTreeMap<CraftId, Vec<Nanos>>,
}

impl Restarts {
    /// Nobody was restarted yet.
    #[must_use]
    pub const fn new(policy: RestartPolicy) -> Self {
        Self { policy, recent: BTreeMap::new() }
    }

    /// Takes one restart of `craft` out of its budget; returns the pause before it, ns, or `None` if the
    /// budget is used up.
    pub fn take(&mut self, craft: CraftId, now: Nanos) -> Option<u64> {
        let RestartPolicy { limit, window_ns, pause_ns } = self.policy;
        let recent = self.recent.entry(craft).or_default();
        recent.retain(|&then| now.since(then) < window_ns);
        let before = u32::try_from(recent.len()).unwrap_or(u32::MAX);
        if before >= limit {
            return None;
        }
        recent.push(now);
        let doublings = before.checked_sub(1);
        let pause =
            doublings.map_or(0, |doublings| pause_ns.saturating_mul(1 << doublings.min(32)));
        Some(pause.min(PAUSE_NS_MAX))
    }
}

#[cfg(test)]
mod tests {
    use super::{CraftId, Nanos, PAUSE_NS_MAX, RestartPolicy, Restarts};

    const POLICY: RestartPolicy = RestartPolicy { limit: 4, window_ns: 1_000, pause_ns: 10 };

    #[test]
    fn the_first_comes_at_once_and_each_further_one_after_twice_the_pause() {
        let mut restarts = Restarts::new(POLICY);
        let pauses: Vec<_> = (0..6).map(|now| restarts.take(CraftId(1), Nanos(now))).collect();
        assert_eq!(pauses, [Some(0), Some(10), Some(20), Some(40), None, None]);
        assert_eq!(restarts.take(CraftId(2), Nanos(6)), Some(0), "everybody has an own budget");
    }

    #[test]
    fn what_is_long_ago_does_not_count() {
        let mut restarts = Restarts::new(POLICY);
        for now in [0, 600] {
            restarts.take(CraftId(0), Nanos(now));
        }
        assert_eq!(restarts.take(CraftId(0), Nanos(1_100)), Some(10));
        assert_eq!(restarts.take(CraftId(0), Nanos(9_000)), Some(0));
    }

    #[test]
    fn no_pause_is_endless() {
        let mut restarts = Restarts::new(RestartPolicy { limit: 100, ..POLICY });
        let last = (0..100).filter_map(|_| restarts.take(CraftId(0), Nanos(0))).last();
        assert_eq!(last, Some(PAUSE_NS_MAX));
    }
}
