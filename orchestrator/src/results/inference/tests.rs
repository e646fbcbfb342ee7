//! What is claimed of the statistics, on data whose truth is known.

use super::quantiles::{Resampler, Slice, excess_interval, interval as quantile_interval};
use super::{Pairing, Verdict, blocks_needed, compare, hodges_lehmann, holm, interval, sign_flip};
use shared_types::rng::{Purpose, Stream};

fn stream(run: u32, number: u32) -> Stream {
    Stream::new(7, run, Purpose::Test, number)
}

/// A normal number by the sum of twelve uniform ones.
fn normal(stream: &mut Stream) -> f64 {
    (0..12).map(|_| stream.unit()).sum::<f64>() - 6.0
}

/// Logarithms of ratios: `shift`, with noise of size `noise` on either side of each of `blocks`.
fn noisy(stream: &mut Stream, blocks: usize, shift: f64, noise: f64) -> Vec<f64> {
    (0..blocks).map(|_| shift + noise * (normal(stream) - normal(stream))).collect()
}

/// One run: `comparisons` pairs shifted by `shift`, against one floor.
fn verdicts(run: u32, blocks: usize, comparisons: u32, shift: f64, noise: f64) -> Vec<Verdict> {
    let mut draws = stream(run, 1000);
    let floor = noisy(&mut draws, blocks, 0.0, noise);
    let pairings = (0..comparisons).map(|number| Pairing {
        log_ratios: noisy(&mut draws, blocks, shift, noise),
        floor: floor.clone(),
        stream: stream(run, number),
    });
    let compared = compare(pairings.collect(), true);
    compared.into_iter().flatten().map(|one| one.verdict).collect()
}

#[test]
fn a_strategy_against_itself_wins_in_at_most_two_of_twenty_runs() {
    for comparisons in [1, 6] {
        let wrong = (0..20)
            .filter(|&run| verdicts(run, 9, comparisons, 0.0, 0.1).contains(&Verdict::Winner))
            .count();
        assert!(wrong <= 2, "{wrong} of 20 runs with {comparisons} comparisons");
    }
}

#[test]
fn a_slowdown_of_a_fifth_is_found_with_nine_blocks() {
    // A tenth of noise between blocks hits both sides of a pair alike; what is left is smaller.
    let paired =
        (0..20).filter(|&run| verdicts(run, 9, 12, 1.2_f64.ln(), 0.03)[0] == Verdict::Winner);
    assert_eq!(paired.count(), 20);
    let unpaired =
        (0..20).filter(|&run| verdicts(run, 9, 1, 1.2_f64.ln(), 0.1)[0] == Verdict::Winner);
    let found = unpaired.count();
    assert!(found >= 16, "{found} of 20, with a tenth of noise on either side of each pair");
}

#[test]
fn intervals_cover_the_truth_about_as_often_as_they_say() {
    let covered = (0..400)
        .filter(|&run| {
            let mut draws = stream(run, 0);
            let values = noisy(&mut draws, 9, 0.3, 0.1);
            let (low, high) = interval(&values, &mut draws).unwrap();
            low <= 0.3 && 0.3 <= high
        })
        .count();
    // 95 % of 400 are 380; a bootstrap of nine values is known to fall somewhat short.
    assert!((350..=398).contains(&covered), "{covered} of 400");
}

#[test]
fn too_few_blocks_and_noise_name_no_winner() {
    assert_eq!(verdicts(0, 8, 1, 1.0, 0.01), [Verdict::TooFewBlocks]);
    assert_eq!(verdicts(0, 9, 13, 1.0, 0.01), [Verdict::TooFewBlocks; 13]);
    assert_eq!(verdicts(0, 10, 13, 1.0, 0.01), [Verdict::Winner; 13]);
    let pair = |floor: Vec<f64>| Pairing { log_ratios: vec![0.5; 9], floor, stream: stream(0, 0) };
    let verdict = |floor: Vec<f64>, is_clean| {
        compare(vec![pair(floor)], is_clean)[0].clone().unwrap().verdict
    };
    assert_eq!(verdict(vec![0.1; 9], true), Verdict::Winner);
    assert_eq!(verdict(vec![0.1; 9], false), Verdict::Noisy);
    assert_eq!(verdict(vec![-0.6; 9], true), Verdict::Tie, "the floor is wider");
    assert_eq!(verdict(Vec::new(), true), Verdict::TooFewBlocks, "no floor was measured");
}

