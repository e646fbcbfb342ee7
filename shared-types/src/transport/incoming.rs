//! Loss on the ways to one real process: shared memory loses nothing, so what a link would lose is left
//! unread.
//!
//! Every way (one sender, one receiver) has a random stream of its own, and a verdict is drawn for each
//! sample that crafts exchange, repeats and receipts included, before its number is looked at: its receiver
//! cannot tell it from one that was never sent. What the orchestrator sends is no radio traffic. Not here:
//! the drawing ([`super::link`]), and in which epochs it acts (the shell, by [`super::Endpoint::expose`]).

use super::link::{Link as _, Lossy, Verdict};
use crate::ids::CraftId;
use crate::time::Nanos;
use crate::wire::Header;
use std::fmt;
use std::str::FromStr;

/// Samples of a million.
const MILLION: f64 = 1e6;

/// What links lose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LinkLoss {
    /// Of a million samples.
    pub per_million: u32,
    /// Seed of the draws.
    pub seed: u64,
}

impl LinkLoss {
    /// Links that lose the share `loss`, drawn from `seed`; `None` if they lose nothing.
    #[must_use]
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a share lies between 0 and 1, and a scenario's is checked"
    )]
    pub fn of(loss: f64, seed: u64) -> Option<Self> {
        let per_million = (loss * MILLION).round() as u32;
        (per_million > 0).then_some(Self { per_million, seed })
    }
}

impl fmt::Display for LinkLoss {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}:{}", self.per_million, self.seed)
    }
}

impl FromStr for LinkLoss {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let parts = text.split_once(':');
        let read = parts.and_then(|(loss, seed)| {
            Some(Self { per_million: loss.parse().ok()?, seed: seed.parse().ok()? })
        });
        read.filter(|loss| f64::from(loss.per_million) < MILLION)
            .ok_or_else(|| format!("`{text}` is no loss per million and seed, such as `250000:1`"))
    }
}

/// The ways to one process.
#[derive(Debug)]
pub(super) struct Incoming {
    loss: LinkLoss,
    own: CraftId,
    /// By sender.
    ways: Vec<Option<Lossy>>,
    is_exposed: bool,
}

impl Incoming {
    /// The ways from `craft_count` crafts to `own`, not exposed yet.
    pub(super) fn new(loss: LinkLoss, own: CraftId, craft_count: u32) -> Self {
        let ways = (0..craft_count).map(|_| None).collect();
        Self { loss, own, ways, is_exposed: false }
    }

    /// Whether anything may be lost from now on.
    pub(super) const fn expose(&mut self, is_exposed: bool) {
        self.is_exposed = is_exposed;
    }

    /// Whether the sample of `header` is lost on its way here.
    #[inline]
    pub(super) fn loses(&mut self, header: &Header) -> bool {
        let is_radio = header.class().is_some_and(crate::wire::Class::is_between_crafts);
        if !self.is_exposed || !is_radio {
            return false;
        }
        let LinkLoss { per_million, seed } = self.loss;
        let (own, count) = (self.own, self.ways.len());
        let Some(way) = self.ways.get_mut(header.source as usize) else { return false };
        let lossy = way.get_or_insert_with(|| {
            let number = CraftId::from_index(header.source as usize * count + own.index()).0;
            Lossy::on_way(seed, number, f64::from(per_million) / MILLION)
        });
        lossy.judge(Nanos(0), own, header) == Verdict::Drop
    }
}

#[cfg(test)]
mod tests {
    use super::{CraftId, Header, Incoming, LinkLoss};
    use crate::wire::{Class, Kind};

    const LOSS: LinkLoss = LinkLoss { per_million: 250_000, seed: 7 };

    fn lost(incoming: &mut Incoming, source: u32, class: Class) -> Vec<bool> {
        let mut header = Header::new(class, Kind::Delta);
        header.source = source;
        (0..4_000).map(|_| incoming.loses(&header)).collect()
    }

    #[test]
    fn a_quarter_is_lost_the_same_in_every_run_and_other_on_every_way() {
        let mut incoming = Incoming::new(LOSS, CraftId(2), 4);
        assert!(lost(&mut incoming, 1, Class::Replication).iter().all(|is_lost| !is_lost));
        incoming.expose(true);
        let first = lost(&mut incoming, 1, Class::Replication);
        let count = first.iter().filter(|&&is_lost| is_lost).count();
        assert!((900..1_100).contains(&count), "{count}");
        let mut again = Incoming::new(LOSS, CraftId(2), 4);
        again.expose(true);
        // What comes on another way moves no draw of this one.
        assert_ne!(lost(&mut again, 0, Class::Repair), first);
        assert_eq!(lost(&mut again, 1, Class::Ack), first);
        let mut other = Incoming::new(LOSS, CraftId(1), 4);
        other.expose(true);
        assert_ne!(lost(&mut other, 2, Class::Reply), first);
    }

    #[test]
    fn what_the_orchestrator_says_always_arrives() {
        let mut incoming = Incoming::new(LOSS, CraftId(2), 4);
        incoming.expose(true);
        let control = lost(&mut incoming, CraftId::ORCHESTRATOR.0, Class::Control);
        assert!(control.into_iter().all(|is_lost| !is_lost));
        assert!(lost(&mut incoming, 9, Class::Replication).into_iter().all(|is_lost| !is_lost));
    }

    #[test]
    fn a_loss_reads_as_it_is_written() {
        assert_eq!(LOSS.to_string().parse(), Ok(LOSS));
        assert_eq!(LinkLoss::of(0.25, 7), Some(LOSS));
        assert_eq!(LinkLoss::of(0.0, 7), None);
        for wrong in ["", "250000", "1000000:1", "-1:1", "1:x"] {
            assert!(wrong.parse::<LinkLoss>().is_err_and(|error| error.contains("250000:1")));
        }
    }
}
