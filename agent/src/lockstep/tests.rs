//! The ledger opens, balances and closes turns as its documentation says.

use super::{LedgerError, Outcome, Referee};
use shared_types::ids::CraftId;
use shared_types::wire::{EpochSpec, StrategyKind, TurnCommand, TurnPhase, TurnReport};

fn spec(own_firing_only: bool) -> EpochSpec {
    EpochSpec {
        epoch: 0,
        network: 0,
        seed: 1,
        trial: 0,
        strategy: StrategyKind::Boundary,
        own_firing_only,
        ignores_finals: false,
        sends_altered_only: false,
        record_bytes: 16,
        turns_max: 3,
        reasoning: shared_types::reasoning::Reasoning::default(),
        recovery: None,
        link: None,
        open: None,
    }
}

fn fired(turn: u32, firing: u32, owed: u32, held: u32) -> TurnReport {
    TurnReport { turn, phase: TurnPhase::Fired as u32, firing, owed, held, is_final: 0 }
}

fn held(turn: u32, held: u32) -> TurnReport {
    TurnReport { phase: TurnPhase::Held as u32, ..fired(turn, u32::MAX, 0, held) }
}

#[test]
fn turn_closes_when_all_have_fired_and_owed_is_held() {
    let mut referee = Referee::new(&spec(true), 2);
    assert_eq!(referee.start().opened, 0);
    referee.record(CraftId(0), &fired(0, 7, 1, 0)).expect("fits");
    assert_eq!(referee.advance(), None, "craft 1 has not fired");
    referee.record(CraftId(1), &fired(0, 9, 0, 0)).expect("fits");
    assert_eq!(referee.advance(), None, "one delivery is under way");
    referee.record(CraftId(1), &held(0, 1)).expect("fits");
    let command = referee.advance().expect("balanced");
    assert_eq!((command.closed, command.opened, command.is_last), (0, 1, 0));
    assert_eq!(referee.path().len(), 2);
}

#[test]
fn trial_ends_with_the_turn_in_which_a_final_fact_is_reached() {
    let mut referee = Referee::new(&spec(true), 2);
    referee.record(CraftId(0), &TurnReport { is_final: 1, ..fired(0, 7, 0, 0) }).expect("fits");
    assert_eq!(referee.outcome(), None);
    referee.record(CraftId(1), &fired(0, 9, 0, 0)).expect("fits");
    let command = referee.advance().expect("balanced");
    assert_eq!((command.opened, command.is_last), (TurnCommand::NO_TURN, 1));
    assert_eq!((referee.outcome(), referee.turns()), (Some(Outcome::Finished), 1));
}

#[test]
fn delivery_may_end_a_mission_after_the_merge() {
    let mut referee = Referee::new(&spec(false), 2);
    for craft in 0..2 {
        referee.record(CraftId(craft), &fired(0, 7, 0, 0)).expect("fits");
    }
    let command = referee.advance().expect("balanced");
    assert_eq!((command.closed, command.wants_merged), (0, 1));
    let merged = |is_final| TurnReport {
        phase: TurnPhase::Merged as u32,
        is_final,
        ..fired(0, u32::MAX, 0, 0)
    };
    referee.record(CraftId(0), &merged(0)).expect("fits");
    assert_eq!(referee.advance(), None);
    referee.record(CraftId(1), &merged(1)).expect("fits");
    assert_eq!(referee.advance().expect("all merged").is_last, 1);
    assert_eq!(referee.outcome(), Some(Outcome::Finished));
}

#[test]
fn idle_fleet_with_nothing_in_flight_is_stalled() {
    for own_firing_only in [true, false] {
        let mut referee = Referee::new(&spec(own_firing_only), 2);
        for craft in 0..2 {
            referee.record(CraftId(craft), &fired(0, u32::MAX, 0, 0)).expect("fits");
        }
        assert_eq!(referee.advance().expect("balanced").is_last, 1);
        assert_eq!((referee.outcome(), referee.turns()), (Some(Outcome::Stalled), 1));
    }
}

#[test]
fn trial_without_a_final_fact_is_dropped_after_its_last_turn() {
    let mut referee = Referee::new(&spec(true), 1);
    for turn in 0..3 {
        assert_eq!(referee.outcome(), None);
        referee.record(CraftId(0), &fired(turn, 1, 0, 0)).expect("fits");
        referee.advance().expect("balanced");
    }
    assert_eq!((referee.outcome(), referee.turns()), (Some(Outcome::Dropped), 3));
}

#[test]
fn report_that_does_not_fit_is_refused() {
    let mut referee = Referee::new(&spec(true), 2);
    let craft = CraftId(1);
    assert_eq!(
        referee.record(CraftId(2), &fired(0, 1, 0, 0)),
        Err(LedgerError::UnknownProcess(CraftId(2)))
    );
    assert_eq!(
        referee.record(craft, &fired(1, 1, 0, 0)),
        Err(LedgerError::WrongTurn { craft, reported: 1, open: 0 })
    );
    assert_eq!(referee.record(craft, &held(0, 1)), Err(LedgerError::OutOfOrder { craft, turn: 0 }));
    referee.record(craft, &fired(0, 1, 2, 0)).expect("fits");
    assert!(referee.record(craft, &fired(0, 1, 2, 0)).is_err());
    assert!(referee.standing().contains("silent: 0"), "{}", referee.standing());
}
