//! Who flies: the crafts of a scenario in order, their tree and their groups.

use super::error::{Finding, place};
use super::nearest::suggestion;
use shared_types::ids::CraftId;
use shared_types::knowledge::{NetworkError, Topology};
use shared_types::limits::{CRAFTS_MIN, REAL_CRAFTS_MAX, SIMULATED_CRAFTS_MAX};
use shared_types::scenario::{CraftCount, Scenario, Tier, Tree};
use std::collections::BTreeMap;

/// One craft; its id is its place in the fleet.
#[derive(Clone, Debug, PartialEq)]
pub struct Craft {
    /// Its name, unique in the fleet.
    pub name: String,
    /// Where it works.
    pub tier: Tier,
    /// Where it is, metres.
    pub position: Option<[f64; 3]>,
}

/// The crafts in order of their ids: as `[[craft]]` lists them, else numbered.
pub(super) fn crafts(scenario: &Scenario) -> Result<Vec<Craft>, Finding> {
    let listed = scenario.craft.len() as u64;
    let stated = scenario.fleet.crafts.as_ref().map(CraftCount::total);
    let count_place = place!["fleet", "crafts"];
    if listed > 0 && stated.is_some_and(|stated| stated != listed) {
        let stated = stated.unwrap_or_default();
        return Err(Finding::at(
            count_place,
            format!("`fleet.crafts` says {stated}, but [[craft]] lists {listed}"),
        )
        .help("leave `fleet.crafts` out where crafts are listed"));
    }
    let count = stated.unwrap_or(listed);
    check_count(scenario, count)?;
    if listed > 0 {
        return listed_crafts(scenario);
    }
    let numbered = |tier: Tier, word: &str, count: u32| -> Vec<Craft> {
        (0..count)
            .map(|number| Craft { name: format!("{word}-{number}"), tier, position: None })
            .collect()
    };
    Ok(match scenario.fleet.crafts.as_ref() {
        Some(CraftCount::ByTier(tiers)) => [
            numbered(Tier::Orbital, "orbital", tiers.orbital),
            numbered(Tier::Aerial, "aerial", tiers.aerial),
            numbered(Tier::Ground, "ground", tiers.ground),
        ]
        .concat(),
        Some(CraftCount::Number(count)) => numbered(Tier::Ground, "craft", *count),
        None => Vec::new(),
    })
}

/// Whether a fleet may have so many crafts in the scenario's mode.
fn check_count(scenario: &Scenario, count: u64) -> Result<(), Finding> {
    let place = if scenario.fleet.crafts.is_some() || scenario.craft.is_empty() {
        place!["fleet", "crafts"]
    } else {
        place!["craft"]
    };
    if count < u64::from(CRAFTS_MIN) {
        return Err(Finding::at(place, "the fleet has no crafts")
            .help("say how many (`fleet.crafts = 10`) or list them ([[craft]])"));
    }
    if count > u64::from(SIMULATED_CRAFTS_MAX) {
        return Err(Finding::at(
            place,
            format!("{count} crafts are more than the {SIMULATED_CRAFTS_MAX} that are accepted"),
        )
        .help(format!("use at most {SIMULATED_CRAFTS_MAX} in simulation")));
    }
    if !scenario.run.mode.is_simulated() && count > u64::from(REAL_CRAFTS_MAX) {
        return Err(Finding::at(
            place,
            format!(
                "{count} crafts are more than the {REAL_CRAFTS_MAX} real ones that one host takes"
            ),
        )
        .help(format!(
            "use at most {REAL_CRAFTS_MAX}, or simulate: `run.mode = \"simulated\"` takes up to \
             {SIMULATED_CRAFTS_MAX}"
        )));
    }
    Ok(())
}

fn listed_crafts(scenario: &Scenario) -> Result<Vec<Craft>, Finding> {
    let mut seen = BTreeMap::new();
    for (index, entry) in scenario.craft.iter().enumerate() {
        let place = place!["craft", index, "name"];
        check_name(&entry.name, "craft")
            .map_err(|finding| Finding { place: place.clone(), ..finding })?;
        if let Some(first) = seen.insert(entry.name.as_str(), index) {
            return Err(Finding::at(place, format!("two crafts are called `{}`", entry.name))
                .help(format!("rename one; the other is craft {first} (counted from 0)"))
                .label("the second"));
        }
        if entry.position.is_some_and(|position| position.iter().any(|metres| !metres.is_finite()))
        {
            return Err(Finding::at(
                place!["craft", index, "position"],
                "a position is not finite",
            )
            .help("give x, y and z in metres"));
        }
    }
    let craft = |entry: &shared_types::scenario::CraftEntry| Craft {
        name: entry.name.clone(),
        tier: entry.tier,
        position: entry.position,
    };
    Ok(scenario.craft.iter().map(craft).collect())
}

/// Whether `name` may name a craft, a fact or an action. The finding has no place yet.
pub(super) fn check_name(name: &str, what: &str) -> Result<(), Finding> {
    let is_allowed = |letter: char| letter.is_alphanumeric() || letter == '-' || letter == '_';
    if !name.is_empty() && name.chars().all(is_allowed) {
        return Ok(());
    }
    Err(Finding::at(place!["name"], format!("`{name}` cannot name a {what}"))
        .help("names are made of letters, digits, `-` and `_`"))
}

/// The ids of crafts by name.
pub(super) fn ids_by_name(crafts: &[Craft]) -> BTreeMap<&str, CraftId> {
    crafts
        .iter()
        .enumerate()
        .map(|(index, craft)| (craft.name.as_str(), CraftId::from_index(index)))
        .collect()
}

