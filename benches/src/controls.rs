//! How often a comparison finds what is there, and nothing else.
//!
//! Runs of the product with `--controls`, each with a seed of its own: in every one a strategy is
//! compared with itself, where no winner should be named, and with itself slowed down, where one
//! should. What is asked of `slateswarm` and where its answer lies stand in `arguments` and `Run::read`.

use crate::comparison;
use crate::program::{RatioError, ResultsDirectory, answer_of};
use serde_json::{Value, json};
use std::ffi::OsString;
use std::fmt;
use std::path::PathBuf;

/// Runs of the product with controls.
#[derive(Clone, Debug)]
pub struct Controls {
    /// The executable `slateswarm`.
    pub slateswarm: PathBuf,
    /// Crafts of a fleet.
    pub crafts: u32,
    /// Fresh fleets of a run.
    pub blocks: u32,
    /// Runs, with seeds from 1.
    pub runs: u32,
}

/// One control of one run.
#[derive(Clone, Debug, PartialEq)]
pub struct Control {
    /// Slower side over the other, or a strategy over itself.
    pub ratio: f64,
    /// What the product says: `winner`, `tie`, `too-few-blocks`, `noisy`.
    pub verdict: String,
}

/// What one run says.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// A strategy beside itself.
    pub itself: Control,
    /// The same beside itself, slowed down.
    pub slowed: Control,
}

/// All runs.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// By seed.
    pub runs: Vec<Run>,
}

impl Controls {
    /// Runs them all; `on_run` is told of each as it ends.
    ///
    /// # Errors
    /// If the program fails or prints no controls.
    pub fn run(&self, mut on_run: impl FnMut(&Run)) -> Result<Outcome, RatioError> {
        let mut runs = Vec::new();
        for seed in 1..=self.runs {
            let out = ResultsDirectory::of_this_process();
            let answer = answer_of(&self.slateswarm, &self.arguments(seed, &out))?;
            let run = Run::read(&answer).ok_or_else(|| RatioError::NoFigure {
                program: self.slateswarm.clone(),
                wanted: "controls",
            })?;
            on_run(&run);
            runs.push(run);
        }
        Ok(Outcome { runs })
    }

    fn arguments(&self, seed: u32, out: &ResultsDirectory) -> Vec<OsString> {
        let [crafts, blocks, seed] = [self.crafts, self.blocks, seed].map(|n| n.to_string());
        let what = ["compare", "--sizes", &crafts, "--blocks", &blocks, "--seed", &seed];
        let how = ["--strategies", "boundary,full", "--timing-only", "--controls"];
        let output = ["--format", "json", "--quiet", "--out"];
        let all = what.into_iter().chain(how).chain(output);
        all.map(OsString::from).chain([out.path().into()]).collect()
    }
}

impl Run {
    /// The controls of the product's answer.
    fn read(answer: &Value) -> Option<Self> {
        let controls = answer.pointer("/timing/controls")?.as_array()?;
        let of = |is_planted: bool| {
            let one = controls
                .iter()
                .find(|one| one["planted_percent"].as_u64().is_some_and(|p| (p > 0) == is_planted));
            let verdict = one?["verdict"].as_str()?.to_owned();
            Some(Control { ratio: one?["ratio"].as_f64()?, verdict })
        };
        Some(Self { itself: of(false)?, slowed: of(true)? })
    }
}

impl Outcome {
    /// Runs that named a winner between a strategy and itself.
    #[must_use]
    pub fn false_winners(&self) -> usize {
        self.runs.iter().filter(|run| run.itself.verdict == "winner").count()
    }

    /// Runs that found the slowdown.
    #[must_use]
    pub fn found(&self) -> usize {
        let is_found = |control: &Control| control.verdict == "winner" && control.ratio > 1.0;
        self.runs.iter().filter(|run| is_found(&run.slowed)).count()
    }

    /// Runs on a noisy host, which name no winner at all.
    #[must_use]
    pub fn noisy(&self) -> usize {
        self.runs.iter().filter(|run| run.itself.verdict == "noisy").count()
    }
}

impl comparison::Outcome for Outcome {
    fn to_json(&self) -> Value {
        let control = |one: &Control| json!({ "ratio": one.ratio, "verdict": one.verdict });
        let runs = self
            .runs
            .iter()
            .map(|run| json!({ "itself": control(&run.itself), "slowed": control(&run.slowed) }));
        json!({
            "runs": runs.collect::<Vec<_>>(),
            "false_winners": self.false_winners(),
            "found": self.found(),
            "noisy": self.noisy(),
        })
    }
}

impl fmt::Display for Control {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{:.3} {}", self.ratio, self.verdict)
    }
}

impl fmt::Display for Run {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "itself {}   slowed {}", self.itself, self.slowed)
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            formatter,
            "{} runs: {} named a winner between a strategy and itself, {} found the slowdown, {} were \
             noisy",
            self.runs.len(),
            self.false_winners(),
            self.found(),
            self.noisy()
        )
    }
}

#[cfg(test)]
mod tests {
    use super::{Outcome, Run};
    use serde_json::json;

    fn run(itself: &str, slowed: &str, ratio: f64) -> Run {
        let control = |planted: u32, verdict: &str, ratio: f64| json!({ "planted_percent": planted, "verdict": verdict, "ratio": ratio });
        let controls = [control(0, itself, 1.0), control(20, slowed, ratio)];
        Run::read(&json!({ "timing": { "controls": controls } })).unwrap()
    }

    #[test]
    fn only_a_slowdown_counts_as_found() {
        let runs = vec![
            run("tie", "winner", 1.2),
            run("winner", "winner", 0.8),
            run("tie", "tie", 1.1),
            run("noisy", "noisy", 1.2),
        ];
        let outcome = Outcome { runs };
        assert_eq!((outcome.false_winners(), outcome.found(), outcome.noisy()), (1, 1, 1));
    }

    #[test]
    fn an_answer_without_controls_is_refused() {
        assert_eq!(Run::read(&json!({ "timing": { "controls": [] } })), None);
        assert_eq!(Run::read(&json!({})), None);
    }
}
