//! The laws. Each takes a fresh fleet whose ports are all open.

use crate::fleet::{
    CRAFTS, FOREIGN_RUN, Fleet, delta, drain, drain_until_quiet, numbers, receive, send_number,
    take_losses, to_craft,
};
use shared_types::ids::CraftId;
use shared_types::limits::{INBOX_PAYLOAD_BYTES, INBOX_SAMPLES, OUTBOX_SAMPLES};
use shared_types::transport::{Destination, Peers, SendError};
use shared_types::wire::{Class, FORMAT_VERSION, Header, Kind, Losses};

/// The capacities that the laws are about, as sample numbers.
const INBOX: u32 = 64;
const OUTBOX: u32 = 256;
const _: () = assert!(INBOX as usize == INBOX_SAMPLES && OUTBOX as usize == OUTBOX_SAMPLES);

/// Calls `$apply!` once per law, with the law's name.
macro_rules! for_every_law {
    ($apply:ident) => {
        $apply! {
            order_is_kept_per_source
            nothing_is_lost_up_to_the_capacity_of_the_inbox
            the_transport_fills_its_own_header_fields
            a_full_inbox_fills_the_outbox_and_then_refuses
            what_waits_in_the_outbox_keeps_its_place
            every_craft_may_send_to_one_inbox
            payloads_of_every_size_up_to_the_bound_arrive_unchanged
            a_payload_above_the_bound_is_refused_and_leaves_no_gap
            damaged_and_foreign_samples_are_refused_and_counted
            samples_of_strangers_and_for_others_are_refused
            no_craft_commands_another
            an_older_life_is_refused_and_a_newer_one_starts_over
            a_gap_is_counted_and_what_follows_still_arrives
            a_repeat_is_counted_and_not_handed_over
            a_multicast_reaches_everybody_but_its_sender_once
            a_missed_multicast_is_repaired_and_never_comes_twice
            a_missed_turn_is_repaired
            only_listeners_get_multicasts
            turns_reach_every_craft
            reopened_ports_keep_their_numbers
            a_closed_port_refuses
            a_world_is_taken_once_and_outlives_later_traffic
            the_newest_world_is_the_one_that_counts
            everybody_reaches_the_orchestrator
        }
    };
}
pub(crate) use for_every_law;

pub(crate) fn order_is_kept_per_source(fleet: &mut dyn Fleet) {
    for number in 0..40 {
        for source in 0..3 {
            send_number(fleet.craft(source), to_craft(3), 100 * source + number).expect("sends");
        }
    }
    let received = receive(fleet, 3);
    for source in 0..3 {
        let from_source: Vec<u32> =
            numbers(&received).into_iter().filter(|number| number / 100 == source).collect();
        assert_eq!(from_source, (100 * source..100 * source + 40).collect::<Vec<_>>());
    }
    assert_eq!(take_losses(fleet), Losses::default());
}

pub(crate) fn nothing_is_lost_up_to_the_capacity_of_the_inbox(fleet: &mut dyn Fleet) {
    for number in 0..INBOX {
        send_number(fleet.craft(0), to_craft(1), number).expect("sends");
    }
    assert_eq!(fleet.craft(0).flush().expect("flushes"), 0);
    assert_eq!(numbers(&receive(fleet, 1)), (0..INBOX).collect::<Vec<_>>());
    assert_eq!(take_losses(fleet), Losses::default());
}

