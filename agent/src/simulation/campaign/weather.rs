//! The links of a campaign: what the faults of the moment make of a sample.

use super::Case;
use super::fault::{Fault, What};
use shared_types::ids::CraftId;
use shared_types::limits::REPEATS_MAX;
use shared_types::rng::{Purpose, Stream};
use shared_types::time::Nanos;
use shared_types::transport::link::{Link, Verdict};
use shared_types::wire::{Class, Header};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;

/// What the links saw.
#[derive(Debug, Default)]
pub(super) struct Seen {
    /// Samples that were lost on the way.
    pub(super) lost: u64,
    /// By (source, life, receiver, address, number) how often a sample was repeated.
    repeats: BTreeMap<(u32, u32, CraftId, u32, u64), u32>,
    /// A sample that was repeated more often than is allowed.
    pub(super) over_budget: Option<Header>,
}

/// Judges every sample by the faults that act.
#[derive(Debug)]
pub(super) struct Weather {
    faults: Vec<Fault>,
    /// How long a sample may be held up while others overtake it, ns at most.
    overtaken_ns: u32,
    stream: Stream,
    seen: Rc<RefCell<Seen>>,
}

impl Weather {
    pub(super) fn new(case: &Case, seen: Rc<RefCell<Seen>>) -> Self {
        let of_links = |fault: &&Fault| !matches!(fault.what, What::Kill(_) | What::Pause(_));
        let stream = Stream::new(case.seed, 1, Purpose::Faults, 0);
        let faults = case.faults.iter().filter(of_links).copied().collect();
        Self { faults, overtaken_ns: case.play.span_ns() / 24, stream, seen }
    }
}

impl Link for Weather {
    fn judge(&mut self, now: Nanos, receiver: CraftId, header: &Header) -> Verdict {
        let is_numbered = header.kind().is_some_and(shared_types::wire::Kind::is_numbered);
        let mut seen = self.seen.borrow_mut();
        if header.class == Class::Repair as u8 && is_numbered {
            let Header { source, incarnation, destination, sequence, .. } = *header;
            let repeats = &mut seen.repeats;
            let count =
                repeats.entry((source, incarnation, receiver, destination, sequence)).or_default();
            *count += 1;
            if *count > REPEATS_MAX {
                seen.over_budget = Some(*header);
            }
        }
        let mut verdict = Verdict::Pass;
        for fault in self.faults.iter().filter(|fault| fault.acts(now.0)) {
            let mut strikes = |permille: u32| self.stream.below(1_000) < permille;
            match fault.what {
                What::Kill(_) | What::Pause(_) => {}
                What::Loss(permille) if strikes(permille) => verdict = Verdict::Drop,
                What::Duplication(permille) if strikes(permille) => verdict = Verdict::Duplicate,
                What::Reordering(permille) if strikes(permille) => {
                    verdict = Verdict::Overtaken(u64::from(self.stream.below(self.overtaken_ns)));
                }
                What::Delay(ns) => verdict = Verdict::Delay(u64::from(ns)),
                What::Partition(crafts) => {
                    let is_inside = |craft: u32| crafts >> craft.min(31) & 1 == 1;
                    if is_inside(header.source) != is_inside(receiver.0) {
                        verdict = Verdict::CutOff;
                    }
                }
                What::Loss(_) | What::Duplication(_) | What::Reordering(_) => {}
            }
            if matches!(verdict, Verdict::Drop | Verdict::CutOff) {
                seen.lost += 1;
                return verdict;
            }
        }
        verdict
    }
}
