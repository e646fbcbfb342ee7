//! In the steady state no delta costs a heap allocation of ours: not in the core, under any strategy,
//! and not in the shared-memory transport, where iceoryx2 itself makes one per loan (the reference
//! count that its publisher and sample share).
#![expect(unsafe_code, reason = "a counting allocator must implement GlobalAlloc")]

use agent::craft::dispatch::{dispatch, dispatch_stamped};
use agent::craft::{Craft, Outbox};
use shared_types::ids::CraftId;
use shared_types::knowledge::{BoardNetwork, Csr, FleetNetwork, FleetView, Literal, Topology};
use shared_types::time::Nanos;
use shared_types::trace::TraceRecord;
use shared_types::transport::Endpoint;
use shared_types::transport::memory::{MemoryEndpoint, MemoryNetwork, MemoryOptions};
use shared_types::wire::{Class, EpochSpec, OpenSpec, StrategyKind, TurnCommand};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

/// The system's allocator, counting per thread.
struct Counting;

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller keeps the contract of `dealloc`.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        // SAFETY: the caller keeps the contract of `realloc`.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn allocations_during(work: impl FnOnce()) -> u64 {
    let before = ALLOCATIONS.with(Cell::get);
    work();
    ALLOCATIONS.with(Cell::get) - before
}

const CRAFTS: u32 = 4;

/// Every craft forever toggles two facts that all crafts share.
fn restless_network() -> FleetNetwork {
    let boards = (0..CRAFTS).map(|craft| {
        let mut board = BoardNetwork { fact_count: 3, initial: vec![0], ..BoardNetwork::default() };
        for negation in 0..2 {
            board.premises.push_row([Literal::holds(shared_types::ids::FactId(0)).0]);
            board.outputs.push_row([1 << 1 | negation, 2 << 1 | negation]);
            board.queues.push_row([]);
        }
        board.repeating_rules = vec![0, 1];
        let others = || (0..CRAFTS).filter(move |&other| other != craft);
        let links: Vec<(u32, u32)> = [1, 2]
            .into_iter()
            .flat_map(|fact| others().flat_map(move |to| [(fact, to), (fact, fact)]))
            .collect();
        board.links = Csr::from_pairs(3, &links);
        board.index_readers();
        board
    });
    let parent = (0..CRAFTS).map(|craft| craft.checked_sub(1).map_or(u32::MAX, |below| below / 2));
    FleetNetwork {
        boards: boards.collect(),
        topology: Topology::new(parent.collect(), vec![0, 0, 1, 1]).expect("a tree"),
        script: Vec::new(),
        trace: Vec::new(),
    }
}

fn spec(strategy: StrategyKind) -> EpochSpec {
    EpochSpec {
        epoch: 0,
        network: 0,
        seed: 3,
        trial: 0,
        strategy,
        own_firing_only: true,
        ignores_finals: true,
        sends_altered_only: false,
        record_bytes: 16,
        turns_max: 1000,
        reasoning: shared_types::reasoning::Reasoning::default(),
        recovery: None,
        link: None,
        open: None,
    }
}

struct Fleet {
    network: MemoryNetwork,
    crafts: Vec<Craft>,
    endpoints: Vec<MemoryEndpoint>,
    out: Outbox,
    reports: u64,
}

impl Fleet {
    fn new(spec: &EpochSpec, view: &FleetView<'_>) -> Self {
        let network = MemoryNetwork::new(CRAFTS + 1, MemoryOptions::default());
        let processes = CRAFTS + u32::from(spec.strategy.has_centre());
        let mut endpoints: Vec<MemoryEndpoint> =
            (0..processes).map(|craft| network.endpoint(CraftId(craft), 0)).collect();
        let mut crafts: Vec<Craft> =
            (0..processes).map(|craft| Craft::new(CraftId(craft))).collect();
        for (craft, endpoint) in crafts.iter_mut().zip(&mut endpoints) {
            craft.begin_epoch(spec, view);
            endpoint.open_ports(&craft.peers(view)).expect("ports open");
        }
        Self { network, crafts, endpoints, out: Outbox::default(), reports: 0 }
    }

    fn turn(&mut self, turn: u32, view: &FleetView<'_>) {
        let closed = turn.checked_sub(1).unwrap_or(TurnCommand::NO_TURN);
        let command = TurnCommand { closed, opened: turn, wants_merged: 0, is_last: 0 };
        for index in 0..self.crafts.len() {
            self.crafts[index].command(self.network.now(), &command, view, &mut self.out);
            self.publish(index);
        }
        while let Some(receiver) = self.network.deliver_next() {
            let (craft, out) = (&mut self.crafts[receiver.index()], &mut self.out);
            self.endpoints[receiver.index()]
                .drain(&mut |_, header, payload| {
                    let class = header.class().expect("a class");
                    let kind = header.kind().expect("a kind");
                    craft.receive(class, kind, header, payload, view, out).expect("accepted");
                })
                .expect("drains");
            self.publish(receiver.index());
        }
        for index in 0..self.crafts.len() {
            self.crafts[index].settle(&mut self.out);
            self.publish(index);
        }
    }

