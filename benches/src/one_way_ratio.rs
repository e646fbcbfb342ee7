//! How Slateswarm's delta path compares one way with bare iceoryx2 and with Unix datagrams.
//!
//! Each triple runs `delta-one-way`, `raw-one-way` and `raw-one-way --over datagrams` one after the
//! other, all polling, in an order that takes every one of the six in turn, so that what the host does
//! meanwhile falls on all three; the results are medians of the ratios of medians.

use crate::comparison;
use crate::program::{RatioError, answer_of, figure, median};
use serde_json::{Value, json};
use std::ffi::OsString;
use std::fmt;
use std::path::PathBuf;

/// Fewest triples that a ratio may rest on.
pub const TRIPLES_MIN: u32 = 9;

/// The three that are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Contender {
    Delta,
    Iceoryx2,
    Datagrams,
}

/// Every order of the three.
const ORDERS: [[Contender; 3]; 6] = {
    use Contender::{Datagrams, Delta, Iceoryx2};
    [
        [Delta, Iceoryx2, Datagrams],
        [Iceoryx2, Datagrams, Delta],
        [Datagrams, Delta, Iceoryx2],
        [Datagrams, Iceoryx2, Delta],
        [Delta, Datagrams, Iceoryx2],
        [Iceoryx2, Delta, Datagrams],
    ]
};

/// What is compared.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// The executable `delta-one-way`.
    pub delta_one_way: PathBuf,
    /// The executable `raw-one-way`.
    pub raw_one_way: PathBuf,
    /// Triples, at least [`TRIPLES_MIN`].
    pub triples: u32,
}

/// Medians of one triple, ns.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Triple {
    /// Of Slateswarm's delta.
    pub delta_ns: f64,
    /// Of bare iceoryx2.
    pub iceoryx2_ns: f64,
    /// Of Unix datagrams.
    pub datagrams_ns: f64,
}

impl Triple {
    /// How much longer a delta takes than bare iceoryx2.
    #[must_use]
    pub fn over_iceoryx2(&self) -> f64 {
        self.delta_ns / self.iceoryx2_ns
    }

    /// How much longer Unix datagrams take than a delta.
    #[must_use]
    pub fn datagrams_over_delta(&self) -> f64 {
        self.datagrams_ns / self.delta_ns
    }
}

/// All triples of a comparison, in the order in which they ran.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// At least one.
    pub triples: Vec<Triple>,
}

impl Comparison {
    /// Runs all triples; `on_triple` is told of each as it ends.
    ///
    /// # Errors
    /// If one of the programs fails or prints no time.
    pub fn run(&self, mut on_triple: impl FnMut(&Triple)) -> Result<Outcome, RatioError> {
        let mut triples = Vec::new();
        for number in 0..self.triples as usize {
            let mut triple = Triple::default();
            for contender in ORDERS[number % ORDERS.len()] {
                let median_ns = self.measure(contender)?;
                match contender {
                    Contender::Delta => triple.delta_ns = median_ns,
                    Contender::Iceoryx2 => triple.iceoryx2_ns = median_ns,
                    Contender::Datagrams => triple.datagrams_ns = median_ns,
                }
            }
            on_triple(&triple);
            triples.push(triple);
        }
        Ok(Outcome { triples })
    }

    fn measure(&self, contender: Contender) -> Result<f64, RatioError> {
        let (program, arguments): (_, &[&str]) = match contender {
            Contender::Delta => (&self.delta_one_way, &[]),
            Contender::Iceoryx2 => (&self.raw_one_way, &["--over", "iceoryx2"]),
            Contender::Datagrams => (&self.raw_one_way, &["--over", "datagrams"]),
        };
        let arguments: Vec<OsString> =
            arguments.iter().chain(&["--format", "json"]).map(OsString::from).collect();
        let answer = answer_of(program, &arguments)?;
        figure(program, "median one-way time", answer.pointer("/time/p50"))
    }
}

impl Outcome {
    /// The median of the triples' ratios of a delta over bare iceoryx2.
    ///
    /// # Panics
    /// If there is no triple.
    #[must_use]
    pub fn over_iceoryx2(&self) -> f64 {
        self.median(Triple::over_iceoryx2)
    }

    /// The median of the triples' ratios of Unix datagrams over a delta.
    ///
    /// # Panics
    /// If there is no triple.
    #[must_use]
    pub fn datagrams_over_delta(&self) -> f64 {
        self.median(Triple::datagrams_over_delta)
    }

    fn median(&self, ratio: impl Fn(&Triple) -> f64) -> f64 {
        median(self.triples.iter().map(ratio)).expect("invariant: there is a triple")
    }
}

impl comparison::Outcome for Outcome {
    fn to_json(&self) -> Value {
        let to_json = |triple: &Triple| {
            json!({
                "delta_ns": triple.delta_ns,
                "raw_iceoryx2_ns": triple.iceoryx2_ns,
                "unix_datagrams_ns": triple.datagrams_ns,
                "delta_over_iceoryx2": triple.over_iceoryx2(),
                "datagrams_over_delta": triple.datagrams_over_delta(),
            })
        };
        json!({
            "triples": self.triples.iter().map(to_json).collect::<Vec<_>>(),
            "median_delta_over_iceoryx2": self.over_iceoryx2(),
            "median_datagrams_over_delta": self.datagrams_over_delta(),
        })
    }
}

impl fmt::Display for Triple {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [delta, iceoryx2, datagrams] =
            [self.delta_ns, self.iceoryx2_ns, self.datagrams_ns].map(|ns| ns / 1_000.0);
        write!(
            formatter,
            "delta {delta:.3} us   iceoryx2 {iceoryx2:.3} us   datagrams {datagrams:.3} us   \
             {:.3}   {:.3}",
            self.over_iceoryx2(),
            self.datagrams_over_delta()
        )
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.triples.iter().try_for_each(|triple| writeln!(formatter, "{triple}"))?;
        write!(
            formatter,
            "medians of {} triples: delta over raw iceoryx2 {:.3}, Unix datagrams over delta {:.3}",
            self.triples.len(),
            self.over_iceoryx2(),
            self.datagrams_over_delta()
        )
    }
}

#[cfg(test)]
mod tests {
    use super::{Contender, ORDERS, Outcome, Triple};

    #[test]
    fn the_ratios_are_medians_of_the_triples() {
        let triple = |delta_ns| Triple { delta_ns, iceoryx2_ns: 10.0, datagrams_ns: 60.0 };
        let outcome = Outcome { triples: [12.0, 90.0, 15.0].map(triple).into() };
        assert!((outcome.over_iceoryx2() - 1.5).abs() < 1e-12);
        assert!((outcome.datagrams_over_delta() - 4.0).abs() < 1e-12);
    }

    #[test]
    fn everybody_takes_every_place_equally_often() {
        for place in 0..3 {
            for contender in [Contender::Delta, Contender::Iceoryx2, Contender::Datagrams] {
                let times = ORDERS.iter().filter(|order| order[place] == contender).count();
                assert_eq!(times, 2, "{contender:?} in place {place}");
            }
        }
    }
}
