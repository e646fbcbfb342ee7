//! The links of a simulated fleet: what `[link]` loses, doubles, holds up and cuts off.
//!
//! Draws come from the seed, sample by sample and a stream for each key, repeats and receipts included.
//! Fleets whose links lose, double or reorder something repair it (docs/decisions/0014), so that a trial
//! takes the path that it takes without. Not here: delay and range of a pair (`positions`), and bounds
//! (`links`).

use super::positions::LinkTable;
use super::resolve::ResolvedScenario;
use shared_types::ids::CraftId;
use shared_types::limits::INBOX_SAMPLES;
use shared_types::rng::{Purpose, Stream};
use shared_types::scenario::{Link as Stated, Outage as StatedOutage, RunMode, Scenario};
use shared_types::time::Nanos;
use shared_types::transport::link::{Link, Verdict};
use shared_types::wire::{HEADER_BYTES, Header, RecoverySpec};
use std::collections::{BTreeMap, BTreeSet};

/// What a process waits beyond the way there and back before it asks again, ns.
const PATIENCE_NS: u64 = 100_000;

/// Outages last at most this many patiences together: who asks in vain pauses up to sixteen of them, and
/// gives up after 256 times.
const PATIENCES_PER_OUTAGE: u64 = 1_000;

/// What samples between two crafts suffer.
#[derive(Clone, Debug)]
pub struct SimulatedLink {
    seed: u64,
    stated: Stated,
    table: LinkTable,
    outages: Vec<Outage>,
    /// When the trial began.
    began: Nanos,
    draws: Draws,
    /// Until when the way from one craft to another carries what was sent before.
    busy: BTreeMap<(u32, CraftId), Nanos>,
}

/// A stream for each key, so that none changes what another one does.
#[derive(Clone, Debug)]
struct Draws {
    loss: Stream,
    duplication: Stream,
    jitter: Stream,
}

impl Draws {
    fn new(seed: u64, trial: u32) -> Self {
        let stream = |key| Stream::new(seed, trial, Purpose::Faults, key);
        Self { loss: stream(0), duplication: stream(1), jitter: stream(2) }
    }
}

/// Nothing passes between some crafts and the others, or between two.
#[derive(Clone, Debug)]
struct Outage {
    from_ns: u64,
    until_ns: u64,
    whom: Whom,
}

#[derive(Clone, Debug)]
enum Whom {
    Group(BTreeSet<CraftId>),
    Pair(CraftId, CraftId),
}

impl Outage {
    fn of(stated: &StatedOutage, scenario: &ResolvedScenario) -> Self {
        let id = |name: &String| {
            scenario.names().craft_id(name).expect("invariant: outages are of crafts of the fleet")
        };
        let whom = match (&stated.craft, &stated.between) {
            (_, Some([one, other])) => Whom::Pair(id(one), id(other)),
            (cut_off, None) => {
                Whom::Group(cut_off.iter().flat_map(|names| names.iter()).map(id).collect())
            }
        };
        Self { from_ns: ns(stated.from_ms), until_ns: ns(stated.until_ms), whom }
    }

    fn stops(&self, passed_ns: u64, one: CraftId, other: CraftId) -> bool {
        let concerns = match &self.whom {
            Whom::Group(group) => group.contains(&one) != group.contains(&other),
            &Whom::Pair(a, b) => (a, b) == (one, other) || (b, a) == (one, other),
        };
        concerns && (self.from_ns..self.until_ns).contains(&passed_ns)
    }
}

impl SimulatedLink {
    /// The links of `scenario`, drawn from `seed`; `None` if nothing happens on them.
    #[must_use]
    pub fn of(scenario: &ResolvedScenario, seed: u64) -> Option<Self> {
        let stated = scenario.scenario().link.clone();
        let table = scenario.links().clone();
        let acts =
            is_faulty(&stated) || stated.bandwidth_bits_per_s.is_some() || !table.is_instant();
        let outages = stated.outages.iter().map(|outage| Outage::of(outage, scenario)).collect();
        let (began, draws, busy) = (Nanos::default(), Draws::new(seed, 0), BTreeMap::new());
        acts.then_some(Self { seed, stated, table, outages, began, draws, busy })
    }

