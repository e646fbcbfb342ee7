//! The laws hold for many seeds, and each of them catches a bug that is planted.

use super::fault::{Fault, What};
use super::laws::Laws;
use super::{Case, LOCKSTEP_STRATEGIES, Play, Played, STRATEGIES, Stage, Violation};
use shared_types::ids::{CraftId, FactId};
use shared_types::knowledge::{Change, FactState, Value, Version};
use shared_types::trace::TraceRecord;
use shared_types::transport::memory::MemoryEndpoint;
use shared_types::transport::sequence::Sequences;
use shared_types::transport::{Destination, Endpoint, Numbered, Peers, SendError, WorldSample};
use shared_types::wire::{Class, DeltaReader, Header, Kind, Losses, StrategyKind, write_deltas};

/// Seeds of a strategy in a test; campaigns of the command take many more.
const SEEDS: u64 = 150;

/// Plays the case of `seed`; it breaks no law.
fn judged(seed: u64, strategy: StrategyKind, play: Play, stage: &mut Stage) -> Played {
    Case::drawn(seed, strategy, play).judge(stage).unwrap_or_else(|failure| {
        let lines: Vec<String> = failure.minimal.iter().map(ToString::to_string).collect();
        panic!("{strategy}, seed {seed}: {}\n{}", failure.violation, lines.join("\n"))
    })
}

#[test]
fn every_law_holds_under_every_strategy_whatever_befalls_the_fleet() {
    let mut stage = Stage::default();
    for strategy in STRATEGIES {
        let mut all = Played::default();
        for seed in 0..SEEDS {
            all += judged(seed, strategy, Play::Open, &mut stage);
        }
        assert!(all.kills > SEEDS / 2, "{strategy}: {all:?}");
        assert!(all.lost > SEEDS, "{strategy}: {all:?}");
        assert!(all.recovered.repeats > SEEDS, "{strategy}: {all:?}");
        assert!(all.recovered.learnt > SEEDS, "{strategy}: {all:?}");
    }
}

#[test]
fn every_trial_of_lockstep_goes_as_without_faults_whatever_befalls_the_fleet() {
    let mut stage = Stage::default();
    for strategy in LOCKSTEP_STRATEGIES {
        let mut all = Played::default();
        for seed in 0..SEEDS {
            all += judged(seed, strategy, Play::Lockstep, &mut stage);
        }
        assert!(all.kills > SEEDS / 2 && all.given_up > SEEDS / 4, "{strategy}: {all:?}");
        assert!(all.trials > 2 * SEEDS && all.lost > SEEDS, "{strategy}: {all:?}");
        assert!(all.recovered.repeats > SEEDS, "{strategy}: {all:?}");
    }
}

/// Seeds in which a new life hears of another one only after it has sent something to it that was lost.
#[test]
fn what_one_new_life_sends_another_is_repeated_until_it_is_confirmed() {
    let mut stage = Stage::default();
    for (strategy, seed) in [
        (StrategyKind::Full, 3665),
        (StrategyKind::Full, 6444),
        (StrategyKind::Full, 6669),
        (StrategyKind::Boundary, 9212),
        (StrategyKind::Limited, 7420),
        (StrategyKind::Hybrid, 7451),
    ] {
        let played = judged(seed, strategy, Play::Lockstep, &mut stage);
        assert!(played.kills > 1 && played.lost > 0, "{strategy}, seed {seed}: {played:?}");
    }
}

#[test]
fn a_case_goes_the_same_way_every_time() {
    let mut stage = Stage::default();
    let cases = [StrategyKind::Hierarchy, StrategyKind::CentralBatched]
        .into_iter()
        .flat_map(|strategy| [Play::Open, Play::Lockstep].map(|play| (strategy, play)));
    for (strategy, play) in cases {
        let case = Case::drawn(11, strategy, play);
        let lines = |stage: &mut Stage| {
            let mut lines = Vec::new();
            let played = case.play(stage, Some(&mut |at, what| lines.push((at, what))));
            (played, lines)
        };
        let first = lines(&mut stage);
        assert!(!first.1.is_empty());
        assert_eq!(first, lines(&mut stage));
        assert_eq!(
            first.0,
            case.play(&mut Stage::default(), None),
            "memory of others is no matter"
        );
    }
}

