//! The drawn networks against closed forms.

use super::{draw, measure};
use crate::results::networks::Condition;
use shared_types::knowledge::BoardNetwork;
use shared_types::rng::{Purpose, Stream};

#[test]
fn what_is_left_has_the_expected_means() {
    for associations in [2, 3, 5] {
        let condition = Condition { associations, ..Condition::BASE };
        let measured = measure(condition, 7, 200);
        let [facts, rules, actions] = measured.kept.map(|mean| mean.value().unwrap());
        let (a, n) = (f64::from(associations), 1000.0);
        let near = |ours: f64, expected: f64| (ours / expected - 1.0).abs() < 0.005;
        assert!(near(actions, n * (1.0 - 1.0 / a)), "actions {actions}");
        let lists: f64 = (1..associations).map(|k| (1.0 / (3.0 * a)).powf(f64::from(k))).sum();
        let expected = n * (1.0 - lists / (a - 1.0));
        assert!(near(rules, expected), "rules {rules} of {expected}");
        let read = 1.0 - (-(a / 2.0) * expected / n).exp();
        let asserted = 1.0 - 0.7 * (-(a / 3.0 + (a - 1.0) / 2.0)).exp();
        assert!((facts / (n * read * asserted) - 1.0).abs() < 0.02, "facts {facts}");
    }
}

#[test]
fn a_network_is_fixed_by_its_seed() {
    let network = |seed, condition| {
        let mut board = BoardNetwork::default();
        draw(condition, &mut Stream::new(seed, 3, Purpose::Networks, 0), &mut board);
        board
    };
    assert_eq!(network(1, Condition::BASE), network(1, Condition::BASE));
    assert_ne!(network(1, Condition::BASE), network(2, Condition::BASE));
    let board = network(1, Condition::BASE);
    assert!(board.view().is_valid(1));
    assert_eq!(board.initial.len(), 300);
    assert!(Condition { facts: 0, ..Condition::BASE }.check().is_err());
    assert!(Condition { associations: 1, ..Condition::BASE }.check().is_err());
}
