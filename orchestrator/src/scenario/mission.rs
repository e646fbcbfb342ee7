//! A mission that is written out: names become dense ids, and every name must mean something.
//!
//! A craft has the facts that it starts with, shares, or outputs by an action or a rule; they are
//! numbered in that order, within each in the order of the file. Rules and actions are numbered in
//! the order of the file among those that the craft has. A premise or final fact must be one of the
//! craft's facts, and something must be able to bring it about: the craft's own outputs, what it
//! starts with, or those of a craft that shares it. Not here: what is shared (`sharing`), building networks
//! (`compile`).

use super::draft::{BoardDraft, Shared};
use super::error::{Finding, Place, place};
use super::fleet::{Craft, check_name, ids_by_name, unknown_craft};
use super::levels::{self, Levels, Text, Threshold};
use super::nearest::{nearest, suggestion};
use super::validate::{check_action, check_cost, check_outputs};
use shared_types::ids::{ActionId, CraftId, FactId};
use shared_types::knowledge::Literal;
use shared_types::limits::PREMISES_MAX;
use shared_types::scenario::{OneOrMany, Scenario, Tier};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// Boards and shared facts of a written-out mission, in ids.
pub(super) fn draft(
    scenario: &Scenario,
    crafts: &[Craft],
) -> Result<(Vec<BoardDraft>, Vec<Shared>), Finding> {
    let mut drafting = Drafting {
        scenario,
        crafts,
        levels: Levels::of(scenario)?,
        ids: ids_by_name(crafts),
        boards: crafts.iter().map(|_| BoardDraft::default()).collect(),
        shared: Vec::new(),
    };
    drafting.initial_facts()?;
    for (index, entry) in scenario.boundary.iter().enumerate() {
        drafting.boundary(entry, &place!["boundary", index])?;
    }
    drafting.actions()?;
    drafting.rule_outputs()?;
    drafting.spread()?;
    drafting.premises()?;
    drafting.finals()?;
    Ok((drafting.boards, drafting.shared))
}

/// A mission on the way from names to ids.
pub(super) struct Drafting<'s> {
    pub(super) scenario: &'s Scenario,
    pub(super) crafts: &'s [Craft],
    pub(super) levels: Levels<'s>,
    ids: BTreeMap<&'s str, CraftId>,
    pub(super) boards: Vec<BoardDraft>,
    pub(super) shared: Vec<Shared>,
}

/// A fact's name and whether it is negated; a comparison of a level is a fact as well.
pub(super) fn parse_fact<'f>(
    text: &'f str,
    place: &Place,
) -> Result<(Cow<'f, str>, bool), Finding> {
    match levels::parse(text, place)? {
        Text::Fact(name, is_negated) => Ok((Cow::Borrowed(name), is_negated)),
        Text::Threshold(threshold) => Ok((Cow::Owned(threshold.name()), false)),
        Text::Set(level, value) => {
            Err(Finding::at(place.clone(), format!("`{text}` sets a level and asks nothing"))
                .help(format!("compare it: `{level} >= {value}`")))
        }
    }
}

fn literal(fact: FactId, is_negated: bool) -> Literal {
    if is_negated { Literal::is_absent(fact) } else { Literal::holds(fact) }
}

