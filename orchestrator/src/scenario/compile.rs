//! From a checked scenario to the network of a trial.
//!
//! A mission's network is the same in every trial and is built once; a generated one is drawn anew.

use super::draft::{BoardDraft, Shared};
use super::fleet::Craft;
use super::generate::generate;
use super::names::NameTable;
use super::resolve::ResolvedScenario;
use shared_types::ids::CraftId;
use shared_types::knowledge::{BoardNetwork, FleetNetwork};

/// Writes the network of `trial` of `seed` into `into`, whose memory is used again.
pub fn compile(scenario: &ResolvedScenario, seed: u64, trial: u32, into: &mut FleetNetwork) {
    match &scenario.scenario().network {
        Some(parameters) => generate(parameters, scenario.craft_count(), seed, trial, into),
        None => scenario.mission_boards().clone_into(&mut into.boards),
    }
    into.topology.clone_from(scenario.topology());
    into.script.clear();
}

/// The boards of a mission in ids, and what their ids are called.
pub(super) fn mission_boards(
    crafts: &[Craft],
    drafts: Vec<BoardDraft>,
    shared: &[Shared],
) -> (Vec<BoardNetwork>, NameTable) {
    let mut links: Vec<Vec<(u32, u32)>> = vec![Vec::new(); drafts.len()];
    for Shared { sharers, .. } in shared {
        for &(craft, fact) in sharers {
            let others = sharers.iter().filter(|(other, _)| *other != craft);
            for &(CraftId(other), other_fact) in others {
                links[craft.index()].push((fact.0, other));
                links[craft.index()].push((fact.0, other_fact.0));
            }
        }
    }
    let boards = drafts.iter().zip(&links).map(|(draft, links)| draft.network(links)).collect();
    let names = drafts.into_iter().map(BoardDraft::into_names).collect();
    (boards, NameTable::new(crafts, names))
}
