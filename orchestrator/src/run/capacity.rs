//! The search for capacity: the highest offered rate that a strategy bears.
//!
//! From a first guess the rate is doubled while it is borne, or halved until it is; then the gap between
//! the highest rate borne and the lowest not borne is halved, as a ratio, to within five percent. A rate
//! counts as not borne only if it failed twice, on two traces: one hiccup of the host is no capacity. A
//! rate that is borne is believed at once. Bounds: no search goes above the highest rate whose trace can
//! be kept, below the lowest, or on beyond so many probes. Not here: what a probe plays and when a rate
//! is borne (the caller).

use crate::results::load::Probe;

/// How a search goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Search {
    /// The rate tried first, writes per second of the fleet.
    pub first_per_s: f64,
    /// The lowest rate tried.
    pub lowest_per_s: f64,
    /// The highest rate tried.
    pub highest_per_s: f64,
    /// The search ends when the lowest rate that is not borne is at most so many times the highest that
    /// is.
    pub ratio: f64,
}

impl Default for Search {
    fn default() -> Self {
        Self { first_per_s: 20_000.0, lowest_per_s: 10.0, highest_per_s: 5e6, ratio: 1.05 }
    }
}

/// Most probes of one search: both bounds are within 20 doublings of each other, the rest is room for
/// repetitions.
const PROBES_MAX: usize = 64;

/// What a search found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Found {
    /// Every rate that was tried, in order.
    pub probes: Vec<Probe>,
    /// Index of the probe with the highest rate that was borne.
    pub borne: Option<usize>,
}

impl Search {
    /// The same search from where another one ended, if that found something.
    #[must_use]
    pub fn starting_at(self, per_s: Option<f64>) -> Self {
        let first = per_s.unwrap_or(self.first_per_s);
        Self { first_per_s: first.clamp(self.lowest_per_s, self.highest_per_s), ..self }
    }

    /// Searches. `play` offers a rate on a trace of its own and says how it went.
    ///
    /// # Errors
    /// What `play` fails with.
    pub fn run<E>(self, play: impl FnMut(f64) -> Result<Probe, E>) -> Result<Found, E> {
        let mut trial = Trial { play, found: Found::default() };
        let (mut borne, mut too_much) = (None, None);
        let mut rate = self.first_per_s.clamp(self.lowest_per_s, self.highest_per_s);
        while trial.found.probes.len() < PROBES_MAX {
            if trial.is_borne(rate)? {
                borne = Some(rate);
            } else {
                too_much = Some(rate);
            }
            rate = match (borne, too_much) {
                (Some(borne), None) if borne < self.highest_per_s => {
                    (borne * 2.0).min(self.highest_per_s)
                }
                (None, Some(too_much)) if too_much > self.lowest_per_s => {
                    (too_much / 2.0).max(self.lowest_per_s)
                }
                (Some(borne), Some(too_much)) if too_much / borne > self.ratio => {
                    (borne * too_much).sqrt()
                }
                _ => break,
            };
        }
        Ok(trial.found)
    }
}

/// A search under way.
struct Trial<F> {
    play: F,
    found: Found,
}

impl<E, F: FnMut(f64) -> Result<Probe, E>> Trial<F> {
    /// Whether `rate` is borne, at once or on a second trace.
    fn is_borne(&mut self, rate: f64) -> Result<bool, E> {
        for _ in 0..2 {
            let probe = (self.play)(rate)?;
            self.found.probes.push(probe);
            if probe.saturated.is_none() {
                let last = self.found.probes.len() - 1;
                let highest = self.found.borne.map(|index| self.found.probes[index].offered_per_s);
                if highest.is_none_or(|highest| probe.offered_per_s > highest) {
                    self.found.borne = Some(last);
                }
                return Ok(true);
            }
        }
        Ok(false)
    }
}

#[cfg(test)]
mod tests;