    fn publish(&mut self, index: usize) {
        let craft = &mut self.crafts[index];
        let now = self.network.now();
        dispatch(&mut self.endpoints[index], now, &mut self.out, craft).expect("sends");
        self.reports += self.out.reports.len() as u64;
        self.out.reports.clear();
    }

    fn deliveries(&self) -> u64 {
        let reports = self.crafts.iter().map(Craft::report);
        reports
            .map(|report| {
                [Class::Replication, Class::Reply]
                    .map(|class| report.counters.traffic[class as usize].deliveries)
                    .iter()
                    .sum::<u64>()
            })
            .sum()
    }
}

#[test]
fn core_allocates_nothing_per_delta_in_the_steady_state() {
    let network = restless_network();
    let view = network.view();
    for strategy in StrategyKind::ALL {
        let spec = spec(strategy);
        let mut fleet = Fleet::new(&spec, &view);
        for turn in 0..200 {
            fleet.turn(turn, &view);
        }
        let before = fleet.deliveries();
        let allocations = allocations_during(|| {
            for turn in 200..600 {
                fleet.turn(turn, &view);
            }
        });
        let deliveries = fleet.deliveries() - before;
        assert!(deliveries >= 400 || strategy == StrategyKind::Null, "{strategy}: {deliveries}");
        assert_eq!(allocations, 0, "{strategy}: {deliveries} deliveries");
        assert!(fleet.reports >= 600 * u64::from(CRAFTS), "{strategy}");
    }
}

/// Under the strategies whose epochs may recover the ring and the receipts take no memory either.
#[test]
fn core_that_recovers_allocates_nothing_per_delta_once_its_ring_is_full() {
    let network = restless_network();
    let view = network.view();
    let recovery = Some(shared_types::wire::RecoverySpec::patient(20_000));
    for strategy in [StrategyKind::Full, StrategyKind::Boundary, StrategyKind::Central] {
        let spec = EpochSpec { recovery, turns_max: 2_000, ..spec(strategy) };
        let mut fleet = Fleet::new(&spec, &view);
        let warm_up = CraftId::from_index(shared_types::limits::RING_SAMPLES + 600).0;
        for turn in 0..warm_up {
            fleet.turn(turn, &view);
        }
        let before = fleet.deliveries();
        let allocations = allocations_during(|| {
            for turn in warm_up..warm_up + 200 {
                fleet.turn(turn, &view);
            }
        });
        let receipts: u64 =
            fleet.crafts.iter().map(|craft| craft.counters().recovered.receipts).sum();
        assert!(fleet.deliveries() - before >= 200 && receipts > 0, "{strategy}");
        assert_eq!(allocations, 0, "{strategy}");
    }
}

/// The trace of a fleet whose crafts each write both shared facts and read one, `bursts` times, 10 us
/// apart.
fn restless_trace(bursts: u64) -> Vec<TraceRecord> {
    let burst = |number: u64| {
        let (at_ns, holds) = (number * 10_000, number.is_multiple_of(2));
        let [first, second] = [1, 2].map(shared_types::ids::FactId);
        [
            TraceRecord::write(at_ns, first, holds),
            TraceRecord::write(at_ns, second, holds),
            TraceRecord::read(at_ns, first),
        ]
    };
    (0..bursts).flat_map(burst).collect()
}

impl Fleet {
    /// Plays everything that is due before `until`, and delivers it.
    fn play_until(&mut self, until: Nanos, trace: &[TraceRecord], view: &FleetView<'_>) {
        loop {
            let part = |index: usize| if index < CRAFTS as usize { trace } else { &[] };
            let due = self.crafts.iter().enumerate().filter_map(|(index, craft)| {
                craft.next_due(part(index)).filter(|&at| at < until).map(|at| (at, index))
            });
            let next = due.min();
            let arrival = self.network.next_due().filter(|&at| at < until);
            match (next, arrival) {
                (Some((at, index)), arrival) if arrival.is_none_or(|arrival| at <= arrival) => {
                    self.network.advance_to(at);
                    self.crafts[index].play_due(at, part(index), view, &mut self.out);
                    self.publish_open(index);
                }
                (_, Some(_)) => {
                    let receiver = self.network.deliver_next().expect("something arrives").index();
                    let now = self.network.now();
                    let (craft, out) = (&mut self.crafts[receiver], &mut self.out);
                    self.endpoints[receiver]
                        .drain(&mut |_, header, payload| {
                            craft.stamp_applied(now);
                            craft.arrive(now);
                            let class = header.class().expect("a class");
                            let kind = header.kind().expect("a kind");
                            craft
                                .receive(class, kind, header, payload, view, out)
                                .expect("accepted");
                        })
                        .expect("drains");
                    self.crafts[receiver].stamp_applied(now);
                    self.publish_open(receiver);
                }
                (_, None) => return,
            }
        }
    }

