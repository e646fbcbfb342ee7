//! A craft that runs and does not go on: it loops where it was told to, as iceoryx2 can on what a killed
//! process left half-made, and no signal or pipe tells of it.

use crate::opens::{AT_ONCE, network, recovering, struck, with_doomed, with_limit};
use agent::process::doom::{Doom, Point};
use orchestrator::launch::craft_process::HowEnded;
use orchestrator::launch::os_process::{CraftErrors, Launcher};
use orchestrator::launch::placement::{Placement, Processors};
use orchestrator::outcome::Outcome;
use orchestrator::results::event::{Event, ProcessEnd, Relief};
use orchestrator::results::provenance::{Provenance, RunIdentity};
use orchestrator::results::read::read_run;
use orchestrator::results::store::{Place, Store};
use orchestrator::run::backend::Backend as _;
use orchestrator::run::plan::{FleetPlan, RunPlan};
use orchestrator::run::{Progress, Runner};
use orchestrator::scenario::{Base, load};
use orchestrator::supervision::heartbeat::SILENCE_NS;
use orchestrator::supervision::restart::RestartPolicy;
use orchestrator::supervision::signals::Signals;
use shared_types::ids::{CraftId, Incarnation};
use shared_types::rng::{Purpose, Stream};
use shared_types::scenario::Pinning;
use shared_types::transport::WakeMode;
use shared_types::transport::paths::SHM;
use shared_types::wire::{Kind, StrategyKind};
use std::collections::BTreeMap;
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;

const VICTIM: CraftId = CraftId(1);

pub(crate) fn craft_that_loops_is_followed_while_the_interval_goes_on() {
    let network = network(1_200);
    let dooms = BTreeMap::from([(VICTIM, Doom { point: Point::Silence, after: 100 })]);
    with_doomed(false, None, Some(AT_ONCE), dooms, |fleet| {
        // What the sweep finds, though it is not what this craft waits for.
        let planted = Path::new(SHM).join(format!("{}planted", fleet.paths().prefix()));
        std::fs::File::create(&planted).unwrap();
        let played = struck(fleet, &recovering(0, StrategyKind::Boundary), &network, &[]);
        let [ended] = &played.dead[..] else { panic!("{:?}", played.dead) };
        let HowEnded::Silent(silent_ns) = ended.how else { panic!("{ended:?}") };
        assert!(silent_ns >= SILENCE_NS, "{silent_ns}");
        let relieved = fleet.take_relieved();
        let [relieved] = &relieved[..] else { panic!("one silence: {relieved:?}") };
        assert_eq!(
            (relieved.silence.craft, relieved.silence.incarnation, relieved.helped),
            (VICTIM, Incarnation(0), Relief::Kill)
        );
        assert_eq!((&relieved.swept, relieved.silence.silent_ns), (&Ok(1), silent_ns));
        assert!(!planted.exists());
        let recoveries = fleet.take_recoveries(false);
        let [recovery] = &recoveries[..] else { panic!("one recovery: {recoveries:?}") };
        assert!(recovery.caught_up.is_some(), "{recovery:?}");
        // Its successor plays on, and nobody else is taken for silent.
        let played = struck(fleet, &recovering(1, StrategyKind::Boundary), &network, &[]);
        assert!(played.dead.is_empty(), "{:?}", played.dead);
        assert_eq!(fleet.take_relieved(), []);
    });
}

/// A craft that goes round and hears nothing, from the first command or from the middle of the interval on.
pub(crate) fn craft_that_never_answers_is_killed_and_followed() {
    const ANSWER_LIMIT_NS: u64 = 3_000_000_000;
    for (after, answer) in [(0, Kind::EpochReady), (100, Kind::TallyReport)] {
        let network = network(600);
        let dooms = BTreeMap::from([(VICTIM, Doom { point: Point::Deafness, after })]);
        with_limit(false, None, Some(AT_ONCE), dooms, ANSWER_LIMIT_NS, |fleet| {
            let played = struck(fleet, &recovering(0, StrategyKind::Boundary), &network, &[]);
            let [ended] = &played.dead[..] else { panic!("{:?}", played.dead) };
            let HowEnded::Mute(waited_ns) = ended.how else { panic!("{ended:?}") };
            assert!(waited_ns >= ANSWER_LIMIT_NS, "{waited_ns}");
            let mute = fleet.take_mute();
            let [mute] = &mute[..] else { panic!("one: {mute:?}") };
            assert_eq!((mute.craft, mute.incarnation), (VICTIM, Incarnation(0)));
            assert_eq!((mute.answer, mute.waited_ns), (answer, waited_ns));
            assert_eq!(fleet.take_relieved(), [], "it went round all the time");
            let played = struck(fleet, &recovering(1, StrategyKind::Boundary), &network, &[]);
            assert!(played.dead.is_empty(), "{:?}", played.dead);
        });
    }
}

struct Silently;

impl Progress for Silently {
    fn at(&mut self, _: u64, _: u64, _: &str) {}

