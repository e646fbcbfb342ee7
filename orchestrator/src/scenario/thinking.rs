//! `[reasoning]`: whether crafts can think as the scenario asks for.

use super::error::{Finding, place};
use super::generate::shared_facts;
use shared_types::knowledge::BoardNetwork;
use shared_types::limits::PLANNED_ITEMS_MAX;
use shared_types::reasoning::Policy;
use shared_types::scenario::{GeneratedNetwork, LinkingModel, Scenario};
use shared_types::wire::StrategyKind;

/// Checks the section against the mission's `boards`, which are empty where networks are generated.
pub(super) fn check(
    scenario: &Scenario,
    crafts: u32,
    boards: &[BoardNetwork],
) -> Result<(), Finding> {
    let reasoning = scenario.reasoning;
    if reasoning.maintain_every_turns > 0 && reasoning.maintain_items == 0 {
        return Err(Finding::at(
            place!["reasoning", "maintain-items"],
            "a slice of maintenance that looks at nothing",
        )
        .help("give at least 1 (256 by default), or drop `maintain-every-turns`"));
    }
    if reasoning.policy != Policy::BestPath {
        return Ok(());
    }
    let policy = place!["reasoning", "policy"];
    let is_endless = match &scenario.network {
        Some(network) => network.finals == 0,
        None => boards.iter().all(|board| board.finals.is_empty()),
    };
    if is_endless {
        return Err(Finding::at(policy, "`best-path` leads nowhere: nothing is final")
            .help("name a final fact (`final` of a [[craft]], `network.finals`), or use `naive`"));
    }
    let items = match &scenario.network {
        Some(network) => generated_items(network, crafts),
        None => boards.iter().map(mission_items).sum(),
    };
    if items > PLANNED_ITEMS_MAX {
        return Err(Finding::at(
            policy,
            format!("`best-path` would plan over {items} facts, rules, actions and links"),
        )
        .help(format!(
            "at most {PLANNED_ITEMS_MAX} are accepted, since each craft keeps the cost of every fact \
             of the fleet; use fewer crafts, smaller boards, or `naive`"
        )));
    }
    Ok(())
}

/// What of the section does nothing.
pub(super) fn notices(scenario: &Scenario, strategies: &[StrategyKind]) -> Vec<String> {
    let reasoning = scenario.reasoning;
    let is_asked = reasoning.has_upkeep() || reasoning.policy != Policy::Random;
    let central = strategies.iter().find(|strategy| strategy.has_centre());
    let mut notices = Vec::new();
    if is_asked && scenario.run.mode.is_open() {
        notices.push("`[reasoning]` acts in turns; no rule runs in mode `open`".to_owned());
    } else if reasoning.has_upkeep()
        && let Some(strategy) = central
    {
        notices.push(format!(
            "crafts prune and maintain boards of their own; under `{strategy}` they have none"
        ));
    }
    notices
}

fn mission_items(board: &BoardNetwork) -> u64 {
    let view = board.view();
    let firings = view.premises.row_count() + view.action_outputs.row_count();
    u64::from(board.fact_count) + (firings + view.links.item_count() / 2) as u64
}

/// At most so many: where facts have one link slot each, every slot may be taken.
fn generated_items(network: &GeneratedNetwork, crafts: u32) -> u64 {
    let board = [network.facts, network.rules, network.actions].map(u64::from);
    let links = match network.linking {
        LinkingModel::Shared => {
            let sharers = u64::from(network.sharers);
            shared_facts(network, crafts) * (sharers + 1) * sharers
        }
        _ => u64::from(crafts) * u64::from(network.facts),
    };
    u64::from(crafts) * board.iter().sum::<u64>() + links
}
