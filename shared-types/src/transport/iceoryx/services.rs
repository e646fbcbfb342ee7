//! Quality of service, and creating and opening services.
//!
//! The orchestrator creates all services and holds them for the whole run, so that none is ever
//! created by two processes or by one that is killed on the way. Bounds follow the fleet: any
//! process may publish to any inbox, and room is left for restarted crafts beside their dead selves.

use super::broadcast::Missed;
use super::endpoint::{EndpointOptions, IceoryxEndpoint};
use super::{BellFactory, Factory, Node, Publisher, Subscriber};
use crate::ids::{CraftId, Incarnation};
use crate::limits::{INBOX_PAYLOAD_BYTES, LOANS};
use crate::transport::WakeMode;
use crate::transport::paths::{PathsError, RunPaths};
use crate::transport::topic::Service;
use crate::wire::Header;
use iceoryx2::port::BackpressureAction;
use iceoryx2::prelude::{
    Alignment, AllocationStrategy, BackpressureStrategy, LogLevel, NodeBuilder, PortName,
    ServiceName, SignalHandlingMode, set_log_level,
};
use std::fmt::Debug;
use std::sync::Arc;

/// Why services could not be created or opened.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// The run cannot live at its paths.
    #[error(transparent)]
    Paths(#[from] PathsError),
    /// iceoryx2 refused.
    #[error("{operation} `{name}` failed: {detail}")]
    Service {
        /// What was tried.
        operation: &'static str,
        /// On which service.
        name: String,
        /// What iceoryx2 said.
        detail: String,
    },
}

impl OpenError {
    pub(super) fn new(operation: &'static str, name: String, detail: impl Debug) -> Self {
        Self::Service { operation, name, detail: format!("{detail:?}") }
    }
}

/// What the services of a run must hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HostOptions {
    /// Crafts of the run; count the centre, if one is started.
    pub craft_count: u32,
    /// Longest payload of an inbox or multicast sample, in bytes.
    pub payload_bytes_max: usize,
    /// Payload that the world's memory is sized for at first, in bytes; it grows in powers of two.
    pub world_bytes: usize,
}

impl HostOptions {
    /// Options for `craft_count` crafts with bounds from the limits file.
    #[must_use]
    pub const fn new(craft_count: u32) -> Self {
        Self { craft_count, payload_bytes_max: INBOX_PAYLOAD_BYTES, world_bytes: 1 << 20 }
    }
}

/// All services of a run, created and held by the orchestrator.
#[derive(Debug)]
pub struct IceoryxHost {
    options: HostOptions,
    paths: RunPaths,
    _services: Vec<Factory>,
    _bells: Vec<BellFactory>,
    _node: Node,
}

impl IceoryxHost {
    /// Creates every service of the run of `paths`.
    ///
    /// # Errors
    /// If the paths are not usable or iceoryx2 refuses.
    pub fn create(paths: &RunPaths, options: HostOptions) -> Result<Self, OpenError> {
        let node = node_of(paths, options.craft_count)?;
        let bounds = Bounds::of(options.craft_count);
        let crafts = (0..options.craft_count).map(CraftId);
        let services =
            [Service::OrchestratorInbox, Service::Multicast, Service::Turn, Service::World]
                .into_iter()
                .chain(crafts.clone().map(Service::Inbox))
                .map(|service| bounds.create(&node, service))
                .collect::<Result<_, _>>()?;
        let bells = std::iter::once(Service::OrchestratorBell)
            .chain(crafts.map(Service::Bell))
            .map(|service| bounds.create_bell(&node, service))
            .collect::<Result<_, _>>()?;
        Ok(Self { options, paths: paths.clone(), _services: services, _bells: bells, _node: node })
    }

    /// What the services were created for.
    #[must_use]
    pub const fn options(&self) -> &HostOptions {
        &self.options
    }

    /// The orchestrator's own endpoint.
    ///
    /// # Errors
    /// If iceoryx2 refuses.
    pub fn endpoint(&self, wake: WakeMode) -> Result<IceoryxEndpoint, OpenError> {
        let options = EndpointOptions {
            craft_count: self.options.craft_count,
            payload_bytes_max: self.options.payload_bytes_max,
            world_bytes: self.options.world_bytes,
            wake,
            hears_turns: false,
        };
        IceoryxEndpoint::open(&self.paths, CraftId::ORCHESTRATOR, Incarnation(0), options)
    }

    /// Where the run lives.
    #[must_use]
    pub const fn paths(&self) -> &RunPaths {
        &self.paths
    }
}

/// A node of a run of `craft_count` crafts, without signal handlers and without iceoryx2's own log.
pub(super) fn node_of(paths: &RunPaths, craft_count: u32) -> Result<Node, OpenError> {
    set_log_level(LogLevel::Fatal);
    let mut config = paths.config()?;
    // Every receive looks through all slots of a subscriber, so there are no more than may be needed.
    config.defaults.publish_subscribe.subscriber_expired_connection_buffer =
        Bounds::of(craft_count).processes;
    NodeBuilder::new()
        .config(&config)
        .signal_handling_mode(SignalHandlingMode::Disabled)
        .create()
        .map_err(|error| OpenError::new("creating node", paths.prefix(), error))
}

