//! What must hold after every step, and once nothing is under way any more.
//!
//! The laws look at boards, at what was handed over and at numbers, never at how recovery works.

use crate::lockstep::LedgerError;
use shared_types::ids::{CraftId, FactId};
use shared_types::knowledge::{FactState, Value, Version};
use shared_types::wire::Header;
use std::collections::{BTreeMap, BTreeSet};

/// A law that was broken.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Violation {
    /// A fact became older, or another value stood under the same version.
    #[error("fact {fact} on the board of {craft} went from {before:?} to {after:?} in one life")]
    WentBack {
        /// Whose board.
        craft: CraftId,
        /// Which fact.
        fact: FactId,
        /// What was held.
        before: FactState,
        /// What was held then.
        after: FactState,
    },
    /// Two writes under one version, or a value that nobody wrote.
    #[error("fact {fact} on the board of {craft} is {held:?}, which nobody wrote so ({wrote:?})")]
    Invented {
        /// Whose board.
        craft: CraftId,
        /// Which fact.
        fact: FactId,
        /// What is held.
        held: FactState,
        /// What was written under this version.
        wrote: Option<Value>,
    },
    /// A numbered sample was handed over a second time.
    #[error("{craft} was handed sample {number} of {source_craft} twice")]
    HandedOverTwice {
        /// The receiver.
        craft: CraftId,
        /// The sender.
        source_craft: CraftId,
        /// The sample's number.
        number: u64,
    },
    /// A sample was repeated more often than its budget allows.
    #[error("sample {number} of {source_craft} was repeated more often than is allowed")]
    OverBudget {
        /// The sender.
        source_craft: CraftId,
        /// The sample's number.
        number: u64,
    },
    /// A sample that was sent was neither handed over nor counted as lost.
    #[error("{craft} was sent {sent} by {source_craft}, got {got}, and counts {counted} as lost")]
    Unaccounted {
        /// The receiver.
        craft: CraftId,
        /// The sender.
        source_craft: CraftId,
        /// Samples sent.
        sent: u64,
        /// Samples handed over.
        got: u64,
        /// Samples counted as lost.
        counted: u64,
    },
    /// Something was given up although both ends lived all the time.
    #[error("{craft} gave up {count} samples although nobody died")]
    GivenUp {
        /// Who gave up.
        craft: CraftId,
        /// How much.
        count: u64,
    },
    /// When quiet, two boards that share a fact disagree on it.
    #[error("fact {fact} is {one:?} at {craft} and {other:?} at {peer} although all is quiet")]
    Disagree {
        /// Which fact.
        fact: FactId,
        /// A sharer.
        craft: CraftId,
        /// What it holds.
        one: FactState,
        /// Another one.
        peer: CraftId,
        /// What that one holds.
        other: FactState,
    },
    /// When quiet, a fact that one craft alone writes is not what the trace says.
    #[error("fact {fact} is {held:?} at {craft}; the trace ends with {wanted:?}")]
    NotAsTraced {
        /// Which fact.
        fact: FactId,
        /// Whose board.
        craft: CraftId,
        /// What it holds.
        held: Value,
        /// What was written last.
        wanted: Value,
    },
    /// A later life never learnt what it missed.
    #[error("{craft} has not caught up")]
    NotCaughtUp {
        /// Who.
        craft: CraftId,
    },
    /// A trial of lockstep went another way than without faults.
    #[error("trial {trial} went another way than without faults: {what}")]
    WentAstray {
        /// Which trial.
        trial: u32,
        /// What was different.
        what: String,
    },
    /// A turn of lockstep stands still and nobody will ask for what is missing.
    #[error("trial {trial} stands still: {standing}")]
    StandsStill {
        /// Which trial.
        trial: u32,
        /// The ledger in words.
        standing: String,
    },
    /// A process reported what does not fit the ledger.
    #[error("the ledger refused a line: {0}")]
    Ledger(#[from] LedgerError),
    /// The fleet did not come to rest.
    #[error("the fleet does not come to rest")]
    Restless,
    /// The memory network refused a sample.
    #[error("the network failed: {0}")]
    Network(String),
}

/// Everything that the laws remember of one case.
#[derive(Debug, Default)]
pub(super) struct Laws {
    /// What was held last, by craft and fact.
    held: Vec<Vec<FactState>>,
    /// Every write, by writer, fact and count.
    written: BTreeMap<(CraftId, FactId, u32), Value>,
    /// What was handed over, by receiver: source, its life, address, number.
    handed: Vec<BTreeSet<(u32, u32, u32, u64)>>,
}

impl Laws {
    pub(super) fn of(processes: usize, facts: u32) -> Self {
        let mut laws = Self::default();
        laws.held.resize(processes, vec![FactState::default(); facts as usize]);
        laws.handed.resize_with(processes, BTreeSet::new);
        laws
    }

    /// Boards begin anew; numbers run on.
    pub(super) fn begin_epoch(&mut self) {
        self.held.iter_mut().for_each(|held| held.fill(FactState::default()));
        self.written.clear();
    }

    /// A new life of `craft` begins: it knows nothing and was handed nothing.
    pub(super) fn begin_life(&mut self, craft: CraftId) {
        self.held[craft.index()].fill(FactState::default());
        self.handed[craft.index()].clear();
    }

    /// `craft` holds `state` of `fact` after a step in which it may have written.
    pub(super) fn look(
        &mut self,
        craft: CraftId,
        fact: FactId,
        state: FactState,
    ) -> Result<(), Violation> {
        let held = &mut self.held[craft.index()][fact.index()];
        if *held == state {
            return Ok(());
        }
        let before = std::mem::replace(held, state);
        if state.version <= before.version {
            return Err(Violation::WentBack { craft, fact, before, after: state });
        }
        let Version { count, writer } = state.version;
        let wrote = self.written.get(&(writer, fact, count)).copied();
        match wrote {
            Some(value) if value == state.value => Ok(()),
            wrote => Err(Violation::Invented { craft, fact, held: state, wrote }),
        }
    }

    /// `craft` made the write whose outcome is `state`.
    pub(super) fn write(
        &mut self,
        craft: CraftId,
        fact: FactId,
        state: FactState,
    ) -> Result<(), Violation> {
        let key = (state.version.writer, fact, state.version.count);
        match self.written.insert(key, state.value) {
            Some(value) if value != state.value => {
                Err(Violation::Invented { craft, fact, held: state, wrote: Some(value) })
            }
            _ => Ok(()),
        }
    }

    /// `craft` is handed the numbered sample of `header`.
    pub(super) fn hand(&mut self, craft: CraftId, header: &Header) -> Result<(), Violation> {
        let &Header { source, incarnation, destination, sequence, .. } = header;
        let handed = &mut self.handed[craft.index()];
        if handed.insert((source, incarnation, destination, sequence)) {
            return Ok(());
        }
        let source_craft = CraftId(source);
        Err(Violation::HandedOverTwice { craft, source_craft, number: sequence })
    }

    /// Samples of `source` in its first life that `craft` was handed.
    pub(super) fn handed(&self, craft: CraftId, source: CraftId) -> u64 {
        let of_source = (source.0, 0, 0, 0)..(source.0, 1, 0, 0);
        self.handed[craft.index()].range(of_source).count() as u64
    }
}
