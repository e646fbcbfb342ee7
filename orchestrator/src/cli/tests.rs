//! What may be typed, and what is said to whoever mistypes.

use super::{Cli, LoadSizes, load_sizes, strategy};
use clap::CommandFactory;
use shared_types::wire::StrategyKind;

#[test]
fn command_line_is_consistent() {
    Cli::command().debug_assert();
}

#[test]
fn load_sizes_are_numbers_or_none() {
    assert_eq!(load_sizes("5, 10"), Ok(LoadSizes(vec![5, 10])));
    assert_eq!(load_sizes("none"), Ok(LoadSizes(Vec::new())));
    assert!(load_sizes("ten").unwrap_err().contains("`ten` is no fleet size"));
}

#[test]
fn mistyped_strategies_are_answered_with_the_nearest_or_with_all() {
    assert_eq!(strategy("boundary"), Ok(StrategyKind::Boundary));
    let near = strategy("boundry").unwrap_err();
    assert!(near.ends_with("did you mean `boundary`?"), "{near}");
    let far = strategy("xyz").unwrap_err();
    for kind in StrategyKind::ALL {
        assert!(far.contains(kind.name()), "{far}");
    }
    assert!(far.lines().all(|line| line.chars().count() <= 80), "{far}");
}
