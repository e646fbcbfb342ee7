//! What a process knows of one other: whether it lives, what it has confirmed, what it is asked for.

use shared_types::limits::ASKS_MAX;
use shared_types::time::Nanos;
use shared_types::transport::Numbered;

/// Something that is asked for again and again until it is answered, with growing pauses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Asking {
    /// When it is asked next; never while nothing is wanted.
    pub(super) at: Nanos,
    tries: u32,
}

/// Never.
pub(super) const NEVER: Nanos = Nanos(u64::MAX);

/// Pauses stop growing at the patience times two to the power of this.
const DOUBLINGS_MAX: u32 = 4;

impl Default for Asking {
    fn default() -> Self {
        Self { at: NEVER, tries: 0 }
    }
}

impl Asking {
    /// Whether something is wanted.
    pub(super) const fn is_on(&self) -> bool {
        self.at.0 != NEVER.0
    }

    /// Asks first at `at`, unless it is asking already.
    pub(super) fn start(&mut self, at: Nanos) {
        if !self.is_on() {
            *self = Self { at, tries: 0 };
        }
    }

    /// Nothing is wanted any more.
    pub(super) fn stop(&mut self) {
        *self = Self::default();
    }

    /// There was progress: pauses are short again.
    pub(super) const fn encourage(&mut self) {
        self.tries = 0;
    }

    /// It was asked at `now`: says whether there is hope, and when to ask next.
    pub(super) fn asked(&mut self, now: Nanos, patience_ns: u64) -> bool {
        let pause_ns = patience_ns.saturating_mul(1 << self.tries.min(DOUBLINGS_MAX));
        self.tries += 1;
        self.at = now.plus(pause_ns);
        self.tries <= ASKS_MAX
    }
}

/// Numbers of the two services.
pub(super) type Numbers = [u64; Numbered::ALL.len()];

/// One other process.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Peer {
    /// Whether it is gone.
    pub(super) is_gone: bool,
    /// The newest life that was heard of.
    pub(super) life: u32,
    /// Next number that it will be sent by unicast; `None` before the first of the epoch.
    pub(super) unicast_next: Option<u64>,
    /// Own unicasts to it below this number cannot be repeated.
    pub(super) kept_from: u64,
    /// It has everything below these numbers.
    pub(super) confirmed: Numbers,
    /// Asks whether it has what it was sent.
    pub(super) announcing: Asking,
    /// Numbered samples that came from it since the last receipt.
    pub(super) unreceipted: u32,
    /// When it gets the next receipt.
    pub(super) receipt_at: Option<Nanos>,
    /// Asks for what is missing from it.
    pub(super) missing: Asking,
    /// How many numbers were missing when it was asked last.
    pub(super) missing_before: u64,
    /// Asks for its state.
    pub(super) pulling: Asking,
    /// Number of the question, and the first fact that it is about.
    pub(super) question: u32,
    pub(super) first_fact: u32,
    /// Whether this life cannot begin to play without the answer.
    pub(super) is_joining: bool,
    /// What it had sent when it answered the first question of this round.
    pub(super) covered: Numbers,
}

impl Peer {
    /// When there is something to do about it.
    pub(super) fn next_due(&self) -> Nanos {
        let receipt_at = self.receipt_at.unwrap_or(NEVER);
        self.announcing.at.min(self.missing.at).min(self.pulling.at).min(receipt_at)
    }

    /// Nothing is expected of it, and nothing owed.
    pub(super) fn rest(&mut self) {
        self.forget_numbers();
        self.pulling.stop();
        self.is_joining = false;
    }

    /// Samples between it and this process are no matter any more.
    pub(super) fn forget_numbers(&mut self) {
        self.announcing.stop();
        self.missing.stop();
        self.receipt_at = None;
        self.unreceipted = 0;
    }

    /// Whether something is wanted of it.
    pub(super) const fn is_busy(&self) -> bool {
        self.announcing.is_on() || self.missing.is_on() || self.pulling.is_on()
    }
}

#[cfg(test)]
mod tests {
    use super::{ASKS_MAX, Asking, NEVER, Nanos};

    #[test]
    fn pauses_double_up_to_a_bound_and_hope_ends() {
        let mut asking = Asking::default();
        assert!(!asking.is_on());
        asking.start(Nanos(5));
        asking.start(Nanos(9));
        assert_eq!(asking.at, Nanos(5));
        let pauses: Vec<u64> = (0..6)
            .map(|_| {
                assert!(asking.asked(Nanos(100), 10));
                asking.at.0 - 100
            })
            .collect();
        assert_eq!(pauses, [10, 20, 40, 80, 160, 160]);
        assert!((6..ASKS_MAX).all(|_| asking.asked(Nanos(100), 10)));
        assert!(!asking.asked(Nanos(100), 10), "it was asked too often");
        asking.stop();
        assert_eq!(asking.at, NEVER);
    }
}
