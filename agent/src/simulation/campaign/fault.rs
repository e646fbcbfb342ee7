//! What befalls a fleet: a list drawn from a seed, as plain values.
//!
//! Every fault has a beginning and a length and stands for itself, so that any part of a list is a list.

use shared_types::ids::CraftId;
use shared_types::rng::{Purpose, Stream};
use shared_types::wire::StrategyKind;

/// One thing that befalls a fleet, from when on, for how long.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fault {
    /// When it begins, ns from the start.
    pub at_ns: u64,
    /// How long it lasts, ns. A craft that is killed for [`Fault::FOR_EVER`] does not come back.
    pub lasts_ns: u64,
    /// What it is.
    pub what: What,
}

/// What befalls a fleet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum What {
    /// A process ends without a word; after the fault's length another life of it begins.
    Kill(CraftId),
    /// A process does nothing and its inboxes fill.
    Pause(CraftId),
    /// Links lose samples, of a thousand this many.
    Loss(u32),
    /// Links take longer, ns.
    Delay(u32),
    /// Links deliver samples twice, of a thousand this many.
    Duplication(u32),
    /// Links let samples be overtaken, of a thousand this many.
    Reordering(u32),
    /// Nothing passes between the crafts whose bits are set and the others.
    Partition(u32),
}

impl Fault {
    /// The length of what does not end.
    pub const FOR_EVER: u64 = u64::MAX;

    /// Whether it acts at `now_ns`.
    #[must_use]
    pub const fn acts(&self, now_ns: u64) -> bool {
        self.at_ns <= now_ns && now_ns - self.at_ns < self.lasts_ns
    }
}

impl std::fmt::Display for Fault {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { at_ns, lasts_ns, what } = self;
        let us = |ns: u64| ns / 1_000;
        write!(formatter, "{:>7} us  ", us(*at_ns))?;
        let length = match *lasts_ns {
            Self::FOR_EVER => "for ever".to_owned(),
            lasts_ns => format!("for {} us", us(lasts_ns)),
        };
        match what {
            What::Kill(craft) => write!(formatter, "kill {craft} {length}"),
            What::Pause(craft) => write!(formatter, "pause {craft} {length}"),
            What::Loss(permille) => write!(formatter, "lose {permille} of 1000 {length}"),
            What::Delay(ns) => write!(formatter, "delay by {} us {length}", us(u64::from(*ns))),
            What::Duplication(permille) => write!(formatter, "double {permille} of 1000 {length}"),
            What::Reordering(permille) => write!(formatter, "reorder {permille} of 1000 {length}"),
            What::Partition(crafts) => write!(formatter, "cut off {crafts:#b} {length}"),
        }
    }
}

/// What befalls a fleet of `crafts` crafts under `strategy` within about `span_ns` as `seed` says, by time.
#[must_use]
pub fn draw(seed: u64, crafts: u32, strategy: StrategyKind, span_ns: u32) -> Vec<Fault> {
    let mut stream = Stream::new(seed, 0, Purpose::Faults, strategy as u32);
    let count = stream.between(1, 6);
    let mut faults: Vec<Fault> = (0..count)
        .map(|_| {
            let at_ns = u64::from(stream.below(span_ns));
            let mut lasts_ns = u64::from(stream.between(span_ns / 120, span_ns / 3));
            let craft = CraftId(stream.below(crafts));
            let what = match stream.below(9) {
                0..=2 => {
                    if stream.below(4) == 0 {
                        lasts_ns = Fault::FOR_EVER;
                    }
                    What::Kill(craft)
                }
                3 => What::Pause(craft),
                4 => What::Loss(stream.between(50, 750)),
                5 => What::Delay(stream.between(span_ns / 480, span_ns / 12)),
                6 => What::Duplication(stream.between(50, 500)),
                7 => What::Reordering(stream.between(50, 500)),
                _ => What::Partition(stream.between(1, (1 << crafts) - 2)),
            };
            Fault { at_ns, lasts_ns, what }
        })
        .collect();
    // A centre that fails comes back: without one nobody learns anything any more.
    if strategy.has_centre() && stream.below(3) == 0 {
        let at_ns = u64::from(stream.below(span_ns));
        let lasts_ns = u64::from(stream.between(span_ns / 120, span_ns / 3));
        faults.push(Fault { at_ns, lasts_ns, what: What::Kill(CraftId(crafts)) });
    }
    faults.sort_by_key(|fault| fault.at_ns);
    faults
}
