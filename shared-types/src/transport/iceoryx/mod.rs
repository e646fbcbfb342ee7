//! The real adapter: shared memory between processes, over iceoryx2 0.10.
//!
//! The orchestrator creates every service of a run and holds it ([`IceoryxHost`]); it and the crafts
//! then open ports on them ([`IceoryxEndpoint`]). A sample is written once, into a loan of shared
//! memory, with our [`Header`] as its user header, and read where it lies. Every publisher discards
//! rather than blocks: a unicast that nobody took goes to the outbox, and whoever missed a broadcast
//! is told by name through the back-pressure handler and gets the sample by unicast. Nothing here
//! allocates per sample once buffers have grown; iceoryx2 itself allocates one small count per loan.
//!
//! Files: `services` (quality of service, creating, opening), `peers` (one slot per process that is
//! sent to), `endpoint` (the port itself), `sending` (its sending half), `broadcast` (one publisher to
//! many, and who missed), `wake` (bells and waiting), `descriptor` (the only unsafe code). Not here:
//! processes, and what dead ones leave behind (`reclaim`).

mod broadcast;
mod descriptor;
mod endpoint;
mod peers;
mod sending;
mod services;
mod wake;
mod world;

pub use endpoint::{EndpointOptions, IceoryxEndpoint};
pub use services::{HostOptions, IceoryxHost, OpenError};
pub use wake::{IdleWait, Wake};

use crate::wire::Header;
use iceoryx2::prelude::ipc;

type Factory =
    iceoryx2::service::port_factory::publish_subscribe::PortFactory<ipc::Service, [u8], Header>;
type BellFactory = iceoryx2::service::port_factory::event::PortFactory<ipc::Service>;
type Publisher = iceoryx2::port::publisher::Publisher<ipc::Service, [u8], Header>;
type Subscriber = iceoryx2::port::subscriber::Subscriber<ipc::Service, [u8], Header>;
type Sample = iceoryx2::sample::Sample<ipc::Service, [u8], Header>;
type Notifier = iceoryx2::port::notifier::Notifier<ipc::Service>;
type Listener = iceoryx2::port::listener::Listener<ipc::Service>;
type Node = iceoryx2::node::Node<ipc::Service>;
