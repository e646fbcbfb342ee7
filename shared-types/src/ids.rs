//! Dense identifiers. Every id is an index into an array that its owner holds, so look-ups never
//! hash; the newtypes keep a fact from being used as a craft.

use serde::{Deserialize, Serialize};

macro_rules! dense_id {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(
            Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
        )]
        #[serde(transparent)]
        pub struct $name(pub u32);

        impl $name {
            /// The id as an array index.
            #[inline]
            #[must_use]
            pub const fn index(self) -> usize {
                self.0 as usize
            }

            /// The id of array index `index`.
            ///
            /// # Panics
            /// If `index` does not fit 32 bits; the limits file keeps every table far below that.
            #[inline]
            #[must_use]
            #[expect(clippy::cast_possible_truncation, reason = "checked by the assertion")]
            pub const fn from_index(index: usize) -> Self {
                assert!(index <= u32::MAX as usize, "invariant: tables stay below 2^32 rows");
                Self(index as u32)
            }
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                write!(formatter, "{}", self.0)
            }
        }
    };
}

dense_id! {
    /// One robot, which is one operating-system process. Crafts of a fleet of N are 0..N; under the
    /// central strategies the centre is one more process with id N.
    CraftId
}
dense_id! {
    /// A fact of one board, local to that board.
    FactId
}
dense_id! {
    /// A rule of one board.
    RuleId
}
dense_id! {
    /// An action of one board.
    ActionId
}
dense_id! {
    /// One trial on a living fleet. Messages of another epoch are refused and counted as late.
    Epoch
}
dense_id! {
    /// A lockstep turn, from 0.
    Turn
}
dense_id! {
    /// Which life of a craft: 0 for those that start with the fleet. A process that starts later, for
    /// the first time or again, gets a number above every one that the fleet has given out before.
    Incarnation
}

impl CraftId {
    /// Stands for "nobody in particular": the destination of a multicast, the parent of the root.
    pub const NONE: Self = Self(u32::MAX);
    /// The orchestrator, where an address is asked for; it is not a craft.
    pub const ORCHESTRATOR: Self = Self(u32::MAX - 1);
}

/// What one firing runs: a rule or an action of the craft's own board, or nothing.
///
/// Rules come first and actions after them, in id order; this is also the order of the candidates
/// from which the draw is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Firing(pub u32);

impl Firing {
    /// A craft without a candidate fires nothing.
    pub const IDLE: Self = Self(u32::MAX);

    /// Whether nothing is fired.
    #[must_use]
    pub const fn is_idle(self) -> bool {
        self.0 == u32::MAX
    }

    /// The rule's firing.
    #[must_use]
    pub const fn of_rule(rule: RuleId) -> Self {
        Self(rule.0)
    }

    /// The action's firing on a board of `rule_count` rules.
    #[must_use]
    pub const fn of_action(action: ActionId, rule_count: u32) -> Self {
        Self(rule_count + action.0)
    }

    /// What this firing runs on a board of `rule_count` rules, `None` if idle.
    #[must_use]
    pub const fn target(self, rule_count: u32) -> Option<FiringTarget> {
        if self.is_idle() {
            None
        } else if self.0 < rule_count {
            Some(FiringTarget::Rule(RuleId(self.0)))
        } else {
            Some(FiringTarget::Action(ActionId(self.0 - rule_count)))
        }
    }
}

/// A firing taken apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FiringTarget {
    /// A rule whose premises hold.
    Rule(RuleId),
    /// An action that a rule queued.
    Action(ActionId),
}
