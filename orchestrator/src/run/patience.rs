//! How long the orchestrator waits for its crafts.
//!
//! A limit is counted in looks, of which each stands for a part of it. So time in which the orchestrator
//! did not run itself, on a host that was frozen or overloaded, counts as one look at most: nobody else
//! may have run either. And a stopped process is paused and not dead: a look at which one is stopped
//! begins the count anew, one at which the kernel holds a process up does not count. It takes a look into
//! /proc for every craft, so looks are few. Not here: the waiting itself, which must wake up for them
//! (`answers`).

use shared_types::time::Nanos;

/// Looks within the limit.
const LOOKS: u32 = 8;

/// What may keep somebody from answering, as one look finds it; the worst of all processes counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Hindrance {
    /// Nothing that can be seen.
    None,
    /// The kernel holds it up.
    HeldUp,
    /// Somebody stopped it.
    Stopped,
}

/// One wait and its limit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Patience {
    part_ns: u64,
    looks_left: u32,
    next_look: Nanos,
}

impl Patience {
    /// A wait of at most `limit_ns` from `now` on.
    pub(super) fn new(limit_ns: u64, now: Nanos) -> Self {
        let part_ns = limit_ns / u64::from(LOOKS);
        Self { part_ns, looks_left: LOOKS, next_look: now.plus(part_ns) }
    }

    /// When whoever waits must look up at the latest.
    pub(super) const fn next_look(&self) -> Nanos {
        self.next_look
    }

    /// Whether the wait has lasted too long at `now`; what hinders anybody is looked for if that is due.
    pub(super) fn is_over(&mut self, now: Nanos, hindrance: impl FnOnce() -> Hindrance) -> bool {
        if self.looks_left > 0 && now >= self.next_look {
            self.next_look = now.plus(self.part_ns);
            match hindrance() {
                Hindrance::None => self.looks_left -= 1,
                Hindrance::HeldUp => {}
                Hindrance::Stopped => self.looks_left = LOOKS,
            }
        }
        self.looks_left == 0
    }
}

#[cfg(test)]
mod tests {
    use super::{Hindrance, LOOKS, Nanos, Patience};

    /// How long `patience` lasts from `now` on for somebody who looks when he must.
    fn lasts(mut patience: Patience, began: Nanos) -> (u64, u32) {
        let (mut now, mut looks) = (began, 0);
        while !patience.is_over(now, || Hindrance::None) {
            assert!(patience.next_look() > now, "a sleep until then would not end");
            now = patience.next_look();
            looks += 1;
        }
        (now.since(began), looks)
    }

    #[test]
    fn it_ends_with_its_limit_and_looks_up_before() {
        assert_eq!(lasts(Patience::new(800, Nanos(1000)), Nanos(1000)), (800, LOOKS));
    }

    #[test]
    fn time_in_which_somebody_is_stopped_does_not_count() {
        let mut patience = Patience::new(800, Nanos(0));
        for now in (0..100_000).step_by(100) {
            assert!(!patience.is_over(Nanos(now), || Hindrance::Stopped));
        }
        assert_eq!(lasts(patience, Nanos(99_900)), (800, LOOKS));
    }

    #[test]
    fn a_look_at_which_the_kernel_holds_somebody_up_does_not_count() {
        let mut patience = Patience::new(800, Nanos(0));
        assert!(!patience.is_over(Nanos(100), || Hindrance::None));
        for now in (200..100_000).step_by(100) {
            assert!(!patience.is_over(Nanos(now), || Hindrance::HeldUp));
        }
        assert_eq!(lasts(patience, Nanos(99_900)), (700, LOOKS - 1));
    }

    #[test]
    fn time_in_which_the_host_stood_still_does_not_count() {
        let mut patience = Patience::new(800, Nanos(0));
        assert!(!patience.is_over(Nanos(1_000_000), || Hindrance::None));
        assert_eq!(lasts(patience, Nanos(1_000_000)), (700, LOOKS - 1));
    }

    #[test]
    fn nobody_is_looked_at_while_answers_come_in_time() {
        let mut patience = Patience::new(800, Nanos(0));
        assert!(!patience.is_over(Nanos(99), || panic!("a look at every craft")));
    }
}
