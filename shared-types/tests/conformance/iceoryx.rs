//! The iceoryx2 adapter under the laws, all endpoints in this process, and what only it can do.

use crate::fleet::{
    CRAFTS, Fleet, delta, drain, numbers, open_everything, receive, send_number, take_losses,
    to_craft,
};
use crate::laws;
use shared_types::ids::{CraftId, Incarnation};
use shared_types::transport::iceoryx::{
    EndpointOptions, HostOptions, IceoryxEndpoint, IceoryxHost, IdleWait, Wake,
};
use shared_types::transport::reclaim::remove_run;
use shared_types::transport::topic::Service;
use shared_types::transport::{Destination, Endpoint, Peers, RunPaths, WakeMode, clock};
use shared_types::wire::{Header, Losses};
use std::fs::File;
use std::os::fd::AsFd;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

/// Keeps tests of real shared memory apart, whichever test binary they are in.
fn machine_wide_lock() -> File {
    let path = std::env::temp_dir().join("slateswarm-real-processes.lock");
    let file = File::options().create(true).append(true).open(path).expect("lock file");
    file.lock().expect("lock");
    file
}

/// A run of its own; whatever happens, nothing of it is left.
pub(crate) struct Run {
    pub(crate) paths: RunPaths,
    _machine: File,
}

impl Run {
    pub(crate) fn new() -> Self {
        static RUNS: AtomicU64 = AtomicU64::new(0);
        let number = RUNS.fetch_add(1, Ordering::Relaxed);
        let run = u64::from(std::process::id()) << 8 | number & 0xff;
        // A base of its own, so that nobody cleans what looks like a dead run to them.
        let base = format!("/dev/shm/sst{:x}", std::process::id());
        Self { paths: RunPaths::below(base, run), _machine: machine_wide_lock() }
    }
}

impl Drop for Run {
    fn drop(&mut self) {
        let removed = remove_run(&self.paths);
        if !std::thread::panicking() {
            removed.expect("everything can be removed");
            assert!(self.paths.segments().expect("listable").is_empty());
            assert!(!self.paths.root().exists());
        }
    }
}

/// A publisher past the adapter, on one craft's inbox.
type Forger = iceoryx2::port::publisher::Publisher<iceoryx2::prelude::ipc::Service, [u8], Header>;

struct IceoryxFleet {
    crafts: Vec<IceoryxEndpoint>,
    orchestrator: IceoryxEndpoint,
    forgers: Vec<Option<Forger>>,
    node: iceoryx2::prelude::Node<iceoryx2::prelude::ipc::Service>,
    _host: IceoryxHost,
    // Last: removes what the others leave.
    run: Run,
}

impl IceoryxFleet {
    fn new(wake: WakeMode) -> Self {
        let run = Run::new();
        let host = IceoryxHost::create(&run.paths, HostOptions::new(CRAFTS)).expect("creates");
        let orchestrator = host.endpoint(wake).expect("opens");
        let open = |craft| {
            let options = EndpointOptions::new(CRAFTS, wake);
            IceoryxEndpoint::open(&run.paths, CraftId(craft), Incarnation(0), options)
                .expect("opens")
        };
        let crafts = (0..CRAFTS).map(open).collect();
        let node = iceoryx2::prelude::NodeBuilder::new()
            .config(&run.paths.config().expect("short paths"))
            .signal_handling_mode(iceoryx2::prelude::SignalHandlingMode::Disabled)
            .create()
            .expect("a node");
        let forgers = (0..CRAFTS).map(|_| None).collect();
        let mut fleet = Self { crafts, orchestrator, forgers, node, _host: host, run };
        open_everything(&mut fleet);
        fleet
    }

    fn forger(&mut self, craft: u32) -> &Forger {
        let Self { forgers, node, .. } = self;
        forgers[craft as usize].get_or_insert_with(|| {
            let name = Service::Inbox(CraftId(craft)).name();
            node.service_builder(&name.as_str().try_into().expect("a valid name"))
                .publish_subscribe::<[u8]>()
                .user_header::<Header>()
                .open()
                .expect("the service is there")
                .publisher_builder()
                .initial_max_slice_len(64)
                .create()
                .expect("one more publisher")
        })
    }
}

impl Fleet for IceoryxFleet {
    fn run(&self) -> u64 {
        self.run.paths.run()
    }

    fn craft(&mut self, craft: u32) -> &mut dyn Endpoint {
        &mut self.crafts[craft as usize]
    }

    fn orchestrator(&mut self) -> &mut dyn Endpoint {
        &mut self.orchestrator
    }

