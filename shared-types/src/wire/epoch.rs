//! What a craft must know of an epoch besides the networks.

use super::{DELTA_BYTES, LinkSpec, OpenSpec, RecoverySpec};
use crate::limits::{OUTAGES_MAX, RECORD_PADDING_BYTES_MAX};
use crate::reasoning::Reasoning;
use rkyv::{Archive, Deserialize, Serialize};
use schemars::JsonSchema;

/// A replication strategy, as scenarios and tables name it.
#[derive(
    Clone,
    Copy,
    Debug,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    Archive,
    Serialize,
    Deserialize,
    serde::Serialize,
    serde::Deserialize,
    JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
#[rkyv(derive(Clone, Copy, Debug))]
#[repr(u8)]
pub enum StrategyKind {
    /// Nothing is replicated; the floor under every time.
    Null,
    /// Every firing's changes by one multicast.
    Full,
    /// Changes of boundary facts to each sharing peer.
    Boundary,
    /// The same changes to each other craft.
    Limited,
    /// The same changes hop by hop along the tree.
    Hierarchy,
    /// Direct inside a group, between groups along the tree of leaders.
    Hybrid,
    /// One blackboard at a centre, round trips one by one.
    Central,
    /// The centre checks for termination itself.
    CentralBatched,
    /// As central, with many round trips in flight.
    Pipelined,
}

impl StrategyKind {
    /// All strategies in the order of the tables.
    pub const ALL: [Self; 9] = [
        Self::Null,
        Self::Full,
        Self::Boundary,
        Self::Limited,
        Self::Hierarchy,
        Self::Hybrid,
        Self::Central,
        Self::CentralBatched,
        Self::Pipelined,
    ];

    /// The name on the command line, in scenarios and in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Null => "null",
            Self::Full => "full",
            Self::Boundary => "boundary",
            Self::Limited => "limited",
            Self::Hierarchy => "hierarchy",
            Self::Hybrid => "hybrid",
            Self::Central => "central",
            Self::CentralBatched => "central-batched",
            Self::Pipelined => "pipelined",
        }
    }

    /// Whether the boards live at a centre, one more process.
    #[must_use]
    pub const fn has_centre(self) -> bool {
        matches!(self, Self::Central | Self::CentralBatched | Self::Pipelined)
    }

    /// Whether it multicasts.
    #[must_use]
    pub const fn multicasts(self) -> bool {
        matches!(self, Self::Full)
    }

    /// Whether it plays traces in open mode. There every request awaits its reply, so that `pipelined`
    /// would be `central` under another name.
    #[must_use]
    pub const fn plays_traces(self) -> bool {
        !matches!(self, Self::Pipelined)
    }

    /// Whether receivers keep what others told in a replica store.
    #[must_use]
    pub const fn keeps_replicas(self) -> bool {
        matches!(self, Self::Full | Self::Limited)
    }
}

impl std::fmt::Display for StrategyKind {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.pad(self.name())
    }
}

impl std::str::FromStr for StrategyKind {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        Self::ALL.into_iter().find(|kind| kind.name() == name).ok_or_else(|| {
            let known: Vec<&str> = Self::ALL.iter().map(|kind| kind.name()).collect();
            format!("unknown strategy `{name}`; known: {}", known.join(", "))
        })
    }
}

/// One epoch: which trial is run, how. Sent to every craft before the epoch's first turn.
#[derive(Clone, Debug, PartialEq, Eq, Archive, Serialize, Deserialize)]
pub struct EpochSpec {
    /// Number of the epoch on this fleet.
    pub epoch: u32,
    /// Epoch whose `world` sample holds the networks: this one, or an earlier one of the same trial.
    pub network: u32,
    /// Seed of the run.
    pub seed: u64,
    /// Trial of the seed; names the random streams.
    pub trial: u32,
    /// How changes are replicated.
    pub strategy: StrategyKind,
    /// Whether a final fact counts only if a firing on its own board newly asserts it (the published
    /// experiment); else a delivery counts as well.
    pub own_firing_only: bool,
    /// Whether the trial runs on past final facts (timing epochs).
    pub ignores_finals: bool,
    /// Whether only changes that alter the value are sent.
    pub sends_altered_only: bool,
    /// Bytes of one record on the wire, padding included.
    pub record_bytes: u32,
    /// Firings that this epoch may reach at most per craft, so that nothing grows while it runs.
    pub turns_max: u32,
    /// How crafts choose what they fire, and keep their boards small.
    pub reasoning: Reasoning,
    /// How the trace is played that travels with the networks; `None` in lockstep.
    pub open: Option<OpenSpec>,
    /// How losses are repaired; `None` if they are detected and counted only.
    pub recovery: Option<RecoverySpec>,
    /// What links do in an interval of real processes; `None` if nothing happens on them. Simulated
    /// networks are told of theirs beforehand.
    pub link: Option<LinkSpec>,
}

