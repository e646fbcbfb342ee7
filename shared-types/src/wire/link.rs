//! What the links of a fleet do to samples, as an epoch says it (names resolved, times in nanoseconds), and
//! how often they did, as a report says it.
//!
//! Not here: the verdicts that follow ([`crate::transport::link::StatedLink`]), and what a user writes
//! ([`crate::scenario::Link`]).

use crate::ids::CraftId;
use rkyv::{Archive, Deserialize, Serialize};
use zerocopy::{Immutable, IntoBytes};

/// What samples between two crafts suffer, in whole numbers. Part of an [`super::EpochSpec`].
#[derive(Clone, Debug, Default, PartialEq, Eq, Archive, Serialize, Deserialize)]
pub struct LinkSpec {
    /// Of a billion samples, how many are lost.
    pub loss_per_billion: u32,
    /// Of a billion samples, how many arrive twice.
    pub duplication_per_billion: u32,
    /// Delay of every sample, ns; propagation comes on top.
    pub delay_ns: u64,
    /// Each sample takes a random time below this on top, ns, and later ones may overtake it.
    pub jitter_ns: u64,
    /// What the way from one craft to another carries, bits per second.
    pub bandwidth_bits_per_s: Option<u64>,
    /// Times in which nothing passes.
    pub outages: Vec<OutageSpec>,
    /// Where each craft is, every coordinate as the time that a signal takes over it, ns; empty if that
    /// makes no difference. The centre, the craft behind the last, is where the first one is.
    pub positions_ns: Vec<[i64; 3]>,
}

/// Nothing passes between some crafts and the others, or between two, for a time.
#[derive(Clone, Debug, PartialEq, Eq, Archive, Serialize, Deserialize)]
pub struct OutageSpec {
    /// When it begins, ns from the start of the trial or interval.
    pub from_ns: u64,
    /// When it is over, likewise.
    pub until_ns: u64,
    /// Who is concerned.
    pub whom: CutOff,
}

/// Between whom nothing passes.
#[derive(Clone, Debug, PartialEq, Eq, Archive, Serialize, Deserialize)]
pub enum CutOff {
    /// These crafts (ascending) and all others; among them all passes.
    Group(Vec<u32>),
    /// Two crafts.
    Pair(u32, u32),
}

impl OutageSpec {
    /// Whether nothing passes from `one` to `other` when `passed_ns` of the trial or interval are over.
    #[must_use]
    pub fn stops(&self, passed_ns: u64, one: CraftId, other: CraftId) -> bool {
        let concerns = match &self.whom {
            CutOff::Group(group) => {
                let has = |craft: CraftId| group.binary_search(&craft.0).is_ok();
                has(one) != has(other)
            }
            &CutOff::Pair(a, b) => [(a, b), (b, a)].contains(&(one.0, other.0)),
        };
        concerns && (self.from_ns..self.until_ns).contains(&passed_ns)
    }
}

impl LinkSpec {
    /// How long a sample travels from one craft to the other, jitter and bandwidth apart, ns.
    #[must_use]
    pub fn delay_ns(&self, from: CraftId, to: CraftId) -> u64 {
        self.delay_ns.saturating_add(self.propagation_ns(from, to))
    }

    #[expect(
        clippy::cast_precision_loss,
        reason = "what is lost is far below a nanosecond in a day"
    )]
    #[expect(clippy::cast_possible_truncation, reason = "distances saturate")]
    #[expect(clippy::cast_sign_loss, reason = "distances are not negative")]
    fn propagation_ns(&self, from: CraftId, to: CraftId) -> u64 {
        let Some(first) = self.positions_ns.first() else { return 0 };
        let position = |craft: CraftId| self.positions_ns.get(craft.index()).unwrap_or(first);
        let apart = position(from).iter().zip(position(to));
        let square: f64 = apart.map(|(&from, &to)| (from.abs_diff(to) as f64).powi(2)).sum();
        square.sqrt().round() as u64
    }

    /// Whether samples may be lost, come twice or out of order.
    #[must_use]
    pub fn is_faulty(&self) -> bool {
        self.loss_per_billion > 0
            || self.duplication_per_billion > 0
            || self.jitter_ns > 0
            || !self.outages.is_empty()
    }

    /// Whether anything happens to samples at all.
    #[must_use]
    pub fn acts(&self) -> bool {
        self.is_faulty()
            || self.delay_ns > 0
            || self.bandwidth_bits_per_s.is_some()
            || !self.positions_ns.is_empty()
    }
}

/// What links did to samples.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    Archive,
    Serialize,
    Deserialize,
    serde::Serialize,
    serde::Deserialize,
    IntoBytes,
    Immutable,
)]
#[repr(C)]
pub struct LinkCounts {
    /// Samples that were lost, those that were cut off apart.
    pub lost: u64,
    /// Samples lost because nothing passed at that time.
    pub cut_off: u64,
    /// Samples that arrived twice.
    pub doubled: u64,
    /// Samples that were held up.
    pub delayed: u64,
    /// Samples that arrived behind one that was sent later on the same way.
    pub overtaken: u64,
}

impl std::ops::AddAssign for LinkCounts {
    fn add_assign(&mut self, other: Self) {
        self.lost = self.lost.saturating_add(other.lost);
        self.cut_off = self.cut_off.saturating_add(other.cut_off);
        self.doubled = self.doubled.saturating_add(other.doubled);
        self.delayed = self.delayed.saturating_add(other.delayed);
        self.overtaken = self.overtaken.saturating_add(other.overtaken);
    }
}
