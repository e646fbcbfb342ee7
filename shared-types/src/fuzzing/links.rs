//! Links as an epoch states them: made of any numbers, archived, read back and asked for verdicts.

use super::archives;
use crate::ids::CraftId;
use crate::limits::OUTAGES_MAX;
use crate::time::Nanos;
use crate::transport::link::{Link as _, StatedLink, Verdict};
use crate::wire::{Class, CutOff, EpochSpec, Header, Kind, LinkSpec, OutageSpec};

/// Most outages and positions that are made: more than are accepted.
const LIST_MAX: u64 = OUTAGES_MAX as u64 + 8;

/// Samples that are judged at most.
const SAMPLES_MAX: usize = 256;

/// Bytes as numbers; zeros follow the last.
struct Numbers<'a>(&'a [u8]);

impl Numbers<'_> {
    /// The next one of `bytes` bytes.
    fn next(&mut self, bytes: usize) -> u64 {
        let (taken, rest) = self.0.split_at(bytes.min(self.0.len()));
        self.0 = rest;
        taken.iter().rev().fold(0, |number, &byte| number << 8 | u64::from(byte))
    }

    fn craft(&mut self) -> u32 {
        u32::try_from(self.next(1)).unwrap_or_default()
    }

    fn link(&mut self) -> LinkSpec {
        let per_billion = |numbers: &mut Self| u32::try_from(numbers.next(4)).unwrap_or_default();
        let (loss_per_billion, duplication_per_billion) = (per_billion(self), per_billion(self));
        let (delay_ns, jitter_ns) = (self.next(8), self.next(8));
        let bandwidth_bits_per_s = Some(self.next(8)).filter(|&bits| bits % 2 == 1);
        let outages = (0..self.next(1).min(LIST_MAX)).map(|_| self.outage()).collect();
        let positions_ns = (0..self.next(1).min(LIST_MAX))
            .map(|_| [(); 3].map(|()| self.next(8).cast_signed()))
            .collect();
        LinkSpec {
            loss_per_billion,
            duplication_per_billion,
            delay_ns,
            jitter_ns,
            bandwidth_bits_per_s,
            outages,
            positions_ns,
        }
    }

    fn outage(&mut self) -> OutageSpec {
        let (from_ns, until_ns) = (self.next(8), self.next(8));
        let whom = match self.next(1) % 4 {
            0 => CutOff::Pair(self.craft(), self.craft()),
            count => CutOff::Group((0..count).map(|_| self.craft()).collect()),
        };
        OutageSpec { from_ns, until_ns, whom }
    }
}

/// The numbers of a link, then samples: sender, receiver, length and when, one to eight bytes each. A spec
/// is accepted as it was made, or has too many outages. Verdicts follow from the spec alone; nothing is
/// lost, doubled or held up that the spec does not say, and what is cut off is so in both directions.
pub(super) fn judge(bytes: &[u8]) {
    let mut numbers = Numbers(bytes);
    let spec = numbers.link();
    let epoch = EpochSpec { link: Some(spec.clone()), ..archives::spec() };
    let archive =
        rkyv::to_bytes::<rkyv::rancor::Error>(&epoch).expect("memory takes every archive");
    let Some(read) = EpochSpec::from_archive(&archive) else {
        return assert!(spec.outages.len() > OUTAGES_MAX, "{spec:?}");
    };
    assert_eq!(read, epoch);
    let _acts = (spec.acts(), spec.is_faulty());
    let mut links = [(); 2].map(|()| StatedLink::new(spec.clone(), epoch.seed));
    links.iter_mut().for_each(|link| link.begin(Nanos(7), epoch.trial));
    for _ in 0..SAMPLES_MAX {
        if numbers.0.is_empty() {
            break;
        }
        let (source, receiver) = (numbers.craft(), numbers.craft());
        let mut header = Header::new(Class::Replication, Kind::Delta);
        header.source = source;
        header.length = u32::try_from(numbers.next(2)).unwrap_or_default();
        let now = Nanos(numbers.next(8));
        let (source, receiver) = (CraftId(source), CraftId(receiver));
        let [verdict, again] = links.each_mut().map(|link| link.judge(now, receiver, &header));
        assert_eq!(verdict, again);
        check(&spec, verdict, (source, receiver), now.since(Nanos(7)));
    }
}

/// Holds `verdict` on a sample from one craft to another against the spec.
fn check(spec: &LinkSpec, verdict: Verdict, (from, to): (CraftId, CraftId), passed_ns: u64) {
    let stops = |from, to| spec.outages.iter().any(|outage| outage.stops(passed_ns, from, to));
    assert_eq!(stops(from, to), stops(to, from), "an outage of one direction");
    assert_eq!(verdict == Verdict::CutOff, stops(from, to));
    let may_double = spec.duplication_per_billion > 0;
    let delay_ns = match verdict {
        Verdict::CutOff => return,
        Verdict::Drop => return assert!(spec.loss_per_billion > 0),
        Verdict::Pass => 0,
        Verdict::Delay(delay_ns) | Verdict::Overtaken(delay_ns) => delay_ns,
        Verdict::Duplicate => return assert!(may_double),
        Verdict::Doubled { delay_ns, .. } => {
            assert!(may_double);
            delay_ns
        }
    };
    assert!(spec.loss_per_billion < 1_000_000_000, "everything is lost");
    assert!(delay_ns >= spec.delay_ns(from, to));
    assert_eq!(spec.delay_ns(from, to), spec.delay_ns(to, from));
    let is_quick = spec.jitter_ns == 0 && spec.bandwidth_bits_per_s.is_none();
    assert!(!is_quick || delay_ns == spec.delay_ns(from, to));
    assert!(spec.acts() || verdict == Verdict::Pass);
}

/// A link that does nothing, one that loses and delays, one with outages and crafts far from each other.
pub(super) fn seeds() -> Vec<Vec<u8>> {
    let samples: Vec<u8> = (0..6_u8)
        .flat_map(|at| [&[at % 3, (at + 1) % 3, 16, 0][..], &u64::from(at).to_le_bytes()].concat())
        .collect();
    let link = |rates: [u32; 2], times: [u64; 3], outages: &[u8], positions: &[u8]| {
        let rates = rates.iter().flat_map(|rate| rate.to_le_bytes());
        let times = times.iter().flat_map(|time| time.to_le_bytes());
        let head: Vec<u8> = rates.chain(times).collect();
        [&head[..], outages, positions, &samples].concat()
    };
    let outage = |whom: &[u8]| [&2_u64.to_le_bytes()[..], &4_u64.to_le_bytes(), whom].concat();
    let outages = [&[2][..], &outage(&[0, 0, 1]), &outage(&[2, 0, 2])].concat();
    let positions = [&[2][..], &[3; 48]].concat();
    vec![
        link([0, 0], [0, 0, 0], &[0], &[0]),
        link([250_000_000, 50_000_000], [1_000, 500, 9_601], &[0], &[0]),
        link([0, 0], [0, 0, 0], &outages, &positions),
    ]
}
