//! The memory network under the laws, and what only it can do.

use crate::fleet::{
    CRAFTS, Fleet, drain, drain_until_quiet, numbers, open_everything, receive, send_number,
    take_losses, to_craft,
};
use crate::laws;
use shared_types::ids::CraftId;
use shared_types::time::Nanos;
use shared_types::transport::link::{Lossy, Verdict};
use shared_types::transport::memory::{MemoryEndpoint, MemoryNetwork, MemoryOptions};
use shared_types::transport::{Destination, Endpoint};
use shared_types::wire::{Header, Losses};

pub(crate) struct MemoryFleet {
    network: MemoryNetwork,
    crafts: Vec<MemoryEndpoint>,
    orchestrator: MemoryEndpoint,
}

const RUN: u64 = 77;

impl MemoryFleet {
    fn new(seed: u64) -> Self {
        let network = MemoryNetwork::new(
            CRAFTS,
            MemoryOptions { run: RUN, seed, ..MemoryOptions::default() },
        );
        let crafts = (0..CRAFTS).map(|craft| network.endpoint(CraftId(craft), 0)).collect();
        let orchestrator = network.orchestrator();
        let mut fleet = Self { network, crafts, orchestrator };
        open_everything(&mut fleet);
        fleet
    }
}

impl Fleet for MemoryFleet {
    fn run(&self) -> u64 {
        RUN
    }

    fn craft(&mut self, craft: u32) -> &mut dyn Endpoint {
        &mut self.crafts[craft as usize]
    }

    fn orchestrator(&mut self) -> &mut dyn Endpoint {
        &mut self.orchestrator
    }

    fn settle(&mut self) {
        self.network.deliver_all();
    }

    fn inject(&mut self, receiver: u32, header: Header, payload: &[u8]) {
        self.network.inject(CraftId(receiver), header, payload);
    }
}

macro_rules! hold_in_memory {
    ($($law:ident)+) => {
        $(
            #[test]
            fn $law() {
                for seed in 0..8 {
                    laws::$law(&mut MemoryFleet::new(seed));
                }
            }
        )+
    };
}
laws::for_every_law!(hold_in_memory);

/// Everybody sends to everybody; who got what in which order.
fn interleaving(seed: u64) -> Vec<Vec<(u32, u32)>> {
    let mut fleet = MemoryFleet::new(seed);
    for number in 0..6 {
        for source in 0..CRAFTS {
            send_number(fleet.craft(source), Destination::Multicast, number).expect("sends");
        }
    }
    (0..CRAFTS)
        .map(|craft| {
            receive(&mut fleet, craft)
                .iter()
                .map(|sample| (sample.header.source, sample.number()))
                .collect()
        })
        .collect()
}

#[test]
fn the_seed_alone_decides_the_order_of_delivery() {
    assert_eq!(interleaving(3), interleaving(3));
    assert_ne!(interleaving(3), interleaving(4));
}

#[test]
fn without_jitter_samples_arrive_in_the_order_of_sending() {
    let network = MemoryNetwork::new(3, MemoryOptions { jitter_ns: 0, ..MemoryOptions::default() });
    let mut crafts: Vec<_> = (0..3).map(|craft| network.endpoint(CraftId(craft), 0)).collect();
    let peers = shared_types::transport::Peers {
        unicast: vec![CraftId(2)],
        ..shared_types::transport::Peers::default()
    };
    for number in 0..10 {
        for craft in &mut crafts[..2] {
            craft.open_ports(&peers).expect("ports open");
            send_number(craft, to_craft(2), number).expect("sends");
        }
    }
    assert_eq!(network.deliver_all(), 20);
    let sources: Vec<u32> =
        drain(&mut crafts[2]).iter().map(|sample| sample.header.source).collect();
    assert_eq!(sources, [0, 1].repeat(10));
}

#[test]
fn delivery_moves_the_clock_and_names_the_receiver() {
    let mut fleet = MemoryFleet::new(1);
    fleet.network.set_link(|_: Nanos, receiver: CraftId, _: &Header| {
        if receiver == CraftId(2) { Verdict::Delay(50_000) } else { Verdict::Pass }
    });
    send_number(fleet.craft(0), to_craft(2), 1).expect("sends");
    send_number(fleet.craft(0), to_craft(1), 2).expect("sends");
    assert!(!fleet.network.is_quiet());
    assert_eq!(fleet.network.deliver_next(), Some(CraftId(1)));
    assert!(fleet.network.now().0 < 1_000);
    let due = fleet.network.next_due().expect("one is in flight");
    assert!(due.0 >= 50_000);
    assert_eq!(fleet.network.deliver_next(), Some(CraftId(2)));
    assert_eq!(fleet.network.now(), due);
    assert_eq!(fleet.network.deliver_next(), None);
    assert!(!fleet.network.is_quiet(), "two samples are unread");
    drain_until_quiet(&mut fleet);
    assert!(fleet.network.is_quiet());
}

