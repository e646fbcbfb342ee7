//! What a campaign does to whom, drawn from its seed.

use agent::process::doom::{Doom, Point};
use shared_types::ids::CraftId;
use shared_types::rng::{Purpose, Stream};
use shared_types::transport::WakeMode;
use shared_types::wire::{CutOff, LinkSpec, OutageSpec, StrategyKind};
use std::collections::BTreeSet;
use std::ops::Range;

/// The latest instant of a random kill after a trial may begin, us.
const INSTANT_US_MAX: u32 = 30_000;

/// The same after an interval of open mode may begin, us: a bit more than its length.
const OPEN_INSTANT_US_MAX: u32 = 320_000;

/// Loans, sends and receptions that a doomed craft is let make at most before.
const PASSES_MAX: u32 = 60;

/// How long opening and dropping ports are given before a doomed craft dies in them, us at most.
const OPENING_US_MAX: u32 = 6_000;
const SHUTDOWN_US_MAX: u32 = 1_500;

/// How long crafts are stopped, us: two in five for longer than a craft may be silent and live.
const PAUSE_US: Range<u32> = 200_000..4_000_000;

/// What links do at most in an interval whose links fail: samples lost and doubled of a billion, delay and
/// jitter, us.
const LOSS_PER_BILLION_MAX: u32 = 150_000_000;
const DUPLICATION_PER_BILLION_MAX: u32 = 100_000_000;
const DELAY_US_MAX: u32 = 1_000;

/// How long nothing passes between some crafts and the others, us.
const OUTAGE_US: std::ops::Range<u32> = 10_000..100_000;

/// Where an orchestrator is killed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum OrchestratorPoint {
    /// At any instant after it was started.
    Random,
    /// While it creates its services.
    Creating,
    /// While its fleet plays.
    Playing,
    /// While it starts the successor of a craft.
    Restart,
    /// After it was asked to end.
    Shutdown,
}

impl OrchestratorPoint {
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Random => crate::results::faults::RANDOM,
            Self::Creating => "creating services",
            Self::Playing => "playing",
            Self::Restart => "restarting a craft",
            Self::Shutdown => "orchestrator shutdown",
        }
    }
}

/// The draws of a campaign.
#[derive(Debug)]
pub(super) struct Draws(Stream);

impl Draws {
    pub(super) fn new(seed: u64) -> Self {
        Self(Stream::new(seed, 0, Purpose::Faults, 0))
    }

    /// The stream itself.
    pub(super) const fn stream(&mut self) -> &mut Stream {
        &mut self.0
    }

    fn one_of<T: Copy>(&mut self, all: &[T]) -> T {
        let count = u32::try_from(all.len()).expect("invariant: few to choose from");
        all[self.0.below(count) as usize]
    }

    pub(super) fn strategy(&mut self, strategies: &[StrategyKind]) -> StrategyKind {
        self.one_of(strategies)
    }

    pub(super) fn wake(&mut self) -> WakeMode {
        self.one_of(&[WakeMode::Poll, WakeMode::Adaptive, WakeMode::Block])
    }

    /// One of `processes` processes.
    pub(super) fn process(&mut self, processes: u32) -> CraftId {
        CraftId(self.0.below(processes))
    }

    /// Up to half of `processes` processes, at least one.
    pub(super) fn up_to_half(&mut self, processes: u32) -> Vec<CraftId> {
        let count = 1 + self.0.below((processes / 2).max(1));
        let mut all: Vec<CraftId> = (0..processes).map(CraftId).collect();
        for _ in count..processes {
            let place = self.0.below(u32::try_from(all.len()).expect("invariant: crafts are few"));
            all.swap_remove(place as usize);
        }
        all
    }

    /// A trial of the scenario's seed.
    pub(super) fn trial(&mut self) -> u32 {
        self.0.below(1_000)
    }

    /// An instant, ns from now: in a trial, or somewhere in an interval of open mode.
    pub(super) fn instant_ns(&mut self, is_open: bool) -> u64 {
        let most_us = if is_open { OPEN_INSTANT_US_MAX } else { INSTANT_US_MAX };
        self.delay_ns(most_us)
    }

    /// How long crafts are stopped, ns.
    pub(super) fn pause_ns(&mut self) -> u64 {
        self.between_ns(PAUSE_US)
    }

    /// Whether links fail in an interval.
    pub(super) fn links_fail(&mut self) -> bool {
        self.0.below(2) == 0
    }