#[test]
fn without_faults_nothing_is_asked_again() {
    let mut stage = Stage::default();
    for strategy in STRATEGIES {
        for seed in 0..20 {
            let case = Case { faults: Vec::new(), ..Case::of(seed, strategy) };
            let played = case.play(&mut stage, None).expect("nothing happened");
            let found = played.recovered;
            let trouble = [found.asked_again, found.repeats, found.given_up, found.states_missed];
            assert_eq!(trouble, [0; 4], "{strategy}, seed {seed}: {found:?}");
            assert!(found.receipts > 0 && found.states > 0, "{strategy}, seed {seed}");
        }
    }
}

#[test]
fn a_failing_case_is_made_small() {
    let case = Case::of(3, StrategyKind::Boundary);
    let wanted = Fault { at_ns: 5, lasts_ns: 1_000, what: What::Pause(CraftId(1)) };
    let mut faults = Case::of(4, StrategyKind::Boundary).faults;
    faults.push(wanted);
    faults.extend(Case::of(5, StrategyKind::Boundary).faults);
    let case = Case { faults, ..case };
    let minimal = case.shrink(|case| {
        case.faults.iter().any(|fault| fault.at_ns == wanted.at_ns && fault.lasts_ns >= 400)
    });
    assert_eq!(minimal, [Fault { lasts_ns: 500, ..wanted }]);
}

/// A bug between a process and the network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Bug {
    /// What is asked for again is never sent.
    NeverRepeats,
    /// What is asked for again is sent over and over.
    RepeatsForEver,
    /// Everything that arrives is handed over twice.
    HandsOverTwice,
    /// A gap is taken for received.
    HidesLosses,
    /// States are empty.
    TellsNothing,
    /// Receipts are never sent: nobody hears of a gap.
    NeverReceipts,
    /// What is handed over says the opposite.
    TurnsRound,
    /// A delta is handed over as one of the next turn.
    Misdates,
    /// A sample is counted as lost in every trial.
    Loses,
}

/// An endpoint with a bug.
struct Buggy {
    endpoint: MemoryEndpoint,
    bug: Bug,
}

impl Endpoint for Buggy {
    fn open_ports(&mut self, peers: &Peers) -> Result<(), SendError> {
        self.endpoint.open_ports(peers)
    }

    fn update_connections(&mut self) -> Result<(), SendError> {
        self.endpoint.update_connections()
    }

    fn send(
        &mut self,
        to: Destination,
        header: Header,
        length: usize,
        write: &mut dyn FnMut(&mut [u8]),
    ) -> Result<(), SendError> {
        self.endpoint.send(to, header, length, write)
    }

    fn take_world(&mut self) -> Result<Option<WorldSample>, SendError> {
        self.endpoint.take_world()
    }

    fn flush(&mut self) -> Result<usize, SendError> {
        self.endpoint.flush()
    }

    fn drain(
        &mut self,
        visit: &mut dyn FnMut(Destination, &Header, &[u8]),
    ) -> Result<usize, SendError> {
        let bug = self.bug;
        let times = if bug == Bug::HandsOverTwice { 2 } else { 1 };
        self.endpoint.drain(&mut |destination, header, payload| {
            let (mut header, mut payload) = (*header, payload.to_vec());
            if header.kind() == Some(Kind::Delta) {
                header.turn += u32::from(bug == Bug::Misdates);
                if bug == Bug::TurnsRound {
                    turn_round(&header, &mut payload);
                }
            }
            for _ in 0..times {
                visit(destination, &header, &payload);
            }
        })
    }

    fn next_number(&self, to: Destination) -> u64 {
        self.endpoint.next_number(to)
    }

