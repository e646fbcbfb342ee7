//! Who wrote what a board holds, in the writer's own numbering: what a state is told from.
//!
//! A board holds values in its own ids; a change travels in its writer's. For every fact the table keeps
//! the writer's id of it, and the last change that the own craft made to it, which may have been
//! overwritten here and still be owed to others. Kept in epochs with recovery only.

use crate::blackboard::Blackboard;
use shared_types::ids::FactId;
use shared_types::knowledge::Change;

/// The authors of one board's facts.
#[derive(Clone, Debug, Default)]
pub(in crate::craft) struct Authors {
    named: Vec<FactId>,
    own: Vec<Option<Change>>,
}

impl Authors {
    /// Starts an epoch on a board of `facts` facts; nothing is kept if it does not recover.
    pub(in crate::craft) fn reset(&mut self, facts: u32, recovers: bool) {
        let facts = if recovers { facts as usize } else { 0 };
        self.named.clear();
        self.named.resize(facts, FactId(0));
        self.own.clear();
        self.own.resize(facts, None);
    }

    /// The own craft made `change`.
    #[inline]
    pub(in crate::craft) fn wrote(&mut self, change: &Change) {
        if let Some(own) = self.own.get_mut(change.fact.index()) {
            *own = Some(*change);
            self.named[change.fact.index()] = change.fact;
        }
    }

    /// What stands for `fact` now was written as `named` by its writer.
    #[inline]
    pub(in crate::craft) fn learnt(&mut self, fact: FactId, named: FactId) {
        if let Some(kept) = self.named.get_mut(fact.index()) {
            *kept = named;
        }
    }

    /// Whether what stands for `fact` is what its writer calls `named`. Unknown where nothing recovers.
    #[inline]
    pub(in crate::craft) fn is_named(&self, fact: FactId, named: FactId) -> bool {
        self.named.get(fact.index()) == Some(&named)
    }

    /// What is known of `fact`, each in its writer's ids: what stands, and the own last change where
    /// that is another one.
    pub(in crate::craft) fn changes(
        &self,
        board: &Blackboard,
        fact: FactId,
    ) -> impl Iterator<Item = Change> + use<> {
        let state = board.state(fact);
        let named = self.named.get(fact.index()).copied();
        let standing = named.filter(|_| state.version.count > 0).map(|named| Change {
            fact: named,
            value: state.value,
            version: state.version,
            altered: false,
        });
        let own = self.own.get(fact.index()).copied().flatten();
        let own = own.filter(|change| change.version != state.version);
        [standing, own].into_iter().flatten()
    }
}