/// The finding that no craft is called `name`; without a place yet.
pub(super) fn unknown_craft(name: &str, crafts: &[Craft]) -> Finding {
    let names: Vec<&str> = crafts.iter().map(|craft| craft.name.as_str()).collect();
    Finding::at(place!["craft"], format!("there is no craft `{name}`"))
        .help(suggestion(name, "crafts", &names))
        .label("no such craft")
}

/// Which tree a scenario means.
pub(super) fn tree(scenario: &Scenario) -> Tree {
    let names_parents = scenario.craft.iter().any(|craft| craft.parent.is_some());
    let default = if names_parents { Tree::Listed } else { Tree::Binary };
    scenario.topology.tree.unwrap_or(default)
}

/// Tree and groups of the fleet.
pub(super) fn topology(scenario: &Scenario, crafts: &[Craft]) -> Result<Topology, Finding> {
    let parents = parents(scenario, crafts)?;
    let groups = groups(scenario, crafts)?;
    let first_root = parents.iter().position(|&parent| parent == CraftId::NONE.0);
    let second_root = parents.iter().rposition(|&parent| parent == CraftId::NONE.0);
    let name = |index: usize| crafts[index].name.as_str();
    Topology::new(parents, groups).map_err(|error| match (error, first_root, second_root) {
        (NetworkError::Cycle(craft), _, _) => Finding::at(
            place!["craft", craft.index(), "parent"],
            format!(
                "the tree has a cycle: from `{}` upwards no root is reached",
                name(craft.index())
            ),
        )
        .help("follow the parents upwards and cut the circle; one craft, the root, has no parent")
        .label("leads in a circle"),
        (NetworkError::Roots(count), Some(first), Some(second)) => Finding::at(
            place!["craft", second, "name"],
            format!("the tree is disconnected: {count} crafts have no parent"),
        )
        .help(format!(
            "only the root has none; give `{}` a parent (`parent = \"{}\"`)",
            name(second),
            name(first)
        ))
        .label("a second root"),
        (error, _, _) => Finding::at(place!["topology"], error.to_string())
            .help("every craft but the root names a parent that leads to the root"),
    })
}

/// Per craft its parent, [`CraftId::NONE`] for the root.
fn parents(scenario: &Scenario, crafts: &[Craft]) -> Result<Vec<u32>, Finding> {
    let tree = tree(scenario);
    if tree == Tree::Listed {
        let ids = ids_by_name(crafts);
        let parent_of = |(index, entry): (usize, &shared_types::scenario::CraftEntry)| {
            let Some(parent) = entry.parent.as_deref() else { return Ok(CraftId::NONE.0) };
            ids.get(parent).map(|id| id.0).ok_or_else(|| Finding {
                place: place!["craft", index, "parent"],
                ..unknown_craft(parent, crafts)
            })
        };
        if scenario.craft.is_empty() {
            return Err(Finding::at(place!["topology", "tree"], "nobody lists a parent").help(
                "list the crafts ([[craft]] with `parent`), or use `binary`, `chain` or `star`",
            ));
        }
        return scenario.craft.iter().enumerate().map(parent_of).collect();
    }
    if let Some(index) = scenario.craft.iter().position(|craft| craft.parent.is_some()) {
        return Err(Finding::at(
            place!["craft", index, "parent"],
            "a parent is stated, but the tree is not `listed`",
        )
        .help("set `topology.tree = \"listed\"`, or leave the parents out"));
    }
    let count = CraftId::from_index(crafts.len()).0;
    let above = |craft: u32| match (craft, tree) {
        (0, _) => CraftId::NONE.0,
        (_, Tree::Star) => 0,
        (_, Tree::Chain) => craft - 1,
        (_, Tree::Binary | Tree::Listed) => (craft - 1) / 2,
    };
    Ok((0..count).map(above).collect())
}

/// Per craft its group, numbered in order of appearance; empty where there are none.
fn groups(scenario: &Scenario, crafts: &[Craft]) -> Result<Vec<u32>, Finding> {
    let stated = scenario.craft.iter().position(|craft| craft.group.is_some());
    match (scenario.topology.group_size, stated) {
        (None, None) => Ok(Vec::new()),
        (Some(_), Some(index)) => Err(Finding::at(
            place!["craft", index, "group"],
            "groups are stated twice: here and by `topology.group-size`",
        )
        .help("keep one of the two")),
        (Some(0), None) => {
            Err(Finding::at(place!["topology", "group-size"], "groups of no crafts")
                .help("give at least 1, or leave it out"))
        }
        (Some(size), None) => {
            Ok((0..CraftId::from_index(crafts.len()).0).map(|craft| craft / size).collect())
        }
        (None, Some(first)) => {
            let mut numbers = BTreeMap::new();
            let group_of = |(index, entry): (usize, &shared_types::scenario::CraftEntry)| {
                let Some(group) = entry.group.as_deref() else {
                    return Err(Finding::at(
                        place!["craft", index, "name"],
                        format!("`{}` has no group, but `{}` has", entry.name, crafts[first].name),
                    )
                    .help("state a `group` for every craft or for none")
                    .label("no group"));
                };
                let next = CraftId::from_index(numbers.len()).0;
                Ok(*numbers.entry(group.to_owned()).or_insert(next))
            };
            scenario.craft.iter().enumerate().map(group_of).collect()
        }
    }
}
