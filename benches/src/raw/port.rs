//! Services and ports of a raw measurement: publish/subscribe of bytes with a plain header.

use super::RawError;
use super::area::AreaName;
use super::link::{Link, Peers};
use iceoryx2::node::Node;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::prelude::*;
use iceoryx2::service::builder::publish_subscribe::Builder;
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;
use std::borrow::Cow;

/// Bytes of every sample.
pub const PAYLOAD_BYTES: usize = 128;

/// Samples that a subscriber holds per publisher where peers wait for each other: a peer is at most
/// one round ahead, so two would do.
pub(super) const TURN_BY_TURN_SAMPLES: usize = 4;

/// The header of every sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
pub struct SampleHeader {
    /// The process that sent it.
    pub source: u32,
    /// Number of the round or of the round trip.
    pub number: u32,
    /// When it was sent, ns of `CLOCK_MONOTONIC`; 0 where the measurement takes no stamps.
    pub published_ns: u64,
}

/// One publish/subscribe service of a measurement.
#[derive(Clone, Debug)]
pub struct ServicePlan {
    /// Its name.
    pub name: Cow<'static, str>,
    /// How many processes publish.
    pub publishers: usize,
    /// How many processes subscribe.
    pub subscribers: usize,
    /// Samples that a subscriber holds per publisher.
    pub buffered_samples: usize,
}

type Service = PortFactory<ipc::Service, [u8], SampleHeader>;

impl ServicePlan {
    fn create(&self, node: &Node<ipc::Service>) -> Result<Service, RawError> {
        self.builder(node)?.create().map_err(RawError::iceoryx("create the service"))
    }

    fn open(&self, node: &Node<ipc::Service>) -> Result<Service, RawError> {
        self.builder(node)?.open().map_err(RawError::iceoryx("open the service"))
    }

    fn builder(
        &self,
        node: &Node<ipc::Service>,
    ) -> Result<Builder<[u8], SampleHeader, ipc::Service>, RawError> {
        let name = ServiceName::new(&self.name).map_err(RawError::iceoryx("service name"))?;
        // The parent and every child hold the service; a process may both publish and subscribe.
        let nodes = self.publishers + self.subscribers + 1;
        Ok(node
            .service_builder(&name)
            .publish_subscribe::<[u8]>()
            .user_header::<SampleHeader>()
            .max_publishers(self.publishers)
            .max_subscribers(self.subscribers)
            .max_nodes(nodes)
            .subscriber_max_buffer_size(self.buffered_samples)
            .history_size(0)
            .enable_safe_overflow(false))
    }
}

/// A node in `area`, without signal handlers of its own and silent unless something fails.
fn create_node(area: &AreaName) -> Result<Node<ipc::Service>, RawError> {
    set_log_level(LogLevel::Error);
    NodeBuilder::new()
        .config(&area.config()?)
        .signal_handling_mode(SignalHandlingMode::Disabled)
        .create::<ipc::Service>()
        .map_err(RawError::iceoryx("create the node"))
}

/// All services of a measurement; they exist as long as this does.
#[derive(Debug)]
pub struct Services {
    _services: Vec<Service>,
    _node: Node<ipc::Service>,
}

impl Services {
    /// Creates a service for each of `plans` in `area`; the parent does, and holds them while the
    /// children run.
    ///
    /// # Errors
    /// If iceoryx2 refuses.
    pub fn create(area: &AreaName, plans: &[ServicePlan]) -> Result<Self, RawError> {
        let node = create_node(area)?;
        let services = plans.iter().map(|plan| plan.create(&node)).collect::<Result<_, _>>()?;
        Ok(Self { _services: services, _node: node })
    }
}

/// The ports of one child: what it sends through and what it receives through.
#[derive(Debug)]
pub struct Ports {
    sender: Sender,
    receiver: Receiver,
    // Last: ports go before what they belong to.
    _node: Node<ipc::Service>,
}

impl Ports {
    /// Opens a publisher on `sends_on` and a subscriber on `receives_on`.
    ///
    /// # Errors
    /// If iceoryx2 refuses.
    pub fn open(
        area: &AreaName,
        sends_on: &ServicePlan,
        receives_on: &ServicePlan,
    ) -> Result<Self, RawError> {
        let node = create_node(area)?;
        let (sender, receiver) =
            (Sender::open(&node, sends_on)?, Receiver::open(&node, receives_on)?);
        Ok(Self { sender, receiver, _node: node })
    }

    /// Connects to every port that exists by now.
    ///
    /// # Errors
    /// If iceoryx2 refuses.
    pub fn connect(&self) -> Result<(), RawError> {
        self.sender.connect()?;
        self.receiver.connect()
    }
}

/// The ports of one child that has a service of its own to receive from, and sends on everybody else's.
#[derive(Debug)]
pub struct Mesh {
    senders: Vec<Sender>,
    receiver: Receiver,
    // Last: ports go before what they belong to.
    _node: Node<ipc::Service>,
}

