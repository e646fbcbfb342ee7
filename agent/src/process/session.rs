//! The life of a craft's process between its start and its stop: epochs, turns, reports.
//!
//! One loop: read what has arrived, let the core step, publish what it planned, wait if nothing
//! came. The networks of an epoch lie in shared memory and are checked once; the view on them is lent
//! to every step. Generic over the endpoint, so that tests can drive it over the memory network.
//! Not here: the steps of open mode (`interval`), opening the endpoint and the process's first acts
//! (`run`).

mod interval;

use crate::craft::dispatch::dispatch;
use crate::craft::{Craft, Outbox};
use interval::Interval;
use shared_types::ids::{CraftId, Turn};
use shared_types::knowledge::{FleetView, NetworkError};
use shared_types::limits::REPORT_PART_BYTES;
use shared_types::time::Nanos;
use shared_types::transport::{Destination, Endpoint, SendError, WorldSample};
use shared_types::wire::{
    Class, EpochSpec, GO_JOINING, Header, Kind, MembershipChange, TrialReport, TurnCommand,
};
use zerocopy::{FromBytes, IntoBytes};

/// What the process asks of the system around it.
pub trait Surroundings<E> {
    /// The time.
    fn now(&self) -> Nanos;
    /// CPU time that the process has used, ns.
    fn cpu_ns(&self) -> u64;
    /// Resident memory of the process, bytes.
    fn resident_bytes(&self) -> u64;
    /// Its share of the memory that it has in common with others, and all of its own, bytes.
    fn proportional_bytes(&self) -> u64;
    /// What the kernel did with the process so far.
    fn usage(&self) -> Usage;
    /// Whether the process was told to end, or the orchestrator is gone.
    fn must_end(&self) -> bool;
    /// Something had arrived: the next wait begins with short ones again.
    fn stay_awake(&mut self);
    /// A long piece of work is done in which nobody was let run.
    fn beat(&self) {}
    /// Lets others run until something may have arrived.
    ///
    /// # Errors
    /// If the transport fails.
    fn rest(&mut self, endpoint: &mut E, rest: Rest) -> Result<(), SendError>;
}

/// What the kernel did with a process.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Usage {
    /// Time that it was ready and did not run, ns.
    pub run_delay_ns: u64,
    /// Times that it slept.
    pub sleeps: u64,
}

/// How a process lets others run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rest {
    /// Once, whatever the wake mode: there is more to do here.
    Yield,
    /// As the wake mode says; a process that has no part in the epoch sleeps at once.
    Wait {
        /// Whether it has a part in the epoch.
        takes_part: bool,
        /// When it must look up at the latest.
        until: Option<Nanos>,
    },
}

