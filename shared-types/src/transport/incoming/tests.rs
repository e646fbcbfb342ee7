//! The links before a real process do what those of a simulated network do, and do it to crafts only.

use super::{Class, Copied, Header, Incoming, LinkCounts, Nanos, StatedLink, Through};
use crate::ids::CraftId;
use crate::limits::HELD_SAMPLES_MAX;
use crate::transport::link::Link as _;
use crate::transport::memory::{MemoryNetwork, MemoryOptions};
use crate::transport::{Destination, Endpoint as _, Peers};
use crate::wire::{CutOff, Kind, LinkSpec, OutageSpec};

const TRIAL: u32 = 3;
const TO: CraftId = CraftId(2);
/// A sample every 10 us, for 6 ms.
const EVERY_NS: u64 = 10_000;
const SAMPLES: u64 = 600;

/// A sample of `source`, published at `at_ns`.
fn sample(source: u32, at_ns: u64) -> Header {
    let header = Header::new(Class::Replication, Kind::Delta);
    Header { source, published_ns: at_ns, length: 8, ..header }
}

fn link(spec: &LinkSpec) -> StatedLink {
    let mut link = StatedLink::new(spec.clone(), 7);
    link.begin(Nanos(0), TRIAL);
    link
}

/// When which sample from craft 0 comes first, and what the links did, on the real transport's side.
fn real(spec: &LinkSpec) -> (Vec<(u64, u64)>, LinkCounts) {
    let mut incoming = Incoming::new(link(spec), TO, 3);
    let mut came = vec![None; usize::try_from(SAMPLES).unwrap()];
    let mut come = |at_ns: u64, number: u64| {
        came[usize::try_from(number).unwrap()].get_or_insert((at_ns, number));
    };
    // The clock stands still only where something happens, as in a simulation.
    let release = |incoming: &mut Incoming, until_ns: u64, come: &mut dyn FnMut(u64, u64)| {
        while let Some(due) = incoming.next_due().filter(|due| due.0 <= until_ns) {
            while let Some(Copied { header, payload, .. }) = incoming.release(due) {
                assert_eq!(payload[..], header.sequence.to_le_bytes());
                come(due.0, header.sequence);
            }
        }
    };
    for number in 0..SAMPLES {
        let at_ns = number * EVERY_NS;
        release(&mut incoming, at_ns, &mut come);
        let header = Header { sequence: number, ..sample(0, at_ns) };
        for _ in 0..incoming.take(Nanos(at_ns), Through::Inbox, &header, &number.to_le_bytes()) {
            come(at_ns, number);
        }
    }
    release(&mut incoming, u64::MAX, &mut come);
    let mut came: Vec<(u64, u64)> = came.into_iter().flatten().collect();
    came.sort_unstable();
    (came, incoming.take_counts())
}

/// The same in a simulated network.
fn simulated(spec: &LinkSpec) -> (Vec<(u64, u64)>, LinkCounts) {
    let network = MemoryNetwork::new(3, MemoryOptions { jitter_ns: 0, ..MemoryOptions::default() });
    network.set_link(StatedLink::new(spec.clone(), 7));
    network.reseed(1, TRIAL);
    let (mut sender, mut receiver) = (network.endpoint(CraftId(0), 0), network.endpoint(TO, 0));
    sender.open_ports(&Peers { unicast: vec![TO], ..Peers::default() }).unwrap();
    let mut came = Vec::new();
    let mut deliver = |until_ns: u64| {
        while network.next_due().is_some_and(|due| due.0 <= until_ns) {
            assert_eq!(network.deliver_next(), Some(TO));
            let at_ns = network.now().0;
            receiver.drain(&mut |_, header, _| came.push((at_ns, header.sequence))).unwrap();
        }
        if until_ns < u64::MAX {
            network.advance_to(Nanos(until_ns));
        }
    };
    for number in 0..SAMPLES {
        deliver(number * EVERY_NS);
        let mut write = |slot: &mut [u8]| slot.copy_from_slice(&number.to_le_bytes());
        let to = Destination::Craft(TO);
        sender.send(to, sample(0, number * EVERY_NS), 8, &mut write).unwrap();
        assert_eq!(sender.flush().unwrap(), 0, "the inbox takes what is under way");
    }
    deliver(u64::MAX);
    came.sort_unstable();
    (came, network.link_counts())
}

