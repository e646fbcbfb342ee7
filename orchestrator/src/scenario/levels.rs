//! Levels: numbers that rules compare, as facts.
//!
//! `battery >= 20` in an `if` is a fact of that name; `battery = 30` in a `then` or an `initial` asserts
//! the comparisons with that level which are true of 30 and de-asserts the others, all at once. A network
//! therefore knows nothing of numbers, and whatever holds of facts (versions, replication, plans,
//! explanations) holds of levels.

use super::error::{Finding, Place, place};
use super::fleet::check_name;
use shared_types::scenario::Scenario;
use std::collections::BTreeMap;

/// What stands in a list of facts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Text<'t> {
    /// A fact, and whether it is negated.
    Fact(&'t str, bool),
    /// A comparison of a level with a number.
    Threshold(Threshold<'t>),
    /// A level takes a value.
    Set(&'t str, f64),
}

/// How a level is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Relation {
    AtLeast,
    AtMost,
    Above,
    Below,
}

/// A comparison of a level with a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Threshold<'t> {
    pub(super) level: &'t str,
    pub(super) relation: Relation,
    pub(super) bound: f64,
}

impl Threshold<'_> {
    /// The fact that stands for it, the same however the number was written.
    pub(super) fn name(&self) -> String {
        let sign = SIGNS.iter().find(|(_, relation)| *relation == Some(self.relation));
        let sign = sign.map_or("=", |(sign, _)| sign);
        format!("{} {sign} {}", self.level, self.bound)
    }

    /// Whether a level of `value` meets it.
    pub(super) fn is_met_by(&self, value: f64) -> bool {
        match self.relation {
            Relation::AtLeast => value >= self.bound,
            Relation::AtMost => value <= self.bound,
            Relation::Above => value > self.bound,
            Relation::Below => value < self.bound,
        }
    }
}

/// Signs, longer ones first; the last sets a level.
const SIGNS: [(&str, Option<Relation>); 5] = [
    (">=", Some(Relation::AtLeast)),
    ("<=", Some(Relation::AtMost)),
    (">", Some(Relation::Above)),
    ("<", Some(Relation::Below)),
    ("=", None),
];

/// Reads a text of a list of facts.
pub(super) fn parse<'t>(text: &'t str, place: &Place) -> Result<Text<'t>, Finding> {
    let at = |finding: Finding| Finding { place: place.clone(), ..finding };
    let sign = SIGNS.into_iter().find_map(|(sign, relation)| {
        text.split_once(sign).map(|(level, number)| (sign, relation, level.trim(), number.trim()))
    });
    let Some((sign, relation, level, number)) = sign else {
        let (name, is_negated) = match text.strip_prefix('!') {
            Some(name) => (name.trim_start(), true),
            None => (text, false),
        };
        check_name(name, "fact").map_err(at)?;
        return Ok(Text::Fact(name, is_negated));
    };
    if level.starts_with('!') {
        return Err(Finding::at(place.clone(), format!("`{text}` negates a comparison"))
            .help("turn it round: `battery < 20` is what `battery >= 20` is not"));
    }
    check_name(level, "level").map_err(at)?;
    let bound = number.parse().ok().filter(|number: &f64| number.is_finite()).ok_or_else(|| {
        Finding::at(place.clone(), format!("`{number}` is no number that a level can have"))
            .help(format!("write a number behind `{sign}`: `{level} {sign} 20`"))
    })?;
    Ok(match relation {
        Some(relation) => Text::Threshold(Threshold { level, relation, bound }),
        None => Text::Set(level, bound),
    })
}

/// Every comparison of a mission, by level.
#[derive(Clone, Debug, Default)]
pub(super) struct Levels<'s>(BTreeMap<&'s str, Vec<Threshold<'s>>>);

impl<'s> Levels<'s> {
    /// Those of the rules and final facts of `scenario`.
    pub(super) fn of(scenario: &'s Scenario) -> Result<Self, Finding> {
        let mut levels = Self::default();
        let rules = scenario.rule.iter().enumerate().flat_map(|(index, entry)| {
            let texts = entry.r#if.iter().enumerate();
            texts.map(move |(position, text)| (text, place!["rule", index, "if", position]))
        });
        let finals = scenario.craft.iter().enumerate().flat_map(|(index, entry)| {
            let texts = entry.r#final.iter().enumerate();
            texts.map(move |(position, text)| (text, place!["craft", index, "final", position]))
        });
        for (text, place) in rules.chain(finals) {
            if text.contains(['<', '>', '='])
                && let Text::Threshold(threshold) = parse(text, &place)?
            {
                let known = levels.0.entry(threshold.level).or_default();
                if !known.contains(&threshold) {
                    known.push(threshold);
                }
            }
        }
        Ok(levels)
    }

    /// The facts that a level of `value` asserts and, with `true`, de-asserts; at least one.
    pub(super) fn written(
        &self,
        level: &str,
        value: f64,
        place: &Place,
    ) -> Result<Vec<(String, bool)>, Finding> {
        let thresholds = self.0.get(level).ok_or_else(|| {
            Finding::at(place.clone(), format!("nothing compares the level `{level}`"))
                .help(format!("write `{level} >= 20` or the like into the `if` of a rule"))
        })?;
        let write = |one: &Threshold<'_>| (one.name(), !one.is_met_by(value));
        Ok(thresholds.iter().map(write).collect())
    }

    /// The facts that stand for a level; empty if `name` is none.
    pub(super) fn facts(&self, name: &str) -> Vec<String> {
        let thresholds = self.0.get(name).map_or(&[][..], Vec::as_slice);
        thresholds.iter().map(Threshold::name).collect()
    }
}