#[test]
fn a_delayed_sample_holds_back_what_follows_it() {
    let mut fleet = MemoryFleet::new(1);
    fleet.network.set_link(|_: Nanos, _: CraftId, header: &Header| {
        if header.sequence == 0 { Verdict::Delay(1_000_000) } else { Verdict::Pass }
    });
    for number in 0..5 {
        send_number(fleet.craft(0), to_craft(1), number).expect("sends");
    }
    assert_eq!(numbers(&receive(&mut fleet, 1)), [0, 1, 2, 3, 4]);
}

#[test]
fn a_dropped_sample_is_a_gap_and_a_doubled_one_a_repeat() {
    let mut fleet = MemoryFleet::new(5);
    fleet.network.set_link(|_: Nanos, _: CraftId, header: &Header| match header.sequence {
        1 | 2 => Verdict::Drop,
        4 => Verdict::Duplicate,
        _ => Verdict::Pass,
    });
    for number in 0..6 {
        send_number(fleet.craft(0), to_craft(1), number).expect("sends");
    }
    assert_eq!(numbers(&receive(&mut fleet, 1)), [0, 3, 4, 5]);
    assert_eq!(take_losses(&mut fleet), Losses { gaps: 2, repeats: 1, ..Losses::default() });
}

#[test]
fn what_a_lossy_link_loses_is_what_the_receivers_miss() {
    let mut fleet = MemoryFleet::new(6);
    fleet.network.set_link(Lossy::new(9, 0.2, 0.1));
    let mut received = 0;
    for number in 0..500 {
        send_number(fleet.craft(0), Destination::Multicast, number).expect("sends");
        received += drain_until_quiet(&mut fleet).concat().len() as u64;
    }
    fleet.network.clear_link();
    send_number(fleet.craft(0), Destination::Multicast, 500).expect("sends");
    received += drain_until_quiet(&mut fleet).concat().len() as u64;
    let losses = take_losses(&mut fleet);
    assert_eq!(received + losses.gaps, 501 * u64::from(CRAFTS - 1));
    assert!(losses.gaps > 0 && losses.repeats > 0, "{losses:?}");
}

#[test]
fn a_new_life_of_a_craft_is_numbered_afresh_and_reads_nothing_of_the_old() {
    let mut fleet = MemoryFleet::new(2);
    for number in 0..3 {
        send_number(fleet.craft(0), to_craft(1), number).expect("sends");
        send_number(fleet.craft(1), to_craft(0), number).expect("sends");
    }
    assert_eq!(receive(&mut fleet, 1).len(), 3);
    fleet.settle();
    fleet.crafts[0] = fleet.network.endpoint(CraftId(0), 1);
    open_everything(&mut fleet);
    assert!(receive(&mut fleet, 0).is_empty());
    send_number(fleet.craft(0), to_craft(1), 9).expect("sends");
    assert_eq!(numbers(&receive(&mut fleet, 1)), [9]);
    assert_eq!(fleet.craft(1).take_losses(), Losses::default());
}

#[test]
fn memory_is_reused_whatever_is_sent() {
    let mut fleet = MemoryFleet::new(2);
    let mut sizes = Vec::new();
    for _ in 0..50 {
        for source in 0..CRAFTS {
            send_number(fleet.craft(source), Destination::Multicast, source).expect("sends");
        }
        drain_until_quiet(&mut fleet);
        sizes.push(fleet.network.samples_held());
    }
    assert_eq!(sizes[0], sizes[49], "{sizes:?}");
}

#[test]
fn a_network_is_not_quiet_while_a_sample_waits_in_an_outbox() {
    let mut fleet = MemoryFleet::new(2);
    for number in 0..=64 {
        send_number(fleet.craft(0), to_craft(1), number).expect("is taken or waits");
    }
    receive(&mut fleet, 1);
    assert!(fleet.network.in_flight() == 0 && !fleet.network.is_quiet(), "one sample waits");
    drain_until_quiet(&mut fleet);
    assert!(fleet.network.is_quiet());
    for number in 0..=64 {
        send_number(fleet.craft(0), to_craft(1), number).expect("is taken or waits");
    }
    fleet.settle();
    fleet.crafts.clear();
    assert!(fleet.network.is_quiet(), "what an endpoint had to send or read goes with it");
}
