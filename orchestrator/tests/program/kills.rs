//! `kill -9` of any craft at any instant, from its first instruction on: the run ends within bounds as
//! partial, names the craft, keeps what it had, and leaves nothing.
//!
//! A few kills by default; `SLATESWARM_KILLS=200` for the long version, `SLATESWARM_KILLS_SEED=N` to
//! repeat what a failure printed.

use crate::invocation::{CraftSeen, Place};
use crate::shared::until;
use orchestrator::results::event::{Event, ProcessEnd};
use rustix::process::Signal;
use shared_types::rng::{Purpose, Stream};
use shared_types::transport::{RunPaths, clock};

/// Kills in continuous integration.
const KILLS_SHORT: u32 = 12;

/// The latest instant of a kill after the executable was started, us: a fleet of ten is up after a
/// tenth of this, or after all of it on a busy machine.
const INSTANT_MAX_US: u32 = 400_000;

/// One kill: which fleet, when, and whom.
#[derive(Debug)]
struct Kill {
    words: Vec<String>,
    instant_us: u32,
    /// Of the crafts that are there at the instant, counted from the first.
    victim: u32,
}

impl Kill {
    fn draw(stream: &mut Stream) -> Self {
        let size = ["2", "3", "5", "10"][stream.below(4) as usize];
        let wake = ["poll", "adaptive", "block"][stream.below(3) as usize];
        let what = [&["--no-timing"][..], &["--timing-only"][..]][stream.below(2) as usize];
        let words = ["compare", "--sizes", size, "--wake", wake, "--trials", "1000000"];
        let endless = ["--set", "run.timing-epochs=1000000"];
        let words = words.iter().chain(what).chain(&endless).map(ToString::to_string).collect();
        // Every third kill as soon as there is somebody to kill.
        let instant_us = if stream.below(3) == 0 { 0 } else { stream.below(INSTANT_MAX_US) };
        Self { words, instant_us, victim: stream.below(128) }
    }

    /// Starts the fleet and kills the craft once the instant has come and somebody is there.
    fn carry_out(&self, place: &Place) {
        let words: Vec<&str> = self.words.iter().map(String::as_str).collect();
        let instant = clock::now().plus(u64::from(self.instant_us) * 1000);
        let mut invocation = place.start(&words);
        let victim: CraftSeen = until("a craft to kill", || {
            assert!(!invocation.has_ended(), "it ended by itself: {}", invocation.said());
            let crafts = if clock::now() < instant { Vec::new() } else { place.crafts() };
            let place = self.victim as usize % crafts.len().max(1);
            crafts.get(place).cloned()
        });
        victim.signal(Signal::KILL);
        let run = RunPaths::below(place.base(), victim.arguments.run);
        let finished = invocation.finish().expect_code(3);
        place.assert_nothing_left(&[run]);
        let results = place.results().unwrap();
        assert_eq!(results.missing, [], "{finished}");
        let is_centre = victim.arguments.craft.0 == victim.arguments.craft_count;
        let number = victim.arguments.craft;
        let name = if is_centre { "centre".to_owned() } else { format!("craft-{number}") };
        let lost: Vec<&Event> = results
            .events
            .iter()
            .map(|line| &line.event)
            .filter(|event| matches!(event, Event::CraftLost { .. }))
            .collect();
        let [Event::CraftLost { name: named, end, phase, .. }] = lost[..] else {
            panic!("lost {lost:?}, killed {name}\n{finished}")
        };
        assert_eq!((named, *end), (&name, ProcessEnd::Signal(9)), "{finished}");
        assert!(finished.stderr.contains(&format!("{name} was lost")), "{finished}");
        place.run(&["report", "runs/latest"]).expect_code(0);
        println!("    {name} in {phase}");
    }
}

fn variable(name: &str) -> Option<u32> {
    std::env::var(name).ok().map(|value| value.parse().unwrap())
}

#[test]
fn craft_killed_at_any_instant_ends_the_run_as_partial() {
    let kills = variable("SLATESWARM_KILLS").unwrap_or(KILLS_SHORT);
    let first = variable("SLATESWARM_KILLS_SEED").unwrap_or(1);
    let place = Place::for_fleets();
    for seed in first..first + kills {
        let kill = Kill::draw(&mut Stream::new(seed.into(), 0, Purpose::Order, 0));
        println!("SLATESWARM_KILLS_SEED={seed} SLATESWARM_KILLS=1: {kill:?}");
        kill.carry_out(&place);
    }
}