    fn send_past_numbering(
        &mut self,
        receiver: CraftId,
        mut header: Header,
        mut length: usize,
        write: &mut dyn FnMut(&mut [u8]),
    ) -> Result<(), SendError> {
        let is_repeat =
            header.class == Class::Repair as u8 && header.kind().is_some_and(Kind::is_numbered);
        let times = match self.bug {
            Bug::NeverRepeats if is_repeat => 0,
            Bug::RepeatsForEver if is_repeat => 70,
            Bug::NeverReceipts if header.kind() == Some(Kind::Receipt) => 0,
            _ => 1,
        };
        let mut nothing = |_: &mut [u8]| {};
        let is_emptied = self.bug == Bug::TellsNothing && header.kind() == Some(Kind::State);
        let write: &mut dyn FnMut(&mut [u8]) = if is_emptied {
            (header.record_count, length) = (0, 0);
            &mut nothing
        } else {
            write
        };
        (0..times)
            .try_for_each(|_| self.endpoint.send_past_numbering(receiver, header, length, write))
    }

    fn numbers(&mut self, service: Numbered) -> &mut Sequences {
        let numbers = self.endpoint.numbers(service);
        if self.bug == Bug::HidesLosses {
            for debtor in numbers.debtors().collect::<Vec<_>>() {
                let next = numbers.next(debtor);
                numbers.cover(debtor, 0, next);
            }
        }
        numbers
    }

    fn holds_back(&self, to: Destination) -> bool {
        self.endpoint.holds_back(to)
    }

    fn discard(&mut self, craft: CraftId) -> usize {
        self.endpoint.discard(craft)
    }

    fn ring(&mut self) {
        self.endpoint.ring();
    }

    fn take_losses(&mut self) -> Losses {
        let mut losses = self.endpoint.take_losses();
        losses.gaps += u64::from(self.bug == Bug::Loses);
        losses
    }
}

/// Makes every record of `payload` say the opposite.
fn turn_round(header: &Header, payload: &mut [u8]) {
    let reader = DeltaReader::new(payload, header.record_count).expect("a delta");
    let mut changes: Vec<Change> = reader.changes().map(|change| change.expect("one")).collect();
    for change in &mut changes {
        change.value = match change.value {
            Value::Asserted => Value::Absent,
            _ => Value::Asserted,
        };
    }
    let stride = payload.len() / changes.len().max(1);
    write_deltas(&changes, stride, payload);
}

/// The laws that `bug` breaks in the first seeds of `strategy` that play `play`, faults on links and
/// processes or, if not `with_deaths`, on links alone.
fn broken_by(bug: Bug, strategy: StrategyKind, play: Play, with_deaths: bool) -> Vec<Violation> {
    let mut stage = Stage::default();
    let cases = (0..40).map(|seed| {
        let mut case = Case::drawn(seed, strategy, play);
        case.faults.retain(|fault| with_deaths || !matches!(fault.what, What::Kill(_)));
        case
    });
    let played =
        cases.map(|case| case.play_through(&mut stage, None, &|endpoint| Buggy { endpoint, bug }));
    played.filter_map(Result::err).collect()
}

#[test]
fn each_planted_bug_breaks_the_law_that_is_meant_for_it() {
    type Law = fn(&Violation) -> bool;
    let given_up: Law = |broken| matches!(broken, Violation::GivenUp { .. });
    let rows: [(Bug, bool, Law); 6] = [
        (Bug::NeverRepeats, false, given_up),
        (Bug::NeverReceipts, false, given_up),
        (Bug::RepeatsForEver, false, |broken| matches!(broken, Violation::OverBudget { .. })),
        (Bug::HandsOverTwice, true, |broken| matches!(broken, Violation::HandedOverTwice { .. })),
        (Bug::HidesLosses, false, |broken| matches!(broken, Violation::Unaccounted { .. })),
        (Bug::TellsNothing, true, |broken| matches!(broken, Violation::Disagree { .. })),
    ];
    for (bug, with_deaths, law) in rows {
        let broken = broken_by(bug, StrategyKind::Boundary, Play::Open, with_deaths);
        assert!(broken.iter().any(law), "{bug:?}: {broken:?}");
    }
}

