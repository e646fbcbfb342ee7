//! From scenarios to what a run does: which fleets, what each plays, in which order, where.

use super::Refusal;
use super::execute::Scope;
use super::record::trace_from_file;
use crate::cli::CommonArguments;
use crate::launch::placement::{Placement, Processors};
use crate::results::record::Label;
use crate::run::capacity::Search;
use crate::run::offer::load_trial;
use crate::run::order::{balanced_orders, labels};
use crate::run::plan::{
    CapacityPlan, FleetPlan, LoadLabel, LoadPlan, Offered, OpenPlan, RunPlan, TimingPlan,
};
use crate::scenario::{ResolvedScenario, compile};
use crate::supervision::restart::RestartPolicy;
use crate::workload::{Trace, draw_at};
use shared_types::knowledge::FleetNetwork;
use shared_types::rng::{Purpose, Stream};
use shared_types::scenario::{
    Capacity, Faults, Fleet, LoadEntry, LoadStrategies, Restart, Scenario,
};
use shared_types::wire::StrategyKind;

/// How long a cell runs unmeasured before its times count, ns (MEASURING: at least 200 ms).
const WARM_UP_NS: u64 = 200_000_000;

/// Length of the slices in which time to knowledge is kept apart, ns (MEASURING: at least 100 ms); a
/// longer interval has longer ones.
const SLICE_NS: u64 = 100_000_000;

/// Most slices of an interval that are wanted.
const SLICES_WANTED: u64 = 100;

/// Epochs under `central` and `pipelined` together have this many turns: each takes a hundred round
/// trips a craft.
const TURNS_OF_ROUND_TRIPS: u32 = 100;

/// Orders of searches for capacity have this number, beyond those of all loads.
const CAPACITY_ORDERS: u32 = 1000;

/// Name of the load that `run.rate-per-s` states.
const STATED_LOAD: &str = "stated";

/// Name of the load that a file holds.
const FILE_LOAD: &str = "file";

/// What a run of `scenarios` does; of the sizes in `load_sizes` alone loads are offered.
pub(super) fn plan(
    scenarios: Vec<ResolvedScenario>,
    scope: Scope,
    load_sizes: Option<&[u32]>,
    common: &CommonArguments,
) -> Result<RunPlan, Refusal> {
    let Some(first) = scenarios.first().map(|scenario| scenario.scenario().clone()) else {
        return Err(Refusal::new("no fleet size is given: `--sizes 2,3` runs two"));
    };
    let is_simulated = first.run.mode.is_simulated();
    let is_open = first.run.mode.is_open();
    let epochs = first.run.timing_epochs;
    let is_timed = epochs > 0 && !is_simulated && !is_open && scope != Scope::Counts;
    let timing = is_timed.then(|| TimingPlan {
        epochs,
        turns: first.run.timing_turns,
        turns_of_round_trips: (TURNS_OF_ROUND_TRIPS / epochs).clamp(1, first.run.timing_turns),
        warm_up_ns: WARM_UP_NS,
    });
    let mut offers = Vec::new();
    for scenario in &scenarios {
        let is_loaded = load_sizes.is_none_or(|sizes| sizes.contains(&scenario.craft_count()));
        let is_wanted = is_loaded && scope != Scope::Counts;
        offers.push(if is_wanted { offered(scenario)? } else { Vec::new() });
    }
    let Capacity { bursts, .. } = &first.capacity;
    let is_searched = |scenario: &ResolvedScenario| {
        let is_wanted = load_sizes.is_none_or(|sizes| sizes.contains(&scenario.craft_count()));
        is_wanted && !bursts.is_empty() && !is_simulated && scope != Scope::Counts
    };
    let capacity = scenarios.iter().any(is_searched).then(|| capacity_plan(&first.capacity));
    let open = offers.iter().any(|offers| !offers.is_empty()).then(|| open_plan(&first, &offers));
    let processors = processors(&first.fleet)?;
    let mut draws = Stream::new(first.run.seed, 0, Purpose::Order, 0);
    let blocks =
        if is_timed || open.is_some() || capacity.is_some() { first.run.blocks } else { 1 };
    let mut orders: Vec<_> = scenarios
        .iter()
        .map(|scenario| orders_of(scenario, is_timed, blocks).into_iter())
        .collect();
    let mut loads: Vec<_> = scenarios
        .iter()
        .zip(&offers)
        .map(|(scenario, offers)| loads_of(scenario, offers, blocks).into_iter())
        .collect();
    let mut searches: Vec<_> = scenarios
        .iter()
        .map(|scenario| searches_of(scenario, is_searched(scenario), blocks).into_iter())
        .collect();
    let launches = (0..blocks).flat_map(|_| scenarios.iter().cloned().enumerate());
    let fleets = launches.map(|(fleet, scenario)| {
        let strategies = scenario.strategies().to_vec();
        let order = orders[fleet].next().unwrap_or_default();
        let loads = loads[fleet].next().unwrap_or_default();
        let has_centre = strategies.iter().any(|strategy| strategy.has_centre());
        let processes = scenario.craft_count() + u32::from(has_centre);
        let pinning = scenario.scenario().fleet.pinning;
        let placement = Placement::draw(&processors, pinning, processes, &mut draws);
        let searched = searches[fleet].next().unwrap_or_default();
        FleetPlan { scenario, strategies, order, loads, searched, placement }
    });
    Ok(RunPlan {
        fleets: fleets.collect(),
        seed: first.run.seed,
        trials: if scope == Scope::Times || is_open { 0 } else { first.run.trials },
        is_simulated,
        timing,
        open,
        capacity,
        wake: first.fleet.wake,
        turn_limit_ns: u64::from(first.run.turn_limit_ms) * 1_000_000,
        time_limit_s: common.time_limit_s,
        restart: restart_policy(&first.faults),
    })
}

