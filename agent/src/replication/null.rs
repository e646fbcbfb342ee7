//! `null`: nothing is replicated. The floor under every time and every count.

use super::{Context, Plans, Strategy};
use shared_types::knowledge::Change;
use shared_types::transport::Peers;

/// Sends nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Null;

impl Strategy for Null {
    fn plan(&mut self, _: &Context<'_>, _: &[Change], _: &mut Plans) {}

    fn expects_deliveries(&self) -> bool {
        false
    }

    fn peers(&self, _: &Context<'_>) -> Peers {
        Peers::default()
    }
}
