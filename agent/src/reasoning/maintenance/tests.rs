//! Statuses against their assessment from scratch, and what follows from each.

use super::reference::{Situation, status};
use super::{Item, Lifetime, Maintenance, Place, Settings, SettingsError, Status};
use crate::reasoning::prune::sound::Sound;
use crate::reasoning::sample::{Shape, board};
use proptest::prelude::{ProptestConfig, any, proptest};
use proptest::prop_assert_eq;
use shared_types::ids::FactId;
use shared_types::knowledge::{BoardNetwork, Literal};
use shared_types::rng::{Purpose, Stream};
use shared_types::time::Nanos;

const SETTINGS: Settings = Settings {
    period_ns: 100,
    cycles_per_period: 4,
    stale_kept_ns: 1000,
    ancillary_items_max: 1000,
};

fn items(board: &BoardNetwork) -> Vec<Item> {
    let view = board.view();
    (0..view.fact_count)
        .map(Item::Fact)
        .chain((0..view.rule_count()).map(Item::Rule))
        .chain((0..view.action_count()).map(Item::Action))
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn statuses_are_those_from_scratch(seed in any::<u64>(), changes in 0_u32..10) {
        let mut stream = Stream::new(seed, 0, Purpose::Test, 3);
        let shape =
            Shape { facts: 12, rules: 12, actions: 6, associations: 3, is_negating: true };
        let mut network = board(shape, &mut stream);
        network.links.clear();
        for fact in 0..shape.facts {
            network.links.push_row(if stream.below(8) == 0 { vec![1, fact] } else { Vec::new() });
        }
        let view = network.view();
        let goal = Literal(stream.below(2 * shape.facts));
        let mut situation = Situation {
            board: view,
            known: Vec::new(),
            goals: vec![goal],
            lifetimes: vec![Lifetime::Lasting; shape.facts as usize],
            replaced: Vec::new(),
            needed: items(&network).into_iter().filter(|_| stream.below(3) == 0).collect(),
        };
        let mut maintenance =
            Maintenance::new(&view, SETTINGS, Sound::new(&view, [], [goal]));
        maintenance.set_needed(situation.needed.iter().copied());
        for change in 0..changes {
            let (fact, now) = (FactId(stream.below(shape.facts)), Nanos(u64::from(change)));
            match stream.below(4) {
                0 => {
                    let lifetime = match stream.below(2) {
                        0 => Lifetime::Until(Nanos(u64::from(stream.below(20)))),
                        _ => Lifetime::For(u64::from(stream.below(20))),
                    };
                    situation.lifetimes[fact.index()] = lifetime;
                    maintenance.set_lifetime(fact, lifetime);
                }
                1 => {
                    situation.replaced.push(fact);
                    maintenance.note_replaced(fact);
                }
                _ => {
                    let literal = Literal(fact.0 << 1 | stream.below(2));
                    situation.known.retain(|(one, _)| one.fact() != fact);
                    situation.known.push((literal, now));
                    situation.replaced.retain(|&one| one != fact);
                    maintenance.note_write(&view, fact, Some(literal), now);
                }
            }
        }
        let now = Nanos(u64::from(changes) + 5);
        for item in items(&network) {
            prop_assert_eq!(maintenance.status(&view, item, now), status(&situation, item, now), "{:?}", item);
        }
    }
}

/// 0 and 1 lead to 2 by two rules; 3 leads nowhere.
fn small() -> BoardNetwork {
    let holds = |fact| Literal::holds(FactId(fact)).0;
    let mut board = BoardNetwork { fact_count: 4, ..BoardNetwork::default() };
    for (premise, output) in [(0, 2), (1, 2), (2, 3)] {
        board.premises.push_row([holds(premise)]);
        board.outputs.push_row([holds(output)]);
        board.queues.push_row([]);
    }
    (0..4).for_each(|_| board.links.push_row([]));
    board.index_readers();
    board
}