    fn settle(&mut self) {}

    fn inject(&mut self, receiver: u32, header: Header, payload: &[u8]) {
        let mut sample = self.forger(receiver).loan_slice(payload.len()).expect("loans");
        sample.payload_mut().copy_from_slice(payload);
        *sample.user_header_mut() = header;
        assert_eq!(sample.send().expect("sends"), 1);
    }
}

macro_rules! hold_in_shared_memory {
    ($($law:ident)+) => {
        $(
            #[test]
            fn $law() {
                laws::$law(&mut IceoryxFleet::new(WakeMode::Poll));
            }
        )+
    };
}
laws::for_every_law!(hold_in_shared_memory);

#[test]
fn a_rung_craft_wakes_and_finds_its_sample() {
    let mut fleet = IceoryxFleet::new(WakeMode::Block);
    let mut idle = IdleWait::new(WakeMode::Block);
    send_number(fleet.craft(0), to_craft(1), 5).expect("sends");
    fleet.craft(0).ring();
    // Far longer than a wake-up takes, far shorter than the longest sleep.
    let wake = idle.wait(&mut fleet.crafts[1], None, &[]).expect("waits");
    assert_eq!(wake, Wake::Bell);
    assert_eq!(numbers(&receive(&mut fleet, 1)), [5]);
    let soon = clock::now().plus(1_000_000);
    let wake = idle.wait(&mut fleet.crafts[1], Some(soon), &[]).expect("waits");
    assert_eq!(wake, Wake::Timeout, "a bell that was heard is silent");
    assert!(clock::now() >= soon);
    assert_eq!(take_losses(&mut fleet), Losses::default());
}

#[test]
fn a_turn_and_a_multicast_ring_everybody_who_gets_them() {
    let mut fleet = IceoryxFleet::new(WakeMode::Block);
    let soon = || Some(clock::now().plus(1_000_000));
    send_number(fleet.orchestrator(), Destination::Turn, 1).expect("sends");
    fleet.orchestrator().ring();
    for craft in &mut fleet.crafts {
        assert_eq!(craft.wait(soon(), &[]).expect("waits"), Wake::Bell);
    }
    send_number(fleet.craft(2), Destination::Multicast, 1).expect("sends");
    fleet.craft(2).ring();
    for (number, craft) in fleet.crafts.iter_mut().enumerate() {
        let expected = if number == 2 { Wake::Timeout } else { Wake::Bell };
        assert_eq!(craft.wait(soon(), &[]).expect("waits"), expected, "craft {number}");
    }
}

#[test]
fn crafts_that_came_after_the_orchestrator_are_rung_at_once() {
    let run = Run::new();
    let host = IceoryxHost::create(&run.paths, HostOptions::new(1)).expect("creates");
    let mut orchestrator = host.endpoint(WakeMode::Block).expect("opens");
    let options = EndpointOptions::new(1, WakeMode::Block);
    let mut craft =
        IceoryxEndpoint::open(&run.paths, CraftId(0), Incarnation(0), options).expect("opens");
    // Nobody has updated any connection.
    send_number(&mut orchestrator, Destination::Turn, 1).expect("sends");
    orchestrator.ring();
    let soon = clock::now().plus(1_000_000);
    assert_eq!(craft.wait(Some(soon), &[]).expect("waits"), Wake::Bell);
    assert_eq!(numbers(&drain(&mut craft)), [1]);
    drop((craft, orchestrator, host));
}

#[test]
fn polling_processes_are_never_rung() {
    let mut fleet = IceoryxFleet::new(WakeMode::Poll);
    send_number(fleet.craft(0), to_craft(1), 5).expect("sends");
    fleet.craft(0).ring();
    let soon = clock::now().plus(1_000_000);
    assert_eq!(fleet.crafts[1].wait(Some(soon), &[]).expect("waits"), Wake::Timeout);
}

#[test]
fn a_ready_descriptor_ends_the_wait() {
    let mut fleet = IceoryxFleet::new(WakeMode::Adaptive);
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(writer);
    let wake = fleet.orchestrator.wait(None, &[reader.as_fd()]).expect("waits");
    assert_eq!(wake, Wake::Descriptor);
}

#[test]
fn an_adaptive_wait_yields_before_it_sleeps() {
    let mut fleet = IceoryxFleet::new(WakeMode::Adaptive);
    let mut idle = IdleWait::new(WakeMode::Adaptive);
    let past = Some(shared_types::time::Nanos(0));
    for _ in 0..2 {
        for _ in 0..shared_types::limits::YIELDS_BEFORE_SLEEP {
            assert_eq!(idle.wait(&mut fleet.crafts[0], past, &[]).expect("waits"), Wake::Bell);
        }
        assert_eq!(idle.wait(&mut fleet.crafts[0], past, &[]).expect("waits"), Wake::Timeout);
        idle.reset();
    }
}