pub(crate) fn the_transport_fills_its_own_header_fields(fleet: &mut dyn Fleet) {
    let run = fleet.run();
    for destination in [to_craft(2), Destination::Multicast] {
        for _ in 0..2 {
            let header = Header { epoch: 7, turn: 8, origin: 9, published_ns: 10, ..delta() };
            fleet.craft(1).send(destination, header, 0, &mut |_| {}).expect("sends");
        }
    }
    let received = receive(fleet, 2);
    assert_eq!(received.len(), 4);
    for sample in &received {
        let header = sample.header;
        assert_eq!(
            header.verify(&sample.payload, run),
            Ok((header.class().expect("known"), header.kind().expect("known")))
        );
        assert_eq!((header.source, header.incarnation), (1, 0));
        assert_eq!(header.destination, sample.destination.address().0);
        assert_eq!((header.epoch, header.turn, header.origin, header.published_ns), (7, 8, 9, 10));
    }
    for destination in [to_craft(2), Destination::Multicast] {
        let sequence: Vec<u64> = received
            .iter()
            .filter(|sample| sample.destination == destination)
            .map(|sample| sample.header.sequence)
            .collect();
        assert_eq!(sequence, [0, 1], "{destination:?} is numbered on its own");
    }
}

pub(crate) fn a_full_inbox_fills_the_outbox_and_then_refuses(fleet: &mut dyn Fleet) {
    let total = INBOX + OUTBOX;
    for number in 0..total {
        send_number(fleet.craft(0), to_craft(1), number).expect("is taken or waits");
    }
    assert_eq!(fleet.craft(0).flush().expect("flushes"), OUTBOX_SAMPLES);
    let refused = send_number(fleet.craft(0), to_craft(1), total);
    assert!(matches!(refused, Err(SendError::OutboxFull(to)) if to == to_craft(1)), "{refused:?}");
    send_number(fleet.craft(0), to_craft(2), 0).expect("other receivers do not suffer");
    let losses = fleet.craft(0).take_losses();
    let expected =
        Losses { full_inboxes: u64::from(OUTBOX), full_outboxes: 1, ..Losses::default() };
    assert_eq!(losses, expected);

    let received = drain_until_quiet(fleet);
    assert_eq!(numbers(&received[1]), (0..total).collect::<Vec<_>>());
    assert_eq!(numbers(&received[2]), [0]);
    send_number(fleet.craft(0), to_craft(1), total + 1).expect("sends");
    assert_eq!(numbers(&receive(fleet, 1)), [total + 1]);
    assert_eq!(fleet.craft(1).take_losses(), Losses { gaps: 1, ..Losses::default() });
}

pub(crate) fn what_waits_in_the_outbox_keeps_its_place(fleet: &mut dyn Fleet) {
    let full = INBOX;
    for number in 0..full + 3 {
        send_number(fleet.craft(0), to_craft(1), number).expect("is taken or waits");
    }
    let mut received = numbers(&receive(fleet, 1));
    // The inbox has room again, but three samples wait before this one.
    send_number(fleet.craft(0), to_craft(1), full + 3).expect("waits");
    received.extend(numbers(&drain_until_quiet(fleet)[1]));
    assert_eq!(received, (0..full + 4).collect::<Vec<_>>());
    assert_eq!(take_losses(fleet), Losses { full_inboxes: 4, ..Losses::default() });
}

pub(crate) fn every_craft_may_send_to_one_inbox(fleet: &mut dyn Fleet) {
    for round in 0..20 {
        for source in 1..CRAFTS {
            send_number(fleet.craft(source), to_craft(0), round).expect("sends");
        }
        send_number(fleet.orchestrator(), to_craft(0), round).expect("sends");
    }
    let received = receive(fleet, 0);
    assert_eq!(received.len(), 20 * CRAFTS as usize);
    for source in (1..CRAFTS).chain([CraftId::ORCHESTRATOR.0]) {
        let count = received.iter().filter(|sample| sample.header.source == source).count();
        assert_eq!(count, 20);
    }
    assert_eq!(take_losses(fleet), Losses::default());
}