/// Shortest and longest record, bytes.
const RECORD_BYTES: std::ops::RangeInclusive<usize> =
    DELTA_BYTES..=DELTA_BYTES + RECORD_PADDING_BYTES_MAX as usize;

impl EpochSpec {
    /// Reads an archive that may lie at any alignment, as inside a sample; `None` if it is damaged, or is of
    /// an epoch that no craft can play.
    #[must_use]
    pub fn from_archive(bytes: &[u8]) -> Option<Self> {
        // One copy an epoch.
        let mut aligned = rkyv::util::AlignedVec::<16>::with_capacity(bytes.len());
        aligned.extend_from_slice(bytes);
        let archived = rkyv::access::<ArchivedEpochSpec, rkyv::rancor::Error>(&aligned).ok()?;
        let spec = rkyv::deserialize::<Self, rkyv::rancor::Error>(archived).ok()?;
        spec.can_be_played().then_some(spec)
    }

    /// Whether records fit samples, the strategy plays what is asked of it, and nothing is beyond its limit.
    fn can_be_played(&self) -> bool {
        RECORD_BYTES.contains(&(self.record_bytes as usize))
            && (self.open.is_none() || self.strategy.plays_traces())
            && self.link.as_ref().is_none_or(|link| link.outages.len() <= OUTAGES_MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::{EpochSpec, RECORD_BYTES, StrategyKind};
    use crate::reasoning::Reasoning;
    use crate::wire::{LinkSpec, OpenSpec, OutageSpec};

    #[test]
    fn an_epoch_that_no_craft_can_play_is_refused() {
        let open = OpenSpec { duration_ns: 9, slice_ns: 9, asks_every_ns: 9, stamps_stages: true };
        let spec = |record_bytes: usize, strategy, outages| EpochSpec {
            epoch: 3,
            network: 3,
            seed: 7,
            trial: 0,
            strategy,
            own_firing_only: true,
            ignores_finals: false,
            sends_altered_only: false,
            record_bytes: u32::try_from(record_bytes).unwrap(),
            turns_max: 200,
            reasoning: Reasoning::default(),
            open: Some(open),
            recovery: None,
            link: Some(LinkSpec { outages, ..LinkSpec::default() }),
        };
        let read = |spec: &EpochSpec| {
            let archive = rkyv::to_bytes::<rkyv::rancor::Error>(spec).unwrap();
            // One byte off, as inside a sample.
            EpochSpec::from_archive(&[&[0], &archive[..]].concat()[1..])
        };
        let (least, most) = RECORD_BYTES.into_inner();
        for record_bytes in [least, most] {
            let spec = spec(record_bytes, StrategyKind::Boundary, Vec::new());
            assert_eq!(read(&spec).as_ref(), Some(&spec));
        }
        // No record fits a sample, or no change a record.
        for record_bytes in [0, least - 1, most + 1, u32::MAX as usize] {
            assert_eq!(read(&spec(record_bytes, StrategyKind::Boundary, Vec::new())), None);
        }
        assert_eq!(read(&spec(least, StrategyKind::Pipelined, Vec::new())), None);
        let whom = crate::wire::CutOff::Pair(0, 1);
        let outage = OutageSpec { from_ns: 0, until_ns: 1, whom };
        let many = vec![outage; crate::limits::OUTAGES_MAX + 1];
        assert_eq!(read(&spec(least, StrategyKind::Boundary, many)), None);
        assert_eq!(EpochSpec::from_archive(&[1; 40]), None);
    }
}
