//! Rows over one axis: bars made of parts, points with intervals, or words where there is no value.

use super::axis::Axis;
use super::element::{Element, group, line, rectangle};
use super::frame::{Frame, size};
use super::look::Mark;
use super::text::{Anchor, fitted, label, width_of};

/// A part of a bar.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Where it begins.
    pub from: f64,
    /// Where it ends.
    pub to: f64,
    /// Style classes of its area.
    pub class: &'static str,
    /// Words in it, left out where there is no room.
    pub words: String,
}

/// A point of a row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spot {
    /// Its value.
    pub x: f64,
    /// Its look.
    pub mark: Mark,
    /// Whether it is hollow.
    pub is_hollow: bool,
}

/// One row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Row {
    /// On its left.
    pub name: String,
    /// Whether the name is a heading over the rows that follow.
    pub is_heading: bool,
    /// From the left on.
    pub parts: Vec<Part>,
    /// On a thin line from the first to the last.
    pub spots: Vec<Spot>,
    /// On its right: n, or why there is no value.
    pub remark: String,
}

/// A chart of rows.
#[derive(Clone, Debug, PartialEq)]
pub struct RowChart {
    /// Above it.
    pub title: String,
    /// Along its lower side.
    pub x: Axis,
    /// From the top on.
    pub rows: Vec<Row>,
}

/// Height of a row.
const ROW_HEIGHT: f64 = 21.0;
/// Height of a bar.
const BAR_HEIGHT: f64 = 15.0;
/// Widest name or remark.
const WORDS_MAX: f64 = 190.0;
/// Room between frame and words.
const GAP: f64 = 8.0;

impl RowChart {
    /// Height with its axis.
    #[must_use]
    pub fn full_height(&self) -> f64 {
        self.height() + Axis::ROOM_BELOW
    }

    fn height(&self) -> f64 {
        u32::try_from(self.rows.len()).map_or(0.0, f64::from) * ROW_HEIGHT
    }

    /// Draws it within `width` from `(left, top)` on; `id` is of its clip path.
    #[must_use]
    pub fn draw(&self, id: &str, left: f64, top: f64, width: f64) -> Element {
        let widest = |words: &dyn Fn(&Row) -> &str| {
            let widths = self.rows.iter().map(|row| width_of(words(row), size::TEXT));
            widths.fold(0.0, f64::max).min(WORDS_MAX) + GAP
        };
        let (names, remarks) = (widest(&|row| &row.name), widest(&|row| &row.remark));
        let frame = Frame {
            left: left + names,
            top,
            width: width - names - remarks,
            height: self.height(),
        };
        let mut chart = group("rows");
        chart.push(frame.clip(id));
        chart.push(self.x.draw_below(frame));
        let mut middle = top + ROW_HEIGHT / 2.0;
        for row in &self.rows {
            chart.push(self.draw_row(row, id, middle, left, frame));
            middle += ROW_HEIGHT;
        }
        chart.holding(line("axis", (frame.left, frame.top), (frame.left, frame.bottom())))
    }

    fn draw_row(&self, row: &Row, id: &str, middle: f64, left: f64, frame: Frame) -> Element {
        let scale = self.x.across(frame);
        let baseline = middle + size::TEXT * 0.36;
        let mut drawn = group("row");
        let name = fitted(&row.name, size::TEXT, WORDS_MAX);
        drawn.push(if row.is_heading {
            label("ink strong", size::TEXT, Anchor::Start, (left, baseline), &name)
        } else {
            label("ink", size::TEXT, Anchor::End, (frame.left - GAP, baseline), &name)
        });
        let mut data = group("data").with("clip-path", format!("url(#{id})"));
        for part in &row.parts {
            let (Some(from), Some(to)) = (scale.nearest(part.from), scale.nearest(part.to)) else {
                continue;
            };
            let top = middle - BAR_HEIGHT / 2.0;
            data.push(rectangle(part.class, from, top, (to - from).max(0.0), BAR_HEIGHT));
            if to - from > width_of(&part.words, size::SMALL) + 6.0 {
                let place = ((from + to) / 2.0, middle + size::SMALL * 0.36);
                data.push(label("ink", size::SMALL, Anchor::Middle, place, &part.words));
            }
        }
        let spots: Vec<(f64, &Spot)> =
            row.spots.iter().filter_map(|spot| Some((scale.place(spot.x)?, spot))).collect();
        if let (Some((first, spot)), Some((last, _))) = (spots.first(), spots.last()) {
            let class = format!("whisker {}", spot.mark.class);
            data.push(line(&class, (*first, middle), (*last, middle)));
        }
        for (x, spot) in &spots {
            data.push(spot.mark.point((*x, middle), spot.is_hollow));
        }
        drawn.push(data);
        let remark = fitted(&row.remark, size::TEXT, WORDS_MAX);
        let place = (frame.right() + GAP, baseline);
        drawn.holding(label("muted", size::TEXT, Anchor::Start, place, &remark))
    }
}