#[test]
fn twelve_comparisons_are_the_most_for_nine_blocks() {
    assert_eq!([0, 1, 12, 13, 25, 26].map(blocks_needed), [9, 9, 9, 10, 10, 11]);
}

#[test]
fn the_estimate_is_the_median_of_all_means_of_pairs() {
    assert_eq!(hodges_lehmann(&[]), None);
    assert_eq!(hodges_lehmann(&[3.0]), Some(3.0));
    // Means: 1, 1.5, 2, 5.5, 6, 10.
    assert_eq!(hodges_lehmann(&[10.0, 1.0, 2.0]), Some(3.75));
    // One wild block of nine does not carry the estimate away.
    let wild = [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 100.0];
    assert_eq!(hodges_lehmann(&wild), Some(1.0));
}

#[test]
fn the_sign_test_is_exact_for_few_blocks_and_agrees_with_drawing_for_many() {
    let p = |values: &[f64]| sign_flip(values, &mut stream(0, 0));
    assert_eq!(p(&[]), 1.0);
    assert_eq!(p(&[0.0; 5]), 1.0);
    assert_eq!(p(&[0.1; 9]), 2.0 / 512.0);
    // Sums as far as 4: of 1, 2, 3, 4 with signs, |sum| >= 4 in 10 of 16.
    assert_eq!(p(&[1.0, 2.0, -3.0, 4.0]), 10.0 / 16.0);
    let mut draws = stream(3, 0);
    let many = noisy(&mut draws, 20, 0.05, 0.1);
    let padded: Vec<f64> = many.iter().copied().chain([0.0]).collect();
    assert!((p(&many) - p(&padded)).abs() < 0.01, "{} {}", p(&many), p(&padded));
}

#[test]
fn corrections_keep_the_order_and_never_exceed_one() {
    assert_eq!(holm(&[0.01, 0.04, 0.03]), [0.03, 0.06, 0.06]);
    assert_eq!(holm(&[0.9, 0.5]), [1.0, 1.0]);
    assert_eq!(holm(&[]), Vec::<f64>::new());
}

/// `blocks` blocks of four slices of 100 values around `base`, each block moved by up to `spread`.
fn slices(blocks: u32, base: u64, spread: u32) -> Vec<Vec<Slice>> {
    (0..blocks)
        .map(|block| {
            let mut draws = stream(block, 5);
            let moved = base + u64::from(draws.below(spread + 1));
            let mut slice = || (0..100).map(|_| (moved + u64::from(draws.below(10)), 1)).collect();
            (0..4).map(|_| slice()).collect()
        })
        .collect()
}

fn resampled(blocks: &[Vec<Slice>], number: u32) -> Option<Vec<super::quantiles::Resample>> {
    let blocks: Vec<&[Slice]> = blocks.iter().map(Vec::as_slice).collect();
    Some(Resampler::new(&blocks)?.resamples(stream(0, 0), stream(0, number)))
}

#[test]
fn an_interval_is_as_wide_as_blocks_differ() {
    let alike = resampled(&slices(9, 1000, 0), 1).unwrap();
    let (low, high) = quantile_interval(&alike, 0).unwrap();
    assert!(low >= 1003.0 && high <= 1006.0, "{low}-{high}");
    let unlike = resampled(&slices(9, 1000, 500), 1).unwrap();
    let (low, high) = quantile_interval(&unlike, 0).unwrap();
    assert!(high - low > 50.0, "{low}-{high}: blocks count, not the 3,600 values");
    assert_eq!(resampled(&slices(2, 1000, 0), 1), None, "two blocks have no interval");
}

#[test]
fn an_excess_is_taken_block_by_block() {
    // Blocks differ by up to 500; in each of them the second is slower by 100.
    let floor = resampled(&slices(9, 1000, 500), 1).unwrap();
    let own = resampled(&slices(9, 1100, 500), 1).unwrap();
    let (low, high) = excess_interval(&own, &floor, 0).unwrap();
    assert!(low > 90.0 && high < 110.0, "{low}-{high}");
}