    /// What they do among `processes` processes in an interval of `duration_ns`: samples are lost, doubled,
    /// delayed and overtaken throughout, and up to half the processes are cut off for a while.
    pub(super) fn link(&mut self, processes: u32, duration_ns: u64) -> LinkSpec {
        let duration_us = u32::try_from(duration_ns / 1_000).expect("invariant: less than an hour");
        let from_ns = self.delay_ns(duration_us);
        let group = self.up_to_half(processes).into_iter().map(|craft| craft.0);
        let outage = OutageSpec {
            from_ns,
            until_ns: from_ns + self.between_ns(OUTAGE_US),
            whom: CutOff::Group(BTreeSet::from_iter(group).into_iter().collect()),
        };
        LinkSpec {
            loss_per_billion: 1 + self.0.below(LOSS_PER_BILLION_MAX),
            duplication_per_billion: self.0.below(DUPLICATION_PER_BILLION_MAX),
            delay_ns: self.delay_ns(DELAY_US_MAX),
            jitter_ns: self.delay_ns(DELAY_US_MAX),
            bandwidth_bits_per_s: None,
            outages: vec![outage],
            positions_ns: Vec::new(),
        }
    }

    fn between_ns(&mut self, us: Range<u32>) -> u64 {
        u64::from(us.start + self.0.below(us.end - us.start)) * 1_000
    }

    /// How a craft's life shall end before its fleet does.
    pub(super) fn doom(&mut self) -> Doom {
        let point = self.one_of(&[
            Point::StartUp,
            Point::Opening,
            Point::Loan,
            Point::Send,
            Point::Receive,
            Point::Handshake,
        ]);
        let after = match point {
            Point::Opening => self.0.below(OPENING_US_MAX),
            Point::Loan | Point::Send | Point::Receive => self.0.below(PASSES_MAX),
            Point::StartUp
            | Point::Handshake
            | Point::Shutdown
            | Point::Silence
            | Point::Deafness => 0,
        };
        Doom { point, after }
    }

    /// How a craft's life shall end with its fleet.
    pub(super) fn last_doom(&mut self) -> Doom {
        Doom { point: Point::Shutdown, after: self.0.below(SHUTDOWN_US_MAX) }
    }

    pub(super) fn orchestrator_point(&mut self) -> OrchestratorPoint {
        self.one_of(&[
            OrchestratorPoint::Random,
            OrchestratorPoint::Creating,
            OrchestratorPoint::Playing,
            OrchestratorPoint::Restart,
            OrchestratorPoint::Shutdown,
        ])
    }

    /// A delay of at most `most_us`, ns.
    pub(super) fn delay_ns(&mut self, most_us: u32) -> u64 {
        u64::from(self.0.below(most_us)) * 1_000
    }
}

#[cfg(test)]
mod tests {
    use super::{BTreeSet, CutOff, Draws, OutageSpec, Point};
    use crate::supervision::heartbeat::{LOOK_NS, SILENCE_NS};

    #[test]
    fn a_seed_draws_the_same_and_every_point_is_drawn() {
        let drawn = |seed: u64| -> Vec<String> {
            let mut draws = Draws::new(seed);
            (0..200).map(|_| draws.doom().to_string()).collect()
        };
        assert_eq!(drawn(3), drawn(3));
        assert_ne!(drawn(3), drawn(4));
        let mut draws = Draws::new(3);
        let points: BTreeSet<Point> = (0..200).map(|_| draws.doom().point).collect();
        assert_eq!(points.len(), Point::ALL.len() - 3, "all but shutdown, silence and deafness");
    }

    #[test]
    fn pauses_are_seconds_and_some_outlast_the_rule_for_silent_crafts() {
        let mut draws = Draws::new(2);
        let pauses: Vec<u64> = (0..100).map(|_| draws.pause_ns()).collect();
        assert!(pauses.iter().any(|&pause_ns| pause_ns < 1_000_000_000));
        let beyond = pauses.iter().filter(|&&pause_ns| pause_ns > SILENCE_NS + LOOK_NS).count();
        assert!(beyond >= 20, "{beyond} of 100");
    }

    #[test]
    fn links_that_fail_do_everything_and_cut_off_some_within_the_interval() {
        let mut draws = Draws::new(4);
        for _ in 0..50 {
            let link = draws.link(5, 300_000_000);
            assert!(link.is_faulty() && link.loss_per_billion > 0, "{link:?}");
            let [OutageSpec { from_ns, until_ns, whom: CutOff::Group(group) }] = &link.outages[..]
            else {
                panic!("{link:?}")
            };
            assert!(from_ns < until_ns && *from_ns < 300_000_000, "{link:?}");
            assert!(group.is_sorted() && (1..=2).contains(&group.len()), "{link:?}");
        }
    }

    #[test]
    fn at_most_half_are_stopped_and_nobody_twice() {
        let mut draws = Draws::new(1);
        for processes in [2, 5, 10, 21] {
            for _ in 0..50 {
                let stopped = draws.up_to_half(processes);
                let different: BTreeSet<_> = stopped.iter().collect();
                assert_eq!(different.len(), stopped.len());
                assert!((1..=processes as usize / 2).contains(&stopped.len()));
            }
        }
    }
}
