//! A power cut at any byte of a results directory: every file is cut at the ends of its lines and at
//! drawn bytes, as a part that remains and as a part that is followed by zeros.

use super::directories;
use shared_types::rng::{Purpose, Stream};
use std::collections::BTreeSet;

/// Ends of lines of one file; longer ones are cut at so many of theirs, the first and the last among
/// them.
const LINES_MAX: usize = 12;
/// Drawn bytes of one file.
const DRAWN: usize = 3;

/// Where `content` is cut.
fn cuts(content: &[u8], draws: &mut Stream) -> BTreeSet<usize> {
    let ends: Vec<usize> =
        (0..=content.len()).filter(|&end| end == 0 || content[end - 1] == b'\n').collect();
    let step = ends.len().div_ceil(LINES_MAX).max(1);
    let last = ends.iter().rev().take(3).copied();
    let bound = u32::try_from(content.len()).unwrap_or(u32::MAX).max(1);
    let drawn: Vec<usize> = (0..DRAWN).map(|_| draws.below(bound) as usize).collect();
    ends.iter().step_by(step).copied().chain(last).chain(drawn).collect()
}

fn after_cuts(seeds: Vec<Vec<u8>>, check: fn(&[u8])) {
    let mut draws = Stream::new(1, 0, Purpose::Test, 0);
    for seed in seeds {
        for cut in cuts(&seed[1..], &mut draws) {
            let mut left = seed[..=cut].to_vec();
            check(&left);
            left.resize(seed.len(), 0);
            check(&left);
        }
    }
}

#[test]
fn a_directory_reads_says_what_is_missing_and_is_reported_on() {
    after_cuts(directories::seeds(), directories::read);
}

#[test]
fn a_directory_is_gone_on_with_or_left_as_it_is() {
    after_cuts(directories::seeds(), directories::resume);
}

#[test]
fn a_campaign_reads_says_what_is_missing_and_is_reported_on() {
    after_cuts(directories::campaign_seeds(), directories::read_campaign);
}
