//! Time as the core sees it: nanoseconds handed in as an argument, never read from a clock here.

/// Nanoseconds of `CLOCK_MONOTONIC` (comparable across the processes of one host) in a real fleet,
/// of the virtual clock in a simulated one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Nanos(pub u64);

impl Nanos {
    /// The time that passed since `earlier`, 0 if it lies ahead.
    #[must_use]
    pub const fn since(self, earlier: Self) -> u64 {
        self.0.saturating_sub(earlier.0)
    }

    /// This time plus `duration_ns`.
    #[must_use]
    pub const fn plus(self, duration_ns: u64) -> Self {
        Self(self.0.saturating_add(duration_ns))
    }
}
