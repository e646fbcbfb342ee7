//! Symmetric boundary facts: who shares how many, and which fact of each board that is.
//!
//! Crafts are dealt from a shuffled deck of the whole fleet, so many at a time as share one fact; when
//! the deck runs out, a new one is shuffled. Every craft therefore shares as many facts as any other,
//! give or take one. Which fact of its board each of them is, is drawn board by board. A shared fact is
//! equal on all its boards at the start, as the first of its sharers drew it; one that is final on some
//! board holds on none.

use shared_types::ids::{CraftId, FactId};
use shared_types::knowledge::{BoardNetwork, Target};
use shared_types::rng::Stream;
use shared_types::scenario::GeneratedNetwork;

/// How many facts a fleet shares: as many as its boards have room for.
pub(in crate::scenario) fn shared_facts(parameters: &GeneratedNetwork, craft_count: u32) -> u64 {
    let places = u64::from(boundary_facts(parameters)) * u64::from(craft_count);
    places / (u64::from(parameters.sharers) + 1)
}

/// Most boundary facts that one board has.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a share of a number of facts is one as well"
)]
fn boundary_facts(parameters: &GeneratedNetwork) -> u32 {
    (f64::from(parameters.facts) * parameters.boundary_fraction).round() as u32
}

/// Deals the boundary facts and writes them into the boards' tables, which hold no links yet.
///
/// # Panics
/// If a fact shall be shared by more crafts than there are, or by more than all facts of a board;
/// validation of a scenario refuses both before.
pub(super) fn link(
    parameters: &GeneratedNetwork,
    stream: &mut Stream,
    boards: &mut [BoardNetwork],
) {
    let craft_count = u32::try_from(boards.len()).expect("invariant: fleets are below 2^32");
    let group_size = parameters.sharers as usize + 1;
    let mut groups = deal(shared_facts(parameters, craft_count), group_size, craft_count, stream);
    choose_facts(parameters.facts, stream, &mut groups, boards.len());
    let mut links: Vec<Vec<(u32, Target)>> = vec![Vec::new(); boards.len()];
    for group in groups.chunks_exact_mut(group_size) {
        group.sort_unstable();
        for own in group.iter() {
            let others = group.iter().filter(|other| *other != own);
            links[own.craft.index()].extend(others.map(|&other| (own.fact.0, other)));
        }
    }
    agree_at_the_start(boards, groups.chunks_exact(group_size));
    for (board, links) in boards.iter_mut().zip(&links) {
        let named = links.iter().flat_map(|&(fact, _)| [fact; 2]);
        let pairs = links
            .iter()
            .flat_map(|&(fact, other)| [other.craft.0, other.fact.0].map(|number| (fact, number)));
        board.links.refill(parameters.facts as usize, named, pairs);
    }
}

/// Makes what is initially asserted of each of `groups` the same on all boards.
fn agree_at_the_start<'a>(boards: &mut [BoardNetwork], groups: impl Iterator<Item = &'a [Target]>) {
    let mut initial: Vec<Vec<bool>> = Vec::with_capacity(boards.len());
    for board in boards.iter() {
        let mut flags = vec![false; board.fact_count as usize];
        board.initial.iter().for_each(|&fact| flags[fact as usize] = true);
        initial.push(flags);
    }
    for group in groups {
        let is_final =
            |one: &Target| boards[one.craft.index()].finals.binary_search(&one.fact.0).is_ok();
        let first = group[0];
        let holds = initial[first.craft.index()][first.fact.index()];
        let holds = holds && !group.iter().any(is_final);
        for one in group {
            initial[one.craft.index()][one.fact.index()] = holds;
        }
    }
    for (board, flags) in boards.iter_mut().zip(initial) {
        board.initial.clear();
        board.initial.extend((0..board.fact_count).filter(|&fact| flags[fact as usize]));
    }
}

/// The sharers of `groups` facts, group after group; which fact of each it is comes later.
fn deal(groups: u64, group_size: usize, craft_count: u32, stream: &mut Stream) -> Vec<Target> {
    let mut dealt = Vec::new();
    let mut deck: Vec<u32> = Vec::new();
    for _ in 0..groups {
        let start = dealt.len();
        while dealt.len() < start + group_size {
            if deck.is_empty() {
                deck.extend(0..craft_count);
                stream.shuffle(&mut deck);
            }
            // Who is in the group already waits for the next one.
            let next = deck.iter().rposition(|&craft| !holds(&dealt[start..], craft));
            let next = next.expect("invariant: a group is no larger than the fleet");
            dealt.push(Target { craft: CraftId(deck.remove(next)), fact: FactId(0) });
        }
    }
    dealt
}

fn holds(group: &[Target], craft: u32) -> bool {
    group.iter().any(|sharer| sharer.craft.0 == craft)
}

/// Makes each place of a craft another random fact of its board.
fn choose_facts(facts: u32, stream: &mut Stream, places: &mut [Target], boards: usize) {
    let mut by_craft: Vec<Vec<usize>> = vec![Vec::new(); boards];
    for (index, place) in places.iter().enumerate() {
        by_craft[place.craft.index()].push(index);
    }
    let mut order: Vec<u32> = Vec::new();
    for own in by_craft {
        order.clear();
        order.extend(0..facts);
        for (drawn, index) in (0..facts).zip(own) {
            let other = drawn + stream.below(facts - drawn);
            order.swap(drawn as usize, other as usize);
            places[index].fact = FactId(order[drawn as usize]);
        }
    }
}
