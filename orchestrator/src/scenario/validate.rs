//! Checks of single values: what is out of its bounds, or cannot be run yet.
//!
//! Not here: links (`links`), what concerns several crafts (`fleet`, `mission`, `positions`), and what is
//! offered in open mode (`offer`).

use super::capacity;
use super::error::{Finding, Place, place};
use super::fleet::{Craft, unknown_craft};
use super::generate::shared_facts;
use super::links;
use super::nearest::listing;
use super::offer;
use super::process_faults;
use shared_types::limits::{
    BLOCKS_MAX, BOARD_ITEMS_MAX, CHANGES_PER_FIRING_MAX, COST_MAX, COST_MIN, DURATION_TURNS_MAX,
    INBOX_PAYLOAD_BYTES, LIKELIHOOD_MIN, PREMISES_MAX, REAL_CRAFTS_MAX, RECORD_PADDING_BYTES_MAX,
    RESTART_WINDOW_S_MAX, SHARED_LINKS_MAX, TURNS_MAX,
};
use shared_types::scenario::{
    ActionEntry, GeneratedNetwork, LinkingModel, RECORD_BYTES_MIN, Replication, Restart, Scenario,
};
use shared_types::wire::StrategyKind;

/// Checks every number and name that stands for itself.
pub(super) fn check(scenario: &Scenario, crafts: &[Craft]) -> Result<(), Finding> {
    check_run(scenario)?;
    offer::check(scenario)?;
    capacity::check(scenario)?;
    check_replication(&scenario.replication)?;
    links::check(&scenario.link, crafts)?;
    check_faults(scenario, crafts)?;
    if scenario.fleet.cores == Some(0) {
        return Err(Finding::at(place!["fleet", "cores"], "a fleet on no cores")
            .help("give at least 1, or leave it out to use all"));
    }
    scenario.network.as_ref().map_or(Ok(()), |network| check_network(network, crafts.len()))
}

fn check_run(scenario: &Scenario) -> Result<(), Finding> {
    let run = &scenario.run;
    whole("turns", run.turns, 1, TURNS_MAX)?;
    whole("trials", run.trials, 1, u32::MAX)?;
    whole("turn-limit-ms", run.turn_limit_ms, 1, u32::MAX)?;
    whole("blocks", run.blocks, 1, BLOCKS_MAX)?;
    whole("timing-turns", run.timing_turns, 1, TURNS_MAX)?;
    if i64::try_from(run.seed).is_err() {
        return Err(Finding::at(place!["run", "seed"], "the seed does not fit 63 bits")
            .help(format!("use 0 to {}", i64::MAX)));
    }
    Ok(())
}

fn whole(key: &'static str, value: u32, least: u32, most: u32) -> Result<(), Finding> {
    if (least..=most).contains(&value) {
        return Ok(());
    }
    Err(Finding::at(place!["run", key], format!("`run.{key}` is {value}"))
        .help(format!("use {least} to {most}"))
        .label("out of bounds"))
}

pub(super) fn above_zero(
    place: Place,
    what: &str,
    value: f64,
    most: f64,
    unit: &str,
) -> Result<(), Finding> {
    if value > 0.0 && value <= most {
        return Ok(());
    }
    Err(Finding::at(place, format!("a {what} of {value} is impossible"))
        .help(format!("use more than 0 and at most {most} {unit}"))
        .label("out of bounds"))
}

fn check_replication(replication: &Replication) -> Result<(), Finding> {
    if let Some(strategies) = &replication.strategies {
        let place = place!["replication", "strategies"];
        if strategies.is_empty() {
            let known = StrategyKind::ALL.map(StrategyKind::name);
            return Err(Finding::at(place, "no strategy is chosen")
                .help(format!("choose among {}, or leave it out", listing(&known))));
        }
        for (index, strategy) in strategies.iter().enumerate() {
            if strategies[..index].contains(strategy) {
                return Err(Finding::at(
                    place.then(index),
                    format!("the strategy `{strategy}` is chosen twice"),
                )
                .help("keep one")
                .label("again"));
            }
        }
    }
    let most = RECORD_BYTES_MIN + RECORD_PADDING_BYTES_MAX;
    if !(RECORD_BYTES_MIN..=most).contains(&replication.record_bytes) {
        return Err(Finding::at(
            place!["replication", "record-bytes"],
            format!("a record of {} bytes is impossible", replication.record_bytes),
        )
        .help(format!("a record takes {RECORD_BYTES_MIN} bytes, with padding at most {most}"))
        .label("out of bounds"));
    }
    Ok(())
}

