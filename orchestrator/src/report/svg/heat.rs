//! A map of cells: colour for who wins, hatching where somebody else says otherwise, words in each cell,
//! and lines across.
//!
//! Places on the map are counted in cells from the lower left corner, so that a line may cross a cell
//! anywhere; what lies outside is cut off.

use super::element::{Element, group, line, path_through, rectangle};
use super::frame::{Frame, size};
use super::text::{Anchor, fitted, label, width_of};

/// One cell.
#[derive(Clone, Debug, PartialEq)]
pub struct HeatCell {
    /// Number of its column from the left.
    pub column: usize,
    /// Number of its row from the bottom.
    pub row: usize,
    /// Style class that sets its colour; `None` for a tie.
    pub class: Option<&'static str>,
    /// Whether it is hatched.
    pub is_hatched: bool,
    /// In bold, then below.
    pub words: [String; 2],
}

/// A line across the map.
#[derive(Clone, Debug, PartialEq)]
pub struct Limit {
    /// As `stroke-dasharray`; empty for a solid line.
    pub dashes: &'static str,
    /// In cells from the lower left corner, from left to right.
    pub points: Vec<(f64, f64)>,
}

/// A map.
#[derive(Clone, Debug, PartialEq)]
pub struct HeatMap {
    /// Above it.
    pub title: String,
    /// Below its columns.
    pub x_title: String,
    /// Beside its rows.
    pub y_title: String,
    /// From the left.
    pub columns: Vec<String>,
    /// From the bottom.
    pub rows: Vec<String>,
    /// In any order.
    pub cells: Vec<HeatCell>,
    /// Drawn over the cells.
    pub limits: Vec<Limit>,
}

/// Height of a row.
const ROW_HEIGHT: f64 = 40.0;
/// Room below, for the names of columns and the title.
const ROOM_BELOW: f64 = 42.0;
/// Room between cells.
const SEAM: f64 = 1.5;
/// Distance of the lines of a hatching.
const HATCH: f64 = 7.0;

/// The pattern with which hatched cells are filled.
#[must_use]
pub fn hatching(id: &str) -> Element {
    Element::new("pattern")
        .with("id", id)
        .with("patternUnits", "userSpaceOnUse")
        .at("width", HATCH)
        .at("height", HATCH)
        .with("patternTransform", "rotate(45)")
        .holding(
            line("hatch", (0.0, 0.0), (0.0, HATCH))
                .with("stroke-width", "2.2")
                .with("stroke-opacity", "0.55"),
        )
}

impl HeatMap {
    /// Height with the names of its columns.
    #[must_use]
    pub fn full_height(&self) -> f64 {
        self.height() + ROOM_BELOW
    }

    fn height(&self) -> f64 {
        steps(self.rows.len()) * ROW_HEIGHT
    }

    /// Draws it within `width` from `(left, top)` on; `id` is of its clip path, `pattern` of the
    /// hatching.
    #[must_use]
    pub fn draw(&self, id: &str, pattern: &str, left: f64, top: f64, width: f64) -> Element {
        let names = self.rows.iter().map(|name| width_of(name, size::TEXT)).fold(0.0, f64::max);
        let room_left = names + size::TEXT + 20.0;
        let frame =
            Frame { left: left + room_left, top, width: width - room_left, height: self.height() };
        let mut map = group("map");
        map.push(Element::new("clipPath").with("id", id).holding(rectangle(
            "clip",
            frame.left,
            frame.top,
            frame.width,
            frame.height,
        )));
        map.push(self.draw_names(left, frame));
        let mut cells = group("cells");
        for cell in &self.cells {
            cells.push(self.draw_cell(cell, pattern, frame));
        }
        map.push(cells);
        let mut limits = group("limits").with("clip-path", format!("url(#{id})"));
        for limit in &self.limits {
            let points: Vec<(f64, f64)> = limit
                .points
                .iter()
                .filter(|(x, y)| x.is_finite() && y.is_finite())
                .map(|&(x, y)| {
                    (frame.left + x * self.column_width(frame), frame.bottom() - y * ROW_HEIGHT)
                })
                .collect();
            // Under every line a broader one in the colour of the paper, to be seen on any cell.
            let path = Element::new("path").with("d", path_through(&points, false));
            limits.push(path.clone().with("class", "limit under"));
            limits.push(path.with("class", "limit").with("stroke-dasharray", limit.dashes));
        }
        map.push(limits);
        let mut words = group("words");
        for cell in &self.cells {
            words.push(self.draw_words(cell, frame));
        }
        map.holding(words)
    }