pub(crate) fn payloads_of_every_size_up_to_the_bound_arrive_unchanged(fleet: &mut dyn Fleet) {
    let sizes = [0, 1, 15, 16, 17, 255, 4096, 4097, INBOX_PAYLOAD_BYTES - 1, INBOX_PAYLOAD_BYTES];
    let byte = |size: usize, at: usize| u8::try_from((size + 3 * at) % 251).expect("below 251");
    for size in sizes {
        for destination in [to_craft(1), Destination::Multicast] {
            fleet
                .craft(0)
                .send(destination, delta(), size, &mut |payload| {
                    assert_eq!(payload.len(), size);
                    for (at, slot) in payload.iter_mut().enumerate() {
                        *slot = byte(size, at);
                    }
                })
                .expect("fits");
        }
    }
    let received = receive(fleet, 1);
    for destination in [to_craft(1), Destination::Multicast] {
        let arrived: Vec<_> =
            received.iter().filter(|sample| sample.destination == destination).collect();
        assert_eq!(arrived.len(), sizes.len());
        for (sample, size) in arrived.into_iter().zip(sizes) {
            assert_eq!(sample.payload.len(), size);
            assert!(sample.payload.iter().enumerate().all(|(at, &slot)| slot == byte(size, at)));
        }
    }
    assert_eq!(take_losses(fleet), Losses::default());
}

pub(crate) fn a_payload_above_the_bound_is_refused_and_leaves_no_gap(fleet: &mut dyn Fleet) {
    for destination in [to_craft(1), Destination::Multicast, Destination::Orchestrator] {
        let refused =
            fleet.craft(0).send(destination, delta(), INBOX_PAYLOAD_BYTES + 1, &mut |_| {
                panic!("nothing is written where nothing is sent")
            });
        let is_refused = matches!(
            refused,
            Err(SendError::TooLong { needed, limit })
                if needed == INBOX_PAYLOAD_BYTES + 1 && limit == INBOX_PAYLOAD_BYTES
        );
        assert!(is_refused, "{refused:?}");
        if destination != Destination::Orchestrator {
            send_number(fleet.craft(0), destination, 5).expect("sends");
        }
    }
    assert_eq!(numbers(&receive(fleet, 1)), [5, 5]);
    drain_until_quiet(fleet);
    assert_eq!(take_losses(fleet), Losses::default());
}

/// A sample that craft 0 could send to craft 1, sealed.
fn genuine(fleet: &dyn Fleet, sequence: u64, payload: &[u8]) -> Header {
    let mut header = Header { run: fleet.run(), source: 0, destination: 1, sequence, ..delta() };
    header.seal(payload);
    header
}

/// The same after `change`, sealed again.
fn forged(fleet: &dyn Fleet, change: impl FnOnce(&mut Header)) -> Header {
    let mut header = genuine(fleet, 0, b"data");
    change(&mut header);
    header.seal(b"data");
    header
}

pub(crate) fn damaged_and_foreign_samples_are_refused_and_counted(fleet: &mut dyn Fleet) {
    let whole = genuine(fleet, 0, b"data");
    let cases: [(&str, Header, &[u8]); 8] = [
        ("payload changed", whole, b"dbta"),
        ("header changed", Header { turn: 1, ..whole }, b"data"),
        ("payload cut", whole, b"dat"),
        ("payload too long", whole, b"data!"),
        ("foreign run", forged(fleet, |header| header.run = FOREIGN_RUN), b"data"),
        (
            "old version",
            forged(fleet, |header| header.format_version = FORMAT_VERSION - 1),
            b"data",
        ),
        ("unknown class", forged(fleet, |header| header.class = 200), b"data"),
        ("unknown kind", forged(fleet, |header| header.kind = 200), b"data"),
    ];
    for (name, header, payload) in cases {
        fleet.inject(1, header, payload);
        assert!(receive(fleet, 1).is_empty(), "{name}");
        assert_eq!(
            fleet.craft(1).take_losses(),
            Losses { refused: 1, ..Losses::default() },
            "{name}"
        );
    }
    fleet.inject(1, whole, b"data");
    assert_eq!(receive(fleet, 1).len(), 1, "the genuine one is still new");
    assert_eq!(take_losses(fleet), Losses::default());
}

