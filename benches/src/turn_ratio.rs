//! How much longer a turn of Slateswarm takes than a bare all-to-all round: alternating pairs.
//!
//! Each pair runs `raw-round` and `slateswarm` one after the other, in alternating order, so that
//! what the host does meanwhile falls on both; the result is the median of the ratios of medians.
//! What is asked of `slateswarm` and where its answer lies stand in `arguments_of_slateswarm` and
//! `turn_of_slateswarm` and nowhere else.

use crate::comparison;
use crate::program::{RatioError, ResultsDirectory, answer_of, figure, median};
use serde_json::{Value, json};
use std::ffi::OsString;
use std::fmt;
use std::path::{Path, PathBuf};

/// Fewest pairs that a ratio may rest on.
pub const PAIRS_MIN: u32 = 9;

/// What is compared.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// The executable `raw-round`.
    pub raw_round: PathBuf,
    /// The executable `slateswarm`.
    pub slateswarm: PathBuf,
    /// Processes of a round, crafts of a turn.
    pub crafts: u32,
    /// Pairs, at least [`PAIRS_MIN`].
    pub pairs: u32,
}

/// Medians of one pair, ns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// Of the raw round.
    pub raw_ns: f64,
    /// Of Slateswarm's turn.
    pub turn_ns: f64,
}

impl Pair {
    /// Turn over round.
    #[must_use]
    pub fn ratio(&self) -> f64 {
        self.turn_ns / self.raw_ns
    }
}

/// All pairs of a comparison, in the order in which they ran.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// At least one.
    pub pairs: Vec<Pair>,
}

impl Comparison {
    /// Runs all pairs; `on_pair` is told of each as it ends.
    ///
    /// # Errors
    /// If one of the programs fails or prints no time.
    pub fn run(&self, mut on_pair: impl FnMut(&Pair)) -> Result<Outcome, RatioError> {
        let mut pairs = Vec::new();
        for number in 0..self.pairs {
            let pair = if number % 2 == 0 {
                let raw_ns = self.measure_raw()?;
                Pair { raw_ns, turn_ns: self.measure_turn()? }
            } else {
                let turn_ns = self.measure_turn()?;
                Pair { raw_ns: self.measure_raw()?, turn_ns }
            };
            on_pair(&pair);
            pairs.push(pair);
        }
        Ok(Outcome { pairs })
    }

    fn measure_raw(&self) -> Result<f64, RatioError> {
        let crafts = self.crafts.to_string();
        let arguments = ["--processes", &crafts, "--format", "json"].map(OsString::from);
        let answer = answer_of(&self.raw_round, &arguments)?;
        figure(&self.raw_round, "median round time", answer.pointer("/time/p50"))
    }

    fn measure_turn(&self) -> Result<f64, RatioError> {
        let out = ResultsDirectory::of_this_process();
        let arguments = arguments_of_slateswarm(self.crafts, out.path());
        let answer = answer_of(&self.slateswarm, &arguments)?;
        figure(&self.slateswarm, "median turn time", turn_of_slateswarm(&answer))
    }
}

/// What makes `slateswarm` measure turns of `crafts` polling crafts under `full`, with its results
/// below `out`.
fn arguments_of_slateswarm(crafts: u32, out: &Path) -> Vec<OsString> {
    let crafts = crafts.to_string();
    let arguments = ["compare", "--sizes", &crafts, "--strategies", "full", "--wake", "poll"];
    let output = ["--timing-only", "--format", "json", "--quiet", "--out"];
    arguments.into_iter().chain(output).map(OsString::from).chain([out.into()]).collect()
}

/// The median turn time in `answer`, ns.
fn turn_of_slateswarm(answer: &Value) -> Option<&Value> {
    let cells = answer.pointer("/timing/cells")?.as_array()?;
    let full = cells.iter().find(|cell| cell["strategy"] == "full")?;
    full.pointer("/figures/turn-time-p50").filter(|figure| figure["unit"] == "ns")?.get("value")
}

impl Outcome {
    /// The median of the pairs' ratios.
    ///
    /// # Panics
    /// If there is no pair.
    #[must_use]
    pub fn median_ratio(&self) -> f64 {
        median(self.pairs.iter().map(Pair::ratio)).expect("invariant: there is a pair")
    }
}

impl comparison::Outcome for Outcome {
    fn to_json(&self) -> Value {
        let to_json = |pair: &Pair| json!({ "raw_round_ns": pair.raw_ns, "turn_ns": pair.turn_ns, "ratio": pair.ratio() });
        json!({
            "pairs": self.pairs.iter().map(to_json).collect::<Vec<_>>(),
            "median_ratio": self.median_ratio(),
        })
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.pairs.iter().try_for_each(|pair| writeln!(formatter, "{pair}"))?;
        let (pairs, ratio) = (self.pairs.len(), self.median_ratio());
        write!(formatter, "median ratio of {pairs} pairs: {ratio:.3}")
    }
}

impl fmt::Display for Pair {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (raw_us, turn_us) = (self.raw_ns / 1_000.0, self.turn_ns / 1_000.0);
        write!(formatter, "round {raw_us:.2} us   turn {turn_us:.2} us   {:.3}", self.ratio())
    }
}

#[cfg(test)]
mod tests {
    use super::{Comparison, Outcome, Pair, RatioError, turn_of_slateswarm};
    use serde_json::json;
    use std::path::PathBuf;

    fn outcome(turns_ns: &[f64]) -> Outcome {
        let pair = |&turn_ns: &f64| Pair { raw_ns: 10.0, turn_ns };
        Outcome { pairs: turns_ns.iter().map(pair).collect() }
    }

    #[test]
    fn the_ratio_is_the_median_of_the_pairs() {
        let check = |turns_ns: &[f64], expected: f64| {
            assert!((outcome(turns_ns).median_ratio() - expected).abs() < 1e-12, "{turns_ns:?}");
        };
        check(&[20.0], 2.0);
        check(&[90.0, 10.0, 20.0], 2.0);
        check(&[90.0, 10.0, 20.0, 30.0], 2.5);
    }

    #[test]
    fn the_turn_time_is_that_of_full_in_nanoseconds() {
        let cell = |strategy: &str, unit: &str, value: f64| {
            let figures = json!({ "turn-time-p50": { "value": value, "unit": unit } });
            json!({ "size": 10, "strategy": strategy, "figures": figures })
        };
        let turn = |cells: [serde_json::Value; 2]| {
            turn_of_slateswarm(&json!({ "timing": { "cells": cells } })).cloned()
        };
        let null = cell("null", "ns", 1.0);
        assert_eq!(turn([null.clone(), cell("full", "ns", 2.0)]), Some(json!(2.0)));
        assert_eq!(turn([null.clone(), cell("full", "us", 2.0)]), None);
        assert_eq!(turn([null.clone(), null]), None);
    }

    #[test]
    fn a_missing_program_is_named_with_the_remedy() {
        let missing = PathBuf::from("no/such/program");
        let comparison =
            Comparison { raw_round: missing.clone(), slateswarm: missing, crafts: 2, pairs: 9 };
        let error = comparison.run(|_| {}).unwrap_err();
        assert!(matches!(error, RatioError::Start { .. }), "{error}");
        assert!(error.to_string().contains("no/such/program"), "{error}");
        assert!(error.to_string().contains("cargo build"), "{error}");
    }
}
