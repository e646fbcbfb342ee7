//! What a strategy costs, and how late knowledge comes, on links that lose a share of all samples.
//!
//! The fleets and traces of campaigns, with nothing befalling them but loss, from the first sample to the
//! last: replication, repeats, receipts and states alike. Every case is held against the laws, so that
//! every change has reached every board that shares its fact.

use super::{Case, Fault, Played, Stage, Violation, What};
use crate::metrics::read_histogram;
use hdrhistogram::Histogram;
use shared_types::wire::StrategyKind;

/// What cases of one strategy at one loss took together.
#[derive(Clone, Debug)]
pub struct Lossy {
    /// Samples lost, of a thousand.
    pub permille: u32,
    /// What the cases took.
    pub played: Played,
    /// Changes that boards of others had to learn.
    pub needed: u64,
    /// Changes that were applied there as deltas or replies.
    pub applied: u64,
    /// Time to knowledge of those, ns of the virtual clock.
    pub knowledge_ns: Histogram<u32>,
}

/// Plays `seeds` under `strategy` at a loss of `permille` in a thousand.
///
/// # Errors
/// The seed that broke a law, and which.
pub fn lossy(
    strategy: StrategyKind,
    permille: u32,
    seeds: std::ops::Range<u64>,
    stage: &mut Stage,
) -> Result<Lossy, (u64, Violation)> {
    let mut sum = Lossy {
        permille,
        played: Played::default(),
        needed: 0,
        applied: 0,
        knowledge_ns: Histogram::new(3).expect("invariant: three digits are allowed"),
    };
    for seed in seeds {
        let mut case = Case::of(seed, strategy);
        let what = What::Loss(permille);
        case.faults = vec![Fault { at_ns: 0, lasts_ns: Fault::FOR_EVER, what }];
        sum.played += case.play(stage, None).map_err(|violation| (seed, violation))?;
        let boards = &case.scene.network.view().boards;
        for (board, part) in boards.iter().zip(&case.scene.trace) {
            sum.needed +=
                part.iter().map(|record| board.targets(record.fact()).len() as u64).sum::<u64>();
        }
        for craft in stage.crafts.iter().take(boards.len()) {
            let Some(open) = craft.report().open else { continue };
            sum.applied += open.applied_from.iter().sum::<u64>();
            let slices = open.knowledge_slices.iter();
            for slice in slices.filter_map(|slice| read_histogram::<u32>(slice)) {
                sum.knowledge_ns += slice;
            }
        }
    }
    Ok(sum)
}
