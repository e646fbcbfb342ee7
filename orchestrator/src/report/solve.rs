//! The cheapest way to a mission's end, step by step.

use super::table::{WIDTH, clip, exact, wrap};
use super::{Look, Report};
use serde::Serialize;

/// Goals beside the best that the first screen shows.
const GOALS_SHOWN: usize = 5;

/// Columns of a craft's name.
const CRAFT_WIDTH: usize = 16;

/// One final fact.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Goal {
    /// Craft and fact.
    pub fact: String,
    /// Its least cost; absent if it cannot be reached.
    pub cost: Option<f64>,
}

/// One thing to do.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Step {
    /// Who.
    pub craft: String,
    /// The rule that it runs, or the fact that it tells.
    pub runs: String,
    /// The rule's actions that are needed.
    pub actions: Vec<String>,
    /// The craft that is told; absent for a rule.
    pub tells: Option<String>,
}

/// Another way to the same goal.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Way {
    /// What it costs.
    pub cost: f64,
    /// What to do.
    pub steps: Vec<Step>,
}

/// An outcome of the plan's actions.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Likely {
    /// How likely it is.
    pub likelihood: f64,
    /// Actions that do not bring about what they presume.
    pub failing: Vec<String>,
    /// What the goal costs where these cannot succeed; absent if it is out of reach then.
    pub cost: Option<f64>,
}

/// What `solve` found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Solution {
    /// Name of the scenario.
    pub mission: String,
    /// How the costs of premises make one: `sum` or `max`.
    pub combine: &'static str,
    /// Every final fact, the cheapest first.
    pub goals: Vec<Goal>,
    /// Least cost of the cheapest goal; absent if none can be reached.
    pub cost: Option<f64>,
    /// Cost of its steps when each is run once.
    pub cost_once: Option<f64>,
    /// Turns that it takes when every craft does its steps in their order.
    pub turns: Option<u32>,
    /// What to do, in an order in which it can be done.
    pub steps: Vec<Step>,
    /// What must hold already.
    pub rests_on: Vec<String>,
    /// What was taken to be known absent.
    pub absent: Vec<String>,
    /// Further ways, the cheapest first.
    pub ways: Vec<Way>,
    /// Outcomes of the plan's actions, the likeliest first.
    pub outcomes: Vec<Likely>,
    /// Facts, rules, actions and links that some way to some goal can need.
    pub kept: [usize; 4],
    /// How many there are.
    pub of: [usize; 4],
}

impl Report for Solution {
    fn table(&self, look: Look) -> String {
        let mut text = format!("{}\n", look.colour.heading(&clip(&self.mission, WIDTH)));
        match (self.goals.first(), self.cost) {
            (Some(goal), Some(cost)) => {
                let once = exact(self.cost_once, 1);
                text += &wrap("goal   ", &goal.fact);
                text += &wrap(
                    "cost   ",
                    &format!(
                        "{} ({} of premises); {once} if each step is run once",
                        exact(Some(cost), 1),
                        self.combine
                    ),
                );
                if let Some(turns) = self.turns {
                    text +=
                        &wrap("time   ", &format!("{turns} turns, every craft its steps in order"));
                }
                text += &wrap("rests  ", &format!("on {}", self.rests_on.join(", ")));
                text += "\n";
                text += &steps_table(&self.steps);
                text += &self.alternatives();
            }
            _ => text += "no final fact can be reached from what holds at the start\n",
        }
        text += "\n";
        let [facts, rules, actions, links] = self.kept;
        let [all_facts, all_rules, all_actions, all_links] = self.of;
        text += &wrap(
            "needed ",
            &format!(
                "by some way to some goal: {facts} of {all_facts} facts, {rules} of {all_rules} \
                 rules, {actions} of {all_actions} actions, {links} of {all_links} links"
            ),
        );
        let others = self.goals.iter().skip(1);
        let shown = if look.all { usize::MAX } else { GOALS_SHOWN };
        for goal in others.clone().take(shown) {
            let cost =
                goal.cost.map_or_else(|| "unreachable".to_owned(), |cost| exact(Some(cost), 1));
            text += &wrap("also   ", &format!("{}: {cost}", goal.fact));
        }
        let hidden = others.count().saturating_sub(shown);
        if hidden > 0 {
            text += &wrap("       ", &format!("{hidden} further final facts: --all shows them"));
        }
        text
    }

    fn json(&self) -> String {
        let text = serde_json::to_string_pretty(self).expect("invariant: documents are plain data");
        text + "\n"
    }

