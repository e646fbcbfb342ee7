//! The links before one real process: what they would lose is left unread, what they hold up is copied out
//! of shared memory and comes later.
//!
//! A verdict is given on each sample that another craft sent, by the judge of the simulator and for the
//! time at which it was published, before its number is looked at: its receiver cannot tell a sample that
//! was lost from one that was never sent. A sample that comes later than its link would have brought it has
//! waited enough. What is repeated says when it was published first, and is judged for when it is taken.
//! Not here: the verdicts ([`super::link::StatedLink`]), and when links act (the shell, by
//! [`super::Endpoint::expose`]).

use super::held::{Copied, Held};
use super::intake::Through;
use super::link::{Link as _, LinkCounts, StatedLink, Verdict};
use crate::ids::CraftId;
use crate::time::Nanos;
use crate::wire::{Class, Header};

/// The links to one process.
#[derive(Debug)]
pub(super) struct Incoming {
    own: CraftId,
    link: StatedLink,
    held: Held,
    /// By sender, unicasts and multicasts apart.
    ways: Vec<[Way; 2]>,
    counts: LinkCounts,
}

/// What comes from one sender through one service.
#[derive(Clone, Copy, Debug, Default)]
struct Way {
    /// When the latest of them is due that others must not overtake.
    latest_due: Nanos,
    /// The latest of those that have come.
    latest: u64,
}

impl Incoming {
    /// The links from `craft_count` crafts, the centre counted, to `own`.
    pub(super) fn new(link: StatedLink, own: CraftId, craft_count: u32) -> Self {
        let ways = vec![[Way::default(); 2]; craft_count as usize];
        Self { own, link, held: Held::default(), ways, counts: LinkCounts::default() }
    }

    /// Takes a sample at `now` as it lies in shared memory; says how often it arrives at once: 0 times if
    /// it is lost or held up.
    pub(super) fn take(
        &mut self,
        now: Nanos,
        through: Through,
        header: &Header,
        payload: &[u8],
    ) -> u32 {
        let Self { own, link, held, ways, counts } = self;
        let is_own = header.source == own.0;
        let Some(ways) = ways.get_mut(header.source as usize).filter(|_| !is_own) else { return 1 };
        let is_repeated = header.class == Class::Repair as u8;
        let sent = if is_repeated { now } else { Nanos(header.published_ns) };
        let verdict = link.judge(sent, *own, header);
        counts.count(verdict);
        let (times, delay_ns, keeps_order) = match verdict {
            Verdict::Pass => (1, 0, true),
            Verdict::Delay(delay_ns) => (1, delay_ns, true),
            Verdict::Overtaken(delay_ns) => (1, delay_ns, false),
            Verdict::Duplicate => (2, 0, true),
            Verdict::Doubled { delay_ns, keeps_order } => (2, delay_ns, keeps_order),
            Verdict::Drop | Verdict::CutOff => return 0,
        };
        if delay_ns == 0 && held.is_empty() {
            return times;
        }
        let way = &mut ways[usize::from(through != Through::Inbox)];
        let mut due = sent.plus(delay_ns);
        if keeps_order {
            due = due.max(way.latest_due);
            way.latest_due = due;
        }
        for _ in 0..times {
            counts.lost += u64::from(!held.keep(due, through, header, payload));
        }
        0
    }

    /// The next sample that was held up and is due at `now`.
    pub(super) fn release(&mut self, now: Nanos) -> Option<&Copied> {
        let (number, copy) = self.held.release(now)?;
        let ways = &mut self.ways[copy.header.source as usize];
        let way = &mut ways[usize::from(copy.through != Through::Inbox)];
        self.counts.overtaken += u64::from(number < way.latest);
        way.latest = way.latest.max(number);
        Some(copy)
    }

    /// When the next of the samples that are held up is due.
    pub(super) fn next_due(&self) -> Option<Nanos> {
        self.held.next_due()
    }

    /// What the links did since the last call.
    pub(super) fn take_counts(&mut self) -> LinkCounts {
        std::mem::take(&mut self.counts)
    }
}

#[cfg(test)]
mod tests;
