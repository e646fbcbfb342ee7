//! What a fleet reports, and what is made of it: records, distributions, and what the replay says.

use super::crafts::{CRAFTS, FLEET, SCENARIO, spec};
use crate::results::record::{Cell, TrialRecord};
use crate::run::backend::{Played, PlayedOpen};
use crate::run::measured::Measured;
use crate::run::offer::Offer;
use crate::run::reports::Reports;
use crate::run::verdict::{self, Demands};
use agent::oracle::{ObservedOpen, Replay, compare_open, compare_recovered};
use agent::simulation::Simulation;
use rkyv::rancor::Error;
use shared_types::ids::{CraftId, FactId};
use shared_types::trace::TraceRecord;
use shared_types::transport::memory::MemoryOptions;
use shared_types::wire::{Class, EpochSpec, Header, Kind, StrategyKind, TrialReport};
use std::sync::LazyLock;

/// Strategy, whether in open mode, and whether it recovers.
const PLAYS: [(StrategyKind, bool, bool); 6] = [
    (StrategyKind::Boundary, false, false),
    (StrategyKind::Full, false, false),
    (StrategyKind::Central, false, false),
    (StrategyKind::Boundary, true, false),
    (StrategyKind::Hierarchy, true, true),
    (StrategyKind::CentralBatched, true, false),
];

/// What was played, and what each process reported as it does.
struct Sound {
    spec: EpochSpec,
    /// A trial; else an interval.
    trial: Option<Played>,
    archives: Vec<Vec<u8>>,
}

static SOUND: LazyLock<Vec<Sound>> = LazyLock::new(|| PLAYS.into_iter().map(Sound::play).collect());

/// Every craft writes and reads each of its facts in turn.
static OFFER: LazyLock<Offer> = LazyLock::new(|| {
    let trace = (0..CRAFTS).map(|craft| {
        let record = |at: u64| {
            let fact = FactId(u32::try_from(at % 12).unwrap_or_default());
            let at_ns = at * 20_000 + u64::from(craft);
            if at % 3 == 2 {
                TraceRecord::read(at_ns, fact)
            } else {
                TraceRecord::write(at_ns, fact, at.is_multiple_of(2))
            }
        };
        (0..40).map(record).collect()
    });
    Offer::new(FLEET.clone(), trace.collect(), 0, 1_000_000)
});

impl Sound {
    fn play((strategy, is_open, recovers): (StrategyKind, bool, bool)) -> Self {
        let spec = spec(strategy, is_open, recovers);
        let mut simulation = Simulation::new(CRAFTS, MemoryOptions::default());
        let archives = |reports: &[TrialReport]| {
            let archive = |report| rkyv::to_bytes::<Error>(report).expect("memory").to_vec();
            reports.iter().map(archive).collect()
        };
        if is_open {
            let fleet = OFFER.network.view();
            let played = simulation.play_open(&spec, &fleet, &OFFER.trace);
            let reports = played.unwrap_or_else(|error| panic!("{error}")).reports;
            return Self { spec, trial: None, archives: archives(&reports) };
        }
        let played =
            simulation.play(&spec, &FLEET.view()).unwrap_or_else(|error| panic!("{error}"));
        Self { spec, archives: archives(&played.reports), trial: Some(played.into()) }
    }

    /// The reports with `archive` in the place of that of process `whose`; `None` if it was refused.
    fn with(&self, whose: usize, archive: &[u8]) -> Option<Vec<TrialReport>> {
        let mut reports = Reports::of(self.archives.len());
        let mut header = Header::new(Class::Telemetry, Kind::TrialReport);
        header.firing_number = 1;
        for (index, own) in self.archives.iter().enumerate() {
            let archive = if index == whose { archive } else { own };
            if let Err(why) = reports.take(CraftId::from_index(index), &header, archive) {
                assert!(why.contains(&format!("process {whose}")), "{why}");
                return None;
            }
        }
        assert!(reports.are_complete());
        Some(reports.into_received())
    }
}

/// What is played and whose report it is in a byte each, then its archive. A report that is no such
/// process's is refused by name; of any other one records and distributions are made, and it is held
/// against the replay.
pub(super) fn judge(bytes: &[u8]) {
    let [play, whose, archive @ ..] = bytes else { return };
    let sound = &SOUND[usize::from(*play) % SOUND.len()];
    let whose = usize::from(*whose) % sound.archives.len();
    let Some(reports) = sound.with(whose, archive) else {
        return assert_ne!(archive, sound.archives[whose]);
    };
    assert_eq!(reports[whose].craft as usize, whose);
    let is_sound = archive == sound.archives[whose];
    match &sound.trial {
        Some(played) => judge_trial(&sound.spec, Played { reports, ..played.clone() }, is_sound),
        None => judge_interval(&sound.spec, reports, is_sound),
    }
}

fn judge_trial(spec: &EpochSpec, played: Played, is_sound: bool) {
    let fleet = FLEET.view();
    let replay = Replay::of(&fleet, spec);
    let expected = replay.expected(&fleet, spec, spec.strategy);
    let names = SCENARIO.names();
    let demands = Demands { replay: &replay, expected: &expected, fleet: &fleet, names };
    let broken = verdict::judge(&demands, spec, &played);
    assert!(!is_sound || broken.is_empty(), "{broken:?}");
    let _suspects = verdict::suspects(&expected, &played.reports, names);
    let cell = Cell { block: 0, size: CRAFTS, strategy: spec.strategy };
    let record = verdict::record(&demands, cell, spec, &played);
    let line = serde_json::to_string(&record).expect("records are plain data");
    assert_eq!(serde_json::from_str::<TrialRecord>(&line).expect("as it was written"), record);
}

fn judge_interval(spec: &EpochSpec, reports: Vec<TrialReport>, is_sound: bool) {
    let open = spec.open.expect("an interval");
    let observed = ObservedOpen { reports: &reports, is_quiet: true };
    let fleet = OFFER.network.view();
    let broken = match spec.recovery {
        Some(_) => compare_recovered(spec, &fleet, &observed, &[]),
        None => compare_open(spec, &fleet, &observed),
    };
    assert!(!is_sound || broken.is_empty(), "{broken:?}");
    let played = PlayedOpen { reports, is_quiet: true, ..PlayedOpen::default() };
    match Measured::of(&OFFER, spec, &open, &played) {
        Ok(measured) => assert!(measured.stale_reads <= measured.reads),
        Err(why) => assert!(!is_sound && why.contains("process "), "{why}"),
    }
}

/// Every report as it was made.
pub(super) fn seeds() -> Vec<Vec<u8>> {
    let plays = (0..=u8::MAX).zip(SOUND.iter());
    let seeds = plays.flat_map(|(play, sound)| {
        let whose = (0..=u8::MAX).zip(&sound.archives);
        whose.map(move |(whose, archive)| [&[play, whose][..], archive].concat())
    });
    seeds.collect()
}