    fn say(&mut self, _: &str) {}
}

/// Starts the real executable, but with a doom on the command line of the first life of [`VICTIM`].
fn doomed_launcher(folder: &Path) -> Launcher {
    let script = folder.join("doomed");
    let text = format!(
        "#!/bin/sh\ncraft= life= last= left=$#\nfor word; do\n  case $last in\n    --craft) craft=$word ;;\n    \
         --incarnation) life=$word ;;\n  esac\n  last=$word\ndone\nlast=\n\
         while [ $left -gt 0 ]; do\n  word=$1 new=$1 left=$((left - 1))\n  shift\n  \
         [ \"$last $craft $life\" = \"--doom {VICTIM} 0\" ] && new=silence:40\n  last=$word\n  \
         set -- \"$@\" \"$new\"\ndone\nexec {} \"$@\"\n",
        env!("CARGO_BIN_EXE_slateswarm")
    );
    std::fs::write(&script, text).unwrap();
    std::fs::set_permissions(&script, std::fs::Permissions::from_mode(0o700)).unwrap();
    Launcher::new(script, CraftErrors::Kept)
}

/// Plays trials with a craft that falls silent in one of them; returns how the run ended, its events and
/// how many trials were played to their end.
fn run_with_silence(restart: Option<RestartPolicy>) -> (Outcome, Vec<Event>, usize) {
    let scenario = load(&Base::Preset("two-craft".to_owned()), [], &[]).unwrap();
    let mut draws = Stream::new(1, 0, Purpose::Order, 0);
    let processors = Processors::of_this_process().unwrap();
    let fleet = FleetPlan {
        scenario,
        strategies: vec![StrategyKind::Boundary],
        order: Vec::new(),
        loads: Vec::new(),
        searched: Vec::new(),
        placement: Placement::draw(&processors, Pinning::Unpinned, 2, &mut draws),
    };
    let plan = RunPlan {
        fleets: vec![fleet],
        seed: 1,
        trials: TRIALS,
        is_simulated: false,
        timing: None,
        open: None,
        capacity: None,
        wake: WakeMode::Adaptive,
        turn_limit_ns: 20_000_000_000,
        time_limit_s: None,
        restart,
    };
    let provenance = Provenance::gather(&RunIdentity {
        scenario: "two-craft".to_owned(),
        command: vec!["run".to_owned()],
        seed: 1,
        is_simulated: false,
        processes_max: 2,
        cores_used: 1,
        wake: WakeMode::Adaptive,
        plan: BTreeMap::new(),
    });
    let folder = tempfile::tempdir().unwrap();
    let launcher = doomed_launcher(folder.path());
    let mut signals = Signals::install().unwrap();
    let place = Place::Below(folder.path());
    let mut store = Store::create(place, &provenance, "").unwrap();
    let outcome =
        Runner::new(&plan, &mut store, &mut Silently).run(&launcher, &mut signals).unwrap();
    let kept = read_run(store.directory()).unwrap();
    let events = kept.events.into_iter().map(|line| line.event).collect();
    (outcome, events, kept.trials.len())
}

const TRIALS: u32 = 30;

/// The silence of [`VICTIM`] is told, and its end with it.
#[track_caller]
fn assert_silence_is_told(events: &[Event]) {
    let silences: Vec<&Event> =
        events.iter().filter(|event| matches!(event, Event::CraftSilent { .. })).collect();
    let [
        Event::CraftSilent {
            name, incarnation: 0, silent_ns, helped: Relief::Kill, swept: 0, ..
        },
    ] = silences[..]
    else {
        panic!("{events:?}")
    };
    assert!(*silent_ns >= SILENCE_NS, "{events:?}");
    let is_its_end = |event: &Event| {
        matches!(event, Event::CraftLost { name: lost, end: ProcessEnd::Silent(ns), .. }
            if lost == name && ns == silent_ns)
    };
    assert_eq!(events.iter().filter(|event| is_its_end(event)).count(), 1, "{events:?}");
}

pub(crate) fn craft_that_loops_ends_the_run_as_partial_and_is_named() {
    let (outcome, events, trials) = run_with_silence(None);
    assert_eq!((outcome, outcome.code()), (Outcome::Partial, 3), "{events:?}");
    assert_silence_is_told(&events);
    assert!(trials < TRIALS as usize, "{trials}");
}

pub(crate) fn craft_that_loops_is_restarted_where_that_is_wanted() {
    let (outcome, events, trials) = run_with_silence(Some(AT_ONCE));
    assert_eq!(outcome, Outcome::Partial, "{events:?}");
    assert_silence_is_told(&events);
    assert_eq!(trials, TRIALS as usize - 1, "one trial was lost: {events:?}");
    let is_back = |event: &&Event| matches!(event, Event::CraftRestarted { incarnation: 1, .. });
    assert_eq!(events.iter().filter(is_back).count(), 1, "{events:?}");
    assert!(!events.iter().any(|event| matches!(event, Event::Discrepancy { .. })), "{events:?}");
}