impl Drafting<'_> {
    fn initial_facts(&mut self) -> Result<(), Finding> {
        for (index, entry) in self.scenario.craft.iter().enumerate() {
            for (position, text) in entry.initial.iter().enumerate() {
                let place = place!["craft", index, "initial", position];
                if let Text::Set(level, value) = levels::parse(text, &place)? {
                    for (name, is_false) in self.levels.written(level, value, &place)? {
                        let board = &mut self.boards[index];
                        let fact = board.fact(&name);
                        if !is_false {
                            board.start_with(fact);
                        }
                    }
                    continue;
                }
                let (name, is_negated) = parse_fact(text, &place)?;
                if is_negated {
                    return Err(Finding::at(place, format!("`{text}` cannot stand in `initial`"))
                        .help(
                            "`initial` lists what holds; everything else is unknown at the start",
                        ));
                }
                let board = &mut self.boards[index];
                let fact = board.fact(&name);
                board.start_with(fact);
            }
        }
        Ok(())
    }

    /// The craft called `name`, which stands at `place`.
    pub(super) fn craft_id(&self, name: &str, place: &Place) -> Result<CraftId, Finding> {
        self.ids
            .get(name)
            .copied()
            .ok_or_else(|| Finding { place: place.clone(), ..unknown_craft(name, self.crafts) })
    }

    /// The crafts that a rule or action is for, ascending.
    fn crafts_of(
        &self,
        names: Option<&OneOrMany<String>>,
        tier: Option<Tier>,
        place: &Place,
    ) -> Result<Vec<CraftId>, Finding> {
        let all = || (0..self.crafts.len()).map(CraftId::from_index);
        match (names, tier) {
            (Some(_), Some(_)) => {
                Err(Finding::at(place.then("tier"), "both `craft` and `tier` are given")
                    .help("keep one of the two"))
            }
            (None, None) => Ok(all().collect()),
            (None, Some(tier)) => {
                let of_tier: Vec<CraftId> =
                    all().filter(|craft| self.crafts[craft.index()].tier == tier).collect();
                if of_tier.is_empty() {
                    return Err(Finding::at(place.then("tier"), "no craft is of this tier")
                        .help("state the `tier` of each [[craft]]; without one it is `ground`"));
                }
                Ok(of_tier)
            }
            (Some(names), None) => {
                let mut found = Vec::with_capacity(names.len());
                for (index, name) in names.iter().enumerate() {
                    let at = place.then("craft").then(index);
                    let id = self.craft_id(name, &at)?;
                    if found.contains(&id) {
                        return Err(
                            Finding::at(at, format!("`{name}` is named twice")).help("keep one")
                        );
                    }
                    found.push(id);
                }
                if found.is_empty() {
                    return Err(Finding::at(place.then("craft"), "a list of no crafts")
                        .help("name the crafts, or leave `craft` out for all"));
                }
                found.sort_unstable();
                Ok(found)
            }
        }
    }

    /// Parses a list of facts in which each may stand once. Where the list `sets`, levels take values
    /// in it, else they are compared.
    fn facts_of<'e>(
        &self,
        texts: &'e [String],
        place: &Place,
        sets: bool,
    ) -> Result<Vec<(Cow<'e, str>, bool)>, Finding> {
        let mut facts: Vec<(Cow<'e, str>, bool)> = Vec::with_capacity(texts.len());
        for (index, text) in texts.iter().enumerate() {
            let at = place.then(index);
            let parsed = match levels::parse(text, &at)? {
                Text::Set(level, value) if sets => {
                    let written = self.levels.written(level, value, &at)?.into_iter();
                    written.map(|(name, is_false)| (Cow::Owned(name), is_false)).collect()
                }
                Text::Threshold(Threshold { level, bound, .. }) if sets => {
                    return Err(Finding::at(at, format!("`{text}` compares a level"))
                        .help(format!("say what it becomes: `{level} = {bound}`")));
                }
                _ => vec![parse_fact(text, &at)?],
            };
            for (name, is_negated) in parsed {
                if facts.iter().any(|(other, _)| *other == name) {
                    return Err(Finding::at(at, format!("`{name}` stands twice in this list"))
                        .help("keep one; a fact cannot both hold and not hold"));
                }
                facts.push((name, is_negated));
            }
        }
        check_outputs(facts.len(), self.scenario.replication.record_bytes, place)?;
        Ok(facts)
    }

    fn actions(&mut self) -> Result<(), Finding> {
        for (index, entry) in self.scenario.action.iter().enumerate() {
            let place = place!["action", index];
            check_name(&entry.name, "action")
                .map_err(|finding| Finding { place: place.then("name"), ..finding })?;
            check_cost(entry.cost, &place)?;
            check_action(entry, &place)?;
            let outputs = self.facts_of(&entry.then, &place.then("then"), true)?;
            if outputs.is_empty() {
                return Err(Finding::at(place.then("then"), "an action without an outcome")
                    .help("say what holds afterwards: `then = [\"photographed\"]`"));
            }
            for craft in self.crafts_of(entry.craft.as_ref(), entry.tier, &place)? {
                if self.boards[craft.index()].action(&entry.name).is_some() {
                    let who = &self.crafts[craft.index()].name;
                    return Err(Finding::at(
                        place.then("name"),
                        format!("`{who}` has two actions called `{}`", entry.name),
                    )
                    .help("rename one, or say with `craft` who has which"));
                }
                let board = &mut self.boards[craft.index()];
                let outputs: Vec<Literal> = outputs
                    .iter()
                    .map(|(name, negated)| literal(board.fact(name), *negated))
                    .collect();
                board.add_action(entry, index, outputs);
            }
        }
        Ok(())
    }

    /// First pass over the rules: what they output and queue.
    fn rule_outputs(&mut self) -> Result<(), Finding> {
        for (index, entry) in self.scenario.rule.iter().enumerate() {
            let place = place!["rule", index];
            if entry.then.is_empty() && entry.run.is_empty() {
                return Err(Finding::at(place, "a rule that does nothing")
                    .help("say what it concludes (`then`) or what it sets going (`run`)"));
            }
            check_cost(entry.cost, &place)?;
            let outputs = self.facts_of(&entry.then, &place.then("then"), true)?;
            for craft in self.crafts_of(entry.craft.as_ref(), entry.tier, &place)? {
                if let Some(name) = &entry.name
                    && self.boards[craft.index()].has_rule(name)
                {
                    let who = &self.crafts[craft.index()].name;
                    return Err(Finding::at(
                        place.then("name"),
                        format!("`{who}` has two rules called `{name}`"),
                    )
                    .help("rename one, or say with `craft` who has which"));
                }
                let queued = entry.run.iter().enumerate().map(|(position, action)| {
                    self.boards[craft.index()].action(action).ok_or_else(|| {
                        self.unknown_action(action, craft, place.then("run").then(position))
                    })
                });
                let queued: Vec<ActionId> = queued.collect::<Result<_, Finding>>()?;
                let board = &mut self.boards[craft.index()];
                let outputs: Vec<Literal> = outputs
                    .iter()
                    .map(|(name, negated)| literal(board.fact(name), *negated))
                    .collect();
                board.add_rule(entry, index, outputs, queued);
            }
        }
        Ok(())
    }

    /// What one sharer starts with or can bring about, all sharers do.
    fn spread(&mut self) -> Result<(), Finding> {
        for shared in &self.shared {
            let mut all = super::draft::Reach::default();
            for &(craft, fact) in &shared.sharers {
                all = all.or(self.boards[craft.index()].reach(fact));
            }
            if !all.can_hold && !all.can_be_absent {
                let (craft, fact) = shared.sharers[0];
                let name = self.boards[craft.index()].fact_name(fact);
                return Err(Finding::at(
                    shared.place.clone(),
                    format!("no craft that shares `{name}` ever asserts it"),
                )
                .help("put it into `initial` of one, or into a `then`"));
            }
            for &(craft, fact) in &shared.sharers {
                self.boards[craft.index()].widen(fact, all);
            }
        }
        Ok(())
    }

    /// Second pass over the rules: what they rest on, now that every fact is known.
    fn premises(&mut self) -> Result<(), Finding> {
        for index in 0..self.boards.len() {
            let craft = CraftId::from_index(index);
            for (rule, entry_index) in self.boards[index].entries().rules.into_iter().enumerate() {
                let entry = &self.scenario.rule[entry_index];
                let place = place!["rule", entry_index, "if"];
                if entry.r#if.is_empty() || entry.r#if.len() > PREMISES_MAX as usize {
                    let count = entry.r#if.len();
                    return Err(Finding::at(place, format!("a rule of {count} premises")).help(
                        format!("give 1 to {PREMISES_MAX}; what always holds is `initial`"),
                    ));
                }
                let facts = self.facts_of(&entry.r#if, &place, false)?;
                let mut premises = Vec::with_capacity(facts.len());
                for (position, (name, is_negated)) in facts.into_iter().enumerate() {
                    let at = place.then(position);
                    let fact = self.reachable_fact(craft, &name, is_negated, &at)?;
                    premises.push(literal(fact, is_negated));
                }
                self.boards[index].set_premises(rule, premises);
            }
        }
        Ok(())
    }

    fn finals(&mut self) -> Result<(), Finding> {
        for (index, entry) in self.scenario.craft.iter().enumerate() {
            for (position, text) in entry.r#final.iter().enumerate() {
                let place = place!["craft", index, "final", position];
                let (name, is_negated) = parse_fact(text, &place)?;
                if is_negated {
                    return Err(Finding::at(place, format!("`{text}` cannot be final"))
                        .help("a final fact completes the mission when it is asserted"));
                }
                let fact = self.reachable_fact(CraftId::from_index(index), &name, false, &place)?;
                if self.boards[index].starts_with(fact) {
                    return Err(Finding::at(place, format!("`{name}` holds from the start"))
                        .help("a final fact is asserted in the course of the mission"));
                }
                self.boards[index].end_with(fact);
            }
        }
        Ok(())
    }

    /// The fact `name` of `craft`, if it can ever have the wanted value there.
    fn reachable_fact(
        &self,
        craft: CraftId,
        name: &str,
        is_negated: bool,
        place: &Place,
    ) -> Result<FactId, Finding> {
        let board = &self.boards[craft.index()];
        let Some(fact) = board.known_fact(name) else {
            return Err(self.unknown_fact(name, craft, place.clone()));
        };
        let reach = board.reach(fact);
        let who = &self.crafts[craft.index()].name;
        if is_negated && !reach.can_be_absent {
            return Err(Finding::at(
                place.clone(),
                format!("nothing ever de-asserts `{name}` on `{who}`, so `!{name}` never holds"),
            )
            .help(format!("put `!{name}` into a `then`; an unknown fact satisfies neither form")));
        }
        if !is_negated && !reach.can_hold {
            return Err(Finding::at(
                place.clone(),
                format!("nothing ever asserts `{name}` on `{who}`; it is only de-asserted"),
            )
            .help(format!("put `{name}` into `initial` or into a `then`")));
        }
        Ok(fact)
    }

    fn unknown_fact(&self, name: &str, craft: CraftId, place: Place) -> Finding {
        let who = &self.crafts[craft.index()].name;
        let known = self.boards[craft.index()].fact_names();
        let elsewhere = (0..self.boards.len())
            .find(|&other| self.boards[other].known_fact(name).is_some())
            .map(|other| &self.crafts[other].name);
        let remedy = match (nearest(name, known.iter().copied()), elsewhere) {
            (Some(near), _) => format!("did you mean `{near}`?"),
            (None, Some(other)) => format!(
                "`{other}` has it; share it: [[boundary]] with `fact = \"{name}\"` and \
                 `crafts = [\"{other}\", \"{who}\"]`"
            ),
            (None, None) => format!(
                "{}; nothing asserts it: put it into `initial` or a `then`",
                suggestion(name, &format!("facts of `{who}`"), &known)
            ),
        };
        Finding::at(place, format!("`{who}` has no fact `{name}`"))
            .help(remedy)
            .label("no such fact")
    }

    fn unknown_action(&self, name: &str, craft: CraftId, place: Place) -> Finding {
        let who = &self.crafts[craft.index()].name;
        let known = self.boards[craft.index()].action_names();
        Finding::at(place, format!("`{who}` has no action `{name}`"))
            .help(suggestion(name, &format!("actions of `{who}`"), &known))
            .label("no such action")
    }
}
