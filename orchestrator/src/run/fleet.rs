//! A real fleet: one process per craft, started, played with over shared memory, and ended.
//!
//! Every wait in here is bounded and looks at three things besides the inbox: whether a process
//! ended, whether somebody asked for an end, and whether the run's time is up. Not here: how one
//! trial goes (`play`), what is played, and what follows from a loss (the run's loop).

use super::answers::Mute;
use super::backend::PlayError;
use super::inflict::Infliction;
use super::patience::Patience;
use super::recovery::{Life, Recovery};
use super::silence::Hearts;
use super::strike::{Strike, Struck};
use crate::launch::craft_process::CraftProcess;
use crate::launch::os_process::Launcher;
use crate::launch::placement::Placement;
use crate::launch::run_root::RunRoot;
use crate::supervision::restart::{RestartPolicy, Restarts};
use crate::supervision::shutdown::{Graces, ShutdownReport, end_fleet};
use crate::supervision::signals::Signals;
use crate::supervision::watch::Watch;
use agent::process::doom::Doom;
use shared_types::ids::CraftId;
use shared_types::time::Nanos;
use shared_types::transport::iceoryx::{HostOptions, IceoryxEndpoint, IceoryxHost, IdleWait, Wake};
use shared_types::transport::reclaim::Steps;
use shared_types::transport::{Destination, Endpoint, Peers, WakeMode, clock};
use shared_types::wire::{Class, EpochSpec, HEADER_BYTES, Header, Kind, Traffic};
use std::collections::BTreeMap;
use std::os::fd::AsFd;

/// The question that nobody asks in an interval: whether everything before it was heard.
pub(super) const LAST_QUESTION: u32 = u32::MAX;

/// Waits of the orchestrator between two looks at processes and signals while it only yields.
const WAITS_BETWEEN_LOOKS: u32 = 128;

/// What a fleet is started with.
#[derive(Clone, Debug)]
pub struct FleetOptions {
    /// Crafts, the centre not counted.
    pub crafts: u32,
    /// Whether a centre is started as one more process.
    pub has_centre: bool,
    /// How every process waits.
    pub wake: WakeMode,
    /// Where every process runs.
    pub placement: Placement,
    /// How long a turn may stay unbalanced, ns.
    pub turn_limit_ns: u64,
    /// How long every other answer may take, ns.
    pub answer_limit_ns: u64,
    /// When the run must be over.
    pub run_ends: Option<Nanos>,
    /// How crafts that die are followed by successors; `None` if they are not.
    pub restart: Option<RestartPolicy>,
    /// Who kills itself where, in the next life that is started.
    pub dooms: BTreeMap<CraftId, Doom>,
    /// What the janitor does for crafts that died.
    pub janitor: Steps,
}

impl FleetOptions {
    /// How many processes the fleet has.
    #[must_use]
    pub const fn processes(&self) -> u32 {
        self.crafts + self.has_centre as u32
    }
}

/// A fleet of living processes.
///
/// Fields are dropped in this order: first the processes, then ports and services, at last the
/// run's files.
#[derive(Debug)]
pub struct RealFleet<'a> {
    pub(super) watch: Watch,
    pub(super) endpoint: IceoryxEndpoint,
    _host: IceoryxHost,
    pub(super) root: RunRoot,
    pub(super) hearts: Hearts,
    pub(super) launcher: &'a Launcher,
    pub(super) signals: &'a mut Signals,
    idle: IdleWait,
    waits: u32,
    pub(super) patience: Patience,
    /// Who was killed because it did not answer.
    pub(super) mute: Vec<Mute>,
    pub(super) options: FleetOptions,
    /// Epoch whose networks the crafts hold.
    pub(super) network: Option<u32>,
    /// What the orchestrator sent of class control since the trial began.
    pub(super) control: Traffic,
    /// How much longer turns take on purpose, percent.
    pub(super) planted_slowdown_percent: u64,
    spawned: Nanos,
    pub(super) ready_ns: Option<u64>,
    /// By process.
    pub(super) lives: Vec<Life>,
    /// The number of the latest life: later ones have larger ones, whosever they are.
    pub(super) lives_given: u32,
    pub(super) restarts: Option<Restarts>,
    /// Those that are under way, and those that nobody has asked for.
    pub(super) recoveries: Vec<Recovery>,
    /// Number of the next question for tallies.
    pub(super) questions: u32,
    /// Faults that the next epoch, or the one under way, still has.
    pub(super) inflictions: Vec<Infliction>,
    /// Blows that are planned, the next one last, and those that were struck.
    pub(super) strikes: Vec<Strike>,
    pub(super) struck: Vec<Struck>,
}

