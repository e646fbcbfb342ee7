//! The links of a scenario: what they lose, double, hold up and cut off, for simulated and real fleets.
//!
//! Every way (one sender, one receiver) has a random stream of its own from seed and trial, of which each
//! sample takes the same number of draws, repeats and receipts included. So what comes on one way changes
//! nothing on another, no key changes what another one draws, and a receiver that judges the samples of a
//! way in the order of sending comes to the verdicts of the simulator, which judges them as they are sent.
//! What the orchestrator sends is no radio traffic.

use super::{Link, Verdict};
use crate::ids::CraftId;
use crate::rng::{Purpose, Stream};
use crate::time::Nanos;
use crate::wire::{HEADER_BYTES, Header, LinkSpec};
use std::collections::BTreeMap;

const BILLION: f64 = 1e9;

/// Judges what crafts exchange as a [`LinkSpec`] says.
#[derive(Clone, Debug)]
pub struct StatedLink {
    spec: LinkSpec,
    seed: u64,
    trial: u32,
    /// When the trial or interval began.
    began: Nanos,
    /// By sender and receiver, those that were used.
    ways: BTreeMap<(CraftId, CraftId), Way>,
}

/// From one craft to another.
#[derive(Clone, Debug)]
struct Way {
    draws: Stream,
    /// Until when it carries what was sent before.
    busy: Nanos,
}

impl StatedLink {
    /// The links of `spec`, drawn from `seed`.
    #[must_use]
    pub const fn new(spec: LinkSpec, seed: u64) -> Self {
        Self { spec, seed, trial: 0, began: Nanos(0), ways: BTreeMap::new() }
    }
}

impl Link for StatedLink {
    fn begin(&mut self, now: Nanos, trial: u32) {
        self.began = now;
        self.trial = trial;
        self.ways.clear();
    }

    fn judge(&mut self, now: Nanos, receiver: CraftId, header: &Header) -> Verdict {
        let source = CraftId(header.source);
        if [source, receiver].contains(&CraftId::ORCHESTRATOR) {
            return Verdict::Pass;
        }
        let Self { spec, seed, trial, began, ways } = self;
        let passed_ns = now.since(*began);
        if spec.outages.iter().any(|outage| outage.stops(passed_ns, source, receiver)) {
            return Verdict::CutOff;
        }
        let ends = (source, receiver);
        let way = ways.entry(ends).or_insert_with(|| Way {
            draws: Stream::of_way(*seed, *trial, Purpose::Faults, ends),
            busy: Nanos(0),
        });
        let [loss, duplication, jitter] = std::array::from_fn(|_| way.draws.unit());
        // What is lost on the way was sent, too.
        let transmission_ns = spec.bandwidth_bits_per_s.map_or(0, |bits_per_s| {
            let carried_ns = carried_ns(bits_per_s, u64::from(header.length));
            way.busy = way.busy.max(now).plus(carried_ns);
            way.busy.since(now)
        });
        if loss < f64::from(spec.loss_per_billion) / BILLION {
            return Verdict::Drop;
        }
        let delay_ns = spec
            .delay_ns(source, receiver)
            .saturating_add(transmission_ns)
            .saturating_add(share_of(spec.jitter_ns, jitter));
        let keeps_order = spec.jitter_ns == 0;
        if duplication < f64::from(spec.duplication_per_billion) / BILLION {
            return Verdict::Doubled { delay_ns, keeps_order };
        }
        match (delay_ns, keeps_order) {
            (0, true) => Verdict::Pass,
            (delay_ns, true) => Verdict::Delay(delay_ns),
            (delay_ns, false) => Verdict::Overtaken(delay_ns),
        }
    }
}

/// How long a link of `bits_per_s` takes over a sample with that much payload, ns.
#[must_use]
pub fn carried_ns(bits_per_s: u64, payload_bytes: u64) -> u64 {
    let bits = payload_bytes.saturating_add(HEADER_BYTES as u64).saturating_mul(8);
    let carried_ns = u128::from(bits) * 1_000_000_000 / u128::from(bits_per_s.max(1));
    u64::try_from(carried_ns).unwrap_or(u64::MAX)
}

#[expect(clippy::cast_precision_loss, reason = "times are bounded by a day")]
#[expect(clippy::cast_possible_truncation, reason = "a share is less than the whole")]
#[expect(clippy::cast_sign_loss, reason = "neither is negative")]
fn share_of(whole_ns: u64, share: f64) -> u64 {
    (whole_ns as f64 * share).round() as u64
}
