//! One step of a craft: receive → merge → agenda → draw → fire → changes → strategy plans.
//!
//! [`Craft`] is one process's core. Calls go down and plans come up: arrivals, commands and `now` are
//! arguments, and what shall be sent is put into the [`Outbox`], which [`dispatch`] publishes through
//! an endpoint. A craft is autonomous, a client of the centre, or the centre, as the epoch's strategy
//! says; in open mode it replays a trace instead. Not here: the clock, the transport, waiting (the shells).

mod autonomous;
pub mod dispatch;
mod open;
mod open_centre;
mod open_client;
mod open_state;
mod outbox;
mod playing;
mod recovering;
mod recovery;
mod schedule;

pub(crate) use outbox::header;
pub use outbox::{Counting, Held, Outbox, Outgoing};

use crate::metrics::Measured;
use crate::replication::central::Client;
use crate::replication::centre::Centre;
use autonomous::Autonomous;
use open::Open;
use open_centre::OpenCentre;
use open_client::OpenClient;
use recovery::{Question, Recovery};
use shared_types::ids::{CraftId, Firing};
use shared_types::knowledge::{Change, FleetView};
use shared_types::time::Nanos;
use shared_types::transport::Peers;
use shared_types::wire::{
    Class, EpochSpec, Header, Kind, Refusal, TrialReport, TurnCommand, TurnPhase, TurnReport,
};

/// Which part a process plays in an epoch.
#[derive(Debug)]
enum Role {
    /// No epoch yet, or the centre in an epoch that has none.
    Absent,
    /// Reasons on its own board and replicates.
    Autonomous(Box<Autonomous>),
    /// Replays a trace and replicates.
    Open(Box<Open>),
    /// Replays a trace through the centre.
    OpenClient(Box<OpenClient>),
    /// Holds all boards while a trace is replayed.
    OpenCentre(Box<OpenCentre>),
    /// Is told what to do.
    Client(Box<Client>),
    /// Holds all boards.
    Centre(Box<Centre>),
}

/// The core of one process.
#[derive(Debug)]
pub struct Craft {
    craft: CraftId,
    epoch: u32,
    /// Samples of epochs before this one are missed by nobody: those epochs were given up, or are of
    /// an earlier life.
    counts_from: u32,
    role: Role,
    counting: Counting,
    /// Copies of one sample that reach others, in this epoch: all others for a multicast.
    copies: u64,
    /// Records of the sample at hand.
    received: Vec<Change>,
    /// When they were meant to be made, where they carry that.
    received_intended: Vec<u64>,
    /// When what is received now arrived; open mode only.
    arrived: Nanos,
    measured: Measured,
    /// Processes that run on the same core only.
    beside: Vec<CraftId>,
    /// Which life of the craft this is.
    life: u32,
    /// Repair of losses, in epochs that want it.
    recovery: Option<Box<Recovery>>,
    questions: Vec<Question>,
}

impl Craft {
    /// The core of process `craft`; id N of a fleet of N is the centre.
    #[must_use]
    pub fn new(craft: CraftId) -> Self {
        Self {
            craft,
            epoch: u32::MAX,
            counts_from: 0,
            role: Role::Absent,
            counting: Counting::default(),
            copies: 1,
            received: Vec::new(),
            received_intended: Vec::new(),
            arrived: Nanos(0),
            measured: Measured::default(),
            beside: Vec::new(),
            life: 0,
            recovery: None,
            questions: Vec::new(),
        }
    }

    /// The same with the processes `beside` on its core, so that wake-ups are told apart.
    #[must_use]
    pub fn with_neighbours(self, beside: Vec<CraftId>) -> Self {
        Self { beside, ..self }
    }

    /// Starts an epoch: boards as before the first turn, counters at zero. In open mode nothing is
    /// played before [`Self::go`].
    pub fn begin_epoch(&mut self, spec: &EpochSpec, fleet: &FleetView<'_>) {
        self.epoch = spec.epoch;
        self.counts_from = self.counts_from.min(spec.epoch);
        self.counting.begin_epoch(spec, fleet.boards.len() + 1);
        let others = u64::from(fleet.craft_count()).saturating_sub(1);
        self.copies = if spec.strategy.multicasts() { others } else { 1 };
        self.begin_role(spec, fleet);
        self.begin_recovery(spec, fleet);
    }

