//! `full`: every firing's changes go to everybody by one multicast.

use super::{Context, Plans, Recipient, Strategy};
use shared_types::ids::FactId;
use shared_types::knowledge::{BoardView, Change};
use shared_types::transport::Peers;

/// One multicast a firing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Full;

impl Strategy for Full {
    fn plan(&mut self, context: &Context<'_>, changes: &[Change], plans: &mut Plans) {
        plans.send_all([Recipient::Everybody], changes.iter().copied());
        if !plans.requests.is_empty() {
            plans.owed = context.fleet.craft_count() - 1;
        }
    }

    fn replicates(&self, _: &BoardView<'_>, _: FactId) -> bool {
        true
    }

    fn peers(&self, _: &Context<'_>) -> Peers {
        Peers { unicast: Vec::new(), sends_multicast: true, receives_multicast: true }
    }
}
