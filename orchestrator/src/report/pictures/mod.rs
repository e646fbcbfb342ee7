//! The pictures of a run, each from the figures that its tables show. One picture a file.
//!
//! A picture that a run carries no data for is left out of the gallery; one whose data is damaged or
//! too little says so in its place. Not here: how charts are drawn (see [`super::svg`]), and where the
//! files go (see [`super::page`]).

pub mod by_hops;
pub mod capacity;
pub mod hops;
pub mod knowledge;
mod loads;
pub mod map;
pub mod requests;
mod rows_of_loads;
pub mod shares;
mod sizes;
pub mod staleness;
pub mod turn_time;

#[cfg(test)]
mod tests;

use super::compare::PublishedMean;
use super::svg::picture::Picture;
use crate::results::read::RunData;
use crate::results::summary::Summary;

/// Every picture that the run carries data for, in the order of the page.
#[must_use]
pub fn gallery(run: &RunData, summary: &Summary, published: &[PublishedMean]) -> Vec<Picture> {
    if summary.timing.loads.iter().any(|row| row.is_simulated) {
        // Pictures of times are of measured ones.
        return requests::requests(summary, published).into_iter().collect();
    }
    let mut pictures = knowledge::knowledge(run, summary);
    pictures.extend(shares::shares(summary));
    pictures.extend(by_hops::by_hops(summary));
    pictures.extend(hops::hops(summary));
    pictures.extend(staleness::staleness(summary));
    pictures.extend(capacity::capacity(summary));
    pictures.extend(turn_time::turn_time(summary));
    pictures.extend(requests::requests(summary, published));
    pictures
}
