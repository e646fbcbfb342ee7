//! Why something holds, or why it did not come about, as sentences that fit a terminal.

use super::table::{WIDTH, clip, wrap};
use super::{Look, Report};
use serde::Serialize;

/// Columns of a craft's name.
const CRAFT_WIDTH: usize = 16;

/// Steps that the first screen shows: the last ones.
const STEPS_SHOWN: usize = 40;

/// Makers of one thing that the first screen shows.
const MAKERS_SHOWN: usize = 8;

/// Something that happened.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Step {
    /// In which turn, from 0.
    pub turn: u32,
    /// Who did it.
    pub craft: String,
    /// `fires` (a rule), `runs` (an action) or `tells` (another craft).
    pub does: &'static str,
    /// The rule, the action, or the facts told.
    pub what: String,
    /// What of it mattered: facts that it wrote, actions that it queued.
    pub gives: Vec<String>,
    /// Who was told.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub to: Option<String>,
    /// Crafts by which the change went.
    pub through: Vec<String>,
}

/// Something that is missing.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Lack {
    /// Craft and fact.
    pub what: String,
    /// What it is instead.
    pub state: String,
    /// Who could bring it about.
    pub makers: Vec<Maker>,
}

/// Who could bring something about.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Maker {
    /// Who.
    pub craft: String,
    /// The rule or action.
    pub what: String,
    /// Why it has not, or when it has.
    pub standing: String,
}

/// The answer to one question.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Explanation {
    /// Craft and name of what was asked about.
    pub subject: String,
    /// `fact`, `rule` or `action`.
    pub kind: &'static str,
    /// How it stands at the end of the trial.
    pub verdict: String,
    /// What led there, in the order in which it happened.
    pub steps: Vec<Step>,
    /// What held from the start.
    pub rests_on: Vec<String>,
    /// What is missing.
    pub lacks: Vec<Lack>,
    /// Seed of the run.
    pub seed: u64,
    /// Trial of the seed.
    pub trial: u32,
    /// Turns of the trial.
    pub turns: u32,
    /// How it ended.
    pub end: &'static str,
    /// By whose way changes went.
    pub strategy: &'static str,
    /// Whether the run recorded this very path; absent if it recorded no such trial.
    pub is_recorded_path: Option<bool>,
}

impl Report for Explanation {
    fn table(&self, look: Look) -> String {
        let mut text = wrap("", &format!("{} {}", self.subject, self.verdict));
        if !self.steps.is_empty() {
            text += "\n";
            text += &self.steps_table(look.all);
        }
        if !self.rests_on.is_empty() {
            text += "\n";
            text += &wrap("from the start  ", &self.rests_on.join(", "));
        }
        for lack in &self.lacks {
            text += "\n";
            text += &lack_text(lack, look.all);
        }
        text += "\n";
        text + &wrap("", &self.source())
    }

    fn json(&self) -> String {
        let text = serde_json::to_string_pretty(self).expect("invariant: answers are plain data");
        text + "\n"
    }

    fn csv(&self) -> String {
        let mut writer = csv::Writer::from_writer(Vec::new());
        let mut row = |cells: [&str; 6]| {
            writer.write_record(cells).expect("invariant: every row has the header's length");
        };
        row(["part", "turn", "craft", "does", "what", "detail"]);
        row(["verdict", "", "", "", &self.subject, &self.verdict]);
        for step in &self.steps {
            let detail = step.to.clone().unwrap_or_else(|| step.gives.join(" "));
            row(["step", &step.turn.to_string(), &step.craft, step.does, &step.what, &detail]);
        }
        for fact in &self.rests_on {
            row(["initial", "", "", "", fact, ""]);
        }
        for lack in &self.lacks {
            row(["lack", "", "", "", &lack.what, &lack.state]);
            for maker in &lack.makers {
                row(["maker", "", &maker.craft, "", &maker.what, &maker.standing]);
            }
        }
        let bytes = writer.into_inner().expect("invariant: memory takes every row");
        String::from_utf8(bytes).expect("invariant: rows are made of text")
    }
}

impl Explanation {
    fn steps_table(&self, all: bool) -> String {
        let longest = self.steps.iter().map(|step| step.craft.chars().count()).max();
        let width = longest.unwrap_or(0).clamp(5, CRAFT_WIDTH);
        let hidden = if all { 0 } else { self.steps.len().saturating_sub(STEPS_SHOWN) };
        let mut text = format!("turn  {:<width$}  what it did\n", "craft");
        if hidden > 0 {
            text += &format!("{:>4}  {hidden} earlier steps: --all shows them\n", "");
        }
        for step in &self.steps[hidden..] {
            let does = match &step.to {
                Some(craft) if step.through.is_empty() => {
                    format!("tells {craft} {}", step.what)
                }
                Some(craft) => {
                    format!("tells {craft} {} through {}", step.what, step.through.join(", "))
                }
                None if step.gives.is_empty() => format!("{} `{}`", step.does, step.what),
                None => format!("{} `{}`: {}", step.does, step.what, step.gives.join(", ")),
            };
            let craft = clip(&step.craft, width);
            text += &wrap(&format!("{:>4}  {craft:<width$}  ", step.turn), &does);
        }
        text
    }

