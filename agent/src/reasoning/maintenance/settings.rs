//! What maintenance is told: periods, lifetimes and bounds; and the five statuses.

use shared_types::time::Nanos;

/// What an item turns out to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// It was looked at within the period.
    Current,
    /// Its lifetime is over, it is too old to be relied upon, or something newer replaced it.
    Stale,
    /// It serves no goal that can still be reached.
    Unused,
    /// It is on none of the best ways.
    Unlikely,
    /// It is on one of them.
    Used,
}

/// How long a value may be relied upon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lifetime {
    /// It does not change by itself.
    Lasting,
    /// Until a given time, which it carries with it.
    Until(Nanos),
    /// For so long after it was written, ns: it evaporates, or changes now and then and this is what is
    /// trusted.
    For(u64),
}

impl Lifetime {
    /// Whether a value that was `written` may be relied upon no longer at `now`.
    #[must_use]
    pub const fn is_over(self, written: Nanos, now: Nanos) -> bool {
        match self {
            Self::Lasting => false,
            Self::Until(end) => now.0 >= end.0,
            Self::For(lifetime_ns) => now.0.saturating_sub(written.0) >= lifetime_ns,
        }
    }
}

/// Periods and bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// For how long an item is not looked at again, ns.
    pub period_ns: u64,
    /// Cycles a period: each looks at that part of the items; three to five in the source.
    pub cycles_per_period: u32,
    /// How long stale values are kept to explain why a rule ran, ns.
    pub stale_kept_ns: u64,
    /// Most items of the ancillary store; above it the oldest leave.
    pub ancillary_items_max: usize,
}

/// Why settings cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SettingsError {
    /// Nothing would ever be current.
    #[error("the expiration period is 0 ns: name one that is longer than a cycle")]
    NoPeriod,
    /// No cycle would look at anything.
    #[error("there are 0 cycles a period: 3 to 5 are usual")]
    NoCycles,
}

impl Settings {
    /// These settings, if they can be used.
    ///
    /// # Errors
    /// If the period or the number of cycles is 0.
    pub const fn checked(self) -> Result<Self, SettingsError> {
        if self.period_ns == 0 {
            return Err(SettingsError::NoPeriod);
        }
        if self.cycles_per_period == 0 {
            return Err(SettingsError::NoCycles);
        }
        Ok(self)
    }
}
