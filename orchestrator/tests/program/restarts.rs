//! A craft that is killed while `faults.restart` is `on-failure`: its trial is lost, its successor takes
//! part in the next ones, which are as if nothing had happened.

use crate::invocation::Place;
use crate::shared::until;
use orchestrator::results::event::Event;
use orchestrator::results::record::TrialEnd;
use rustix::process::Signal;

const ON_FAILURE: [&str; 2] = ["--set", "faults.restart=\"on-failure\""];

/// Kills `kills` crafts, one after the other and each while trials are played, and lets the run come to
/// its end; its trials are those that were not lost, and all of them agree with the replay.
fn check_restarts(words: &str, kills: usize) {
    let place = Place::for_fleets();
    let words: Vec<&str> = words.split(' ').chain(ON_FAILURE).collect();
    let mut invocation = place.start(&words);
    for kill in 0..kills {
        place.await_epochs(20 * kill);
        let crafts = place.crafts();
        assert!(!invocation.has_ended(), "it ended by itself: {}", invocation.said());
        crafts[kill % crafts.len()].signal(Signal::KILL);
        until("a successor", || {
            assert!(!invocation.has_ended(), "no successor came: {}", invocation.said());
            let events = place.results()?.events;
            let returned =
                events.iter().filter(|line| matches!(line.event, Event::CraftRestarted { .. }));
            (returned.count() > kill).then_some(())
        });
    }
    let finished = invocation.finish().expect_code(3);
    place.assert_nothing_left(&[]);
    let results = place.results().unwrap();
    let is_lost = |event: &&Event| matches!(event, Event::EpochDone { end: TrialEnd::Partial, .. });
    let events: Vec<&Event> = results.events.iter().map(|line| &line.event).collect();
    let lost = events.iter().filter(|event| is_lost(event)).count();
    assert!((1..=kills).contains(&lost), "{lost} trials were lost\n{finished}");
    let discrepancies: Vec<&&Event> =
        events.iter().filter(|event| matches!(event, Event::Discrepancy { .. })).collect();
    assert!(discrepancies.is_empty(), "{discrepancies:?}\n{finished}");
    let wrong = results.trials.iter().find(|trial| {
        !trial.deterministic.agrees_with_oracle() || trial.timing.losses.is_partial()
    });
    assert!(wrong.is_none(), "{wrong:?}\n{finished}");
    assert!(finished.stdout.contains("lived again"), "{finished}");
}

#[test]
fn fleet_goes_on_with_successors_of_killed_crafts() {
    check_restarts("compare --sizes 5 --no-timing --trials 60 --strategies boundary,full", 3);
}

#[test]
fn fleet_of_a_centre_goes_on_with_successors_the_centre_among_them() {
    check_restarts(
        "compare --sizes 3 --no-timing --trials 60 --strategies central-batched,boundary",
        4,
    );
}

#[test]
fn craft_that_dies_again_and_again_is_given_up() {
    let place = Place::for_fleets();
    let words = "compare --sizes 3 --no-timing --trials 100000 --strategies boundary";
    let limit = ["--set", "faults.restart-limit=1"];
    let words: Vec<&str> = words.split(' ').chain(ON_FAILURE).chain(limit).collect();
    let mut invocation = place.start(&words);
    place.await_epochs(0);
    while !invocation.has_ended() {
        if let Some(craft) = place.crafts().first() {
            craft.signal(Signal::KILL);
        }
        rustix::event::poll(
            &mut [],
            Some(&rustix::event::Timespec { tv_sec: 0, tv_nsec: 20_000_000 }),
        )
        .unwrap();
    }
    let finished = invocation.finish().expect_code(3);
    assert!(finished.stderr.contains("the restarts of a craft are used up"), "{finished}");
    place.assert_nothing_left(&[]);
}