/// Whether `count` outputs of one firing fit one sample; `place` is where they are listed.
pub(super) fn check_outputs(count: usize, record_bytes: u32, place: &Place) -> Result<(), Finding> {
    let fitting = (INBOX_PAYLOAD_BYTES / record_bytes as usize).min(CHANGES_PER_FIRING_MAX);
    if count <= fitting {
        return Ok(());
    }
    Err(Finding::at(place.clone(), format!("{count} outputs of one firing are too many"))
        .help(format!("at most {fitting} records of {record_bytes} bytes fit one message")))
}

/// Whether the `cost` of the rule or action at `entry` is one that plans can add up.
pub(super) fn check_cost(cost: Option<f64>, entry: &Place) -> Result<(), Finding> {
    match cost {
        Some(cost) if !(COST_MIN..=COST_MAX).contains(&cost) => {
            Err(Finding::at(entry.then("cost"), format!("a cost of {cost} is impossible"))
                .help(format!("use {COST_MIN} to {COST_MAX}, or leave it out for 1"))
                .label("out of bounds"))
        }
        _ => Ok(()),
    }
}

/// Whether likelihood and duration of the action at `place` are ones.
pub(super) fn check_action(entry: &ActionEntry, place: &Place) -> Result<(), Finding> {
    if let Some(likelihood) = entry.likelihood
        && !(LIKELIHOOD_MIN..=1.0).contains(&likelihood)
    {
        return Err(Finding::at(
            place.then("likelihood"),
            format!("a likelihood of {likelihood} is impossible"),
        )
        .help(format!("use {LIKELIHOOD_MIN} to 1; what never happens needs no action"))
        .label("out of bounds"));
    }
    if let Some(duration) = entry.duration
        && !(1..=DURATION_TURNS_MAX).contains(&duration)
    {
        return Err(Finding::at(
            place.then("duration"),
            format!("a duration of {duration} turns is impossible"),
        )
        .help(format!("use 1 to {DURATION_TURNS_MAX}"))
        .label("out of bounds"));
    }
    Ok(())
}

fn check_faults(scenario: &Scenario, crafts: &[Craft]) -> Result<(), Finding> {
    let faults = &scenario.faults;
    if faults.restart == Restart::OnFailure && faults.restart_limit == 0 {
        return Err(Finding::at(place!["faults", "restart-limit"], "a limit of no restart")
            .help("give at least 1, or `restart = \"never\"`")
            .label("nobody would be restarted"));
    }
    if !(1..=RESTART_WINDOW_S_MAX).contains(&faults.restart_window_s) {
        let given = faults.restart_window_s;
        return Err(Finding::at(
            place!["faults", "restart-window-s"],
            format!("a window of {given} s is impossible"),
        )
        .help(format!("use 1 to {RESTART_WINDOW_S_MAX} s"))
        .label("out of bounds"));
    }
    for (index, fault) in scenario.faults.process.iter().enumerate() {
        let place = place!["faults", "process", index];
        check_craft(&fault.craft, &place, crafts)?;
        process_faults::check(fault, scenario, &place)?;
    }
    Ok(())
}

pub(super) fn check_craft(name: &str, entry: &Place, crafts: &[Craft]) -> Result<(), Finding> {
    if crafts.iter().any(|craft| craft.name == name) {
        return Ok(());
    }
    Err(Finding { place: entry.then("craft"), ..unknown_craft(name, crafts) })
}