/// Takes a message: from whom, what it is, its header and payload.
pub(super) type Visit<'a> = dyn FnMut(CraftId, Kind, &Header, &[u8]) + 'a;

/// How a fleet ended.
#[derive(Debug)]
pub struct FleetEnd {
    /// Who ended how.
    pub report: ShutdownReport,
    /// What could not be done: a process that could not be ended, files that could not be removed.
    pub trouble: Vec<String>,
}

impl<'a> RealFleet<'a> {
    /// Starts the processes of a fleet and waits until each is up.
    ///
    /// # Errors
    /// If services cannot be created, or a process cannot be started or ends; nothing is left.
    pub fn launch(
        options: FleetOptions,
        launcher: &'a Launcher,
        signals: &'a mut Signals,
    ) -> Result<Self, PlayError> {
        let failed = |what: &'static str| {
            move |error: &dyn std::error::Error| PlayError::Failed(format!("{what}: {error}"))
        };
        let root = RunRoot::create().map_err(|error| failed("no place for the run")(&error))?;
        // Crafts reckon with a centre, whether or not the fleet has one.
        let host = IceoryxHost::create(root.paths(), HostOptions::new(options.crafts + 1))
            .map_err(|error| failed("no services")(&error))?;
        let mut endpoint =
            host.endpoint(options.wake).map_err(|error| failed("no ports")(&error))?;
        let hearts = Hearts::create(root.paths(), options.processes())
            .map_err(|error| failed("no heartbeats")(&error))?;
        let centre = options.has_centre.then_some(CraftId(options.crafts));
        endpoint
            .open_ports(&Peers { unicast: centre.into_iter().collect(), ..Peers::default() })?;
        let spawned = clock::now();
        let mut fleet = Self {
            watch: Watch::new().map_err(|error| failed("no supervision")(&error))?,
            endpoint,
            _host: host,
            root,
            hearts,
            launcher,
            signals,
            idle: IdleWait::new(options.wake),
            waits: 0,
            patience: Patience::new(options.answer_limit_ns, spawned),
            mute: Vec::new(),
            network: None,
            control: Traffic::default(),
            planted_slowdown_percent: 0,
            spawned,
            ready_ns: None,
            lives: vec![Life::default(); options.processes() as usize],
            lives_given: 0,
            restarts: options.restart.map(Restarts::new),
            recoveries: Vec::new(),
            questions: 0,
            inflictions: Vec::new(),
            strikes: Vec::new(),
            struck: Vec::new(),
            options,
        };
        let arguments: Vec<_> =
            (0..fleet.options.processes()).map(|craft| fleet.arguments(CraftId(craft))).collect();
        let processes =
            launcher.spawn_all(arguments).map_err(|error| failed("no processes")(&error))?;
        for process in processes {
            fleet.watch.add(process).map_err(|error| failed("no supervision")(&error))?;
        }
        match fleet.await_up() {
            Err(PlayError::Lost(lost)) => fleet.replace(lost)?,
            ended => ended?,
        }
        Ok(fleet)
    }

    /// The living processes, by their numbers in the system.
    #[must_use]
    pub fn process_ids(&self) -> Vec<u32> {
        self.watch.living().map(CraftProcess::pid).collect()
    }

    /// Notes that the first turn opens now.
    pub(super) fn note_ready(&mut self, now: Nanos) {
        self.ready_ns.get_or_insert(now.since(self.spawned));
    }

    /// Ends every process and removes everything that the run left. Processes may end by themselves
    /// unless the user asks a second time.
    #[must_use]
    pub fn end(mut self) -> FleetEnd {
        // Who does not hear it is ended by signals.
        let _unheard = self.send(Destination::Turn, Kind::Stop, u32::MAX, &[]);
        if self.options.has_centre {
            let centre = Destination::Craft(CraftId(self.options.crafts));
            let _unheard = self.send(centre, Kind::Stop, u32::MAX, &[]);
        }
        let is_whole = self.watch.living().count() == self.options.processes() as usize;
        let ended = end_fleet(&mut self.watch, Graces::ORDERLY, Some(self.signals));
        let Self { watch, endpoint, _host, root, .. } = self;
        drop(watch);
        // Who died may have left something half done, on which dropping ports would wait for ever.
        match &ended {
            Ok(report) if is_whole && report.nobody_died() => drop((endpoint, _host)),
            _ => std::mem::forget((endpoint, _host)),
        }
        let mut trouble = Vec::from_iter(root.remove().err().map(|error| error.to_string()));
        let report = ended.unwrap_or_else(|error| {
            trouble.push(error.to_string());
            ShutdownReport::default()
        });
        FleetEnd { report, trouble }
    }

    /// Tells every process that takes part in the epoch something: crafts over the turn service, the
    /// centre, which does not listen to turns, over its inbox.
    pub(super) fn tell(
        &mut self,
        spec: &EpochSpec,
        kind: Kind,
        payload: &[u8],
    ) -> Result<(), PlayError> {
        self.tell_with(spec, Header::new(Class::Control, kind), payload)
    }

    /// The same with a header of the caller's.
    pub(super) fn tell_with(
        &mut self,
        spec: &EpochSpec,
        mut header: Header,
        payload: &[u8],
    ) -> Result<(), PlayError> {
        header.epoch = spec.epoch;
        if spec.strategy.has_centre() {
            let centre = Destination::Craft(CraftId(self.options.crafts));
            self.send_with(centre, header, payload)?;
        }
        self.send_with(Destination::Turn, header, payload)
    }

    pub(super) fn send(
        &mut self,
        to: Destination,
        kind: Kind,
        epoch: u32,
        payload: &[u8],
    ) -> Result<(), PlayError> {
        let mut header = Header::new(Class::Control, kind);
        header.epoch = epoch;
        self.send_with(to, header, payload)
    }

    pub(super) fn send_with(
        &mut self,
        to: Destination,
        mut header: Header,
        payload: &[u8],
    ) -> Result<(), PlayError> {
        header.published_ns = clock::now().0;
        self.control.transmissions += 1;
        self.control.bytes_sent += (HEADER_BYTES + payload.len()) as u64;
        self.endpoint.send(to, header, payload.len(), &mut |slot| slot.copy_from_slice(payload))?;
        self.endpoint.ring();
        Ok(())
    }

    /// Lets others run, then hands over what has arrived.
    pub(super) fn pump(&mut self, visit: &mut Visit<'_>) -> Result<(), PlayError> {
        self.rest()?;
        let Self { endpoint, lives, .. } = self;
        let arrived = endpoint.drain(&mut |_, header, payload| {
            if let Some(kind) = header.kind() {
                if kind == Kind::Ready
                    && let Some(life) = lives.get_mut(header.source as usize)
                {
                    life.is_ready |= life.incarnation.0 == header.incarnation;
                }
                visit(CraftId(header.source), kind, header, payload);
            }
        })?;
        if arrived > 0 {
            self.idle.reset();
        }
        Ok(())
    }

    /// Waits as the wake mode says. A sleeping orchestrator is woken by its bell, by a process that
    /// ends, and by a signal; one that only yields looks at these from time to time.
    fn rest(&mut self) -> Result<(), PlayError> {
        self.endpoint.flush()?;
        self.endpoint.ring();
        let others = [self.watch.as_fd(), self.signals.as_fd()];
        let look = self.patience.next_look();
        let until = self.options.run_ends.map_or(look, |ends| ends.min(look));
        let until = self.next_strike().map_or(until, |due| due.min(until));
        let wake = self.idle.wait(&mut self.endpoint, Some(until), &others)?;
        self.waits = self.waits.wrapping_add(1);
        if self.waits.is_multiple_of(WAITS_BETWEEN_LOOKS) || wake != Wake::Bell {
            self.look_around()?;
        }
        Ok(())
    }

    /// Whether the run must end, and who has.
    pub(super) fn look_around(&mut self) -> Result<(), PlayError> {
        let system = |error: std::io::Error| PlayError::Failed(error.to_string());
        if let Some(request) = self.signals.poll().map_err(system)? {
            return Err(PlayError::Stopped(request));
        }
        self.strike_when_due().map_err(system)?;
        self.look_for_silence().map_err(system)?;
        let ended = self.watch.poll().map_err(system)?;
        if !ended.is_empty() {
            return Err(PlayError::Lost(ended));
        }
        if self.options.run_ends.is_some_and(|ends| clock::now() >= ends) {
            return Err(PlayError::TimeLimit);
        }
        Ok(())
    }
}
