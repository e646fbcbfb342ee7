//! The merged text of a scenario: file or preset, environment, flags, with the origin of every value.
//!
//! A layer's text is parsed behind as much white space as the layers before it are long. The spans of
//! all layers therefore share one space, the merged tables keep theirs, and whoever meets a span,
//! serde included, can be told which file, variable or flag it came from. Not here: which layers there
//! are (`load`), and what values mean (`resolve`).

use super::error::{Finding, Place, ScenarioError, Step};
use super::explain;
use serde::Deserialize;
use shared_types::scenario::Scenario;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// One text of a scenario.
#[derive(Clone, Debug)]
pub(super) struct Layer {
    /// What errors call it: the file, the variable, the flag.
    label: String,
    /// White space as long as all layers before, then the text.
    padded: String,
    /// Where the text begins.
    start: usize,
}

/// The texts of a scenario, in rising precedence.
#[derive(Clone, Debug, Default)]
pub(super) struct Layers(Vec<Layer>);

impl Layers {
    /// Adds a text that overrides all before.
    pub(super) fn push(&mut self, label: impl Into<String>, text: &str) {
        let start = self.0.last().map_or(0, |last| last.padded.len());
        let padded = format!("{:start$}{text}", "");
        self.0.push(Layer { label: label.into(), padded, start });
    }

    /// Parses every text and merges them: tables key by key, a table of positions into a list, every
    /// other value as a whole.
    pub(super) fn parse(&self) -> Result<Document<'_>, ScenarioError> {
        let mut root = DeTable::new();
        for layer in &self.0 {
            let mut table = DeTable::parse(&layer.padded)
                .map_err(|error| self.syntax_error(layer, &error))?
                .into_inner();
            name_strategies_once(&mut table)
                .and_then(|()| merge_tables(&mut root, table))
                .map_err(|(span, finding)| self.error_at(finding, span))?;
        }
        Ok(Document { layers: self, root })
    }

    fn syntax_error(&self, layer: &Layer, error: &toml::de::Error) -> ScenarioError {
        let span = error.span().unwrap_or(layer.start..layer.start);
        let finding = Finding::at(Place::default(), explain::syntax_message(error.message()))
            .help(explain::syntax_remedy(error.message()))
            .label("not TOML from here on");
        self.error_at(finding, span)
    }

    /// `finding` at `span` of the shared space.
    fn error_at(&self, finding: Finding, span: Range<usize>) -> ScenarioError {
        let owner = self.0.iter().rev().find(|layer| layer.start <= span.start);
        match owner {
            Some(layer) => {
                let text = &layer.padded[layer.start..];
                let span = span.start - layer.start..span.end.saturating_sub(layer.start);
                ScenarioError::within(finding, &layer.label, text, span)
            }
            None => finding.into(),
        }
    }
}

/// All layers of a scenario, merged.
#[derive(Clone, Debug)]
pub(super) struct Document<'t> {
    layers: &'t Layers,
    root: DeTable<'t>,
}