    fn begin_role(&mut self, spec: &EpochSpec, fleet: &FleetView<'_>) {
        let is_centre = self.craft.0 == fleet.craft_count();
        if let Some(open) = &spec.open {
            return self.begin_open_epoch(spec, open, fleet);
        }
        match (&mut self.role, spec.strategy.has_centre(), is_centre) {
            (Role::Centre(centre), true, true) => centre.begin_epoch(spec, fleet),
            (Role::Client(client), true, false) => client.begin_epoch(self.craft, spec, fleet),
            (Role::Autonomous(craft), false, false) => craft.begin_epoch(self.craft, spec, fleet),
            (role, true, true) => {
                let mut centre = Box::<Centre>::default();
                centre.begin_epoch(spec, fleet);
                *role = Role::Centre(centre);
            }
            (role, true, false) => {
                let mut client = Box::<Client>::default();
                client.begin_epoch(self.craft, spec, fleet);
                *role = Role::Client(client);
            }
            (role, false, false) => {
                let mut craft = Box::new(Autonomous::new());
                craft.begin_epoch(self.craft, spec, fleet);
                *role = Role::Autonomous(craft);
            }
            (role, false, true) => *role = Role::Absent,
        }
    }

    /// Replaces the strategy of an autonomous craft: tests plant mutants this way.
    pub fn plant(&mut self, strategy: Box<dyn crate::replication::Strategy>) {
        if let Role::Autonomous(craft) = &mut self.role {
            craft.plant(strategy);
        }
    }

    /// Which process this is.
    #[must_use]
    pub const fn id(&self) -> CraftId {
        self.craft
    }

    /// Whether the process has a part in the epoch.
    #[must_use]
    pub const fn takes_part(&self) -> bool {
        !matches!(self.role, Role::Absent)
    }

    /// The ports that this epoch needs.
    #[must_use]
    pub fn peers(&self, fleet: &FleetView<'_>) -> Peers {
        let mut peers = match &self.role {
            Role::Absent => return Peers::default(),
            Role::Autonomous(craft) => craft.peers(fleet),
            Role::Open(craft) => craft.peers(fleet),
            Role::Client(_) | Role::OpenClient(_) => Client::peers(fleet),
            Role::Centre(_) | Role::OpenCentre(_) => Centre::peers(fleet),
        };
        self.add_recovery_peers(&mut peers);
        peers
    }

    /// Carries out a turn command that was given at `now`.
    pub fn command(
        &mut self,
        now: Nanos,
        command: &TurnCommand,
        fleet: &FleetView<'_>,
        out: &mut Outbox,
    ) {
        if let (Role::Autonomous(craft), Some(turn)) = (&mut self.role, command.closed()) {
            craft.close_turn(turn, fleet, &mut self.counting);
        }
        if let (true, Some(turn)) = (command.wants_merged != 0, command.closed()) {
            let is_final = match &self.role {
                Role::Autonomous(craft) => craft.has_final(fleet),
                _ => false,
            };
            out.reports.push(TurnReport {
                turn: turn.0,
                phase: TurnPhase::Merged as u32,
                firing: Firing::IDLE.0,
                owed: 0,
                held: 0,
                is_final: u32::from(is_final),
            });
        }
        if let Some(turn) = command.opened() {
            match &mut self.role {
                Role::Autonomous(craft) => {
                    craft.open_turn(now, turn, fleet, &mut self.counting, out);
                }
                Role::Client(client) => client.open_turn(now, turn, &mut self.counting, out),
                Role::Centre(centre) => centre.open_turn(turn),
                Role::Open(_) | Role::OpenClient(_) | Role::OpenCentre(_) | Role::Absent => {}
            }
        }
        if command.is_last != 0 {
            match &mut self.role {
                Role::Client(client) => client.sign_off(&mut self.counting, out),
                Role::Centre(_) => {}
                _ => out.is_finished = true,
            }
        }
    }

    /// Takes a verified sample of the classes replication, reply, repair and ack.
    ///
    /// # Errors
    /// If its records do not fill it, name something that does not exist, or do not belong to the
    /// conversation. The sample is counted as refused and changes nothing.
    pub fn receive(
        &mut self,
        class: Class,
        kind: Kind,
        header: &Header,
        payload: &[u8],
        fleet: &FleetView<'_>,
        out: &mut Outbox,
    ) -> Result<(), Refusal> {
        if header.epoch != self.epoch {
            self.count_late(class, header.epoch);
            return Ok(());
        }
        if let Some(recovery) = &mut self.recovery {
            recovery.look(self.arrived);
            if recovery.heard(header) {
                self.take_member(CraftId(header.source), false, fleet);
            }
        }
        let result = if kind.is_numbered() {
            self.take(class, kind, header, payload, fleet, out)
        } else {
            let counted = self.counting.received(class, header, payload.len());
            counted.and_then(|()| self.take_recovery(kind, header, payload, fleet, out))
        };
        if result.is_err() {
            self.counting.counters.losses.refused += 1;
        }
        self.call_back();
        result
    }

