//! What marks, lines and fills stand for, in lines of entries above the data.

use super::element::{Element, group, line, rectangle};
use super::frame::size;
use super::look::Mark;
use super::text::{Anchor, label, width_of};

/// The sign of an entry.
#[derive(Clone, Debug, PartialEq)]
pub enum Sign {
    /// A line with a marker.
    Line(Mark),
    /// A marker alone, hollow.
    Hollow(Mark),
    /// A filled square of a style class.
    Fill(&'static str),
    /// A square filled by the pattern with this id.
    Pattern(String),
    /// A thick line with dashes, empty for a solid one.
    Limit(&'static str),
}

/// One entry.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Its sign.
    pub sign: Sign,
    /// What the sign stands for.
    pub name: String,
}

/// Room of a sign.
const SIGN_WIDTH: f64 = 34.0;
/// Height of a line of entries.
const LINE_HEIGHT: f64 = 20.0;
/// Room between entries.
const APART: f64 = 20.0;

impl Entry {
    /// An entry.
    #[must_use]
    pub fn new(sign: Sign, name: impl Into<String>) -> Self {
        Self { sign, name: name.into() }
    }

    fn width(&self) -> f64 {
        SIGN_WIDTH + width_of(&self.name, size::TEXT)
    }

    fn draw(&self, left: f64, middle: f64) -> Element {
        let mut entry = group("entry");
        let centre = (left + 13.0, middle);
        match &self.sign {
            Sign::Line(mark) => {
                entry.push(
                    line(&format!("curve {}", mark.class), (left, middle), (left + 27.0, middle))
                        .with("stroke-dasharray", mark.dashes),
                );
                entry.push(mark.point(centre, false));
            }
            Sign::Hollow(mark) => entry.push(mark.point(centre, true)),
            Sign::Fill(class) => entry.push(rectangle(class, left + 4.0, middle - 8.0, 22.0, 16.0)),
            Sign::Pattern(id) => {
                let area = rectangle("void", left + 4.0, middle - 8.0, 22.0, 16.0);
                entry.push(area.clone());
                entry.push(area.with("style", format!("fill:url(#{id})")));
            }
            Sign::Limit(dashes) => entry.push(
                line("limit", (left, middle), (left + 27.0, middle))
                    .with("stroke-dasharray", *dashes),
            ),
        }
        let place = (left + SIGN_WIDTH, middle + size::TEXT * 0.36);
        entry.holding(label("ink", size::TEXT, Anchor::Start, place, &self.name))
    }
}

/// Entries in lines of at most `width`, from `(left, top)` on.
#[must_use]
pub fn legend(entries: &[Entry], left: f64, top: f64, width: f64) -> Element {
    let mut drawn = group("legend");
    for (x, line, entry) in placed(entries, width) {
        drawn.push(entry.draw(left + x, top + (line + 0.5) * LINE_HEIGHT));
    }
    drawn
}

/// Height of the same.
#[must_use]
pub fn legend_height(entries: &[Entry], width: f64) -> f64 {
    placed(entries, width).last().map_or(0.0, |(_, line, _)| (line + 1.0) * LINE_HEIGHT)
}

/// Every entry with its distance from the left and the number of its line.
fn placed(entries: &[Entry], width: f64) -> Vec<(f64, f64, &Entry)> {
    let (mut x, mut line) = (0.0, 0.0);
    let mut places = Vec::new();
    for entry in entries {
        if x > 0.0 && x + entry.width() > width {
            (x, line) = (0.0, line + 1.0);
        }
        places.push((x, line, entry));
        x += entry.width() + APART;
    }
    places
}
