//! Axes: a title with the unit, named ticks that never overlap, and thin lines behind the data.

use super::element::{Element, group, line};
use super::frame::{Frame, size};
use super::number::Unit;
use super::scale::{Bounds, Scale};
use super::text::{Anchor, label, width_of};

/// An axis: where values lie and how they are named.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// What it shows, with its unit or the words that say what a number is.
    pub title: String,
    /// From where to where.
    pub bounds: Bounds,
    /// The named values, ascending.
    pub ticks: Vec<(f64, String)>,
    /// Values that a thin line marks.
    pub minor: Vec<f64>,
}

/// Room between a tick's name and the frame.
const GAP: f64 = 7.0;

/// Least room between the names of two ticks.
const APART: f64 = 6.0;

impl Axis {
    /// An axis with ticks at round numbers in `unit`.
    #[must_use]
    pub fn measured(title: impl Into<String>, bounds: Bounds, unit: Unit) -> Self {
        let ticks = bounds.ticks().into_iter().map(|value| (value, unit.format(value))).collect();
        Self { title: title.into(), bounds, ticks, minor: bounds.minor_ticks() }
    }

    /// An axis with ticks at the values that occur.
    #[must_use]
    pub fn named(title: impl Into<String>, bounds: Bounds, ticks: Vec<(f64, String)>) -> Self {
        Self { title: title.into(), bounds, ticks, minor: Vec::new() }
    }

    /// Width of the widest name.
    #[must_use]
    pub fn names_width(&self) -> f64 {
        self.ticks.iter().map(|(_, name)| width_of(name, size::TEXT)).fold(0.0, f64::max)
    }

    /// Room that it takes on the left of a frame: names, and its title turned by a quarter.
    #[must_use]
    pub fn room_left(&self) -> f64 {
        self.names_width() + GAP + size::TEXT + 12.0
    }

    /// Room that it takes below a frame.
    pub const ROOM_BELOW: f64 = 42.0;

    /// The scale along the lower side of `frame`.
    #[must_use]
    pub const fn across(&self, frame: Frame) -> Scale {
        Scale::new(self.bounds, frame.left, frame.right())
    }

    /// The scale along the left side of `frame`, low values at the bottom.
    #[must_use]
    pub const fn upward(&self, frame: Frame) -> Scale {
        Scale::new(self.bounds, frame.bottom(), frame.top)
    }

    /// Where lines stand behind the data, each with its style class.
    fn grid(&self) -> impl Iterator<Item = (&'static str, f64)> {
        let minor = self.minor.iter().map(|&value| ("grid minor", value));
        minor.chain(self.ticks.iter().map(|&(value, _)| ("grid", value)))
    }

    /// Draws it below `frame`.
    #[must_use]
    pub fn draw_below(&self, frame: Frame) -> Element {
        let scale = self.across(frame);
        let (top, bottom) = (frame.top, frame.bottom());
        let mut axis = group("across");
        for (class, value) in self.grid() {
            if let Some(x) = scale.place(value) {
                axis.push(line(class, (x, top), (x, bottom)));
            }
        }
        axis.push(line("axis", (frame.left, bottom), (frame.right(), bottom)));
        let mut free_from = f64::NEG_INFINITY;
        for (value, name) in &self.ticks {
            let Some(x) = scale.place(*value) else { continue };
            axis.push(line("axis", (x, bottom), (x, bottom + 4.0)));
            let half = width_of(name, size::TEXT) / 2.0;
            if x - half >= free_from {
                let place = (x, bottom + 5.0 + size::TEXT);
                axis.push(label("ink", size::TEXT, Anchor::Middle, place, name));
                free_from = x + half + APART;
            }
        }
        let place = (frame.left + frame.width / 2.0, bottom + Self::ROOM_BELOW - 6.0);
        axis.holding(label("muted", size::TEXT, Anchor::Middle, place, &self.title))
    }

    /// Draws it on the left of `frame`.
    #[must_use]
    pub fn draw_left(&self, frame: Frame) -> Element {
        let scale = self.upward(frame);
        let mut axis = group("upward");
        for (class, value) in self.grid() {
            if let Some(y) = scale.place(value) {
                axis.push(line(class, (frame.left, y), (frame.right(), y)));
            }
        }
        let mut free_from = f64::INFINITY;
        for (value, name) in &self.ticks {
            let Some(y) = scale.place(*value) else { continue };
            if y <= free_from {
                let place = (frame.left - GAP, y + size::TEXT * 0.36);
                axis.push(label("ink", size::TEXT, Anchor::End, place, name));
                free_from = y - size::TEXT - 2.0;
            }
        }
        axis.push(line("axis", (frame.left, frame.top), (frame.left, frame.bottom())));
        let x = frame.left - self.room_left() + size::TEXT;
        let y = frame.top + frame.height / 2.0;
        let turned = format!(
            "rotate(-90 {} {})",
            super::element::coordinate(x),
            super::element::coordinate(y)
        );
        let title = label("muted", size::TEXT, Anchor::Middle, (x, y), &self.title);
        axis.holding(title.with("transform", turned))
    }
}