    /// Where the answer comes from, and how far it can be relied upon.
    fn source(&self) -> String {
        let trial = format!(
            "trial {} of seed {} {} after {} turns; ways of `{}`",
            self.trial, self.seed, self.end, self.turns, self.strategy
        );
        let checked = match self.is_recorded_path {
            Some(true) => "replayed from scenario and seed, and of the recorded path",
            Some(false) => {
                "REPLAYED ON ANOTHER PATH than the recorded one: another version of the program?"
            }
            None => "replayed from scenario and seed; the run recorded no such trial",
        };
        format!("{trial}; {checked}")
    }
}

fn lack_text(lack: &Lack, all: bool) -> String {
    let mut text = wrap("missing  ", &format!("{}, which is {}", lack.what, lack.state));
    if lack.makers.is_empty() {
        text += &wrap("         ", "nothing on any board asserts it");
    }
    let shown = if all { usize::MAX } else { MAKERS_SHOWN };
    for maker in lack.makers.iter().take(shown) {
        let Maker { craft, what, standing } = maker;
        text += &wrap("  could  ", &format!("{craft}: `{what}`, which {}", verb(standing)));
    }
    let hidden = lack.makers.len().saturating_sub(shown);
    if hidden > 0 {
        text += &clip(&format!("         and {hidden} more: --all shows them"), WIDTH);
        text += "\n";
    }
    text
}

/// A standing as the end of a sentence.
fn verb(standing: &str) -> String {
    match standing.split_once(' ') {
        Some(("queued", rest)) => format!("was queued {rest}"),
        Some(("never", rest)) => format!("was never {rest}"),
        _ => standing.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::{Explanation, Lack, Maker, Step};
    use crate::report::{Look, Report};

    fn explanation() -> Explanation {
        let step = |turn, does, to: Option<&str>| Step {
            turn,
            craft: "a-craft-with-a-long-name".to_owned(),
            does,
            what: "if a and b then c ".repeat(6).trim_end().to_owned(),
            gives: vec!["c".to_owned()],
            to: to.map(str::to_owned),
            through: vec!["leader".to_owned()],
        };
        let maker = |standing: &str| Maker {
            craft: "b".to_owned(),
            what: "look".to_owned(),
            standing: standing.to_owned(),
        };
        Explanation {
            subject: "a: c".to_owned(),
            kind: "fact",
            verdict: "holds, since turn 4".to_owned(),
            steps: vec![step(3, "fires", None), step(4, "tells", Some("b"))],
            rests_on: vec!["a: a".to_owned()],
            lacks: vec![Lack {
                what: "b: d".to_owned(),
                state: "unknown".to_owned(),
                makers: ["never queued", "lacks x", "queued in turn 3, not run"]
                    .map(maker)
                    .to_vec(),
            }],
            turns: 6,
            end: "finished",
            strategy: "hierarchy",
            is_recorded_path: Some(true),
            ..Explanation::default()
        }
    }

    #[test]
    fn an_answer_fits_80_columns_and_says_where_it_comes_from() {
        let text = explanation().table(Look::default());
        for part in [
            "a: c holds, since turn 4",
            "tells b",
            "through leader",
            "from the start  a: a",
            "missing  b: d, which is unknown",
            "b: `look`, which was never queued",
            "which lacks x",
            "was queued in turn 3, not run",
            "of the recorded path",
        ] {
            assert!(text.contains(part), "{part}: {text}");
        }
        assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
        let other = Explanation { is_recorded_path: Some(false), ..explanation() };
        assert!(other.table(Look::default()).contains("ANOTHER PATH"));
    }

    #[test]
    fn long_chains_show_their_end() {
        let step = explanation().steps[0].clone();
        let long = Explanation { steps: vec![step; 50], ..explanation() };
        assert!(long.table(Look::default()).contains("10 earlier steps"));
        let all = Look { all: true, ..Look::default() };
        assert!(!long.table(all).contains("earlier steps"));
        assert_eq!(long.csv().lines().count(), 1 + 1 + 50 + 1 + 1 + 3);
        assert!(long.json().contains("\"is_recorded_path\": true"));
    }
}
