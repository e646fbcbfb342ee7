//! `[[rule]]`, `[[action]]` and `[[boundary]]`: a mission that is written out.
//!
//! A fact is named by a text, its negation by `"!text"`: in `if` that it is de-asserted or known
//! absent, in `then` that it is de-asserted. A fact exists on a craft that starts with it, outputs
//! it, shares it or ends with it; the same name on two crafts is two facts unless `[[boundary]]`
//! makes it one.

use super::fleet::Tier;
use super::one_or_many::OneOrMany;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[[rule]]`: when all of `if` holds, the craft may fire it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct RuleEntry {
    /// What reports call it; default its text, `if a and !b then c`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// The crafts that have it, a name or a list; default all (of `tier`, where that is given).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub craft: Option<OneOrMany<String>>,
    /// Gives it to all crafts of a tier, instead of naming them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tier: Option<Tier>,
    /// Its premises; at least one. A fact, `!fact`, or a level compared: `battery >= 20`, `depth < 3`.
    pub r#if: Vec<String>,
    /// The facts that it asserts or, with `!`, de-asserts, and what levels become: `battery = 30`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub then: Vec<String>,
    /// The actions that it queues, by name.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub run: Vec<String>,
    /// Whether it may fire more than once in a trial; default false.
    #[serde(default)]
    pub repeat: bool,
    /// What running it costs a plan, above 0; default 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cost: Option<f64>,
}

/// `[[action]]`: something a craft does, once a rule has queued it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct ActionEntry {
    /// Its name, unique on each craft.
    pub name: String,
    /// The crafts that have it, a name or a list; default all (of `tier`, where that is given).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub craft: Option<OneOrMany<String>>,
    /// Gives it to all crafts of a tier, instead of naming them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tier: Option<Tier>,
    /// The facts that it asserts or, with `!`, de-asserts, and what levels become: `battery = 30`.
    pub then: Vec<String>,
    /// Whether it may run more than once in a trial; default false.
    #[serde(default)]
    pub repeat: bool,
    /// What running it costs a plan, above 0; default 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cost: Option<f64>,
    /// How likely one run is to bring about what it presumes, above 0 and at most 1; default 1. One that is
    /// in vain writes nothing; if it says `repeat` it stays queued and may be tried again. Plans count its
    /// cost over its likelihood: what it costs until it succeeds, on average.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub likelihood: Option<f64>,
    /// Turns that one run takes, in which its craft does nothing else; it writes in the last. Default 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub duration: Option<u32>,
}

/// `[[boundary]]`: one fact that several crafts share; any of them may write it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct BoundaryEntry {
    /// The fact, of the same name on all its crafts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fact: Option<String>,
    /// The crafts that share `fact`, two or more; default all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crafts: Option<Vec<String>>,
    /// Instead of `fact` and `crafts`: the fact under each craft's own name for it, as
    /// `["orbiter.target", "aerial-1.goal"]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub link: Option<Vec<String>>,
}
