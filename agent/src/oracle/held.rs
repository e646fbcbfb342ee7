//! What boards hold after an interval of open mode, from the trace alone where it decides that.
//!
//! A write's version is one more than what its board held of the fact, so that the state of a fact
//! which several crafts write depends on who heard of whom in time. A fact that one craft alone
//! writes ends as that craft's last write, with as many writes as the trace has.

use shared_types::ids::{CraftId, FactId};
use shared_types::knowledge::{BoardView, FactState, FleetView, Value, Version};
use shared_types::trace::TraceRecord;
use shared_types::wire::HeldFact;
use std::collections::{BTreeMap, BTreeSet};

/// A fact of a board.
type Place = (CraftId, FactId);

/// Per fact of every board what the trace says of its end.
pub(super) struct Held {
    /// Facts that are written somewhere: the state, `None` where the trace alone does not decide it.
    /// All others are as at the start.
    written: BTreeMap<Place, Option<FactState>>,
    start: Vec<Vec<FactState>>,
}

impl Held {
    /// What `played` (per craft) leaves on the boards of `fleet`, with or without replication.
    pub(super) fn of_trace(
        fleet: &FleetView<'_>,
        played: &[&[TraceRecord]],
        is_replicated: bool,
    ) -> Self {
        let mut last: BTreeMap<Place, FactState> = BTreeMap::new();
        for (craft, records) in (0..).map(CraftId).zip(played) {
            for record in *records {
                let Some(holds) = record.holds() else { continue };
                let state = last.entry((craft, record.fact())).or_default();
                let version = Version { count: state.version.count + 1, writer: craft };
                let value = if holds { Value::Asserted } else { Value::Absent };
                *state = FactState { value, version };
            }
        }
        // Per fact the facts whose writes reach it, its own among them.
        let mut sources: BTreeMap<Place, BTreeSet<Place>> = BTreeMap::new();
        for &(craft, fact) in last.keys() {
            sources.entry((craft, fact)).or_default().insert((craft, fact));
            let targets = fleet.board(craft).targets(fact).filter(|_| is_replicated);
            for target in targets.filter(|target| target.craft != craft) {
                sources.entry((target.craft, target.fact)).or_default().insert((craft, fact));
            }
        }
        let decided = |places: &BTreeSet<Place>| {
            let (first, others) = (places.first()?, places.len() - 1);
            // A writer that others reach counts on from what it heard of them.
            let is_undisturbed = sources.get(first).is_some_and(|reached_by| reached_by.len() == 1);
            if others == 0 && is_undisturbed { last.get(first).copied() } else { None }
        };
        let written = sources.iter().map(|(&place, places)| (place, decided(places))).collect();
        let start = fleet.boards.iter().map(|board| Self::states(board, &[])).collect();
        Self { written, start }
    }

    /// The state of every fact of `board`: as at the start, but for those in `held`.
    pub(super) fn states(board: &BoardView<'_>, held: &[HeldFact]) -> Vec<FactState> {
        let mut states = vec![FactState::default(); board.fact_count as usize];
        for &fact in board.initial {
            states[fact as usize].value = Value::Asserted;
        }
        for held in held {
            if let (Some(state), Some(value)) =
                (states.get_mut(held.fact as usize), Value::from_code(held.value))
            {
                let version = Version { count: held.count, writer: CraftId(held.writer) };
                *state = FactState { value, version };
            }
        }
        states
    }

    /// The same where it is not known which of `traces` those in `doubtful` have played: the trace
    /// decides nothing that they write.
    pub(super) fn without(
        mut self,
        fleet: &FleetView<'_>,
        traces: &[&[TraceRecord]],
        doubtful: &[CraftId],
    ) -> Self {
        for &craft in doubtful {
            let Some(&trace) = traces.get(craft.index()) else { continue };
            for record in trace.iter().filter(|record| record.holds().is_some()) {
                let targets = fleet.board(craft).targets(record.fact());
                let places = targets.map(|target| (target.craft, target.fact));
                for place in places.chain([(craft, record.fact())]) {
                    if let Some(decided) = self.written.get_mut(&place) {
                        *decided = None;
                    }
                }
            }
        }
        self
    }

    /// How many facts of the board of `craft` are not as the trace left them.
    pub(super) fn differences(&self, craft: CraftId, states: &[FactState]) -> u64 {
        self.unlike(craft, states, |wanted, state| wanted != state)
    }

    /// The same, whatever the count of a version.
    pub(super) fn values_that_differ(&self, craft: CraftId, states: &[FactState]) -> u64 {
        self.unlike(craft, states, |wanted, state| {
            (wanted.value, wanted.version.writer) != (state.value, state.version.writer)
        })
    }

    fn unlike(
        &self,
        craft: CraftId,
        states: &[FactState],
        differ: impl Fn(&FactState, &FactState) -> bool,
    ) -> u64 {
        let facts = (0..).map(FactId).zip(states).filter(|&(fact, state)| {
            let wanted = match self.written.get(&(craft, fact)) {
                Some(decided) => *decided,
                None => Some(self.start[craft.index()][fact.index()]),
            };
            wanted.is_some_and(|wanted| differ(&wanted, state))
        });
        facts.count() as u64
    }
}

/// How many shared facts `boards` hold in different states, by pairs of crafts that share them. Nothing
/// where links do not all lead back: there sharers need not agree.
pub(super) fn differences_between_sharers(
    fleet: &FleetView<'_>,
    boards: &[Vec<FactState>],
) -> BTreeMap<(CraftId, CraftId), u64> {
    let of_board = |(craft, board): (CraftId, &BoardView<'_>)| -> Vec<Vec<Place>> {
        (0..board.fact_count).map(|fact| sharers(board, (craft, FactId(fact)))).collect()
    };
    let all: Vec<_> = (0..).map(CraftId).zip(&fleet.boards).map(of_board).collect();
    let mut differing = BTreeMap::new();
    for (craft, facts) in (0..).map(CraftId).zip(&all) {
        for (fact, sharers) in (0..).map(FactId).zip(facts) {
            for &(other, theirs) in sharers.iter().filter(|&&sharer| sharer != (craft, fact)) {
                if all[other.index()][theirs.index()] != *sharers {
                    return BTreeMap::new();
                }
                let states = [(craft, fact), (other, theirs)]
                    .map(|(craft, fact)| boards[craft.index()][fact.index()]);
                if craft < other && states[0] != states[1] {
                    *differing.entry((craft, other)).or_default() += 1;
                }
            }
        }
    }
    differing
}

/// A fact and all that it has links to, ascending.
fn sharers(board: &BoardView<'_>, (craft, fact): Place) -> Vec<Place> {
    let targets = board.targets(fact).map(|target| (target.craft, target.fact));
    let mut sharers: Vec<Place> = targets.chain([(craft, fact)]).collect();
    sharers.sort_unstable();
    sharers
}