#[test]
fn real_links_do_what_simulated_ones_do() {
    let outage = |from_ns, until_ns, whom| OutageSpec { from_ns, until_ns, whom };
    let plain = LinkSpec::default();
    let specs = [
        LinkSpec { loss_per_billion: 300_000_000, ..plain.clone() },
        LinkSpec { duplication_per_billion: 300_000_000, ..plain.clone() },
        LinkSpec { delay_ns: 123_000, ..plain.clone() },
        LinkSpec { jitter_ns: 200_000, ..plain.clone() },
        // A sample takes 9 us, and 11 us.
        LinkSpec { bandwidth_bits_per_s: Some(140_000_000), ..plain.clone() },
        LinkSpec { bandwidth_bits_per_s: Some(115_000_000), ..plain.clone() },
        LinkSpec { positions_ns: vec![[0; 3], [0; 3], [30_000, 40_000, 0]], ..plain.clone() },
        LinkSpec {
            outages: vec![outage(1_000_000, 2_000_000, CutOff::Group(vec![1, 2]))],
            ..plain.clone()
        },
        LinkSpec {
            loss_per_billion: 100_000_000,
            duplication_per_billion: 200_000_000,
            delay_ns: 50_000,
            jitter_ns: 100_000,
            bandwidth_bits_per_s: Some(300_000_000),
            outages: vec![outage(3_000_000, 4_000_000, CutOff::Pair(0, 2))],
            positions_ns: vec![[5_000, 0, 0], [0; 3], [0; 3]],
        },
    ];
    let mut all = LinkCounts::default();
    for spec in specs {
        let (came, counts) = real(&spec);
        assert!(came.len() > 300, "{spec:?}");
        assert_ne!(counts, LinkCounts::default(), "{spec:?}");
        assert_eq!((came, counts), simulated(&spec), "{spec:?}");
        all += counts;
    }
    let LinkCounts { lost, cut_off, doubled, delayed, overtaken } = all;
    assert!(
        [lost, cut_off, doubled, delayed, overtaken].iter().all(|&count| count > 50),
        "{all:?}"
    );
}

#[test]
fn what_comes_on_one_way_changes_nothing_on_another() {
    let lossy = LinkSpec { loss_per_billion: 250_000_000, ..LinkSpec::default() };
    let lost = |incoming: &mut Incoming, source: u32| -> Vec<bool> {
        let header = sample(source, 1);
        (0..4_000).map(|_| incoming.take(Nanos(1), Through::Inbox, &header, &[]) == 0).collect()
    };
    let mut alone = Incoming::new(link(&lossy), TO, 4);
    let first = lost(&mut alone, 1);
    let count = first.iter().filter(|&&is_lost| is_lost).count();
    assert!((900..1_100).contains(&count), "{count}");
    let mut again = Incoming::new(link(&lossy), TO, 4);
    assert_ne!(lost(&mut again, 0), first);
    assert_eq!(lost(&mut again, 1), first);
    let mut other = Incoming::new(link(&lossy), CraftId(1), 4);
    assert_ne!(lost(&mut other, 2), first);
}

#[test]
fn what_the_orchestrator_says_and_what_comes_back_arrives_at_once() {
    let spec = LinkSpec { loss_per_billion: 900_000_000, delay_ns: 5, ..LinkSpec::default() };
    let mut incoming = Incoming::new(link(&spec), TO, 4);
    for source in [CraftId::ORCHESTRATOR.0, TO.0, 9] {
        for _ in 0..100 {
            assert_eq!(incoming.take(Nanos(1), Through::Broadcast, &sample(source, 1), &[]), 1);
        }
    }
    assert_eq!(incoming.take_counts(), LinkCounts::default());
}

#[test]
fn what_finds_no_room_is_lost_and_counted() {
    let slow = LinkSpec { delay_ns: 1_000_000, ..LinkSpec::default() };
    let mut incoming = Incoming::new(link(&slow), TO, 4);
    let most = HELD_SAMPLES_MAX as u64;
    for number in 0..most + 3 {
        assert_eq!(incoming.take(Nanos(number), Through::Inbox, &sample(0, number), &[0; 8]), 0);
    }
    let counts = incoming.take_counts();
    assert_eq!((counts.delayed, counts.lost), (most + 3, 3));
    assert_eq!(incoming.next_due(), Some(Nanos(1_000_000)));
    let mut came = 0;
    while incoming.release(Nanos(u64::MAX)).is_some() {
        came += 1;
    }
    assert_eq!(came, most);
}

#[test]
fn what_is_repeated_passes_once_the_outage_is_over() {
    let whom = CutOff::Pair(0, 2);
    let outages = vec![OutageSpec { from_ns: 0, until_ns: 1_000, whom }];
    let spec = LinkSpec { outages, ..LinkSpec::default() };
    let mut incoming = Incoming::new(link(&spec), TO, 3);
    let first = sample(0, 999);
    let repeat = Header { class: Class::Repair as u8, ..first };
    let mut times =
        |now_ns: u64, header: &Header| incoming.take(Nanos(now_ns), Through::Inbox, header, &[]);
    // A craft that was held up finds what was sent in the outage, and it is cut off all the same.
    assert_eq!([times(999, &first), times(1_000, &first)], [0, 0]);
    assert_eq!([times(999, &repeat), times(1_000, &repeat)], [0, 1]);
}