/// How crafts that die are followed by successors.
fn restart_policy(faults: &Faults) -> Option<RestartPolicy> {
    (faults.restart == Restart::OnFailure).then(|| RestartPolicy {
        limit: faults.restart_limit,
        window_ns: u64::from(faults.restart_window_s) * 1_000_000_000,
        pause_ns: u64::from(faults.restart_pause_ms) * 1_000_000,
    })
}

/// What is timed in each block of a fleet, in which order.
fn orders_of(scenario: &ResolvedScenario, is_timed: bool, blocks: u32) -> Vec<Vec<Label>> {
    if !is_timed {
        return Vec::new();
    }
    let run = &scenario.scenario().run;
    let labels = labels(scenario.strategies(), blocks, run.controls);
    balanced_orders(&labels, blocks, &mut order_stream(scenario, 0))
}

/// Where the orders of a fleet come from: turn times are number 0, loads follow.
fn order_stream(scenario: &ResolvedScenario, number: u32) -> Stream {
    // Placement draws from the stream of craft 0; no fleet has no craft.
    let seed = scenario.scenario().run.seed;
    Stream::new(seed, number, Purpose::Order, scenario.craft_count())
}

/// A load that a fleet is offered, before anybody is asked to bear it.
struct Offer {
    name: String,
    offered: Offered,
    /// Records of its trace, on average.
    records: u64,
    strategies: LoadStrategies,
}

/// What the fleet of `scenario` is offered.
fn offered(scenario: &ResolvedScenario) -> Result<Vec<Offer>, Refusal> {
    let Scenario { run, trace, load, .. } = scenario.scenario();
    let mut network = FleetNetwork::default();
    compile(scenario, run.seed, load_trial(0), &mut network);
    let fleet = network.view();
    if let Some(path) = trace.file.as_ref().filter(|_| run.mode.is_open()) {
        let trace = trace_from_file(path, scenario, &fleet)?;
        return Ok(vec![Offer {
            name: FILE_LOAD.to_owned(),
            records: trace.crafts.iter().map(|records| records.len() as u64).sum(),
            offered: Offered::Given(trace),
            strategies: LoadStrategies::All,
        }]);
    }
    let stated = run.rate_per_s.filter(|_| load.is_empty() && run.mode.is_open());
    let stated = stated.map(|rate_per_s| LoadEntry {
        name: STATED_LOAD.to_owned(),
        rate_per_s,
        strategies: LoadStrategies::All,
    });
    let mut offers = Vec::new();
    for entry in load.iter().chain(&stated) {
        // No time at all: only whether there is something to write.
        draw_at(scenario.scenario(), (entry.rate_per_s, 0.0), &fleet, load_trial(0))?;
        let per_s = entry.rate_per_s + trace.reads_per_s;
        offers.push(Offer {
            name: entry.name.clone(),
            records: whole(per_s * run.duration_s.unwrap_or(0.0)),
            offered: Offered::Drawn { rate_per_s: entry.rate_per_s },
            strategies: entry.strategies,
        });
    }
    Ok(offers)
}

/// How long the loads last, and in which slices.
fn open_plan(scenario: &Scenario, offers: &[Vec<Offer>]) -> OpenPlan {
    let given = offers.iter().flatten().filter_map(|offer| match &offer.offered {
        Offered::Given(trace) => Some(length_ns(trace)),
        Offered::Drawn { .. } => None,
    });
    let duration_ns = match scenario.run.duration_s {
        Some(duration_s) => whole(duration_s * 1e9),
        None => given.max().unwrap_or(SLICE_NS),
    };
    let slice_ns = SLICE_NS.max(duration_ns.div_ceil(SLICES_WANTED));
    // On a virtual clock nothing grows warm.
    let warm_up_ns = if scenario.run.mode.is_simulated() { 0 } else { WARM_UP_NS };
    OpenPlan { duration_ns, slice_ns, warm_up_ns }
}

