//! Draws the network of one trial: the chapter VII experiment and its named variants.
//!
//! Every board is drawn from its own stream, the links between boards from one more, so a trial is
//! fixed by seed and trial number alone. Draws are made in one order that never changes. Per board:
//! the final facts and the initial ones (the first places of a random order of all facts), every
//! rule's number of premises, all premises, the fact that each rule asserts, the action that each
//! queues, the fact that each action asserts. For the links: all end points pair by pair, then the
//! order in which they are written; symmetric boundary facts are dealt in `shared`. All memory of the
//! previous trial's network is used again.
//!
//! Not here: the parameters (`shared_types::scenario`), and networks that a user writes out
//! (`compile`).

mod shared;

pub(super) use shared::shared_facts;

use shared_types::ids::{CraftId, FactId};
use shared_types::knowledge::{BoardNetwork, Csr, FleetNetwork, Literal, Target, Topology};
use shared_types::rng::{Purpose, Stream};
use shared_types::scenario::{GeneratedNetwork, LinkingModel};

/// Fills `into` with the network of `trial` of `seed` for `craft_count` crafts.
///
/// # Panics
/// If the parameters ask for more final and initial facts than there are facts, or for a draw from
/// nothing; validation of a scenario refuses both before.
pub fn generate(
    parameters: &GeneratedNetwork,
    craft_count: u32,
    seed: u64,
    trial: u32,
    into: &mut FleetNetwork,
) {
    into.script.clear();
    into.topology = Topology::binary(craft_count);
    into.boards.resize_with(craft_count as usize, BoardNetwork::default);

    let mut order = vec![0; parameters.facts as usize];
    for (board, craft) in into.boards.iter_mut().zip(0..) {
        let mut stream = Stream::new(seed, trial, Purpose::Board, craft);
        draw_board(parameters, &mut stream, &mut order, board);
    }
    let mut stream = Stream::new(seed, trial, Purpose::Links, 0);
    if parameters.linking == LinkingModel::Shared {
        shared::link(parameters, &mut stream, &mut into.boards);
        return;
    }
    let links = draw_links(parameters, craft_count, &mut stream);
    write_links(parameters.facts, &links, &mut into.boards);
}

/// One link before it is written: a fact of each of two boards.
type Link = [Target; 2];

/// Draws facts, rules and actions of one board. `order` is scratch memory, one entry per fact.
fn draw_board(
    parameters: &GeneratedNetwork,
    stream: &mut Stream,
    order: &mut [u32],
    board: &mut BoardNetwork,
) {
    board.clear();
    board.fact_count = parameters.facts;
    draw_marked_facts(parameters, stream, order, board);

    let (fewest, most) = (parameters.premises_min, parameters.premises_max);
    board.premises.set_rows((0..parameters.rules).map(|_| stream.between(fewest, most)));
    draw_literals(parameters, stream, &mut board.premises);
    board.outputs.set_rows((0..parameters.rules).map(|_| 1));
    draw_literals(parameters, stream, &mut board.outputs);
    board.queues.set_rows((0..parameters.rules).map(|_| 1));
    for action in board.queues.items_mut() {
        *action = stream.below(parameters.actions);
    }
    board.action_outputs.set_rows((0..parameters.actions).map(|_| 1));
    draw_literals(parameters, stream, &mut board.action_outputs);
    board.index_readers();
}

/// Makes every entry of `table` a random fact, asserted.
fn draw_literals(parameters: &GeneratedNetwork, stream: &mut Stream, table: &mut Csr) {
    for entry in table.items_mut() {
        *entry = Literal::holds(FactId(stream.below(parameters.facts))).0;
    }
}

/// Draws the final facts, and the initially asserted ones among the others: the first places of a
/// random order (Fisher and Yates, stopped early), listed ascending.
fn draw_marked_facts(
    parameters: &GeneratedNetwork,
    stream: &mut Stream,
    order: &mut [u32],
    board: &mut BoardNetwork,
) {
    for (place, fact) in order.iter_mut().zip(0..) {
        *place = fact;
    }
    let marked = parameters.finals + parameters.initial;
    for place in 0..marked {
        let other = place + stream.below(parameters.facts - place);
        order.swap(place as usize, other as usize);
    }
    let (finals, rest) = order.split_at_mut(parameters.finals as usize);
    let initial = &mut rest[..parameters.initial as usize];
    finals.sort_unstable();
    initial.sort_unstable();
    board.finals.extend_from_slice(finals);
    board.initial.extend_from_slice(initial);
}

