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
    /// What to do, in an order in which it can be done.
    pub steps: Vec<Step>,
    /// What must hold already.
    pub rests_on: Vec<String>,
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
                text += &wrap("rests  ", &format!("on {}", self.rests_on.join(", ")));
                text += "\n";
                text += &self.steps_table();
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
    /// One line a step, aligned to the left: sentences, not numbers.
    fn steps_table(&self) -> String {
        let longest = self.steps.iter().map(|step| step.craft.chars().count()).max();
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
        (1..).zip(&self.steps).map(line).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::{Goal, Solution, Step};
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
            rests_on: vec!["a: in-orbit".to_owned()],
            kept: [3, 1, 1, 1],
            of: [4, 2, 1, 2],
        }
    }

    #[test]
    fn a_plan_reads_from_top_to_bottom_within_80_columns() {
        let text = solution().table(Look::default());
        for part in ["goal   b: seen", "4.0 (sum", "3.0 if each", "look -> take-image", "tells b"] {
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