/// How capacity is searched.
fn capacity_plan(capacity: &Capacity) -> CapacityPlan {
    let duration_ns = whole(capacity.probe_s * 1e9);
    let slice_ns = SLICE_NS.max(duration_ns.div_ceil(SLICES_WANTED));
    let search = Search {
        first_per_s: capacity.first_per_s,
        lowest_per_s: Search::default().lowest_per_s.min(capacity.first_per_s),
        highest_per_s: capacity.highest_per_s,
        ..Search::default()
    };
    CapacityPlan {
        open: OpenPlan { duration_ns, slice_ns, warm_up_ns: WARM_UP_NS },
        search,
        bursts: capacity.bursts.clone(),
        percents: capacity.loads_percent.clone(),
    }
}

/// Whose capacity is searched in each block of a fleet, in which order: every strategy that sends, a
/// central one at its middle asking interval.
fn searches_of(scenario: &ResolvedScenario, is_searched: bool, blocks: u32) -> Vec<Vec<LoadLabel>> {
    let asks = &scenario.scenario().run.asks_every_ms;
    let middle = asks.get(asks.len() / 2).map(|&every| whole(every * 1e6));
    let sends = |kind: &StrategyKind| *kind != StrategyKind::Null && kind.plays_traces();
    let strategies =
        scenario.strategies().iter().copied().filter(|kind| is_searched && sends(kind));
    let labels: Vec<LoadLabel> = strategies
        .map(|strategy| LoadLabel {
            label: Label::first(strategy),
            asks_every_ns: middle.filter(|_| strategy.has_centre()),
        })
        .collect();
    balanced_orders(&labels, blocks, &mut order_stream(scenario, CAPACITY_ORDERS))
}

/// Until when a trace from a file lasts: a slice beyond its last record.
fn length_ns(trace: &Trace) -> u64 {
    let last = trace.crafts.iter().filter_map(|records| records.last());
    last.map(|record| record.at_ns).max().unwrap_or(0).saturating_add(SLICE_NS)
}

/// At least 1.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "times and numbers of records are above 0, and a year in ns fits"
)]
const fn whole(number: f64) -> u64 {
    if number < 1.0 { 1 } else { number as u64 }
}

/// The loads of each block of a fleet.
fn loads_of(scenario: &ResolvedScenario, offers: &[Offer], blocks: u32) -> Vec<Vec<LoadPlan>> {
    let Scenario { run, .. } = scenario.scenario();
    let asks: Vec<u64> = run.asks_every_ms.iter().map(|&every| whole(every * 1e6)).collect();
    let mut of_blocks: Vec<Vec<LoadPlan>> = (0..blocks).map(|_| Vec::new()).collect();
    for (number, offer) in (1..).zip(offers) {
        let bear = |strategy: &StrategyKind| {
            offer.strategies.include(*strategy) && strategy.plays_traces()
        };
        let strategies: Vec<StrategyKind> =
            scenario.strategies().iter().copied().filter(bear).collect();
        // Who is simulated twice does the same twice: there is nothing to compare it with itself for.
        let entries_of = if run.mode.is_simulated() { 1 } else { blocks };
        let mut entries = labels(&strategies, entries_of, false);
        if let (true, Some(twice)) = (run.controls, entries.iter().find(|entry| entry.again == 1)) {
            entries.push(Label { again: Label::UNSTAMPED, ..*twice });
        }
        let labels: Vec<LoadLabel> =
            entries.into_iter().flat_map(|label| asking(label, &asks)).collect();
        let orders = balanced_orders(&labels, blocks, &mut order_stream(scenario, number));
        for (block, order) in of_blocks.iter_mut().zip(orders) {
            let (name, offered) = (offer.name.clone(), offer.offered.clone());
            let records = offer.records;
            block.push(LoadPlan { name, offered, records, order });
        }
    }
    of_blocks
}

/// `label`, under a central strategy once for each asking interval.
fn asking(label: Label, asks: &[u64]) -> Vec<LoadLabel> {
    if !label.strategy.has_centre() {
        return vec![LoadLabel { label, asks_every_ns: None }];
    }
    asks.iter().map(|&every| LoadLabel { label, asks_every_ns: Some(every) }).collect()
}

/// The processors that the fleet may use.
pub(super) fn processors(fleet: &Fleet) -> Result<Processors, Refusal> {
    let all = Processors::of_this_process().map_err(|error| Refusal::new(error.to_string()))?;
    let cores_max = u32::try_from(all.core_count()).unwrap_or(u32::MAX);
    match fleet.cores {
        Some(cores) => {
            all.confined_to(cores.min(cores_max)).map_err(|error| Refusal::new(error.to_string()))
        }
        None => Ok(all),
    }
}