#[test]
fn a_craft_that_comes_late_gets_the_world() {
    let mut fleet = IceoryxFleet::new(WakeMode::Poll);
    fleet.crafts.truncate(3);
    fleet
        .orchestrator()
        .send(Destination::World, delta(), 100, &mut |payload| payload.fill(7))
        .expect("publishes");
    let options = EndpointOptions::new(CRAFTS, WakeMode::Poll);
    let mut late = IceoryxEndpoint::open(&fleet.run.paths, CraftId(3), Incarnation(1), options)
        .expect("opens");
    fleet.orchestrator().update_connections().expect("connects");
    assert_eq!(&*late.take_world().expect("works").expect("is there"), &[7; 100]);
}

#[test]
fn a_restarted_craft_finds_its_place_and_reads_nothing_of_its_old_self() {
    let mut fleet = IceoryxFleet::new(WakeMode::Poll);
    send_number(fleet.craft(0), to_craft(1), 1).expect("sends");
    send_number(fleet.craft(1), to_craft(0), 2).expect("sends");
    drop(fleet.crafts.remove(1));
    let options = EndpointOptions::new(CRAFTS, WakeMode::Poll);
    let mut again = IceoryxEndpoint::open(&fleet.run.paths, CraftId(1), Incarnation(1), options)
        .expect("opens");
    let to_zero = Peers { unicast: vec![CraftId(0)], ..Peers::default() };
    again.open_ports(&to_zero).expect("ports open");
    assert!(drain(&mut again).is_empty());
    send_number(&mut again, to_craft(0), 3).expect("sends");
    assert_eq!(numbers(&receive(&mut fleet, 0)), [2, 3], "what the old one sent is still there");
    send_number(fleet.craft(0), to_craft(1), 4).expect("sends");
    assert_eq!(numbers(&drain(&mut again)), [4]);
    assert_eq!(again.take_losses(), Losses::default(), "what its old self missed is not its loss");
    assert_eq!(fleet.craft(0).take_losses(), Losses::default());
}

/// Two threads ring a third over and over, all at the same time: a ring often meets a hearing half-way.
#[test]
fn no_bell_is_lost_however_rings_and_hearings_meet() {
    const ROUNDS: u32 = 100_000;
    const OVER: u32 = u32::MAX;
    let run = Run::new();
    let _host = IceoryxHost::create(&run.paths, HostOptions::new(CRAFTS)).expect("creates");
    let open = |craft| {
        let options = EndpointOptions::new(CRAFTS, WakeMode::Block);
        let mut endpoint =
            IceoryxEndpoint::open(&run.paths, CraftId(craft), Incarnation(0), options)
                .expect("opens");
        let unicast = if craft == 0 { vec![] } else { vec![CraftId(0)] };
        endpoint.open_ports(&Peers { unicast, ..Peers::default() }).expect("opens");
        endpoint
    };
    let mut sleeper = open(0);
    let round = AtomicU32::new(0);
    let rung = [AtomicU32::new(0), AtomicU32::new(0)];
    std::thread::scope(|scope| {
        for (craft, rung) in (1..).zip(&rung) {
            let (open, round) = (&open, &round);
            scope.spawn(move || {
                let mut ringer = open(craft);
                for number in 1..=ROUNDS {
                    while round.load(Ordering::Acquire) < number {
                        std::thread::yield_now();
                    }
                    if round.load(Ordering::Acquire) == OVER {
                        return;
                    }
                    send_number(&mut ringer, to_craft(0), number).expect("sends");
                    ringer.ring();
                    rung.store(number, Ordering::Release);
                }
            });
        }
        let slept_through = (1..=ROUNDS).find(|&number| {
            round.store(number, Ordering::Release);
            let (mut received, mut slept_through) = (0, false);
            while received < 2 {
                received += sleeper.drain(&mut |_, _, _| ()).expect("drains");
                if received < 2 && sleeper.wait(None, &[]).expect("waits") == Wake::Timeout {
                    slept_through |= rung.iter().all(|rung| rung.load(Ordering::Acquire) == number);
                }
            }
            slept_through
        });
        round.store(OVER, Ordering::Release);
        assert_eq!(slept_through, None, "the round in which it slept through both bells");
    });
}