pub(crate) fn samples_of_strangers_and_for_others_are_refused(fleet: &mut dyn Fleet) {
    fleet.inject(1, forged(fleet, |header| header.source = CRAFTS), b"data");
    fleet.inject(1, forged(fleet, |header| header.destination = 2), b"data");
    fleet.inject(1, forged(fleet, |header| header.destination = CraftId::ORCHESTRATOR.0), b"data");
    assert!(receive(fleet, 1).is_empty());
    assert_eq!(take_losses(fleet), Losses { refused: 3, ..Losses::default() });
}

pub(crate) fn no_craft_commands_another(fleet: &mut dyn Fleet) {
    let stop = forged(fleet, |header| {
        let Header { class, kind, .. } = Header::new(Class::Control, Kind::Stop);
        (header.class, header.kind) = (class, kind);
    });
    fleet.inject(1, stop, b"data");
    assert!(receive(fleet, 1).is_empty());
    assert_eq!(take_losses(fleet), Losses { refused: 1, ..Losses::default() });
}

pub(crate) fn an_older_life_is_refused_and_a_newer_one_starts_over(fleet: &mut dyn Fleet) {
    send_number(fleet.craft(0), to_craft(1), 1).expect("sends");
    assert_eq!(numbers(&receive(fleet, 1)), [1]);
    fleet.inject(1, forged(fleet, |header| header.incarnation = 1), b"data");
    assert_eq!(receive(fleet, 1).len(), 1, "number 0 of the new life");
    send_number(fleet.craft(0), to_craft(1), 2).expect("sends");
    assert!(receive(fleet, 1).is_empty());
    assert_eq!(take_losses(fleet), Losses { old_incarnation: 1, ..Losses::default() });
}

pub(crate) fn a_gap_is_counted_and_what_follows_still_arrives(fleet: &mut dyn Fleet) {
    for sequence in [0, 3, 4] {
        fleet.inject(1, genuine(fleet, sequence, b"data"), b"data");
    }
    assert_eq!(receive(fleet, 1).len(), 3);
    assert_eq!(fleet.craft(1).take_losses(), Losses { gaps: 2, ..Losses::default() });
    assert_eq!(take_losses(fleet), Losses::default(), "a gap is counted once");
}

pub(crate) fn a_repeat_is_counted_and_not_handed_over(fleet: &mut dyn Fleet) {
    for sequence in [0, 0, 1, 0] {
        fleet.inject(1, genuine(fleet, sequence, b"data"), b"data");
    }
    assert_eq!(receive(fleet, 1).len(), 2);
    assert_eq!(take_losses(fleet), Losses { repeats: 2, ..Losses::default() });
}

pub(crate) fn a_multicast_reaches_everybody_but_its_sender_once(fleet: &mut dyn Fleet) {
    for sender in 0..CRAFTS {
        send_number(fleet.craft(sender), Destination::Multicast, sender).expect("sends");
    }
    for craft in 0..CRAFTS {
        let mut received = numbers(&receive(fleet, craft));
        received.sort_unstable();
        let others: Vec<u32> = (0..CRAFTS).filter(|&other| other != craft).collect();
        assert_eq!(received, others);
    }
    fleet.settle();
    assert!(drain(fleet.orchestrator()).is_empty());
    assert_eq!(take_losses(fleet), Losses::default());
}

