//! How many samples go from whom to whom. What goes to everybody is kept once per sender, so that a
//! large fleet does not need a square of numbers.

use shared_types::ids::CraftId;
use std::collections::BTreeMap;

/// Deliveries by sender and receiver.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Deliveries {
    /// Per sender the samples that every other craft receives.
    to_everybody: BTreeMap<CraftId, u64>,
    /// The others, by sender and receiver.
    to_one: BTreeMap<(CraftId, CraftId), u64>,
}

impl Deliveries {
    /// How many samples of `sender` reach `receiver`.
    #[must_use]
    pub fn between(&self, sender: CraftId, receiver: CraftId) -> u64 {
        if sender == receiver {
            return 0;
        }
        self.to_everybody.get(&sender).copied().unwrap_or(0)
            + self.to_one.get(&(sender, receiver)).copied().unwrap_or(0)
    }

    pub(super) fn add(&mut self, sender: CraftId, receiver: CraftId, samples: u64) {
        *self.to_one.entry((sender, receiver)).or_default() += samples;
    }

    pub(super) fn add_to_everybody(&mut self, sender: CraftId, samples: u64) {
        *self.to_everybody.entry(sender).or_default() += samples;
    }
}
