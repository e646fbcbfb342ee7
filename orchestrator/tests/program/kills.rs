//! `kill -9` of any process at any instant, from its first instruction on. Of a craft: the run ends within
//! bounds as partial, names the craft, keeps what it had, and leaves nothing. Of the orchestrator: the
//! crafts end, and `clean` finds all the rest. Beside it Ctrl-C, which may come at any instant as well.
//!
//! A few kills by default; `SLATESWARM_KILLS=200` for the long version, `SLATESWARM_KILLS_SEED=N` to
//! repeat what a failure printed.

use crate::invocation::{CraftSeen, Finished, Invocation, Place, RunsSeen, ignores};
use crate::shared::until;
use orchestrator::results::event::{Event, ProcessEnd};
use rustix::process::Signal;
use shared_types::rng::{Purpose, Stream};
use shared_types::time::Nanos;
use shared_types::transport::{RunPaths, clock};

/// Kills in continuous integration.
const KILLS_SHORT: u32 = 12;

/// The latest instant of a kill after the executable was started, us: while the fleet starts.
const START_MAX_US: u32 = 60_000;

/// The latest instant of a kill after the first epoch is done, us.
const PLAY_MAX_US: u32 = 100_000;

/// What a fleet may be doing when it is hit; two at once, so that epochs with other ports follow each
/// other.
const STRATEGIES: [&str; 7] = [
    "full",
    "boundary,full",
    "limited",
    "hierarchy,boundary",
    "central",
    "central-batched,full",
    "pipelined",
];

/// One kill: which fleet, when, and whom.
#[derive(Debug)]
struct Kill {
    words: Vec<String>,
    /// Whether the instant counts from the end of the first epoch, else from the start.
    while_it_plays: bool,
    instant_us: u32,
    /// Of the crafts that are there at the instant, counted from the first.
    victim: u32,
}

impl Kill {
    fn draw(stream: &mut Stream) -> Self {
        let size = ["2", "3", "5", "10"][stream.below(4) as usize];
        let wake = ["poll", "adaptive", "block"][stream.below(3) as usize];
        let what = [&["--no-timing"][..], &["--timing-only"][..]][stream.below(2) as usize];
        let strategy = STRATEGIES[stream.below(7) as usize];
        let words = ["compare", "--sizes", size, "--wake", wake, "--strategies", strategy];
        let endless = ["--trials", "1000000", "--set", "run.timing-epochs=1000000"];
        let words = words.iter().chain(what).chain(&endless).map(ToString::to_string).collect();
        let while_it_plays = stream.below(2) == 0;
        // The earliest instant is as soon as there is somebody to kill.
        let instant_max_us = if while_it_plays { PLAY_MAX_US } else { START_MAX_US };
        let instant_us = stream.below(instant_max_us);
        Self { words, while_it_plays, instant_us, victim: stream.below(128) }
    }

    /// Starts the fleet and says when the instant comes.
    fn start(&self, place: &Place) -> (Invocation, Nanos) {
        let words: Vec<&str> = self.words.iter().map(String::as_str).collect();
        let invocation = place.start(&words);
        if self.while_it_plays {
            place.await_epochs(0);
        }
        (invocation, clock::now().plus(u64::from(self.instant_us) * 1000))
    }

    /// Starts the fleet and signals the orchestrator once the instant has come.
    fn signal_orchestrator(&self, place: &Place, signal: Signal) -> (Finished, RunsSeen) {
        let (invocation, instant) = self.start(place);
        let mut runs = RunsSeen::default();
        // What whoever started the tests ignores is ignored until the orchestrator's own handlers are there.
        let is_heeded = || !ignores(invocation.pid(), signal);
        until("the instant", || {
            runs.look(place);
            (clock::now() >= instant && is_heeded()).then_some(())
        });
        invocation.signal(signal);
        runs.look(place);
        (invocation.finish(), runs)
    }

    /// Starts the fleet and kills the craft once the instant has come and somebody is there.
    fn kill_craft(&self, place: &Place) {
        let (mut invocation, instant) = self.start(place);
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

/// Draws the kills and lets `carry_out` do one after the other.
fn for_all_kills(carry_out: impl Fn(&Kill, &Place)) {
    let kills = variable("SLATESWARM_KILLS").unwrap_or(KILLS_SHORT);
    let first = variable("SLATESWARM_KILLS_SEED").unwrap_or(1);
    for seed in first..first + kills {
        let place = Place::for_fleets();
        let kill = Kill::draw(&mut Stream::new(seed.into(), 0, Purpose::Order, 0));
        println!("SLATESWARM_KILLS_SEED={seed} SLATESWARM_KILLS=1: {kill:?}");
        carry_out(&kill, &place);
    }
}

#[test]
fn craft_killed_at_any_instant_ends_the_run_as_partial() {
    for_all_kills(Kill::kill_craft);
}

#[test]
fn craft_killed_in_an_interval_of_open_mode_ends_the_run_as_partial() {
    let keys = ["run.mode=open", "run.duration-s=20", "run.rate-per-s=500", "fleet.crafts=4"];
    let settings = keys.iter().flat_map(|key| ["--set", key]);
    let words = ["run", "generated"].into_iter().chain(settings).map(ToString::to_string);
    let kill =
        Kill { words: words.collect(), while_it_plays: false, instant_us: 1_500_000, victim: 2 };
    kill.kill_craft(&Place::for_fleets());
}

#[test]
fn orchestrator_killed_at_any_instant_leaves_nothing_after_clean() {
    for_all_kills(|kill, place| {
        let (finished, runs) = kill.signal_orchestrator(place, Signal::KILL);
        finished.expect_signal(Signal::KILL);
        place.run(&["clean"]).expect_code(0);
        // One that was being spawned becomes visible as a craft only now, and ends by itself.
        until("the crafts to end", || place.crafts().is_empty().then_some(()));
        place.assert_nothing_left(&runs.paths(place));
    });
}

#[test]
fn interrupt_at_any_instant_leaves_nothing() {
    for_all_kills(|kill, place| {
        let (finished, runs) = kill.signal_orchestrator(place, Signal::INT);
        // Before the handlers are there, nothing has been started.
        match finished.code() {
            None => finished.expect_signal(Signal::INT),
            Some(_) => finished.expect_code(130),
        };
        place.assert_nothing_left(&runs.paths(place));
    });
}