pub(crate) fn a_missed_multicast_is_repaired_and_never_comes_twice(fleet: &mut dyn Fleet) {
    // More than multicast buffer, inbox and outbox take one after the other.
    let total = 2 * INBOX + 40;
    for number in 0..total {
        send_number(fleet.craft(0), Destination::Multicast, number).expect("is taken or waits");
        if number % 3 == 0 {
            // One receiver keeps up; its neighbours' troubles are not its own.
            let _ = receive_into(fleet, 4, number);
        }
    }
    let received = drain_until_quiet(fleet);
    for arrived in &received[1..4] {
        let mut arrived_numbers = numbers(arrived);
        arrived_numbers.sort_unstable();
        assert_eq!(arrived_numbers, (0..total).collect::<Vec<_>>());
        assert!(arrived.iter().all(|sample| sample.destination == Destination::Multicast));
    }
    let losses = take_losses(fleet);
    let missed = 3 * (u64::from(total) - u64::from(INBOX));
    let waited = 3 * (u64::from(total) - 2 * u64::from(INBOX));
    let expected = Losses { missed_multicasts: missed, full_inboxes: waited, ..Losses::default() };
    assert_eq!(losses, expected);
}

/// Reads at `craft` and checks that the numbers up to `number` have come.
fn receive_into(fleet: &mut dyn Fleet, craft: u32, number: u32) -> usize {
    let received = receive(fleet, craft);
    assert_eq!(received.last().map(crate::fleet::Received::number), Some(number));
    received.len()
}

pub(crate) fn a_missed_turn_is_repaired(fleet: &mut dyn Fleet) {
    let total = INBOX + 5;
    for number in 0..total {
        send_number(fleet.orchestrator(), Destination::Turn, number).expect("sends");
    }
    let received = drain_until_quiet(fleet);
    for arrived in &received {
        let mut arrived_numbers = numbers(arrived);
        arrived_numbers.sort_unstable();
        assert_eq!(arrived_numbers, (0..total).collect::<Vec<_>>());
        assert!(arrived.iter().all(|sample| sample.destination == Destination::Turn));
    }
    let missed_multicasts = 5 * u64::from(CRAFTS);
    assert_eq!(take_losses(fleet), Losses { missed_multicasts, ..Losses::default() });
}

pub(crate) fn only_listeners_get_multicasts(fleet: &mut dyn Fleet) {
    fleet.craft(2).open_ports(&Peers::default()).expect("ports close");
    send_number(fleet.craft(0), Destination::Multicast, 1).expect("sends");
    assert!(receive(fleet, 2).is_empty());
    assert_eq!(numbers(&receive(fleet, 3)), [1]);
    let refused = send_number(fleet.craft(2), Destination::Multicast, 1);
    assert!(matches!(refused, Err(SendError::NotOpen(Destination::Multicast))), "{refused:?}");
    drain_until_quiet(fleet);
    assert_eq!(take_losses(fleet), Losses::default());
}

pub(crate) fn turns_reach_every_craft(fleet: &mut dyn Fleet) {
    for number in 0..3 {
        send_number(fleet.orchestrator(), Destination::Turn, number).expect("sends");
    }
    for craft in 0..CRAFTS {
        let received = receive(fleet, craft);
        assert_eq!(numbers(&received), [0, 1, 2]);
        assert!(received.iter().all(|sample| sample.destination == Destination::Turn));
    }
    assert_eq!(take_losses(fleet), Losses::default());
}

pub(crate) fn reopened_ports_keep_their_numbers(fleet: &mut dyn Fleet) {
    for round in 0..3 {
        crate::fleet::open_everything(fleet);
        for destination in [to_craft(1), Destination::Multicast] {
            send_number(fleet.craft(0), destination, round).expect("sends");
        }
        let received = drain_until_quiet(fleet);
        assert_eq!(numbers(&received[1]), [round, round]);
        let sequences = received[1].iter().map(|sample| sample.header.sequence);
        assert!(sequences.eq([u64::from(round); 2]));
        for craft in 0..CRAFTS {
            fleet.craft(craft).open_ports(&Peers::default()).expect("ports close");
        }
    }
    assert_eq!(take_losses(fleet), Losses::default());
}

