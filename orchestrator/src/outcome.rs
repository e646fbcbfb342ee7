//! How an invocation ends: the exit codes, which scripts may rely on.

use serde::{Deserialize, Serialize};

/// Why the process ends, worst first in [`Outcome::severity`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    /// Everything asked for was done and every promise held.
    #[default]
    Success,
    /// An identity or a promise is broken: a result cannot be trusted.
    Broken,
    /// The command line, the scenario or the surroundings are wrong; nothing was started.
    Usage,
    /// Completed, but something was lost on the way: a craft, data.
    Partial,
    /// A comparison found a regression.
    Regression,
    /// The time limit of the run was reached.
    TimeLimit,
    /// Ended by SIGINT.
    Interrupted,
    /// Ended by SIGTERM or SIGHUP.
    Terminated,
}

impl Outcome {
    /// All outcomes.
    pub const ALL: [Self; 8] = [
        Self::Success,
        Self::Broken,
        Self::Usage,
        Self::Partial,
        Self::Regression,
        Self::TimeLimit,
        Self::Interrupted,
        Self::Terminated,
    ];

    /// The exit code.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::Success => 0,
            Self::Broken => 1,
            Self::Usage => 2,
            Self::Partial => 3,
            Self::Regression => 4,
            Self::TimeLimit => 124,
            Self::Interrupted => 130,
            Self::Terminated => 143,
        }
    }

    /// The outcome with exit code `code`, `None` if there is none.
    #[must_use]
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|outcome| outcome.code() == code)
    }

    /// What a reader of a report is told.
    #[must_use]
    pub const fn sentence(self) -> &'static str {
        match self {
            Self::Success => "complete, every identity held",
            Self::Broken => "an identity or promise is broken",
            Self::Usage => "refused: usage, scenario or surroundings",
            Self::Partial => "partial: something was lost",
            Self::Regression => "a regression was found",
            Self::TimeLimit => "ended by its time limit",
            Self::Interrupted => "interrupted (SIGINT)",
            Self::Terminated => "terminated (SIGTERM or SIGHUP)",
        }
    }

    /// How bad an outcome is; the larger one stands when two things went wrong. A broken promise
    /// outweighs an interruption, which outweighs a loss.
    #[must_use]
    pub const fn severity(self) -> u8 {
        match self {
            Self::Success => 0,
            Self::Regression => 1,
            Self::Partial => 2,
            Self::TimeLimit => 3,
            Self::Terminated => 4,
            Self::Interrupted => 5,
            Self::Usage => 6,
            Self::Broken => 7,
        }
    }

    /// The worse of two outcomes.
    #[must_use]
    pub const fn worse(self, other: Self) -> Self {
        if other.severity() > self.severity() { other } else { self }
    }
}

impl From<Outcome> for std::process::ExitCode {
    fn from(outcome: Outcome) -> Self {
        Self::from(outcome.code())
    }
}

#[cfg(test)]
mod tests {
    use super::Outcome;

    #[test]
    fn every_code_leads_back_to_its_outcome() {
        for outcome in Outcome::ALL {
            assert_eq!(Outcome::from_code(outcome.code()), Some(outcome));
        }
        assert_eq!(Outcome::from_code(77), None);
    }

    #[test]
    fn a_broken_promise_outweighs_everything() {
        for outcome in Outcome::ALL {
            assert_eq!(outcome.worse(Outcome::Broken), Outcome::Broken);
            assert_eq!(Outcome::Broken.worse(outcome), Outcome::Broken);
            assert_eq!(Outcome::Success.worse(outcome), outcome);
        }
    }
}