#[test]
fn every_status_has_its_place_and_lists() {
    let network = small();
    let view = network.view();
    let goal = Literal::holds(FactId(2));
    let mut maintenance = Maintenance::new(&view, SETTINGS, Sound::new(&view, [], [goal]));
    for fact in [0, 1] {
        let literal = Literal::holds(FactId(fact));
        maintenance.note_write(&view, FactId(fact), Some(literal), Nanos(0));
    }
    maintenance.set_lifetime(FactId(1), Lifetime::For(200));
    maintenance.set_needed([Item::Fact(0), Item::Rule(0), Item::Fact(2)]);
    let all = view.fact_count as usize + view.premises.row_count();
    let slice = maintenance.slice(&view, Nanos(1), all);
    assert_eq!(slice.statuses, [0, 0, 2, 2, 3], "3 and its rule; 1 and its rule; the way");
    assert_eq!(maintenance.place(Item::Fact(0)), Place::Board);
    assert_eq!(maintenance.place(Item::Fact(1)), Place::Ancillary);
    assert_eq!(maintenance.place(Item::Rule(2)), Place::Unused);
    assert_eq!(maintenance.available().collect::<Vec<_>>(), [FactId(1)]);
    assert_eq!(maintenance.do_not_collect().collect::<Vec<_>>(), [FactId(1), FactId(3)]);
    let again = maintenance.slice(&view, Nanos(50), all);
    assert_eq!((again.statuses[Status::Current as usize], again.moved), (7, 0));
    // Its lifetime over, the second premise is archived, and its rule serves nothing any more.
    maintenance.slice(&view, Nanos(250), all);
    assert_eq!(maintenance.place(Item::Fact(1)), Place::Stale { since: Nanos(250) });
    maintenance.slice(&view, Nanos(400), all);
    assert_eq!(maintenance.place(Item::Rule(1)), Place::Unused);
    // Written again, it serves again, and so does its rule.
    maintenance.note_write(&view, FactId(1), Some(Literal::holds(FactId(1))), Nanos(410));
    assert_eq!(maintenance.place(Item::Rule(1)), Place::Board);
    assert!(!maintenance.do_not_collect().any(|fact| fact == FactId(1)));
}

#[test]
fn a_full_store_lets_the_oldest_go_and_archives_forget() {
    let network = small();
    let view = network.view();
    let settings = Settings { ancillary_items_max: 1, ..SETTINGS };
    let goal = Literal::holds(FactId(2));
    let mut maintenance = Maintenance::new(&view, settings, Sound::new(&view, [], [goal]));
    for fact in [0, 1] {
        maintenance.note_write(&view, FactId(fact), Some(Literal::holds(FactId(fact))), Nanos(0));
    }
    maintenance.slice(&view, Nanos(1), 2);
    assert_eq!(maintenance.place(Item::Fact(0)), Place::Unused, "the oldest of two");
    assert_eq!(maintenance.place(Item::Fact(1)), Place::Ancillary);
    maintenance.note_replaced(FactId(1));
    maintenance.slice(&view, Nanos(200), 7);
    assert_eq!(maintenance.place(Item::Fact(1)), Place::Stale { since: Nanos(200) });
    maintenance.slice(&view, Nanos(1200), 1);
    assert_ne!(maintenance.place(Item::Fact(1)), Place::Stale { since: Nanos(200) });
}

#[test]
fn a_cycle_is_a_share_of_the_period() {
    let network = small();
    let view = network.view();
    let maintenance = Maintenance::new(&view, SETTINGS, Sound::new(&view, [], []));
    assert_eq!(maintenance.share(), 2, "7 items in 4 cycles");
    let without = |settings: Settings| settings.checked().unwrap_err();
    assert_eq!(without(Settings { period_ns: 0, ..SETTINGS }), SettingsError::NoPeriod);
    assert_eq!(without(Settings { cycles_per_period: 0, ..SETTINGS }), SettingsError::NoCycles);
}