    fn column_width(&self, frame: Frame) -> f64 {
        frame.width / steps(self.columns.len().max(1))
    }

    fn draw_names(&self, left: f64, frame: Frame) -> Element {
        let mut names = group("names");
        for (row, name) in self.rows.iter().enumerate() {
            let y = frame.bottom() - (steps(row) + 0.5) * ROW_HEIGHT + size::TEXT * 0.36;
            names.push(label("ink", size::TEXT, Anchor::End, (frame.left - 8.0, y), name));
        }
        let width = self.column_width(frame);
        for (column, name) in self.columns.iter().enumerate() {
            let place =
                (frame.left + (steps(column) + 0.5) * width, frame.bottom() + size::TEXT + 4.0);
            let name = fitted(name, size::TEXT, width);
            names.push(label("ink", size::TEXT, Anchor::Middle, place, &name));
        }
        let place = (frame.left + frame.width / 2.0, frame.bottom() + ROOM_BELOW - 6.0);
        names.push(label("muted", size::TEXT, Anchor::Middle, place, &self.x_title));
        let (x, y) = (left + size::TEXT, frame.top + frame.height / 2.0);
        let turned = format!(
            "rotate(-90 {} {})",
            super::element::coordinate(x),
            super::element::coordinate(y)
        );
        let title = label("muted", size::TEXT, Anchor::Middle, (x, y), &self.y_title);
        names.holding(title.with("transform", turned))
    }

    /// Left, top and width of a cell.
    fn area(&self, cell: &HeatCell, frame: Frame) -> (f64, f64, f64) {
        let width = self.column_width(frame);
        let left = frame.left + steps(cell.column) * width;
        (left, frame.bottom() - (steps(cell.row) + 1.0) * ROW_HEIGHT, width)
    }

    fn draw_cell(&self, cell: &HeatCell, pattern: &str, frame: Frame) -> Element {
        let (left, top, width) = self.area(cell, frame);
        let area = |class: &str| {
            let (width, height) = (width - 2.0 * SEAM, ROW_HEIGHT - 2.0 * SEAM);
            rectangle(class, left + SEAM, top + SEAM, width.max(0.0), height)
        };
        let mut drawn = group("cell");
        drawn.push(match cell.class {
            Some(class) => area(class),
            None => area("tie"),
        });
        if cell.is_hatched {
            drawn.push(area("hatched").with("style", format!("fill:url(#{pattern})")));
        }
        drawn
    }

    fn draw_words(&self, cell: &HeatCell, frame: Frame) -> Element {
        let (left, top, width) = self.area(cell, frame);
        let mut words = group("cell");
        let baselines = [top + ROW_HEIGHT / 2.0 - 5.5, top + ROW_HEIGHT / 2.0 + 14.5];
        for ((text, y), class) in cell.words.iter().zip(baselines).zip(["halo strong", "halo"]) {
            let text = fitted(text, size::SMALL, width - 2.0 * SEAM);
            words.push(label(class, size::SMALL, Anchor::Middle, (left + width / 2.0, y), &text));
        }
        words
    }
}

/// A number of cells as a length in cells.
fn steps(count: usize) -> f64 {
    u32::try_from(count).map_or(0.0, f64::from)
}
