//! Why a scenario was refused: what is wrong, where, and what to do about it.
//!
//! Checks speak of a [`Finding`] at a [`Place`], a path of keys, and know nothing of files. The
//! document turns the path into file, line and column, or into the flag or variable that set the
//! value, and the finding into a [`ScenarioError`], which miette renders.

use miette::{Diagnostic, NamedSource, SourceSpan};
use std::fmt;

/// A scenario was refused. Rendered by miette with the place underlined and the remedy below;
/// displayed it is one sentence without either.
#[derive(Debug, thiserror::Error, Diagnostic)]
#[error(transparent)]
#[diagnostic(transparent)]
pub struct ScenarioError(Box<Refused>);

#[derive(Debug, thiserror::Error, Diagnostic)]
#[error("{message}")]
struct Refused {
    message: String,
    #[help]
    remedy: Option<String>,
    label: String,
    #[source_code]
    source_text: Option<NamedSource<String>>,
    #[label("{label}")]
    span: Option<SourceSpan>,
    position: Option<Position>,
}

/// Where in a file (or in the text of a flag or variable) an error lies.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Position {
    /// The file as it was named, or the flag or variable.
    pub source: String,
    /// From 1.
    pub line: usize,
    /// In characters, from 1.
    pub column: usize,
}

impl fmt::Display for Position {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}:{}:{}", self.source, self.line, self.column)
    }
}

impl ScenarioError {
    /// What is wrong, in one sentence.
    #[must_use]
    pub fn message(&self) -> &str {
        &self.0.message
    }

    /// What to do about it.
    #[must_use]
    pub fn remedy(&self) -> Option<&str> {
        self.0.remedy.as_deref()
    }

    /// Where it is; `None` if the scenario was not read from a text, or could not be.
    #[must_use]
    pub fn position(&self) -> Option<&Position> {
        self.0.position.as_ref()
    }

    /// An error without a place in a text.
    pub(super) fn without_place(message: String, remedy: String) -> Self {
        Self(Box::new(Refused {
            message,
            remedy: Some(remedy).filter(|remedy| !remedy.is_empty()),
            label: String::new(),
            source_text: None,
            span: None,
            position: None,
        }))
    }

    /// `finding` at `span` (bytes) of `text`, which is shown as `source`.
    pub(super) fn within(
        finding: Finding,
        source: &str,
        text: &str,
        span: std::ops::Range<usize>,
    ) -> Self {
        let start = floor_char_boundary(text, span.start);
        let end = floor_char_boundary(text, span.end.max(start));
        let before = &text[..start];
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        let position = Position {
            source: source.to_owned(),
            line: before.matches('\n').count() + 1,
            column: before[line_start..].chars().count() + 1,
        };
        Self(Box::new(Refused {
            message: finding.message,
            remedy: Some(finding.remedy).filter(|remedy| !remedy.is_empty()),
            label: finding.label.to_owned(),
            source_text: Some(NamedSource::new(source, text.to_owned()).with_language("TOML")),
            span: Some((start..end).into()),
            position: Some(position),
        }))
    }
}

/// The nearest character boundary at or before `index`.
fn floor_char_boundary(text: &str, index: usize) -> usize {
    (0..=index.min(text.len()))
        .rev()
        .find(|&index| text.is_char_boundary(index))
        .expect("invariant: 0 is a boundary")
}

/// Something wrong at a place of a scenario.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Finding {
    /// The value, or the key that it concerns.
    pub(super) place: Place,
    /// What is wrong, in one sentence.
    pub(super) message: String,
    /// What to do about it.
    pub(super) remedy: String,
    /// A word or two beside the underlined place.
    pub(super) label: &'static str,
}

impl Finding {
    /// `message` about what stands at `place`.
    pub(super) fn at(place: Place, message: impl Into<String>) -> Self {
        Self { place, message: message.into(), remedy: String::new(), label: "here" }
    }

    /// What to do about it.
    pub(super) fn help(mut self, remedy: impl Into<String>) -> Self {
        self.remedy = remedy.into();
        self
    }

    /// The words beside the underlined place.
    pub(super) const fn label(mut self, label: &'static str) -> Self {
        self.label = label;
        self
    }
}

/// For scenarios that were put together by a program: the place is named by its keys.
impl From<Finding> for ScenarioError {
    fn from(finding: Finding) -> Self {
        Self::without_place(format!("{}: {}", finding.place, finding.message), finding.remedy)
    }
}

/// A path of keys and positions in lists: `rule[3].if[1]`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Place(pub(super) Vec<Step>);

/// One step of a [`Place`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// Into a table.
    Key(&'static str),
    /// Into a list.
    Index(usize),
}

impl From<&'static str> for Step {
    fn from(key: &'static str) -> Self {
        Self::Key(key)
    }
}

impl From<usize> for Step {
    fn from(index: usize) -> Self {
        Self::Index(index)
    }
}

impl Place {
    /// The place `step` below this one.
    pub(super) fn then(&self, step: impl Into<Step>) -> Self {
        let mut steps = self.0.clone();
        steps.push(step.into());
        Self(steps)
    }
}

impl fmt::Display for Place {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (position, step) in self.0.iter().enumerate() {
            match step {
                Step::Key(key) if position == 0 => write!(formatter, "{key}")?,
                Step::Key(key) => write!(formatter, ".{key}")?,
                Step::Index(index) => write!(formatter, "[{index}]")?,
            }
        }
        Ok(())
    }
}

/// The place reached by these keys and list positions.
macro_rules! place {
    ($($step:expr),+ $(,)?) => {
        $crate::scenario::error::Place(vec![$($crate::scenario::error::Step::from($step)),+])
    };
}
pub(super) use place;