pub(crate) fn a_closed_port_refuses(fleet: &mut dyn Fleet) {
    let only_two =
        Peers { unicast: vec![CraftId(2)], sends_multicast: false, receives_multicast: true };
    fleet.craft(0).open_ports(&only_two).expect("ports open");
    for closed in [to_craft(1), Destination::Multicast, Destination::Turn, Destination::World] {
        let refused = send_number(fleet.craft(0), closed, 1);
        assert!(matches!(refused, Err(SendError::NotOpen(to)) if to == closed), "{refused:?}");
    }
    let refused = send_number(fleet.orchestrator(), to_craft(CRAFTS), 1);
    assert!(matches!(refused, Err(SendError::NotOpen(_))), "there is no such craft: {refused:?}");
    send_number(fleet.craft(0), to_craft(2), 7).expect("sends");
    send_number(fleet.craft(0), Destination::Orchestrator, 8).expect("is always open");
    assert_eq!(numbers(&receive(fleet, 2)), [7]);
    assert_eq!(numbers(&drain(fleet.orchestrator())), [8]);
    assert_eq!(take_losses(fleet), Losses::default());
}

/// Publishes a world of `length` bytes of `fill`.
fn publish_world(fleet: &mut dyn Fleet, epoch: u32, fill: u8, length: usize) {
    fleet
        .orchestrator()
        .send(Destination::World, Header { epoch, ..delta() }, length, &mut |payload| {
            payload.fill(fill);
        })
        .expect("publishes");
    fleet.settle();
}

pub(crate) fn a_world_is_taken_once_and_outlives_later_traffic(fleet: &mut dyn Fleet) {
    assert!(fleet.craft(0).take_world().expect("works").is_none());
    // Larger than any inbox sample.
    let length = 5 * INBOX_PAYLOAD_BYTES + 3;
    publish_world(fleet, 1, 0x5a, length);
    for craft in 0..CRAFTS {
        let world = fleet.craft(craft).take_world().expect("works").expect("is there");
        assert_eq!(world.header.epoch, 1);
        assert_eq!(world.as_ptr().align_offset(16), 0);
        assert!(fleet.craft(craft).take_world().expect("works").is_none());
        for number in 0..10 {
            send_number(fleet.craft(craft), to_craft((craft + 1) % CRAFTS), number).expect("sends");
        }
        assert_eq!(receive(fleet, (craft + 1) % CRAFTS).len(), 10);
        assert!(world.len() == length && world.iter().all(|&byte| byte == 0x5a));
    }
    assert_eq!(take_losses(fleet), Losses::default());
}

pub(crate) fn the_newest_world_is_the_one_that_counts(fleet: &mut dyn Fleet) {
    for epoch in 0..6_u8 {
        publish_world(fleet, u32::from(epoch), epoch, 1000 * (usize::from(epoch) + 1));
        for craft in 0..CRAFTS {
            let world = fleet.craft(craft).take_world().expect("works").expect("is there");
            assert_eq!(world.header.epoch, u32::from(epoch));
            assert!(world.len() == 1000 * (usize::from(epoch) + 1));
            assert!(world.iter().all(|&byte| byte == epoch));
        }
    }
    // A craft that sleeps through an epoch loses nothing that it could still use.
    publish_world(fleet, 6, 6, 10);
    publish_world(fleet, 7, 7, 10);
    let world = fleet.craft(0).take_world().expect("works").expect("is there");
    assert_eq!(world.header.epoch, 7);
    assert!(fleet.craft(0).take_world().expect("works").is_none());
    assert_eq!(take_losses(fleet), Losses::default());
}

pub(crate) fn everybody_reaches_the_orchestrator(fleet: &mut dyn Fleet) {
    for round in 0..100 {
        for craft in 0..CRAFTS {
            send_number(fleet.craft(craft), Destination::Orchestrator, round).expect("sends");
        }
    }
    fleet.settle();
    let received = drain(fleet.orchestrator());
    assert_eq!(received.len(), 100 * CRAFTS as usize);
    assert!(received.iter().all(|sample| sample.destination == Destination::Orchestrator));
    assert_eq!(take_losses(fleet), Losses::default());
}