/// Opens a service that the orchestrator has created.
pub(super) fn open(node: &Node, service: Service) -> Result<Factory, OpenError> {
    node.service_builder(&name_of(service)?)
        .publish_subscribe::<[u8]>()
        .user_header::<Header>()
        .payload_alignment(Alignment::ALIGN_16)
        .open()
        .map_err(|error| OpenError::new("opening", service.name(), error))
}

/// Opens a bell that the orchestrator has created.
pub(super) fn open_bell(node: &Node, service: Service) -> Result<BellFactory, OpenError> {
    node.service_builder(&name_of(service)?)
        .event()
        .open()
        .map_err(|error| OpenError::new("opening", service.name(), error))
}

fn name_of(service: Service) -> Result<ServiceName, OpenError> {
    let name = service.name();
    ServiceName::new(&name).map_err(|error| OpenError::new("naming", name, error))
}

/// How many ports services are made for.
struct Bounds {
    crafts: usize,
    /// Crafts and the orchestrator, each once more for a restart while its dead self is still listed.
    processes: usize,
}

/// Ports of dead processes count until they are reclaimed.
const RESTARTS: usize = 4;

/// A receiver holds one sample while it is visited; a world for a whole epoch, while the next is
/// already taken.
const BORROWED_SAMPLES: usize = 2;

impl Bounds {
    fn of(craft_count: u32) -> Self {
        let crafts = craft_count as usize;
        Self { crafts, processes: crafts + 1 + RESTARTS }
    }

    fn create(&self, node: &Node, service: Service) -> Result<Factory, OpenError> {
        let everybody = self.crafts + RESTARTS;
        let (publishers, subscribers) = match service {
            Service::Multicast => (everybody, everybody),
            Service::Turn | Service::World => (1, everybody),
            _ => (self.processes, 1),
        };
        let keeps_newest = service == Service::World;
        node.service_builder(&name_of(service)?)
            .publish_subscribe::<[u8]>()
            .user_header::<Header>()
            .payload_alignment(Alignment::ALIGN_16)
            .max_publishers(publishers)
            .max_subscribers(subscribers)
            .max_nodes(self.processes)
            .subscriber_max_buffer_size(service.capacity())
            .subscriber_max_borrowed_samples(BORROWED_SAMPLES)
            .history_size(usize::from(keeps_newest))
            .enable_safe_overflow(keeps_newest)
            .create()
            .map_err(|error| OpenError::new("creating", service.name(), error))
    }

    fn create_bell(&self, node: &Node, service: Service) -> Result<BellFactory, OpenError> {
        node.service_builder(&name_of(service)?)
            .event()
            .max_notifiers(self.processes)
            .max_listeners(1)
            .max_nodes(self.processes)
            .event_id_max_value(0)
            .create()
            .map_err(|error| OpenError::new("creating", service.name(), error))
    }
}

/// A publisher of `service` for payloads of up to `payload_bytes_max` bytes. It discards rather than
/// blocks; `missed` is told who did not get a sample.
pub(super) fn publish(
    factory: &Factory,
    service: Service,
    payload_bytes_max: usize,
    missed: Option<Arc<Missed>>,
) -> Result<Publisher, OpenError> {
    let growth = if service == Service::World {
        AllocationStrategy::PowerOfTwo
    } else {
        AllocationStrategy::Static
    };
    let mut builder = factory
        .publisher_builder()
        .initial_max_slice_len(payload_bytes_max)
        .allocation_strategy(growth)
        .max_loaned_samples(LOANS)
        .backpressure_strategy(BackpressureStrategy::DiscardData)
        .override_sample_preallocation(move |worst_case| worst_case.min(chunks_of(service)));
    if let Some(missed) = missed {
        builder = builder.set_backpressure_handler(move |info| {
            missed.note(info.receiver_port_id);
            BackpressureAction::DiscardData
        });
    }
    builder.create().map_err(|error| OpenError::new("publishing on", service.name(), error))
}

/// A subscriber of `service` for the craft `own`, whose name it carries.
pub(super) fn subscribe(
    factory: &Factory,
    service: Service,
    own: CraftId,
) -> Result<Subscriber, OpenError> {
    let failed = |error: &dyn Debug| OpenError::new("subscribing to", service.name(), error);
    let name = PortName::new(&own.to_string()).map_err(|error| failed(&error))?;
    factory.subscriber_builder().name(&name).create().map_err(|error| failed(&error))
}

/// Samples that the memory of one publisher holds. A broadcast would need as many for every single
/// receiver if they all stood still at different samples; instead of that a few such sets are kept,
/// and a broadcast that finds no memory goes out by unicast.
const fn chunks_of(service: Service) -> usize {
    const BROADCAST_SETS: usize = 4;
    let one_set = service.capacity() + BORROWED_SAMPLES;
    match service {
        Service::Multicast | Service::Turn => BROADCAST_SETS * one_set + LOANS,
        Service::World => WORLDS_ALIVE,
        _ => one_set + LOANS,
    }
}

/// Worlds that may be held at once: the newest, the one that crafts still read, and some spare.
const WORLDS_ALIVE: usize = 8;