    fn csv(&self) -> String {
        let mut writer = csv::Writer::from_writer(Vec::new());
        let mut row = |cells: [&str; 5]| {
            writer.write_record(cells).expect("invariant: every row has the header's length");
        };
        row(["step", "craft", "runs", "actions", "tells"]);
        for (number, step) in (1..).zip(&self.steps) {
            let (number, actions): (u32, String) = (number, step.actions.join(" "));
            let tells = step.tells.as_deref().unwrap_or_default();
            row([&number.to_string(), &step.craft, &step.runs, &actions, tells]);
        }
        let bytes = writer.into_inner().expect("invariant: memory takes every row");
        String::from_utf8(bytes).expect("invariant: rows are made of text")
    }
}

impl Solution {
    /// Further ways, each by what it does that the best does not, and outcomes.
    fn alternatives(&self) -> String {
        let mut text = String::new();
        for (number, way) in (2..).zip(&self.ways) {
            let others: Vec<Step> =
                way.steps.iter().filter(|step| !self.steps.contains(step)).cloned().collect();
            let cost = exact(Some(way.cost), 1);
            text += &format!("\nway {number}, cost {cost}; besides steps of the first:\n");
            text += &steps_table(&others);
        }
        if !self.outcomes.is_empty() {
            text += "\nlikely  outcome, and what the goal costs where that is for good\n";
        }
        for outcome in &self.outcomes {
            let what = if outcome.failing.is_empty() {
                "every action does what it presumes".to_owned()
            } else {
                format!("without {}", outcome.failing.join(", "))
            };
            let cost =
                outcome.cost.map_or_else(|| "out of reach".to_owned(), |cost| exact(Some(cost), 1));
            let lead = format!("{:>6}  ", exact(Some(outcome.likelihood), 3));
            text += &wrap(&lead, &format!("{what}: {cost}"));
        }
        text
    }
}

/// One line a step, aligned to the left: sentences, not numbers.
fn steps_table(steps: &[Step]) -> String {
    let longest = steps.iter().map(|step| step.craft.chars().count()).max();
    let width = longest.unwrap_or(0).min(CRAFT_WIDTH);
    let line = |(number, step): (usize, &Step)| {
        let does = match &step.tells {
            Some(craft) => format!("tells {craft} {}", step.runs),
            None if step.actions.is_empty() => step.runs.clone(),
            None => format!("{} -> {}", step.runs, step.actions.join(", ")),
        };
        let craft = clip(&step.craft, width);
        clip(&format!("{number:>4}  {craft:<width$}  {does}"), WIDTH) + "\n"
    };
    (1..).zip(steps).map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::{Goal, Likely, Solution, Step, Way};
    use crate::report::{Look, Report};

    fn solution() -> Solution {
        Solution {
            mission: "two".to_owned(),
            combine: "sum",
            goals: vec![
                Goal { fact: "b: seen".to_owned(), cost: Some(4.0) },
                Goal { fact: "a: lost".to_owned(), cost: None },
            ],
            cost: Some(4.0),
            cost_once: Some(3.0),
            steps: vec![
                Step {
                    craft: "a".to_owned(),
                    runs: "look".to_owned(),
                    actions: vec!["take-image".to_owned()],
                    tells: None,
                },
                Step {
                    craft: "a".to_owned(),
                    runs: "x".repeat(90),
                    actions: Vec::new(),
                    tells: Some("b".to_owned()),
                },
            ],
            turns: Some(2),
            rests_on: vec!["a: in-orbit".to_owned()],
            absent: Vec::new(),
            ways: vec![Way {
                cost: 9.0,
                steps: vec![Step {
                    craft: "b".to_owned(),
                    runs: "guess".to_owned(),
                    actions: Vec::new(),
                    tells: None,
                }],
            }],
            outcomes: vec![
                Likely { likelihood: 0.8, failing: Vec::new(), cost: Some(4.0) },
                Likely { likelihood: 0.2, failing: vec!["a: take-image".to_owned()], cost: None },
            ],
            kept: [3, 1, 1, 1],
            of: [4, 2, 1, 2],
        }
    }

    #[test]
    fn a_plan_reads_from_top_to_bottom_within_80_columns() {
        let text = solution().table(Look::default());
        for part in [
            "goal   b: seen",
            "4.0 (sum",
            "3.0 if each",
            "look -> take-image",
            "tells b",
            "2 turns",
            "way 2, cost 9.0",
            "guess",
            "0.800  every action",
            "without a: take-image: out of reach",
        ] {
            assert!(text.contains(part), "{part}: {text}");
        }
        assert!(text.contains("a: lost: unreachable"), "{text}");
        assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
        assert_eq!(solution().csv().lines().count(), 3);
        assert!(solution().json().contains("\"cost_once\": 3.0"));
    }

    #[test]
    fn an_unreachable_mission_says_so() {
        let nothing = Solution { cost: None, steps: Vec::new(), ..solution() };
        assert!(nothing.table(Look::default()).contains("no final fact can be reached"));
    }
}
