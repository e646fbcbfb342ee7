//! The table of services: how each is called, who sends on it, how much it holds.
//!
//! Every service is created by the orchestrator and only opened by crafts. A destination names
//! exactly one service, and a service has one sequence per source; both adapters number by
//! [`Service`], so that a repaired multicast keeps the number that it was sent with. Not here: where
//! a run keeps its files (`paths`), and how services are created (`iceoryx`).

use super::Destination;
use crate::ids::CraftId;
use crate::limits;

/// A service of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Service {
    /// Samples for one craft (the centre is craft N).
    Inbox(CraftId),
    /// Samples for the orchestrator.
    OrchestratorInbox,
    /// From every craft to every other craft.
    Multicast,
    /// From the orchestrator to every craft: turns, epochs, start and stop.
    Turn,
    /// From the orchestrator to every craft: the networks of an epoch.
    World,
    /// Wakes one craft.
    Bell(CraftId),
    /// Wakes the orchestrator.
    OrchestratorBell,
}

impl Service {
    /// The name under which the service is created and opened.
    #[must_use]
    pub fn name(self) -> String {
        match self {
            Self::Inbox(craft) => format!("inbox/{craft}"),
            Self::OrchestratorInbox => "inbox/orchestrator".to_owned(),
            Self::Multicast => "multicast".to_owned(),
            Self::Turn => "turn".to_owned(),
            Self::World => "world".to_owned(),
            Self::Bell(craft) => format!("bell/{craft}"),
            Self::OrchestratorBell => "bell/orchestrator".to_owned(),
        }
    }

    /// Samples of one sender that a receiver holds before the sender is told that it is full.
    #[must_use]
    pub const fn capacity(self) -> usize {
        match self {
            Self::Inbox(_) | Self::Multicast | Self::Turn => limits::INBOX_SAMPLES,
            Self::OrchestratorInbox => limits::ORCHESTRATOR_INBOX_SAMPLES,
            Self::World | Self::Bell(_) | Self::OrchestratorBell => 1,
        }
    }
}

impl Destination {
    /// The service that takes samples for this destination.
    #[must_use]
    pub const fn service(self) -> Service {
        match self {
            Self::Craft(craft) => Service::Inbox(craft),
            Self::Orchestrator => Service::OrchestratorInbox,
            Self::Multicast => Service::Multicast,
            Self::Turn => Service::Turn,
            Self::World => Service::World,
        }
    }

    /// What a header's destination field says: the receiver, or nobody in particular.
    #[must_use]
    pub const fn address(self) -> CraftId {
        match self {
            Self::Craft(craft) => craft,
            Self::Orchestrator => CraftId::ORCHESTRATOR,
            Self::Multicast | Self::Turn | Self::World => CraftId::NONE,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{CraftId, Service};
    use std::collections::BTreeSet;

    #[test]
    fn names_of_a_fleet_are_all_different() {
        let mut services = vec![
            Service::OrchestratorInbox,
            Service::Multicast,
            Service::Turn,
            Service::World,
            Service::OrchestratorBell,
        ];
        for craft in 0..=crate::limits::REAL_CRAFTS_MAX {
            services.extend([Service::Inbox(CraftId(craft)), Service::Bell(CraftId(craft))]);
        }
        let names: BTreeSet<String> = services.iter().map(|service| service.name()).collect();
        assert_eq!(names.len(), services.len());
    }
}