impl Mesh {
    /// Opens a publisher on each of `peers` and a subscriber on `own`.
    ///
    /// # Errors
    /// If iceoryx2 refuses.
    pub fn open(
        area: &AreaName,
        own: &ServicePlan,
        peers: &[ServicePlan],
    ) -> Result<Self, RawError> {
        let node = create_node(area)?;
        let senders =
            peers.iter().map(|peer| Sender::open(&node, peer)).collect::<Result<_, _>>()?;
        Ok(Self { senders, receiver: Receiver::open(&node, own)?, _node: node })
    }

    /// Connects to every port that exists by now.
    ///
    /// # Errors
    /// If iceoryx2 refuses.
    pub fn connect(&self) -> Result<(), RawError> {
        self.senders.iter().try_for_each(Sender::connect)?;
        self.receiver.connect()
    }
}

impl Peers for Mesh {
    #[inline]
    fn try_send(&mut self, peer: usize, header: SampleHeader) -> Result<bool, RawError> {
        Ok(self.senders[peer].try_send(header)? > 0)
    }

    #[inline]
    fn receive(&mut self) -> Result<Option<SampleHeader>, RawError> {
        self.receiver.receive()
    }
}

impl Link for Ports {
    #[inline]
    fn send(&mut self, header: SampleHeader) -> Result<(), RawError> {
        self.sender.send(header)
    }

    #[inline]
    fn receive(&mut self) -> Result<Option<SampleHeader>, RawError> {
        self.receiver.receive()
    }
}

/// What one child sends through.
#[derive(Debug)]
struct Sender {
    publisher: Publisher<ipc::Service, [u8], SampleHeader>,
    subscribers: usize,
}

impl Sender {
    /// Opens the service and a publisher on it.
    fn open(node: &Node<ipc::Service>, plan: &ServicePlan) -> Result<Self, RawError> {
        let publisher = plan
            .open(node)?
            .publisher_builder()
            .initial_max_slice_len(PAYLOAD_BYTES)
            .allocation_strategy(AllocationStrategy::Static)
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .create()
            .map_err(RawError::iceoryx("create the publisher"))?;
        Ok(Self { publisher, subscribers: plan.subscribers })
    }

    /// Connects to every subscriber that exists by now.
    fn connect(&self) -> Result<(), RawError> {
        self.publisher.update_connections().map_err(RawError::iceoryx("connect the publisher"))
    }

    /// Sends one sample, filled with the low byte of its number.
    /// It must reach every subscriber of the service.
    #[inline]
    fn send(&self, header: SampleHeader) -> Result<(), RawError> {
        let reached = self.try_send(header)?;
        if reached == self.subscribers {
            Ok(())
        } else {
            let expected = self.subscribers;
            Err(RawError::Lost { number: header.number, reached, expected })
        }
    }

    /// Sends one sample to every subscriber that has room for it; returns how many had.
    #[inline]
    fn try_send(&self, header: SampleHeader) -> Result<usize, RawError> {
        let mut sample = self
            .publisher
            .loan_slice_uninit(PAYLOAD_BYTES)
            .map_err(RawError::iceoryx("loan a sample"))?;
        *sample.user_header_mut() = header;
        sample
            .write_from_slice(&[low_byte(header.number); PAYLOAD_BYTES])
            .send()
            .map_err(RawError::iceoryx("send a sample"))
    }
}

/// What one child receives through.
#[derive(Debug)]
struct Receiver {
    subscriber: Subscriber<ipc::Service, [u8], SampleHeader>,
}

impl Receiver {
    /// Opens the service and a subscriber on it.
    fn open(node: &Node<ipc::Service>, plan: &ServicePlan) -> Result<Self, RawError> {
        let subscriber = plan
            .open(node)?
            .subscriber_builder()
            .create()
            .map_err(RawError::iceoryx("create the subscriber"))?;
        Ok(Self { subscriber })
    }

    /// Connects to every publisher that exists by now.
    fn connect(&self) -> Result<(), RawError> {
        self.subscriber.update_connections().map_err(RawError::iceoryx("connect the subscriber"))
    }

    /// The header of the next sample, `None` if none has arrived.
    #[inline]
    fn receive(&self) -> Result<Option<SampleHeader>, RawError> {
        let received = self.subscriber.receive().map_err(RawError::iceoryx("receive a sample"))?;
        let Some(sample) = received else { return Ok(None) };
        let (header, payload) = (*sample.user_header(), sample.payload());
        if payload.len() == PAYLOAD_BYTES && payload.last() == Some(&low_byte(header.number)) {
            Ok(Some(header))
        } else {
            Err(RawError::Unexpected(format!("payload with {header:?}")))
        }
    }
}

/// What every byte of the payload of sample `number` is.
pub(super) fn low_byte(number: u32) -> u8 {
    number.to_le_bytes()[0]
}
