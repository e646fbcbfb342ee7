//! What a campaign does to whom, drawn from its seed.

use agent::process::doom::{Doom, Point};
use shared_types::ids::CraftId;
use shared_types::rng::{Purpose, Stream};
use shared_types::transport::WakeMode;
use shared_types::wire::StrategyKind;

/// The latest instant of a random kill after a trial may begin, us.
const INSTANT_US_MAX: u32 = 30_000;

/// The same after an interval of open mode may begin, us: a bit more than its length.
const OPEN_INSTANT_US_MAX: u32 = 320_000;

/// Loans, sends and receptions that a doomed craft is let make at most before.
const PASSES_MAX: u32 = 60;

/// How long opening and dropping ports are given before a doomed craft dies in them, us at most.
const OPENING_US_MAX: u32 = 6_000;
const SHUTDOWN_US_MAX: u32 = 1_500;

/// How long crafts are stopped, us.
const PAUSE_US: std::ops::Range<u32> = 200_000..2_000_000;

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
        u64::from(PAUSE_US.start + self.0.below(PAUSE_US.end - PAUSE_US.start)) * 1_000
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
    use super::{Draws, Point};
    use std::collections::BTreeSet;

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
