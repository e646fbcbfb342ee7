//! The replica store of the strategies `full` and `limited`: what others told, by origin and fact.
//!
//! In the published experiment no rule reads it; keeping it is part of what these strategies cost.

use super::state_bytes;
use shared_types::ids::{CraftId, FactId};
use shared_types::knowledge::{FactState, FleetView};
use xxhash_rust::xxh3::Xxh3;

/// Replicas of other boards' facts, dense by origin and fact.
#[derive(Clone, Debug, Default)]
pub struct ReplicaStore {
    /// First slot of each origin's facts in `states`.
    starts: Vec<usize>,
    states: Vec<FactState>,
    /// Slots that hold something, in the order in which they were first told.
    told: Vec<(CraftId, FactId)>,
}

impl ReplicaStore {
    /// Forgets everything and makes room for every fact of the fleet.
    pub fn reset(&mut self, fleet: &FleetView<'_>) {
        for &(origin, fact) in &self.told {
            if let Some(state) = self.states.get_mut(self.starts[origin.index()] + fact.index()) {
                *state = FactState::default();
            }
        }
        self.told.clear();
        self.starts.clear();
        let mut end = 0;
        for board in &fleet.boards {
            self.starts.push(end);
            end += board.fact_count as usize;
        }
        self.states.resize(end, FactState::default());
        self.told.reserve(end.min(self.told.capacity() + 4096));
    }

    /// Keeps what `origin` told of its `fact`, if it is newer than what is held.
    pub fn tell(&mut self, origin: CraftId, fact: FactId, state: FactState) {
        let held = &mut self.states[self.starts[origin.index()] + fact.index()];
        if held.version.count == 0 {
            self.told.push((origin, fact));
        }
        if state.version > held.version {
            *held = state;
        }
    }

    /// What `origin` told of its `fact`.
    #[must_use]
    pub fn state(&self, origin: CraftId, fact: FactId) -> FactState {
        self.states[self.starts[origin.index()] + fact.index()]
    }

    /// Digest over (origin u32, fact u32, value u8, count u32, writer u32; little-endian) of every
    /// replica held, by origin and fact.
    #[must_use]
    pub fn digest(&self) -> u64 {
        let mut told = self.told.clone();
        told.sort_unstable();
        let mut hasher = Xxh3::new();
        for (origin, fact) in told {
            hasher.update(&origin.0.to_le_bytes());
            hasher.update(&fact.0.to_le_bytes());
            hasher.update(&state_bytes(&self.states[self.starts[origin.index()] + fact.index()]));
        }
        hasher.digest()
    }
}