fn check_network(network: &GeneratedNetwork, craft_count: usize) -> Result<(), Finding> {
    let at = |key: &'static str, message: String| Finding::at(place!["network", key], message);
    for (key, value) in
        [("facts", network.facts), ("rules", network.rules), ("actions", network.actions)]
    {
        if !(1..=BOARD_ITEMS_MAX).contains(&value) {
            return Err(at(key, format!("a board of {value} {key} is impossible"))
                .help(format!("use 1 to {BOARD_ITEMS_MAX}"))
                .label("out of bounds"));
        }
    }
    let needed = u64::from(network.initial) + u64::from(network.finals);
    if needed > u64::from(network.facts) {
        let key = if network.finals > network.facts { "finals" } else { "initial" };
        return Err(at(key, format!("{needed} initial and final facts of {}", network.facts))
            .help(format!(
                "initial facts are never final: `network.facts` must be at least {needed}"
            )));
    }
    if network.premises_min == 0 || network.premises_min > network.premises_max {
        return Err(at(
            "premises-min",
            format!("rules of {} to {} premises", network.premises_min, network.premises_max),
        )
        .help(format!("use 1 to `premises-max`, which is {}", network.premises_max)));
    }
    if network.premises_max > PREMISES_MAX {
        return Err(at(
            "premises-max",
            format!("rules of up to {} premises", network.premises_max),
        )
        .help(format!("use at most {PREMISES_MAX}")));
    }
    if network.links > BOARD_ITEMS_MAX {
        return Err(at("links", format!("{} links are too many", network.links))
            .help(format!("use 0 to {BOARD_ITEMS_MAX}")));
    }
    if network.linking == LinkingModel::Sparse && network.degree == 0 {
        return Err(at("degree", "boards without neighbours".to_owned())
            .help("give at least 1 (4 by default)"));
    }
    if network.linking.links_every_pair() && craft_count > REAL_CRAFTS_MAX as usize {
        return Err(at(
            "linking",
            format!(
                "`{}` links every pair: {craft_count} crafts are too many",
                network.linking.name()
            ),
        )
        .help(format!(
            "use `linking = \"sparse\"` (the preset `sparse`), or at most {REAL_CRAFTS_MAX} crafts"
        )));
    }
    if network.linking == LinkingModel::Shared {
        check_shared(network, craft_count)?;
    }
    Ok(())
}

/// Whether boundary facts can be shared as `linking = "shared"` asks for.
fn check_shared(network: &GeneratedNetwork, craft_count: usize) -> Result<(), Finding> {
    let at = |key: &'static str, message: String| Finding::at(place!["network", key], message);
    if !(0.0..=1.0).contains(&network.boundary_fraction) {
        return Err(at(
            "boundary-fraction",
            format!("a boundary fraction of {} is impossible", network.boundary_fraction),
        )
        .help("it is a share: 0 shares no fact, 0.1 every tenth, 1 all")
        .label("out of bounds"));
    }
    let others = u64::from(network.sharers);
    if others == 0 || others >= craft_count as u64 {
        let remedy = match craft_count {
            1 => "one craft shares with nobody; give the fleet two or more".to_owned(),
            _ => format!("use 1 to {}, the crafts of the fleet but one", craft_count - 1),
        };
        return Err(at(
            "sharers",
            format!("facts shared with {others} others of {craft_count} crafts"),
        )
        .help(remedy)
        .label("out of bounds"));
    }
    let craft_count = u32::try_from(craft_count).expect("invariant: fleets are below 2^32");
    let facts = shared_facts(network, craft_count);
    let needed = facts.saturating_mul(others + 1).saturating_mul(others);
    if needed > SHARED_LINKS_MAX {
        return Err(at(
            "sharers",
            format!(
                "{facts} shared facts need {needed} links, one from each sharer to every other"
            ),
        )
        .help(format!(
            "at most {SHARED_LINKS_MAX} are accepted; share less, or with fewer crafts"
        )));
    }
    Ok(())
}