#[test]
fn each_bug_planted_in_lockstep_breaks_the_law_that_is_meant_for_it() {
    type Law = fn(&Violation) -> bool;
    let stands_still: Law = |broken| matches!(broken, Violation::StandsStill { .. });
    let rows: [(Bug, bool, Law); 8] = [
        (Bug::NeverRepeats, false, stands_still),
        (Bug::NeverReceipts, false, stands_still),
        (Bug::HidesLosses, false, stands_still),
        (Bug::Misdates, false, stands_still),
        (Bug::RepeatsForEver, false, |broken| matches!(broken, Violation::OverBudget { .. })),
        (Bug::HandsOverTwice, true, |broken| matches!(broken, Violation::HandedOverTwice { .. })),
        (Bug::TurnsRound, false, |broken| matches!(broken, Violation::Invented { .. })),
        (Bug::Loses, false, |broken| matches!(broken, Violation::WentAstray { .. })),
    ];
    for (bug, with_deaths, law) in rows {
        let broken = broken_by(bug, StrategyKind::Boundary, Play::Lockstep, with_deaths);
        assert!(broken.iter().any(law), "{bug:?}: {broken:?}");
    }
}

#[test]
fn on_lossy_links_every_change_reaches_every_board_that_shares_its_fact() {
    let mut stage = Stage::default();
    for strategy in STRATEGIES {
        let mut before = 0;
        for permille in [0, 100, 250, 500, 750] {
            let lossy = super::lossy(strategy, permille, 0..15, &mut stage).expect("laws hold");
            assert_eq!(lossy.played.lost > 0, permille > 0, "{strategy}");
            if strategy.has_centre() {
                // A reply may tell again what the centre had learnt as state before the request came.
                continue;
            }
            assert_eq!(lossy.applied, lossy.needed, "{strategy} at {permille}");
            let repeats = lossy.played.recovered.repeats;
            assert!(repeats >= before, "{strategy} at {permille}: {repeats} after {before}");
            before = repeats;
        }
    }
}

#[test]
fn what_a_ring_no_longer_holds_is_given_up_and_told_as_state() {
    let mut case = Case::of(2, StrategyKind::Boundary);
    let (fact, writer) = (FactId(0), case.scene.sharers[0][0]);
    let writes =
        (0..1_500).map(|number| TraceRecord::write(number * 10_000, fact, number % 2 == 0));
    case.scene.trace[writer as usize] = writes.collect();
    let what = What::Partition(1 << writer);
    case.faults = vec![Fault { at_ns: 0, lasts_ns: 18_000_000, what }];
    let played = case.play(&mut Stage::default(), None).expect("laws hold");
    assert!(played.recovered.given_up > 0 && played.recovered.learnt > 0, "{played:?}");
}

#[test]
fn a_merge_that_goes_back_or_invents_is_found() {
    let (craft, fact) = (CraftId(1), FactId(0));
    let state = |count, value| FactState { value, version: Version { count, writer: CraftId(0) } };
    let mut laws = Laws::of(2, 1);
    for (count, value) in [(1, Value::Asserted), (2, Value::Absent)] {
        laws.write(CraftId(0), fact, state(count, value)).expect("versions of its own");
    }
    assert_eq!(laws.look(craft, fact, state(2, Value::Absent)), Ok(()));
    // A merge that keeps the smaller version.
    let back = laws.look(craft, fact, state(1, Value::Asserted));
    assert!(matches!(back, Err(Violation::WentBack { .. })), "{back:?}");
    // A merge that takes the version and not the value, and a life that gives out a version again.
    let invented = laws.look(craft, fact, state(3, Value::Asserted));
    assert!(matches!(invented, Err(Violation::Invented { .. })), "{invented:?}");
    let twice = laws.write(CraftId(0), fact, state(2, Value::Asserted));
    assert!(matches!(twice, Err(Violation::Invented { .. })), "{twice:?}");
    laws.begin_life(craft);
    assert_eq!(
        laws.look(craft, fact, state(1, Value::Asserted)),
        Ok(()),
        "a new life knows nothing"
    );
}