/// Why a session ended before it was stopped.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// The transport failed.
    #[error(transparent)]
    Transport(#[from] SendError),
    /// The networks of an epoch cannot be used.
    #[error(transparent)]
    Network(#[from] NetworkError),
    /// The networks of an epoch are those of a fleet, of so many crafts, in which this process has no place.
    #[error("networks of {1} crafts were published for process {0}: they are of another fleet")]
    OtherFleet(CraftId, u32),
}

/// What the loop has to do besides stepping.
#[derive(Clone, Debug)]
enum Order {
    Begin(EpochSpec),
    Connect,
    /// The trace begins at this time; whoever joins comes after it.
    Go(Nanos, bool),
    Tally(u32),
    Report,
    Membership(MembershipChange),
    Stop,
}

/// How serving one set of networks ended.
enum Served {
    /// The next epoch has other networks.
    Next(EpochSpec),
    /// The process shall end.
    Stop,
}

/// One process's session with its orchestrator.
#[derive(Debug)]
pub struct Session<E, S> {
    // Dropped before the endpoint: the surroundings hear that the end begins.
    surroundings: S,
    endpoint: E,
    craft: Craft,
    out: Outbox,
    orders: Vec<Order>,
    epoch: u32,
    /// CPU time when the epoch's first turn opened.
    cpu_start_ns: u64,
    /// The interval of an epoch of open mode.
    interval: Option<Interval>,
    has_reported: bool,
}

impl<E: Endpoint, S: Surroundings<E>> Session<E, S> {
    /// A session of the process whose core is `craft`.
    pub fn new(craft: Craft, endpoint: E, surroundings: S) -> Self {
        Self {
            endpoint,
            surroundings,
            craft,
            out: Outbox::default(),
            orders: Vec::new(),
            epoch: u32::MAX,
            cpu_start_ns: 0,
            interval: None,
            has_reported: true,
        }
    }

    /// Says that the process is up and serves epochs until it is told to stop.
    ///
    /// # Errors
    /// If the transport fails or an epoch's networks are damaged.
    pub fn run(mut self) -> Result<(), SessionError> {
        self.tell(Kind::Ready, &[])?;
        let Some(mut next) = self.await_first_epoch()? else { return Ok(()) };
        let mut world: Option<WorldSample> = None;
        loop {
            // The old networks are released before the new ones are taken.
            drop(world.take());
            let Some(sample) = self.await_world(next.network)? else { return Ok(()) };
            let fleet = FleetView::from_archive(&sample)?;
            self.surroundings.beat();
            let (craft, crafts) = (self.craft.id(), fleet.craft_count());
            if craft.0 > crafts {
                return Err(SessionError::OtherFleet(craft, crafts));
            }
            let served = self.serve(&fleet, &next)?;
            world = Some(sample);
            match served {
                Served::Next(spec) => next = spec,
                Served::Stop => return Ok(()),
            }
        }
    }

    fn await_first_epoch(&mut self) -> Result<Option<EpochSpec>, SessionError> {
        loop {
            let orders = &mut self.orders;
            let arrived = self.endpoint.drain(&mut |_, header, payload| {
                orders.extend(order(header, payload));
            })?;
            for order in std::mem::take(&mut self.orders) {
                match order {
                    Order::Begin(spec) => return Ok(Some(spec)),
                    Order::Stop => return Ok(None),
                    Order::Membership(change) => self.member_changed(change, None)?,
                    Order::Tally(question) => self.answer_tally(question)?,
                    Order::Connect | Order::Go(..) | Order::Report => {}
                }
            }
            if self.surroundings.must_end() {
                return Ok(None);
            }
            self.rest(arrived)?;
        }
    }

    /// The networks published for epoch `network`; `None` if the process shall end.
    fn await_world(&mut self, network: u32) -> Result<Option<WorldSample>, SessionError> {
        loop {
            if let Some(sample) = self.endpoint.take_world()?
                && sample.header.epoch == network
            {
                return Ok(Some(sample));
            }
            if self.surroundings.must_end() {
                return Ok(None);
            }
            self.rest(0)?;
        }
    }

    /// Serves every epoch on `fleet`, beginning with `spec`.
    fn serve(&mut self, fleet: &FleetView<'_>, spec: &EpochSpec) -> Result<Served, SessionError> {
        let network = spec.network;
        self.begin(fleet, spec)?;
        loop {
            let arrived = match &self.interval {
                Some(_) => self.step_open(fleet)?,
                None => self.step(fleet)?,
            };
            let mut orders = std::mem::take(&mut self.orders);
            for order in orders.drain(..) {
                match order {
                    // Meant for a successor, which this process may be: it is in the epoch already, and
                    // whoever was to come in with it died.
                    Order::Begin(spec) if spec.epoch == self.epoch && !self.has_reported => {
                        self.tell(Kind::EpochReady, &[])?;
                    }
                    Order::Begin(spec) if spec.network == network => self.begin(fleet, &spec)?,
                    Order::Begin(spec) => return Ok(Served::Next(spec)),
                    Order::Connect => {
                        self.endpoint.update_connections()?;
                        self.tell(Kind::Connected, &[])?;
                    }
                    Order::Go(started, joins) => self.go(started, joins, fleet),
                    Order::Tally(question) => self.answer_tally(question)?,
                    Order::Report => self.end_epoch()?,
                    Order::Membership(change) => self.member_changed(change, Some(fleet))?,
                    Order::Stop => return Ok(Served::Stop),
                }
            }
            self.orders = orders;
            if self.surroundings.must_end() {
                return Ok(Served::Stop);
            }
            self.rest(arrived)?;
        }
    }

    /// Starts an epoch: boards reset, ports open. The orchestrator then hears that this process is
    /// ready.
    fn begin(&mut self, fleet: &FleetView<'_>, spec: &EpochSpec) -> Result<(), SessionError> {
        self.epoch = spec.epoch;
        self.has_reported = false;
        self.out.clear();
        self.craft.begin_epoch(spec, fleet);
        self.surroundings.beat();
        self.interval = spec.open.as_ref().map(|open| Interval::of(open, spec));
        self.endpoint.take_losses();
        self.endpoint.expose(None);
        self.endpoint.open_ports(&self.craft.peers(fleet))?;
        self.tell(Kind::EpochReady, &[])
    }

    /// One step: everything that has arrived, then everything that is to be sent.
    fn step(&mut self, fleet: &FleetView<'_>) -> Result<usize, SessionError> {
        // A report that was held back has waited for one look at the inboxes: this one.
        let held_before = self.craft.holds_report();
        let Self { endpoint, surroundings, craft, out, orders, epoch, cpu_start_ns, .. } = self;
        let arrived = endpoint.drain(&mut |_, header, payload| {
            match (header.class(), header.kind()) {
                (Some(class), Some(kind)) if class.is_between_crafts() => {
                    // A refusal is counted by the craft and changes nothing.
                    let _refusal = craft.receive(class, kind, header, payload, fleet, out);
                }
                (_, Some(Kind::TurnCommand)) if header.epoch == *epoch => {
                    let Ok(command) = TurnCommand::read_from_bytes(payload) else {
                        craft.counting_mut().counters.losses.refused += 1;
                        return;
                    };
                    if command.opened() == Some(Turn(0)) {
                        *cpu_start_ns = surroundings.cpu_ns();
                    }
                    craft.command(surroundings.now(), &command, fleet, out);
                }
                _ => match order(header, payload) {
                    Some(order) => orders.push(order),
                    None => craft.counting_mut().counters.losses.refused += 1,
                },
            }
        })?;
        if held_before || !self.craft.holds_report() {
            self.craft.settle(&mut self.out);
        }
        self.publish()?;
        if self.craft.has_upkeep() {
            // Nobody waits for it: others are rung first.
            self.endpoint.flush()?;
            self.endpoint.ring();
            let Self { craft, surroundings, .. } = self;
            craft.upkeep(fleet, &mut || surroundings.now());
        }
        Ok(arrived)
    }

    /// Sends the planned samples, then the ledger's lines, then (at the end) the trial report.
    fn publish(&mut self) -> Result<(), SessionError> {
        if !self.out.samples.is_empty() {
            let now = self.surroundings.now();
            dispatch(&mut self.endpoint, now, &mut self.out, &mut self.craft)?;
        }
        for index in 0..self.out.reports.len() {
            let report = self.out.reports[index];
            self.tell(Kind::TurnReport, report.as_bytes())?;
        }
        self.out.reports.clear();
        if std::mem::take(&mut self.out.is_finished) {
            self.report()?;
        }
        Ok(())
    }

    fn report(&mut self) -> Result<(), SessionError> {
        if self.has_reported {
            return Ok(());
        }
        self.has_reported = true;
        self.craft.counting_mut().counters.losses += self.endpoint.take_losses();
        let mut report = TrialReport {
            cpu_ns: self.surroundings.cpu_ns().saturating_sub(self.cpu_start_ns),
            resident_bytes: self.surroundings.resident_bytes(),
            ..self.craft.report()
        };
        self.add_interval(&mut report);
        self.craft.give_up();
        let archive = rkyv::to_bytes::<rkyv::rancor::Error>(&report)
            .expect("invariant: memory takes every archive");
        let parts = archive.chunks(REPORT_PART_BYTES);
        let count = u32::try_from(parts.len()).expect("invariant: reports are bounded");
        for (number, part) in (0..).zip(parts) {
            let mut header = Header::new(Class::Telemetry, Kind::TrialReport);
            (header.argument, header.firing_number) = (number, count);
            self.tell_with(header, part)?;
            self.await_outbox()?;
        }
        Ok(())
    }

    /// Waits until everything sent to the orchestrator lies in its inbox: no part of a report may be
    /// lost behind another. Others are not waited for: one may be dead.
    fn await_outbox(&mut self) -> Result<(), SessionError> {
        loop {
            self.endpoint.flush()?;
            let is_held_back = self.endpoint.holds_back(Destination::Orchestrator);
            if !is_held_back || self.surroundings.must_end() {
                return Ok(());
            }
            self.endpoint.ring();
            self.surroundings.rest(&mut self.endpoint, Rest::Yield)?;
        }
    }

    /// Tells the orchestrator something.
    fn tell(&mut self, kind: Kind, payload: &[u8]) -> Result<(), SessionError> {
        self.tell_with(Header::new(Class::Control, kind), payload)
    }

    fn tell_with(&mut self, mut header: Header, payload: &[u8]) -> Result<(), SessionError> {
        header.epoch = self.epoch;
        header.published_ns = self.surroundings.now().0;
        self.endpoint.send(Destination::Orchestrator, header, payload.len(), &mut |slot| {
            slot.copy_from_slice(payload);
        })?;
        Ok(())
    }

    /// Rings for what was sent, retries what waits, and lets others run: a step ends with empty
    /// inboxes, so the next look pays only after that.
    fn rest(&mut self, arrived: usize) -> Result<(), SessionError> {
        // In this order: what leaves the outbox now is rung for as well.
        self.endpoint.flush()?;
        self.endpoint.ring();
        if arrived > 0 {
            self.surroundings.stay_awake();
        }
        let takes_part = self.craft.takes_part();
        let until = self.interval.as_ref().and_then(Interval::next_look);
        let rest =
            if self.craft.holds_report() { Rest::Yield } else { Rest::Wait { takes_part, until } };
        Ok(self.surroundings.rest(&mut self.endpoint, rest)?)
    }
}

/// What a control message asks for.
fn order(header: &Header, payload: &[u8]) -> Option<Order> {
    match header.kind()? {
        Kind::EpochBegin => EpochSpec::from_archive(payload)
            .filter(|spec| spec.epoch == header.epoch)
            .map(Order::Begin),
        Kind::Connect => Some(Order::Connect),
        Kind::Go => Some(Order::Go(Nanos(header.intended_ns), header.argument == GO_JOINING)),
        Kind::Tally => Some(Order::Tally(header.argument)),
        Kind::EpochEnd => Some(Order::Report),
        Kind::Membership => MembershipChange::read_from_bytes(payload).ok().map(Order::Membership),
        Kind::Stop => Some(Order::Stop),
        _ => None,
    }
}
