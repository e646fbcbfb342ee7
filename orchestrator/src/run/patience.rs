//! How long the orchestrator waits for its crafts.
//!
//! A stopped process is paused and not dead, so the time in which one is stopped does not count. Whether
//! one is, is asked a few times within the limit only: the answer takes a look into /proc for every
//! craft. Not here: the waiting itself, which must wake up for these looks (`fleet`).

use shared_types::time::Nanos;

/// Looks for stopped processes within the limit. One that is continued shortly before the limit has
/// counted for less than two of these parts.
const LOOKS: u64 = 8;

/// One wait and its limit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Patience {
    limit_ns: u64,
    began: Nanos,
    next_look: Nanos,
}

impl Patience {
    /// A wait of at most `limit_ns` from `now` on.
    pub(super) fn new(limit_ns: u64, now: Nanos) -> Self {
        Self { limit_ns, began: now, next_look: now.plus(limit_ns / LOOKS) }
    }

    /// When whoever waits must look up at the latest.
    pub(super) const fn next_look(&self) -> Nanos {
        self.next_look
    }

    /// Whether the wait has lasted too long at `now`.
    pub(super) fn is_over(&mut self, now: Nanos, is_paused: impl FnOnce() -> bool) -> bool {
        if now < self.next_look {
            return false;
        }
        if is_paused() {
            self.began = now;
        }
        self.next_look = now.plus(self.limit_ns / LOOKS);
        now.since(self.began) >= self.limit_ns
    }
}

#[cfg(test)]
mod tests {
    use super::{LOOKS, Nanos, Patience};

    #[test]
    fn it_ends_with_its_limit_and_looks_up_before() {
        let mut patience = Patience::new(800, Nanos(1000));
        let mut looks = 0;
        let mut now = Nanos(1000);
        while !patience.is_over(now, || false) {
            assert!(patience.next_look() > now, "a sleep until then would not end");
            now = patience.next_look();
            looks += 1;
        }
        assert_eq!((now, looks), (Nanos(1800), LOOKS));
    }

    #[test]
    fn time_in_which_somebody_is_stopped_does_not_count() {
        let mut patience = Patience::new(800, Nanos(0));
        for now in (0..100_000).step_by(100) {
            assert!(!patience.is_over(Nanos(now), || true));
        }
        let continued = 99_900;
        assert!(!patience.is_over(Nanos(continued + 799), || false));
        assert!(patience.is_over(Nanos(continued + 900), || false));
    }

    #[test]
    fn nobody_is_looked_at_while_answers_come_in_time() {
        let mut patience = Patience::new(800, Nanos(0));
        assert!(!patience.is_over(Nanos(99), || panic!("a look at every craft")));
    }
}
