//! What `[link]` makes of the samples of a fleet: names resolved, positions filled in; and how the fleet
//! repairs it.
//!
//! Fleets whose links lose, double or reorder something repair it (docs/decisions/0014), so that a simulated
//! trial takes the path that it takes without; real intervals repair on every link that does anything, since
//! what is held up beyond a bound is lost. Not here: the verdicts (`shared_types::transport::link`), range
//! (`positions`), and bounds (`links`).

use super::fleet::Craft;
use super::names::NameTable;
use shared_types::limits::{INBOX_SAMPLES, REAL_PATIENCE_NS};
use shared_types::scenario::{Outage, Restart, Scenario};
use shared_types::transport::link::carried_ns;
use shared_types::wire::{CutOff, LinkSpec, OutageSpec, RecoverySpec};

/// What a simulated process waits beyond the way there and back before it asks again, ns.
const PATIENCE_NS: u64 = 100_000;

/// Outages last at most this many patiences together: who asks in vain pauses up to sixteen of them, and
/// gives up after 256 times.
const PATIENCES_PER_OUTAGE: u64 = 1_000;

/// What the links of `scenario` do to samples of its `crafts`; `None` if nothing happens on them.
pub(super) fn link_spec(
    scenario: &Scenario,
    crafts: &[Craft],
    names: &NameTable,
) -> Option<LinkSpec> {
    let link = &scenario.link;
    let positions_ns = link.from_positions.as_ref().map(|stated| {
        let time_ns = |metres: f64| rounded(metres * 1e9 / stated.propagation_m_per_s);
        let positions = crafts.iter().map(|craft| craft.position.unwrap_or_default());
        positions.map(|position| position.map(time_ns)).collect()
    });
    let spec = LinkSpec {
        loss_per_billion: per_billion(link.loss),
        duplication_per_billion: per_billion(link.duplication),
        delay_ns: ns(link.delay_ms),
        jitter_ns: ns(link.jitter_ms),
        bandwidth_bits_per_s: link.bandwidth_bits_per_s.map(|bits| whole(bits).max(1)),
        outages: link.outages.iter().map(|stated| outage(stated, names)).collect(),
        positions_ns: positions_ns.unwrap_or_default(),
    };
    spec.acts().then_some(spec)
}

fn outage(stated: &Outage, names: &NameTable) -> OutageSpec {
    let id = |name: &String| {
        names.craft_id(name).expect("invariant: outages are of crafts of the fleet").0
    };
    let whom = match (&stated.craft, &stated.between) {
        (_, Some([one, other])) => CutOff::Pair(id(one), id(other)),
        (cut_off, None) => {
            let mut group: Vec<u32> =
                cut_off.iter().flat_map(|names| names.iter()).map(id).collect();
            group.sort_unstable();
            CutOff::Group(group)
        }
    };
    OutageSpec { from_ns: ns(stated.from_ms), until_ns: ns(stated.until_ms), whom }
}

fn ns(ms: f64) -> u64 {
    whole(ms * 1e6)
}

/// Shares are checked to be 1 at most.
fn per_billion(share: f64) -> u32 {
    u32::try_from(whole(share * 1e9)).unwrap_or(u32::MAX)
}

#[expect(clippy::cast_possible_truncation, reason = "what is bounded by checks saturates")]
#[expect(clippy::cast_sign_loss, reason = "values are checked not to be negative")]
fn whole(value: f64) -> u64 {
    value.round() as u64
}

#[expect(clippy::cast_possible_truncation, reason = "what is bounded by checks saturates")]
fn rounded(value: f64) -> i64 {
    value.round() as i64
}

/// How simulated fleets of `scenario` repair what its links do; `None` where every sample arrives once and
/// in order.
pub(super) fn simulated_recovery(
    scenario: &Scenario,
    link: Option<&LinkSpec>,
) -> Option<RecoverySpec> {
    let link = link.filter(|link| scenario.run.mode.is_simulated() && link.is_faulty())?;
    Some(RecoverySpec::patient(patience_ns(scenario, link, PATIENCE_NS)))
}

/// How real processes repair in an interval of open mode what they lose, where they are to.
pub(super) fn open_recovery(scenario: &Scenario, link: Option<&LinkSpec>) -> Option<RecoverySpec> {
    let faults = &scenario.faults;
    let may_die = faults.restart == Restart::OnFailure || !faults.process.is_empty();
    let patience_ns = link.map(|link| patience_ns(scenario, link, REAL_PATIENCE_NS));
    let patience_ns = patience_ns.or(may_die.then_some(REAL_PATIENCE_NS))?;
    Some(RecoverySpec::patient(patience_ns))
}

/// How long an answer may take that takes `least_ns` on links which hold nothing up.
fn patience_ns(scenario: &Scenario, link: &LinkSpec, least_ns: u64) -> u64 {
    let positions = scenario.link.from_positions.as_ref();
    let propagation_s = positions.map_or(0.0, |stated| stated.range_m / stated.propagation_m_per_s);
    // With as much before it as an inbox takes.
    let record_bytes = scenario.replication.record_bytes.into();
    let queue_ns = link.bandwidth_bits_per_s.map_or(0, |bits_per_s| {
        carried_ns(bits_per_s, record_bytes).saturating_mul(INBOX_SAMPLES as u64)
    });
    let way_ns = [link.jitter_ns, ns(propagation_s * 1e3), queue_ns]
        .into_iter()
        .fold(link.delay_ns, u64::saturating_add);
    let outages_ns = link.outages.iter().map(|outage| outage.until_ns - outage.from_ns);
    (way_ns.saturating_mul(4).saturating_add(least_ns))
        .max(outages_ns.fold(0, u64::saturating_add) / PATIENCES_PER_OUTAGE)
}

#[cfg(test)]
mod tests;
