//! What a hop costs on a host before anything of ours: the yardstick of times of two hosts.
//!
//! Two threads on the fleet's processors pass a datagram of a Unix socket there and back, asleep in the
//! kernel while they wait; half a round trip is a hop. No fleet lives meanwhile. Each block has one
//! measurement before its fleet and one after it, and is divided by its own. How it is taken is in the
//! run (`run::baseline`); why it is this one, in docs/decisions/0017-the-raw-hop-of-a-run.md.

use super::event::{Event, EventLine};
use super::statistics::as_float;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Half round trips of one measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RawHops {
    /// How many.
    pub n: u64,
    /// Their median, ns.
    pub p50_ns: u64,
    /// Their 99th percentile, ns.
    pub p99_ns: u64,
}

/// The raw hop around one block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Baseline {
    /// The processor of each end, as the kernel numbers them.
    pub processors: [u32; 2],
    /// Length of a datagram.
    pub bytes: u32,
    /// Round trips before those that count.
    pub warm_up: u32,
    /// Before the fleet was started.
    pub before: RawHops,
    /// After it had ended.
    pub after: RawHops,
}

impl Baseline {
    /// The raw hop of the block, ns: the middle of both medians as a ratio sees it.
    #[must_use]
    pub fn hop_ns(&self) -> f64 {
        (as_float(self.before.p50_ns) * as_float(self.after.p50_ns)).sqrt()
    }
}

/// The baseline of one block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct BlockBaseline {
    /// Which launch.
    pub block: u32,
    /// Crafts, a centre not counted.
    pub size: u32,
    /// As measured.
    #[serde(flatten)]
    pub baseline: Baseline,
}

/// Every baseline among `events`, in the order in which they were measured.
#[must_use]
pub fn baselines(events: &[EventLine]) -> Vec<BlockBaseline> {
    let of_event = |line: &EventLine| match line.event {
        Event::BaselineMeasured { block, size, baseline } => {
            Some(BlockBaseline { block, size, baseline })
        }
        _ => None,
    };
    events.iter().filter_map(of_event).collect()
}

/// The raw hop of every block of `size`, ns.
#[must_use]
pub fn raw_hops(events: &[EventLine], size: u32) -> BTreeMap<u32, f64> {
    let of_size = baselines(events).into_iter().filter(|one| one.size == size);
    of_size.map(|one| (one.block, one.baseline.hop_ns())).collect()
}
