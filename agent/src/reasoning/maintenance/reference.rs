//! The status of an item assessed from scratch: nothing is kept between two calls.

use super::{Item, Lifetime, Status};
use crate::reasoning::prune::reference::sound;
use shared_types::ids::FactId;
use shared_types::knowledge::{BoardView, Literal};
use shared_types::time::Nanos;

/// Everything that a status depends on.
#[derive(Clone, Debug)]
pub struct Situation<'a> {
    /// The network.
    pub board: BoardView<'a>,
    /// What is known, and when it was written.
    pub known: Vec<(Literal, Nanos)>,
    /// What shall be reached.
    pub goals: Vec<Literal>,
    /// How long values of a fact may be relied upon.
    pub lifetimes: Vec<Lifetime>,
    /// Facts of which a newer value is known elsewhere.
    pub replaced: Vec<FactId>,
    /// What is on one of the best ways.
    pub needed: Vec<Item>,
}

/// The status of `item` at `now`, if it was not looked at within the period.
#[must_use]
pub fn status(situation: &Situation<'_>, item: Item, now: Nanos) -> Status {
    let Situation { board, known, goals, lifetimes, replaced, needed } = situation;
    let open: Vec<u32> =
        (0..board.fact_count).filter(|&fact| board.is_boundary(FactId(fact))).collect();
    if let Item::Fact(fact) = item {
        let is_stale = known.iter().any(|(literal, written)| {
            literal.fact().0 == fact
                && (replaced.contains(&FactId(fact))
                    || lifetimes[fact as usize].is_over(*written, now))
        });
        if is_stale {
            return Status::Stale;
        }
    }
    let literals: Vec<Literal> = known.iter().map(|(literal, _)| *literal).collect();
    let kept = sound(board, &literals, goals, &open);
    let serves = match item {
        Item::Fact(fact) => kept.facts[fact as usize],
        Item::Rule(rule) => kept.rules[rule as usize],
        Item::Action(action) => kept.actions[action as usize],
    };
    let is_open = matches!(item, Item::Fact(fact) if open.contains(&fact));
    match (serves, needed.contains(&item) || is_open) {
        (false, _) => Status::Unused,
        (true, true) => Status::Used,
        (true, false) => Status::Unlikely,
    }
}