    fn publish_open(&mut self, index: usize) {
        let (network, craft) = (&self.network, &mut self.crafts[index]);
        let mut clock = || network.now();
        dispatch_stamped(&mut self.endpoints[index], &mut clock, &mut self.out, craft)
            .expect("sends");
    }
}

#[test]
fn open_mode_allocates_nothing_per_delta_once_buffers_have_grown() {
    const BURSTS: u64 = 3_000;
    let network = restless_network();
    let view = network.view();
    let trace = restless_trace(BURSTS);
    for strategy in StrategyKind::ALL.into_iter().filter(|strategy| strategy.plays_traces()) {
        let spec = EpochSpec {
            open: Some(OpenSpec {
                duration_ns: BURSTS * 10_000,
                slice_ns: 5_000_000,
                asks_every_ns: 20_000,
                stamps_stages: true,
            }),
            ..spec(strategy)
        };
        let mut fleet = Fleet::new(&spec, &view);
        for index in 0..fleet.crafts.len() {
            let part = if index < CRAFTS as usize { &trace[..] } else { &[] };
            fleet.crafts[index].go(Nanos(0), part);
        }
        fleet.play_until(Nanos(BURSTS * 10_000 / 3), &trace, &view);
        let before = fleet.deliveries();
        let allocations = allocations_during(|| {
            fleet.play_until(Nanos(BURSTS * 10_000), &trace, &view);
        });
        let deliveries = fleet.deliveries() - before;
        assert!(deliveries >= 1_000 || strategy == StrategyKind::Null, "{strategy}: {deliveries}");
        assert_eq!(allocations, 0, "{strategy}: {deliveries} deliveries");
    }
}

#[cfg(feature = "shell")]
mod real {
    use super::allocations_during;
    use shared_types::ids::{CraftId, Incarnation};
    use shared_types::transport::iceoryx::{
        EndpointOptions, HostOptions, IceoryxEndpoint, IceoryxHost,
    };
    use shared_types::transport::reclaim::remove_run;
    use shared_types::transport::{Destination, Endpoint, Peers, RunPaths, WakeMode};
    use shared_types::wire::{Class, Header, Kind};

    const SAMPLES: u64 = 1000;

    /// A run whose files go whatever happens.
    struct Run(RunPaths);

    impl Drop for Run {
        fn drop(&mut self) {
            let removed = remove_run(&self.0);
            assert!(removed.is_ok() || std::thread::panicking(), "{removed:?}");
        }
    }

    #[test]
    fn shared_memory_costs_the_allocation_of_iceoryx2_to_send_and_none_to_receive() {
        let base = format!("/dev/shm/ssa{:x}", std::process::id());
        let run = Run(RunPaths::below(base, u64::from(std::process::id())));
        let host = IceoryxHost::create(&run.0, HostOptions::new(2)).expect("services");
        let mut endpoints = [0, 1].map(|craft| {
            let options = EndpointOptions::new(2, WakeMode::Poll);
            IceoryxEndpoint::open(&run.0, CraftId(craft), Incarnation(0), options).expect("opens")
        });
        for (endpoint, peer) in endpoints.iter_mut().zip([1, 0]) {
            let peers = Peers {
                unicast: vec![CraftId(peer)],
                sends_multicast: true,
                receives_multicast: true,
            };
            endpoint.open_ports(&peers).expect("ports");
        }
        let [sender, receiver] = &mut endpoints;
        for to in [Destination::Craft(CraftId(1)), Destination::Multicast] {
            let mut exchange = |samples: u64| {
                let (mut sending, mut receiving, mut arrived) = (0, 0, 0);
                for _ in 0..samples {
                    let header = Header::new(Class::Replication, Kind::Delta);
                    sending += allocations_during(|| {
                        sender.send(to, header, 32, &mut |slot| slot.fill(7)).expect("sends");
                    });
                    receiving += allocations_during(|| {
                        arrived += receiver.drain(&mut |_, _, _| ()).expect("drains");
                        sender.drain(&mut |_, _, _| ()).expect("drains");
                    });
                }
                (sending, receiving, arrived as u64)
            };
            exchange(200);
            let (sending, receiving, arrived) = exchange(SAMPLES);
            assert_eq!(arrived, SAMPLES, "{to:?}");
            assert_eq!(receiving, 0, "{to:?}");
            assert_eq!(sending, SAMPLES, "{to:?}: one each, made by iceoryx2");
        }
        drop(endpoints);
        drop(host);
    }
}
