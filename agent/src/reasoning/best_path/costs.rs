//! What rules and actions cost, and how the costs of premises add up.

use shared_types::knowledge::BoardView;

/// How the costs of a rule's premises make one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Combine {
    /// Their sum: premises are worked for one after the other. A premise that stands twice counts twice.
    Sum,
    /// The largest: premises are worked for side by side.
    Max,
}

/// Why costs cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CostError {
    /// Not one cost for each rule.
    #[error("there are {found} costs for {needed} rules")]
    Rules {
        /// Costs given.
        found: usize,
        /// Rules of the board.
        needed: usize,
    },
    /// Not one cost for each action.
    #[error("there are {found} costs for {needed} actions")]
    Actions {
        /// Costs given.
        found: usize,
        /// Actions of the board.
        needed: usize,
    },
    /// A cost that is no number, or below zero.
    #[error("the cost of {what} {index} is negative or no number")]
    Value {
        /// `rule` or `action`.
        what: &'static str,
        /// Which.
        index: usize,
    },
}

/// Costs of one board's rules and actions. Running rule r costs `rules[r]` beside its premises; what
/// action x writes costs `actions[x]` more.
#[derive(Clone, Debug, PartialEq)]
pub struct Costs {
    combine: Combine,
    rules: Vec<f64>,
    actions: Vec<f64>,
}

impl Costs {
    /// Every rule and every action of `board` costs 1.
    #[must_use]
    pub fn uniform(board: &BoardView<'_>, combine: Combine) -> Self {
        Self {
            combine,
            rules: vec![1.0; board.premises.row_count()],
            actions: vec![1.0; board.action_outputs.row_count()],
        }
    }

    /// The costs `rules` and `actions` of `board`.
    ///
    /// # Errors
    /// If one is missing, negative or no number.
    pub fn new(
        board: &BoardView<'_>,
        combine: Combine,
        rules: Vec<f64>,
        actions: Vec<f64>,
    ) -> Result<Self, CostError> {
        let needed = board.premises.row_count();
        if rules.len() != needed {
            return Err(CostError::Rules { found: rules.len(), needed });
        }
        let needed = board.action_outputs.row_count();
        if actions.len() != needed {
            return Err(CostError::Actions { found: actions.len(), needed });
        }
        for (what, values) in [("rule", &rules), ("action", &actions)] {
            let is_wrong = |&value: &f64| value.is_nan() || value < 0.0;
            if let Some(index) = values.iter().position(is_wrong) {
                return Err(CostError::Value { what, index });
            }
        }
        Ok(Self { combine, rules, actions })
    }

    /// How premises add up.
    #[must_use]
    pub const fn combine(&self) -> Combine {
        self.combine
    }

    /// The cost of running `rule`, premises apart.
    #[inline]
    #[must_use]
    pub fn rule(&self, rule: u32) -> f64 {
        self.rules[rule as usize]
    }

    /// The cost of running `action`.
    #[inline]
    #[must_use]
    pub fn action(&self, action: u32) -> f64 {
        self.actions[action as usize]
    }

    /// Sets the cost of `rule`.
    ///
    /// # Errors
    /// If it is negative or no number; nothing changes then.
    pub fn set_rule(&mut self, rule: u32, cost: f64) -> Result<(), CostError> {
        if cost.is_nan() || cost < 0.0 {
            return Err(CostError::Value { what: "rule", index: rule as usize });
        }
        self.rules[rule as usize] = cost;
        Ok(())
    }

    /// What running `rule` costs in all when its premises cost what `of` says.
    #[inline]
    #[must_use]
    pub fn of_rule(&self, rule: u32, premises: &[u32], of: impl Fn(u32) -> f64) -> f64 {
        let own = self.rule(rule);
        match self.combine {
            Combine::Sum => premises.iter().fold(own, |sum, &premise| sum + of(premise)),
            Combine::Max => {
                own + premises.iter().fold(0.0, |most, &premise| f64::max(most, of(premise)))
            }
        }
    }
}