impl Document<'_> {
    /// The scenario that the document says, defaults filled in.
    pub(super) fn deserialize(&self) -> Result<Scenario, ScenarioError> {
        let whole = Spanned::new(0..0, self.root.clone());
        Scenario::deserialize(toml::de::Deserializer::from(whole)).map_err(|error| {
            let span = error.span().unwrap_or(0..0);
            let (keys, value) = self.keys_to(&span);
            let finding = explain::type_finding(error.message(), &keys, value);
            self.layers.error_at(finding, span)
        })
    }

    /// `finding` as an error at the place that it names, or at the nearest that stands in a text;
    /// what is missing altogether is missing from the lowest layer.
    pub(super) fn error(&self, finding: Finding) -> ScenarioError {
        match self.locate(&finding.place) {
            Some(span) => self.layers.error_at(finding, span),
            None => self.layers.error_at(finding.label("missing from this scenario"), 0..0),
        }
    }

    /// The span of the value at `place` (of its key, if it is a table under a header), or of the
    /// deepest that exists on the way.
    fn locate(&self, place: &Place) -> Option<Range<usize>> {
        let mut found = None;
        let mut here: Option<&DeValue<'_>> = None;
        for step in &place.0 {
            let next = match (*step, here) {
                (Step::Key(key), None) => self.root.get_key_value(key),
                (Step::Key(key), Some(DeValue::Table(table))) => table.get_key_value(key),
                (Step::Index(index), Some(DeValue::Array(items))) => {
                    let Some(item) = items.get(index) else { break };
                    found = Some(item.span());
                    here = Some(item.get_ref());
                    continue;
                }
                _ => None,
            };
            let Some((key, value)) = next else { break };
            found = Some(if is_block(value.get_ref()) { key.span() } else { value.span() });
            here = Some(value.get_ref());
        }
        found
    }

    /// The keys that lead to the value or key at `span`, and the value.
    fn keys_to(&self, span: &Range<usize>) -> (Vec<String>, Option<&DeValue<'_>>) {
        fn search<'d, 't>(
            table: &'d DeTable<'t>,
            span: &Range<usize>,
            keys: &mut Vec<String>,
        ) -> Option<&'d DeValue<'t>> {
            for (key, value) in table {
                keys.push(key.get_ref().to_string());
                if key.span() == *span || value.span() == *span {
                    return Some(value.get_ref());
                }
                if let Some(found) = inside(value.get_ref(), span, keys) {
                    return Some(found);
                }
                keys.pop();
            }
            None
        }
        fn inside<'d, 't>(
            value: &'d DeValue<'t>,
            span: &Range<usize>,
            keys: &mut Vec<String>,
        ) -> Option<&'d DeValue<'t>> {
            match value {
                DeValue::Table(table) => search(table, span, keys),
                DeValue::Array(items) => items.iter().find_map(|item| {
                    if item.span() == *span {
                        return Some(item.get_ref());
                    }
                    inside(item.get_ref(), span, keys)
                }),
                _ => None,
            }
        }
        let mut keys = Vec::new();
        let value = search(&self.root, span, &mut keys);
        (keys, value)
    }
}

/// Whether a value spans many lines, so that its key is the better place to show.
fn is_block(value: &DeValue<'_>) -> bool {
    match value {
        DeValue::Table(_) => true,
        DeValue::Array(items) => items.iter().any(|item| item.get_ref().is_table()),
        _ => false,
    }
}

/// `replication.strategy` is another name of `replication.strategies`; one name in all layers lets a
/// later layer override an earlier one under either. An error has the place of the one to remove.
fn name_strategies_once(table: &mut DeTable<'_>) -> Result<(), (Range<usize>, Finding)> {
    let Some(DeValue::Table(replication)) = table.get_mut("replication").map(Spanned::get_mut)
    else {
        return Ok(());
    };
    let Some((key, value)) = replication.remove_entry("strategy") else { return Ok(()) };
    if replication.contains_key("strategies") {
        let finding = Finding::at(Place::default(), "the strategies are given twice")
            .help("`strategy` and `strategies` are two names of one key; keep one");
        return Err((key.span(), finding));
    }
    replication.insert(Spanned::new(key.span(), "strategies".into()), value);
    Ok(())
}

/// Overrides `base` by `over`.
fn merge_tables<'t>(
    base: &mut DeTable<'t>,
    over: DeTable<'t>,
) -> Result<(), (Range<usize>, Finding)> {
    for (key, value) in over {
        match (base.get_mut(key.get_ref().as_ref()).map(Spanned::get_mut), value.get_ref()) {
            (Some(DeValue::Table(below)), DeValue::Table(_)) => {
                merge_tables(below, into_table(value))?;
            }
            (Some(DeValue::Array(below)), DeValue::Table(_)) => {
                for (position, value) in into_table(value) {
                    let count = below.len();
                    let index: Result<usize, _> = position.get_ref().parse();
                    let Some(item) = index.ok().and_then(|index| below.get_mut(index)) else {
                        let message = format!("`{}` has no entry `{position}`", key.get_ref());
                        let remedy = format!("entries are counted from 0; it has {count}");
                        let finding = Finding::at(Place::default(), message).help(remedy);
                        return Err((position.span(), finding));
                    };
                    match (item.get_mut(), value.get_ref()) {
                        (DeValue::Table(below), DeValue::Table(_)) => {
                            merge_tables(below, into_table(value))?;
                        }
                        _ => *item = value,
                    }
                }
            }
            _ => {
                base.remove_entry(key.get_ref().as_ref());
                base.insert(key, value);
            }
        }
    }
    Ok(())
}

fn into_table(value: Spanned<DeValue<'_>>) -> DeTable<'_> {
    match value.into_inner() {
        DeValue::Table(table) => table,
        other => unreachable!("invariant: only called for tables, not {}", other.type_str()),
    }
}
