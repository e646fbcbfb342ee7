//! What became of every fact of every board in a replayed trial, and why: the source of explanations.
//!
//! The firings of the replay are run once more and every change is kept with its cause. A firing acts on
//! its own board at once, what it tells acts on linked boards at the end of the turn, so the state before
//! a turn is what all earlier turns left.

use super::board::PlainBoard;
use super::replay::{Replay, Turnout};
use super::routes::route;
use shared_types::ids::{CraftId, FactId, Turn};
use shared_types::knowledge::{FactState, FleetView, Value};
use shared_types::wire::{EpochSpec, StrategyKind};

/// Why a fact has a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// It had it before the first turn.
    Initial,
    /// The board's own craft fired.
    Fired {
        /// Place in [`Replay::firings`].
        firing: usize,
    },
    /// Another craft fired and told it.
    Told {
        /// Who, and its fact.
        from: (CraftId, FactId),
        /// Place in [`Replay::firings`].
        firing: usize,
    },
}

/// A value that a fact took.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Entry {
    /// In which turn; what is initial stands in turn 0 as well.
    pub turn: Turn,
    /// Value and version.
    pub state: FactState,
    /// Why.
    pub cause: Cause,
}

/// All values that facts took in a trial, by craft and fact, in order.
#[derive(Clone, Debug)]
pub struct History {
    entries: Vec<Vec<Vec<Entry>>>,
}

impl History {
    /// The history of `replay`, the trial of `spec` on `fleet`.
    #[must_use]
    pub fn of(replay: &Replay, fleet: &FleetView<'_>, spec: &EpochSpec) -> Self {
        let mut boards: Vec<PlainBoard> = fleet.boards.iter().map(PlainBoard::new).collect();
        let initial = |state: &FactState| {
            let entry = Entry { turn: Turn(0), state: *state, cause: Cause::Initial };
            if state.value == Value::Unknown { Vec::new() } else { vec![entry] }
        };
        let entries =
            boards.iter().map(|board| board.states.iter().map(initial).collect()).collect();
        let mut history = Self { entries };
        let mut place = 0;
        for turn in replay.firings.chunk_by(|one, other| one.turn == other.turn) {
            let mut told = Vec::new();
            for fired in turn {
                let (craft, firing) = (fired.craft, place);
                place += 1;
                let mut changes = Vec::new();
                let board = &mut boards[craft.index()];
                let network = fleet.board(craft);
                match fired.turnout {
                    Turnout::Done => {
                        board.fire(network, craft, fired.firing, &mut changes);
                    }
                    Turnout::Underway => {}
                    Turnout::InVain => board.run_in_vain(network, fired.firing),
                }
                changes.sort_by_key(|change| change.fact);
                for change in changes {
                    let state = FactState { value: change.value, version: change.version };
                    let cause = Cause::Fired { firing };
                    history.put(craft, change.fact, Entry { turn: fired.turn, state, cause });
                    if change.altered || !spec.sends_altered_only {
                        told.push((craft, change.fact, state, firing));
                    }
                }
            }
            for (craft, fact, state, firing) in told {
                for target in fleet.board(craft).targets(fact) {
                    let board = &mut boards[target.craft.index()];
                    let before = board.states[target.fact.index()];
                    board.merge(target.fact, state);
                    if board.states[target.fact.index()] != before {
                        let cause = Cause::Told { from: (craft, fact), firing };
                        let entry = Entry { turn: turn[0].turn, state, cause };
                        history.put(target.craft, target.fact, entry);
                    }
                }
            }
        }
        history
    }

    /// Every value that a fact took, in order; empty if it stayed unknown.
    #[must_use]
    pub fn entries(&self, craft: CraftId, fact: FactId) -> &[Entry] {
        &self.entries[craft.index()][fact.index()]
    }

    /// The value that a fact had when `turn` opened, and since when; `None` if it was unknown.
    #[must_use]
    pub fn before(&self, craft: CraftId, fact: FactId, turn: Turn) -> Option<&Entry> {
        let entries = self.entries(craft, fact);
        let earlier = |entry: &&Entry| entry.cause == Cause::Initial || entry.turn < turn;
        entries.iter().rev().find(earlier)
    }

    /// The value of a fact when `turn` opened.
    #[must_use]
    pub fn value_before(&self, craft: CraftId, fact: FactId, turn: Turn) -> Value {
        self.before(craft, fact, turn).map_or(Value::Unknown, |entry| entry.state.value)
    }

    fn put(&mut self, craft: CraftId, fact: FactId, entry: Entry) {
        self.entries[craft.index()][fact.index()].push(entry);
    }
}

/// The crafts that a change passes from `source` to `sharer` under `strategy`, neither included.
#[must_use]
pub fn relays(
    strategy: StrategyKind,
    fleet: &FleetView<'_>,
    source: CraftId,
    sharer: CraftId,
) -> Vec<CraftId> {
    match strategy {
        StrategyKind::Boundary | StrategyKind::Hierarchy | StrategyKind::Hybrid => {
            let way = route(strategy, &fleet.topology, source, sharer);
            way[1..way.len() - 1].to_vec()
        }
        // The process behind the last craft.
        strategy if strategy.has_centre() => vec![CraftId(fleet.craft_count())],
        _ => Vec::new(),
    }
}