    /// How long the sample of `header`, sent at `now`, waits for the way and then takes to be put on it.
    fn transmission_ns(&mut self, now: Nanos, receiver: CraftId, header: &Header) -> u64 {
        let Some(bits_per_s) = self.stated.bandwidth_bits_per_s else { return 0 };
        let free = self.busy.entry((header.source, receiver)).or_default();
        *free = (*free).max(now).plus(carried_ns(bits_per_s, u64::from(header.length)));
        free.since(now)
    }
}

impl Link for SimulatedLink {
    fn begin(&mut self, now: Nanos, trial: u32) {
        self.began = now;
        self.draws = Draws::new(self.seed, trial);
        self.busy.clear();
    }

    fn judge(&mut self, now: Nanos, receiver: CraftId, header: &Header) -> Verdict {
        let source = CraftId(header.source);
        if [source, receiver].contains(&CraftId::ORCHESTRATOR) {
            return Verdict::Pass;
        }
        let passed_ns = now.since(self.began);
        if self.outages.iter().any(|outage| outage.stops(passed_ns, source, receiver)) {
            return Verdict::CutOff;
        }
        // What is lost on the way was sent, too.
        let transmission_ns = self.transmission_ns(now, receiver, header);
        let Stated { loss, duplication, jitter_ms, .. } = self.stated;
        if loss > 0.0 && self.draws.loss.unit() < loss {
            return Verdict::Drop;
        }
        let jitter_ns = if jitter_ms > 0.0 { ns(jitter_ms * self.draws.jitter.unit()) } else { 0 };
        let delay_ns = self.table.delay_ns(source, receiver) + transmission_ns + jitter_ns;
        let keeps_order = jitter_ms == 0.0;
        if duplication > 0.0 && self.draws.duplication.unit() < duplication {
            return Verdict::Doubled { delay_ns, keeps_order };
        }
        match (delay_ns, keeps_order) {
            (0, true) => Verdict::Pass,
            (delay_ns, true) => Verdict::Delay(delay_ns),
            (delay_ns, false) => Verdict::Overtaken(delay_ns),
        }
    }
}

/// How long a link of `bits_per_s` takes over a sample with that much payload.
fn carried_ns(bits_per_s: f64, payload_bytes: u64) -> u64 {
    #[expect(clippy::cast_precision_loss, reason = "samples are short")]
    let bits = (payload_bytes + HEADER_BYTES as u64) as f64 * 8.0;
    ns(bits * 1e3 / bits_per_s)
}

#[expect(clippy::cast_possible_truncation, reason = "times are bounded by days, saturating")]
#[expect(clippy::cast_sign_loss, reason = "times are checked not to be negative")]
fn ns(ms: f64) -> u64 {
    (ms * 1e6).round() as u64
}

/// Whether samples may be lost, come twice or out of order.
fn is_faulty(link: &Stated) -> bool {
    let Stated { loss, duplication, jitter_ms, outages, .. } = link;
    *loss > 0.0 || *duplication > 0.0 || *jitter_ms > 0.0 || !outages.is_empty()
}

/// How fleets of `scenario` repair what its links do; `None` where every sample arrives once and in order.
pub(super) fn recovery(scenario: &Scenario) -> Option<RecoverySpec> {
    let Scenario { link, run, replication, .. } = scenario;
    if run.mode != RunMode::Simulated || !is_faulty(link) {
        return None;
    }
    let propagation_s = link
        .from_positions
        .as_ref()
        .map_or(0.0, |stated| stated.range_m / stated.propagation_m_per_s);
    // With as much before it as an inbox takes.
    let queue_ns = link.bandwidth_bits_per_s.map_or(0, |bits_per_s| {
        carried_ns(bits_per_s, replication.record_bytes.into()).saturating_mul(INBOX_SAMPLES as u64)
    });
    let way_ns = ns(link.delay_ms + link.jitter_ms + propagation_s * 1e3).saturating_add(queue_ns);
    let outages_ns = link.outages.iter().map(|outage| ns(outage.until_ms - outage.from_ms));
    let patience_ns = (way_ns.saturating_mul(4).saturating_add(PATIENCE_NS))
        .max(outages_ns.fold(0, u64::saturating_add) / PATIENCES_PER_OUTAGE);
    Some(RecoverySpec::patient(patience_ns))
}

#[cfg(test)]
mod tests;