/// Draws all links, in the random order in which they are written.
fn draw_links(parameters: &GeneratedNetwork, craft_count: u32, stream: &mut Stream) -> Vec<Link> {
    let mut links = match parameters.linking {
        LinkingModel::PerBoard => draw_links_per_board(parameters, craft_count, stream),
        LinkingModel::DirectedSlotsPerPair => {
            let pairs = (0..craft_count)
                .flat_map(|first| (first + 1..craft_count).map(move |second| [first, second]))
                .collect::<Vec<_>>();
            draw_links_per_pair(parameters, &pairs, stream)
        }
        LinkingModel::Sparse => {
            draw_links_per_pair(parameters, &sparse_pairs(craft_count, parameters.degree), stream)
        }
        LinkingModel::Shared => unreachable!("invariant: shared facts are dealt, not linked"),
    };
    stream.shuffle(&mut links);
    links
}

/// For each of `pairs`, ascending, `links` times a random fact of the first board and one of the
/// second.
fn draw_links_per_pair(
    parameters: &GeneratedNetwork,
    pairs: &[[u32; 2]],
    stream: &mut Stream,
) -> Vec<Link> {
    let mut links = Vec::with_capacity(pairs.len() * parameters.links as usize);
    for &pair in pairs {
        for _ in 0..parameters.links {
            links.push(pair.map(|craft| draw_target(parameters, craft, stream)));
        }
    }
    links
}

/// For each board `links` times a random fact of it, a random other board and a random fact of that.
fn draw_links_per_board(
    parameters: &GeneratedNetwork,
    craft_count: u32,
    stream: &mut Stream,
) -> Vec<Link> {
    let mut links = Vec::new();
    if craft_count < 2 {
        return links;
    }
    for craft in 0..craft_count {
        for _ in 0..parameters.links {
            let own = draw_target(parameters, craft, stream);
            let other = stream.below(craft_count - 1);
            let other = if other < craft { other } else { other + 1 };
            links.push([own, draw_target(parameters, other, stream)]);
        }
    }
    links
}

/// A random fact of `craft`'s board.
#[inline]
fn draw_target(parameters: &GeneratedNetwork, craft: u32, stream: &mut Stream) -> Target {
    Target { craft: CraftId(craft), fact: FactId(stream.below(parameters.facts)) }
}

/// The linked pairs of boards of a sparse fleet, ascending: the edges of the binary tree first, then
/// ever longer chords of the ring of crafts, each taken while both ends have fewer than `degree`
/// neighbours.
fn sparse_pairs(craft_count: u32, degree: u32) -> Vec<[u32; 2]> {
    let tree = (1..craft_count).map(|craft| [(craft - 1) / 2, craft]);
    let chords = (1..=degree.min(craft_count.saturating_sub(1))).flat_map(|length| {
        (0..craft_count).map(move |craft| {
            let other = (craft + length) % craft_count;
            [craft.min(other), craft.max(other)]
        })
    });
    let mut neighbours = vec![Vec::new(); craft_count as usize];
    let mut pairs = Vec::new();
    for [first, second] in tree.chain(chords) {
        let is_full = |craft: u32| neighbours[craft as usize].len() >= degree as usize;
        let is_known = neighbours[first as usize].contains(&second);
        if !is_known && !is_full(first) && !is_full(second) {
            neighbours[first as usize].push(second);
            neighbours[second as usize].push(first);
            pairs.push([first, second]);
        }
    }
    pairs.sort_unstable();
    pairs
}

/// Writes each link into the slots of both its facts, overwriting what is there, and then every
/// board's slots into its table.
fn write_links(facts: u32, links: &[Link], boards: &mut [BoardNetwork]) {
    const EMPTY: Target = Target { craft: CraftId::NONE, fact: FactId(0) };
    let mut slots = vec![EMPTY; boards.len() * facts as usize];
    let slot_of = |end: Target| end.craft.index() * facts as usize + end.fact.index();
    for &[first, second] in links {
        slots[slot_of(first)] = second;
        slots[slot_of(second)] = first;
    }
    for (board, slots) in boards.iter_mut().zip(slots.chunks_exact(facts as usize)) {
        for slot in slots {
            if slot.craft != CraftId::NONE {
                board.links.push_item(slot.craft.0);
                board.links.push_item(slot.fact.0);
            }
            board.links.finish_row();
        }
    }
}

#[cfg(test)]
mod tests;
