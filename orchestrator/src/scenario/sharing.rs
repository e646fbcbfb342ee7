//! `[[boundary]]`: who shares which fact.
//!
//! A shared fact is one fact, under one name (`fact`) or each craft's own (`link`). A craft's fact is
//! shared by one entry at most: a delivered fact is not passed on, so two entries that met on a craft
//! would not agree.

use super::draft::Shared;
use super::error::{Finding, Place};
use super::mission::{Drafting, parse_fact};
use shared_types::ids::CraftId;
use shared_types::limits::SHARED_LINKS_MAX;
use shared_types::scenario::BoundaryEntry;
use std::borrow::Cow;

/// Links of a fact that so many crafts share.
const fn link_count(sharers: usize) -> u64 {
    sharers as u64 * (sharers as u64).saturating_sub(1)
}

/// A craft, its name for a fact that it shares, and where that stands.
type Sharer<'e> = (CraftId, Cow<'e, str>, Place);

impl Drafting<'_> {
    /// Turns one `[[boundary]]` into a shared fact.
    pub(super) fn boundary(&mut self, entry: &BoundaryEntry, place: &Place) -> Result<(), Finding> {
        let named = match (&entry.fact, &entry.link) {
            (Some(fact), None) => self.sharers_by_fact(fact, entry.crafts.as_deref(), place)?,
            (None, Some(link)) => {
                if entry.crafts.is_some() {
                    return Err(Finding::at(place.then("crafts"), "`crafts` beside `link`")
                        .help("`link` names the crafts already; leave `crafts` out"));
                }
                self.sharers_by_link(link, place)?
            }
            (Some(_), Some(_)) => {
                return Err(Finding::at(place.then("link"), "both `fact` and `link` are given")
                    .help("use `fact` where all crafts call it the same, else `link`"));
            }
            (None, None) => {
                return Err(Finding::at(place.clone(), "a boundary without a fact").help(
                    "name it: `fact = \"target\"` with `crafts = [..]`, or \
                     `link = [\"orbiter.target\", \"aerial.goal\"]`",
                ));
            }
        };
        if named.len() < 2 {
            let place = place.then(if entry.link.is_some() { "link" } else { "crafts" });
            return Err(Finding::at(place, "a boundary fact needs two crafts or more")
                .help("name every craft that shares it; a fact of one craft needs no [[boundary]]")
                .label("nobody to share with"));
        }
        // A level is shared as all comparisons with it.
        let thresholds = entry.fact.as_ref().map_or_else(Vec::new, |fact| self.levels.facts(fact));
        if thresholds.is_empty() {
            return self.share(&named, None, place);
        }
        thresholds.iter().try_for_each(|threshold| self.share(&named, Some(threshold), place))
    }

    /// Makes one shared fact of what `named` calls its own name for it or, for a level, of `threshold`.
    fn share(
        &mut self,
        named: &[Sharer<'_>],
        threshold: Option<&str>,
        place: &Place,
    ) -> Result<(), Finding> {
        let mut sharers = Vec::with_capacity(named.len());
        for (craft, name, at) in named {
            let (craft, name) = (*craft, threshold.unwrap_or(name));
            let board = &mut self.boards[craft.index()];
            let fact = board.fact(name);
            if let Err(other) = board.share(fact, self.shared.len()) {
                let who = &self.crafts[craft.index()].name;
                let message = if other == self.shared.len() {
                    format!("`{who}` is named twice")
                } else {
                    format!("`{who}` already shares `{name}` by boundary {other} (counted from 0)")
                };
                return Err(Finding::at(at.clone(), message)
                    .help("list all sharers of a fact once, in one [[boundary]]"));
            }
            sharers.push((craft, fact));
        }
        sharers.sort_unstable();
        let links = self.shared.iter().map(|shared| link_count(shared.sharers.len()));
        let needed = links.sum::<u64>() + link_count(sharers.len());
        if needed > SHARED_LINKS_MAX {
            return Err(Finding::at(
                place.clone(),
                format!("boundary facts need {needed} links, one from each sharer to every other"),
            )
            .help(format!("at most {SHARED_LINKS_MAX} are accepted; share with fewer crafts")));
        }
        self.shared.push(Shared { sharers, place: place.clone() });
        Ok(())
    }

    fn sharers_by_fact<'e>(
        &self,
        fact: &'e str,
        crafts: Option<&[String]>,
        place: &Place,
    ) -> Result<Vec<Sharer<'e>>, Finding> {
        let at = place.then("fact");
        let (name, is_negated) = parse_fact(fact, &at)?;
        if is_negated {
            return Err(Finding::at(at, "a boundary fact is named without `!`")
                .help(format!("write `{name}`")));
        }
        let Some(crafts) = crafts else {
            return Ok((0..self.crafts.len())
                .map(|index| (CraftId::from_index(index), name.clone(), place.then("fact")))
                .collect());
        };
        let at = place.then("crafts");
        let sharer = |(index, craft): (usize, &String)| {
            Ok((self.craft_id(craft, &at.then(index))?, name.clone(), at.then(index)))
        };
        crafts.iter().enumerate().map(sharer).collect()
    }

    fn sharers_by_link<'e>(
        &self,
        link: &'e [String],
        place: &Place,
    ) -> Result<Vec<Sharer<'e>>, Finding> {
        let sharer = |(index, text): (usize, &'e String)| {
            let at = place.then("link").then(index);
            let Some((craft, fact)) = text.split_once('.') else {
                return Err(Finding::at(at, format!("`{text}` names no craft and fact"))
                    .help("write craft and fact with a dot between: `orbiter.target`"));
            };
            let craft = self.craft_id(craft, &at)?;
            let (fact, is_negated) = parse_fact(fact, &at)?;
            if is_negated {
                return Err(Finding::at(at, "a boundary fact is named without `!`")
                    .help(format!("write `{fact}`")));
            }
            if !self.levels.facts(&fact).is_empty() {
                return Err(Finding::at(at, format!("`{fact}` is a level"))
                    .help(format!("a level has one name on all crafts: `fact = \"{fact}\"`")));
            }
            Ok((craft, fact, at))
        };
        link.iter().enumerate().map(sharer).collect()
    }
}
