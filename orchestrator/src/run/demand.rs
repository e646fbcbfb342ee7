//! What a fleet needs of its host, computed from the ports that its strategies open.

use super::plan::FleetPlan;
use crate::launch::resources::{Demand, EpochPorts, FleetShape, LOCKSTEP_SAMPLES_IN_FLIGHT};
use crate::scenario::compile;
use agent::replication::central::Client;
use agent::replication::centre::Centre;
use agent::replication::{Context, strategy};
use shared_types::ids::CraftId;
use shared_types::knowledge::{CsrView, FleetNetwork, FleetView};
use shared_types::limits::{INBOX_SAMPLES, PIPELINE_DEPTH};
use shared_types::scenario::Capacity;
use shared_types::trace::TraceRecord;
use shared_types::transport::Peers;
use shared_types::wire::{HEADER_BYTES, StrategyKind};

/// What the fleet of `plan` needs; its networks are taken to be as large as those of trial 0.
#[must_use]
pub fn demand(plan: &FleetPlan, seed: u64) -> Demand {
    let mut network = FleetNetwork::default();
    compile(&plan.scenario, seed, 0, &mut network);
    let fleet = network.view();
    let is_open = !plan.loads.is_empty() || !plan.searched.is_empty();
    let ports: Vec<(StrategyKind, Vec<Peers>)> =
        plan.strategies.iter().map(|&kind| (kind, peers(kind, &fleet))).collect();
    let recovers = is_open && plan.scenario.open_recovery().is_some();
    let ports: Vec<_> = ports
        .into_iter()
        .map(|(kind, peers)| (kind, if recovers { with_recovery(kind, peers) } else { peers }))
        .collect();
    let shape = FleetShape::of_epochs(ports.iter().map(|(kind, peers)| EpochPorts {
        peers,
        samples_in_flight: match kind {
            _ if is_open => INBOX_SAMPLES as u64,
            StrategyKind::Pipelined => PIPELINE_DEPTH as u64,
            _ => LOCKSTEP_SAMPLES_IN_FLIGHT,
        },
    }));
    let scenario = plan.scenario.scenario();
    let searched = scenario.capacity.bursts.iter().filter(|_| !plan.searched.is_empty());
    let stated = Some(&scenario.trace.burst).filter(|_| !plan.loads.is_empty());
    let burst = searched.chain(stated).max().map_or(0, |&burst| burst as usize);
    let records = most_outputs(&fleet).max(burst) * scenario.replication.record_bytes as usize;
    let loads = plan.loads.iter().map(|load| load.records);
    let probes = (!plan.searched.is_empty()).then(|| probe_records(&scenario.capacity));
    let trace = loads.chain(probes).max().unwrap_or(0);
    let world_bytes = network.to_archive().len() as u64 + trace * size_of::<TraceRecord>() as u64;
    shape.demand((HEADER_BYTES + records) as u64, world_bytes)
}

/// Records of the longest probe that a search for capacity may play.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "rates and lengths are above 0, and their product is bounded by the scenario's checks"
)]
fn probe_records(capacity: &Capacity) -> u64 {
    (capacity.highest_per_s * capacity.probe_s) as u64
}

/// The ports of every process under a strategy, the centre last.
fn peers(kind: StrategyKind, fleet: &FleetView<'_>) -> Vec<Peers> {
    let crafts = (0..fleet.craft_count()).map(CraftId);
    if kind.has_centre() {
        return crafts.map(|_| Client::peers(fleet)).chain([Centre::peers(fleet)]).collect();
    }
    let strategy = strategy(kind);
    crafts.map(|craft| strategy.peers(&Context { craft, fleet })).collect()
}

/// The same with the ports of recovery: without a centre everybody asks everybody.
fn with_recovery(kind: StrategyKind, mut peers: Vec<Peers>) -> Vec<Peers> {
    if !kind.has_centre() {
        let all: Vec<CraftId> = (0..peers.len()).map(CraftId::from_index).collect();
        for (own, peers) in peers.iter_mut().enumerate() {
            peers.unicast = all.iter().copied().filter(|craft| craft.index() != own).collect();
        }
    }
    peers
}

/// Facts that one firing writes at most.
fn most_outputs(fleet: &FleetView<'_>) -> usize {
    let longest =
        |rows: CsrView<'_>| (0..rows.row_count()).map(|row| rows.row(row).len()).max().unwrap_or(0);
    let of_board = |board: &shared_types::knowledge::BoardView<'_>| {
        longest(board.outputs).max(longest(board.action_outputs))
    };
    fleet.boards.iter().map(of_board).max().unwrap_or(0)
}