    /// Whether the report of a firing is held back for deliveries that are about to arrive: the
    /// shell lets others run once, takes what has come, and settles.
    #[must_use]
    pub fn holds_report(&self) -> bool {
        matches!(&self.role, Role::Autonomous(craft) if craft.holds_report())
    }

    /// Reports what is held back and what has arrived since the last report of the open turn.
    pub fn settle(&mut self, out: &mut Outbox) {
        if let Role::Autonomous(craft) = &mut self.role {
            craft.report(out);
        }
    }

    /// Whether the board is due to be pruned or maintained.
    #[must_use]
    pub fn has_upkeep(&self) -> bool {
        matches!(&self.role, Role::Autonomous(craft) if craft.has_upkeep())
    }

    /// Prunes and maintains the board between turns, where the scenario asks for it and it is due;
    /// `clock` times it.
    pub fn upkeep(&mut self, fleet: &FleetView<'_>, clock: &mut impl FnMut() -> Nanos) {
        if let Role::Autonomous(craft) = &mut self.role {
            craft.upkeep(fleet, clock);
        }
    }

    /// What the process counted in the epoch.
    pub fn counting_mut(&mut self) -> &mut Counting {
        &mut self.counting
    }

    /// The report of the epoch; CPU time and memory are the shell's to add.
    #[must_use]
    pub fn report(&self) -> TrialReport {
        let mut report = TrialReport {
            craft: self.craft.0,
            counters: self.counters(),
            open: self.report_open(),
            ..TrialReport::default()
        };
        match &self.role {
            Role::Absent | Role::Client(_) | Role::OpenClient(_) => {}
            Role::Autonomous(craft) => {
                report.board_digests = vec![(self.craft.0, craft.digest())];
                report.replica_digest = craft.replica_digest();
                report.reasoning = craft.reasoning();
            }
            Role::Open(craft) => {
                report.board_digests = vec![(self.craft.0, craft.board().digest())];
                report.replica_digest = craft.replica_digest();
            }
            Role::Centre(centre) => report.board_digests = centre.digests(),
            Role::OpenCentre(centre) => report.board_digests = centre.digests(),
        }
        report
    }

    fn take(
        &mut self,
        class: Class,
        kind: Kind,
        header: &Header,
        payload: &[u8],
        fleet: &FleetView<'_>,
        out: &mut Outbox,
    ) -> Result<(), Refusal> {
        // Nobody hears from itself, and a change is somebody's.
        let is_somebodys = header.origin != self.craft.0 && header.origin < fleet.craft_count();
        if header.source == self.craft.0 || (kind == Kind::Delta && !is_somebodys) {
            return Err(Refusal::Record);
        }
        let reader = self.read_changes(header, payload, fleet, false)?;
        if matches!(self.role, Role::OpenClient(_) | Role::OpenCentre(_)) {
            self.received_intended.clear();
            for intended_ns in reader.intended_ns() {
                self.received_intended.push(intended_ns.ok_or(Refusal::Length)?);
            }
        }
        // A repeat is the one delivery that its receiver missed, and is passed on like it; repairs are
        // counted where they are sent.
        let class = match (class, kind) {
            (Class::Repair, Kind::Reply) => Class::Reply,
            (Class::Repair, _) => Class::Replication,
            _ => class,
        };
        let header = &Header { class: class as u8, ..*header };
        self.counting.received(class, header, payload.len())?;
        let (changes, counting) = (&self.received[..], &mut self.counting);
        match (&mut self.role, kind) {
            (Role::Autonomous(craft), Kind::Delta) => {
                craft.receive_delta(header, changes, fleet, counting, out)
            }
            (Role::Open(craft), Kind::Delta) => {
                let books = (counting, &mut self.measured);
                craft.receive_delta(self.arrived, header, changes, fleet, books, out)
            }
            (Role::OpenClient(client), Kind::Reply) => {
                counting.counters.hops += u64::from(header.hop_count);
                let (records, books) =
                    ((changes, &self.received_intended[..]), (counting, &mut self.measured));
                client.receive_reply(self.arrived, header, records, fleet, books, out)
            }
            (Role::OpenCentre(centre), _) => {
                counting.counters.hops += u64::from(header.hop_count);
                let (records, books) =
                    ((changes, &self.received_intended[..]), (counting, &mut self.measured));
                centre.receive_request(self.arrived, (kind, header), records, fleet, books, out)
            }
            (Role::Client(client), Kind::Reply) => {
                counting.counters.hops += u64::from(header.hop_count);
                client.receive_reply(header, changes, fleet, counting, out)
            }
            (Role::Centre(centre), _) => {
                counting.counters.hops += u64::from(header.hop_count);
                centre.receive_request(kind, header, changes, fleet, counting, out)
            }
            _ => Err(Refusal::Kind),
        }
    }
}
