//! Campaigns on the virtual clock: fleets that are killed, paused and cut off as a seed says, and the
//! laws that hold all the same.
//!
//! A [`Case`] is a seed, a strategy and a [`Play`]: they decide the fleet, what it does ([`Scene`]) and what
//! befalls it ([`Fault`]). [`Case::play`] plays it in one process, holds every step against the laws and,
//! once nothing is under way any more, the boards against each other; in lockstep every trial that comes to
//! its end is held against the same trial without faults. A case that breaks a law is made small
//! ([`Case::shrink`]): as few faults, as short, as still break it. The same case always goes the same way,
//! so that a replay shows what happened, step by step. Not here: real processes.

mod arrival;
mod events;
mod fault;
mod judge;
mod laws;
mod lossy;
mod play;
mod scene;
mod shrink;
#[cfg(test)]
mod tests;
mod trial;
mod turns;
mod weather;

pub use fault::{Fault, What, draw};
pub use laws::Violation;
pub use lossy::{Lossy, lossy};
pub use scene::Scene;

use crate::craft::Craft;
use shared_types::ids::CraftId;
use shared_types::time::Nanos;
use shared_types::transport::Endpoint;
use shared_types::transport::memory::MemoryEndpoint;
use shared_types::wire::{Recovered, StrategyKind, Traffic};

/// Strategies that a campaign can be run with: those that play traces and replicate.
pub const STRATEGIES: [StrategyKind; 7] = [
    StrategyKind::Full,
    StrategyKind::Boundary,
    StrategyKind::Limited,
    StrategyKind::Hierarchy,
    StrategyKind::Hybrid,
    StrategyKind::Central,
    StrategyKind::CentralBatched,
];

/// Those that a campaign in lockstep can be run with.
pub const LOCKSTEP_STRATEGIES: [StrategyKind; 8] = [
    StrategyKind::Full,
    StrategyKind::Boundary,
    StrategyKind::Limited,
    StrategyKind::Hierarchy,
    StrategyKind::Hybrid,
    StrategyKind::Central,
    StrategyKind::CentralBatched,
    StrategyKind::Pipelined,
];

/// What a fleet plays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Play {
    /// A trace, in one epoch of open mode.
    #[default]
    Open,
    /// Trials in lockstep, one after the other, until nothing befalls the fleet any more.
    Lockstep,
}

impl Play {
    /// The time in which things begin to befall a fleet, ns: it has something to do for about as long.
    #[must_use]
    pub const fn span_ns(self) -> u32 {
        match self {
            Self::Open => 24_000_000,
            Self::Lockstep => 2_400_000,
        }
    }

    /// Strategies that it can be played with.
    #[must_use]
    pub const fn strategies(self) -> &'static [StrategyKind] {
        match self {
            Self::Open => &STRATEGIES,
            Self::Lockstep => &LOCKSTEP_STRATEGIES,
        }
    }
}

/// One fleet and what befalls it.
#[derive(Clone, Debug)]
pub struct Case {
    /// What everything is drawn from.
    pub seed: u64,
    /// How the fleet replicates.
    pub strategy: StrategyKind,
    /// What it plays.
    pub play: Play,
    /// The fleet and its trace.
    pub scene: Scene,
    /// What befalls it, by time.
    pub faults: Vec<Fault>,
}

/// What a case that kept every law took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Played {
    /// Steps of processes.
    pub steps: u64,
    /// Trials of lockstep that came to their end.
    pub trials: u64,
    /// Trials of lockstep that were given up because a process ended.
    pub given_up: u64,
    /// Virtual time until nothing was under way, ns.
    pub duration_ns: u64,
    /// Lives that ended.
    pub kills: u64,
    /// Samples that the links lost.
    pub lost: u64,
    /// What recovery did, all processes together.
    pub recovered: Recovered,
    /// Traffic of the classes replication and reply.
    pub first_sent: Traffic,
    /// Traffic of the classes repair and ack.
    pub on_top: Traffic,
}

impl std::ops::AddAssign for Played {
    fn add_assign(&mut self, other: Self) {
        self.steps += other.steps;
        self.trials += other.trials;
        self.given_up += other.given_up;
        self.duration_ns += other.duration_ns;
        self.kills += other.kills;
        self.lost += other.lost;
        self.recovered += other.recovered;
        self.first_sent += other.first_sent;
        self.on_top += other.on_top;
    }
}

/// A case that broke a law.
#[derive(Clone, Debug)]
pub struct Failure {
    /// The case, faults as drawn.
    pub case: Case,
    /// Which law, and how.
    pub violation: Violation,
    /// Faults that still break a law, as few and short as were found.
    pub minimal: Vec<Fault>,
}

/// Told what happens, step by step: when, and what.
pub type Witness<'a> = &'a mut dyn FnMut(Nanos, String);

/// Memory that cases share: a campaign plays thousands of them.
#[derive(Debug, Default)]
pub struct Stage {
    crafts: Vec<Craft>,
}

impl Stage {
    /// The first `count` crafts, at the start of their first life.
    fn crafts(&mut self, count: usize) -> &mut [Craft] {
        for id in self.crafts.len()..count {
            self.crafts.push(Craft::new(CraftId::from_index(id)));
        }
        let crafts = &mut self.crafts[..count];
        crafts.iter_mut().for_each(|craft| craft.begin_life(0));
        crafts
    }
}

impl Case {
    /// The case that `seed` draws for `strategy`.
    #[must_use]
    pub fn of(seed: u64, strategy: StrategyKind) -> Self {
        Self::drawn(seed, strategy, Play::Open)
    }

    /// The case that `seed` draws for `strategy` when `play` is played.
    #[must_use]
    pub fn drawn(seed: u64, strategy: StrategyKind, play: Play) -> Self {
        let scene = match play {
            Play::Open => Scene::of(seed),
            Play::Lockstep => Scene::mission(seed),
        };
        let faults = draw(seed, scene.crafts(), strategy, play.span_ns());
        Self { seed, strategy, play, scene, faults }
    }

    /// Plays the case and says what it took.
    ///
    /// # Errors
    /// The first law that is broken.
    pub fn play<'a>(
        &'a self,
        stage: &'a mut Stage,
        witness: Option<Witness<'a>>,
    ) -> Result<Played, Violation> {
        self.play_through(stage, witness, &|endpoint| endpoint)
    }

    /// The same with endpoints that `wrap` makes: how tests plant bugs.
    ///
    /// # Errors
    /// As [`Self::play`].
    pub fn play_through<'a, E: Endpoint>(
        &'a self,
        stage: &'a mut Stage,
        witness: Option<Witness<'a>>,
        wrap: &'a dyn Fn(MemoryEndpoint) -> E,
    ) -> Result<Played, Violation> {
        match self.play {
            Play::Open => play::play(self, stage, witness, wrap),
            Play::Lockstep => turns::play(self, stage, witness, wrap),
        }
    }

    /// Plays the case; one that breaks a law is made small.
    ///
    /// # Errors
    /// The law, with the faults that break it.
    pub fn judge(self, stage: &mut Stage) -> Result<Played, Box<Failure>> {
        match self.play(stage, None) {
            Ok(played) => Ok(played),
            Err(violation) => {
                let minimal = self.shrink(|case| case.play(stage, None).is_err());
                Err(Box::new(Failure { case: self, violation, minimal }))
            }
        }
    }
}
