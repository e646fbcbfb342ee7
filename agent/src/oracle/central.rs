//! What the strategies with a centre must send: a conversation per craft, whose length depends on the
//! turns, the firings and the final facts, whose bytes on what firings output and links carried.

use super::expected::Ledger;
use super::replay::Replay;
use shared_types::ids::CraftId;
use shared_types::knowledge::FleetView;
use shared_types::wire::{Class, StrategyKind};

/// Counts the conversation of every craft with the centre.
///
/// A craft registers, asks each turn what to run, sends the result unless it was idle, checks every
/// final fact of its board (`central-batched` leaves that to the centre), and signs off. Each request
/// has one reply. Results carry the changes; a turn's changes of the asker's links ride on the first
/// reply of the next turn, the last turn's on the reply to the sign-off, so that each is one record.
pub(super) fn count(replay: &Replay, fleet: &FleetView<'_>, ledger: &mut Ledger) {
    let centre = CraftId(fleet.craft_count());
    let mut results = vec![0; fleet.boards.len()];
    let mut result_records = vec![0; fleet.boards.len()];
    let mut news_records = vec![0; fleet.boards.len()];
    for fired in &replay.firings {
        let changes = replay.changes(fired);
        results[fired.craft.index()] += 1;
        result_records[fired.craft.index()] += changes.len();
        for change in changes {
            for target in fleet.board(fired.craft).targets(change.fact) {
                news_records[target.craft.index()] += 1;
            }
        }
    }
    for craft in (0..fleet.craft_count()).map(CraftId) {
        let checks = match ledger.expected.strategy {
            StrategyKind::CentralBatched => 0,
            _ => fleet.board(craft).finals.len() as u64,
        };
        let requests = 2 + u64::from(replay.turns) * (1 + checks) + results[craft.index()];
        ledger.send(Class::Replication, craft, centre, requests, result_records[craft.index()]);
        ledger.send(Class::Reply, centre, craft, requests, news_records[craft.index()]);
        ledger.expected.processes[centre.index()].hops += requests;
        ledger.expected.processes[craft.index()].hops += requests;
    }
    ledger.expected.owed = vec![0; replay.firings.len()];
}
