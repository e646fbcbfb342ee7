//! What things look like: one colour, marker, dash pattern and letter for each strategy, and the style
//! classes that every picture shares.
//!
//! Colours are those of Okabe and Ito (Color Universal Design, 2008), which people with any common
//! colour vision tell apart; the light ones are darkened until lines of them stand out on white. Marker
//! and dash are different for every strategy as well, so that a print in grey can be read.

use super::element::{Element, path_through};
use super::text::FONTS;
use shared_types::wire::StrategyKind;

/// The shape of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Shape {
    /// A disc.
    Circle,
    /// A square on its side.
    Square,
    /// A triangle that points up.
    TriangleUp,
    /// A triangle that points down.
    TriangleDown,
    /// A square on its corner.
    Diamond,
    /// Two bars that stand upright.
    Plus,
    /// Two bars aslant.
    Cross,
    /// Six corners.
    Hexagon,
    /// A narrow upright bar.
    Bar,
}

/// How a strategy, or anything else that has a place in a legend, is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mark {
    /// Style class that sets the colour.
    pub class: &'static str,
    /// Of points.
    pub shape: Shape,
    /// Of lines, as `stroke-dasharray`; empty for a solid line.
    pub dashes: &'static str,
    /// Where there is no room for more.
    pub letter: char,
}

impl Mark {
    /// The look of `strategy`.
    #[must_use]
    pub const fn of(strategy: StrategyKind) -> Self {
        let (class, shape, dashes, letter) = match strategy {
            StrategyKind::Null => ("s-null", Shape::Bar, "1 4", 'N'),
            StrategyKind::Full => ("s-full", Shape::Square, "9 4", 'F'),
            StrategyKind::Boundary => ("s-boundary", Shape::Circle, "", 'B'),
            StrategyKind::Limited => ("s-limited", Shape::TriangleUp, "5 3", 'L'),
            StrategyKind::Hierarchy => ("s-hierarchy", Shape::Diamond, "9 3 2 3", 'H'),
            StrategyKind::Hybrid => ("s-hybrid", Shape::TriangleDown, "12 3 2 3 2 3", 'Y'),
            StrategyKind::Central => ("s-central", Shape::Cross, "3 3", 'C'),
            StrategyKind::CentralBatched => ("s-central-batched", Shape::Plus, "14 4", 'c'),
            StrategyKind::Pipelined => ("s-pipelined", Shape::Hexagon, "5 3 1 3", 'P'),
        };
        Self { class, shape, dashes, letter }
    }

    /// A point at `(x, y)`; hollow, and larger, if it stands for something that others said, so that
    /// both can be seen where they coincide.
    #[must_use]
    pub fn point(self, (x, y): (f64, f64), is_hollow: bool) -> Element {
        // Bars cannot be filled; hollow ones stand in a ring.
        let is_stroked = matches!(self.shape, Shape::Plus | Shape::Cross);
        let fill = if is_hollow || is_stroked { "hollow" } else { "point" };
        let outline = match (is_hollow, is_stroked) {
            (true, true) => {
                Self { shape: Shape::Circle, ..self }.outline((x, y), 1.7)
                    + &self.outline((x, y), 0.9)
            }
            (true, false) => self.outline((x, y), 1.5),
            (false, _) => self.outline((x, y), 1.0),
        };
        Element::new("path").with("class", format!("{fill} {}", self.class)).with("d", outline)
    }

    fn outline(self, (x, y): (f64, f64), scale: f64) -> String {
        let place = |&(right, down): &(f64, f64)| (x + scale * right, y + scale * down);
        let around = |corners: &[(f64, f64)]| -> String {
            path_through(&corners.iter().map(place).collect::<Vec<_>>(), true)
        };
        let bars = |one: [(f64, f64); 2], other: [(f64, f64); 2]| {
            let moved = |bar: [(f64, f64); 2]| path_through(&bar.map(|end| place(&end)), false);
            moved(one) + &moved(other)
        };
        match self.shape {
            Shape::Circle => around(&polygon(4.5, 24, 0.0)),
            Shape::Square => around(&[(-4.0, -4.0), (4.0, -4.0), (4.0, 4.0), (-4.0, 4.0)]),
            Shape::TriangleUp => around(&[(0.0, -5.5), (5.2, 4.0), (-5.2, 4.0)]),
            Shape::TriangleDown => around(&[(0.0, 5.5), (5.2, -4.0), (-5.2, -4.0)]),
            Shape::Diamond => around(&[(0.0, -5.8), (5.8, 0.0), (0.0, 5.8), (-5.8, 0.0)]),
            Shape::Plus => bars([(-5.5, 0.0), (5.5, 0.0)], [(0.0, -5.5), (0.0, 5.5)]),
            Shape::Cross => bars([(-4.2, -4.2), (4.2, 4.2)], [(-4.2, 4.2), (4.2, -4.2)]),
            Shape::Hexagon => around(&polygon(5.0, 6, 0.5)),
            Shape::Bar => around(&[(-1.6, -5.0), (1.6, -5.0), (1.6, 5.0), (-1.6, 5.0)]),
        }
    }
}

fn polygon(radius: f64, corners: u32, turn: f64) -> Vec<(f64, f64)> {
    let angle =
        |corner: u32| std::f64::consts::TAU * (f64::from(corner) + turn) / f64::from(corners);
    (0..corners)
        .map(|corner| (radius * angle(corner).cos(), radius * angle(corner).sin()))
        .collect()
}

/// A style class with its colour on white and on black.
const COLOURS: [(&str, &str, &str); 12] = [
    ("s-null", "#767676", "#a0a0a0"),
    ("s-full", "#d55e00", "#ff8c42"),
    ("s-boundary", "#0072b2", "#4aa8e8"),
    ("s-limited", "#b9608f", "#e39bc6"),
    ("s-hierarchy", "#00916a", "#2cc79a"),
    ("s-hybrid", "#8c7500", "#e6d048"),
    ("s-central", "#222222", "#f2f2f2"),
    ("s-central-batched", "#c98600", "#f2b544"),
    ("s-pipelined", "#3a9bd6", "#8fd0f7"),
    ("part-1", "#e1e6ec", "#2f353e"),
    ("part-2", "#b3bdca", "#465060"),
    ("part-3", "#8593a6", "#616e80"),
];

/// Colours of paper, text, weaker text, and lines behind data: on white and on black.
const SURFACES: [(&str, [&str; 4]); 2] = [
    ("", ["#ffffff", "#1b1f24", "#57606a", "#d8dee4"]),
    (
        "@media screen and (prefers-color-scheme: dark)",
        ["#14171b", "#e8eaed", "#a5adb8", "#343a42"],
    ),
];

/// The style sheet of a picture. Classes are valid inside `svg.picture` only, so that a page may hold
/// the sheet of each of its pictures.
#[must_use]
pub fn style_sheet() -> String {
    let mut sheet = format!(".picture{{font-family:{FONTS}}}\n");
    sheet += ".picture .title{font-weight:bold}.picture .strong{font-weight:bold}\
              .picture .curve{fill:none;stroke:currentColor;stroke-width:2;stroke-linejoin:round}\
              .picture .band{fill:currentColor;fill-opacity:.15;stroke:none}\
              .picture .whisker{stroke:currentColor;stroke-width:1.4}\
              .picture .leader{stroke:currentColor;stroke-width:1;stroke-opacity:.5}\
              .picture .fill{fill:currentColor;stroke:none}\
              .picture .tint{fill:currentColor;fill-opacity:.38;stroke:none}\
              .picture .grid,.picture .axis{fill:none;shape-rendering:crispEdges}\
              .picture .minor{stroke-opacity:.4}.picture .hollow{stroke:currentColor;stroke-width:1.8}\
              .picture .limit{fill:none;stroke-width:2.5}\n";
    for (place, (media, [paper, ink, muted, grid])) in SURFACES.into_iter().enumerate() {
        let mut rules = format!(
            ".picture .paper{{fill:{paper}}}.picture .ink{{fill:{ink}}}.picture .muted{{fill:{muted}}}\
             .picture .grid{{stroke:{grid}}}.picture .axis{{stroke:{muted}}}\
             .picture .limit{{stroke:{ink}}}.picture .hatch{{stroke:{ink}}}\
             .picture .tie{{fill:{grid}}}.picture .void{{fill:none;stroke:{grid}}}\
             .picture .point{{fill:currentColor;stroke:{paper};stroke-width:1}}\
             .picture .hollow{{fill:{paper}}}.picture .knockout{{fill:{paper}}}\
             .picture .halo{{fill:{ink};stroke:{paper};stroke-width:3;paint-order:stroke;\
             stroke-linejoin:round}}\
             .picture .under{{stroke:{paper};stroke-width:5.5}}\n"
        );
        for (class, on_white, on_black) in COLOURS {
            let colour = if place == 0 { on_white } else { on_black };
            rules += &format!(".picture .{class}{{color:{colour}}}");
        }
        sheet += &if media.is_empty() { rules + "\n" } else { format!("{media}{{\n{rules}\n}}\n") };
    }
    sheet
}

#[cfg(test)]
mod tests {
    use super::{COLOURS, Mark, style_sheet};
    use shared_types::wire::StrategyKind;
    use std::collections::BTreeSet;

    #[test]
    fn every_strategy_has_a_colour_marker_dash_and_letter_of_its_own() {
        let all = StrategyKind::ALL.map(Mark::of);
        let distinct =
            |what: &dyn Fn(&Mark) -> String| all.iter().map(what).collect::<BTreeSet<_>>().len();
        let colour = |mark: &Mark, of: usize| {
            let (_, on_white, on_black) =
                COLOURS.into_iter().find(|(class, ..)| *class == mark.class).unwrap();
            [on_white, on_black][of].to_owned()
        };
        assert_eq!(distinct(&|mark| colour(mark, 0)), all.len());
        assert_eq!(distinct(&|mark| colour(mark, 1)), all.len());
        assert_eq!(distinct(&|mark| mark.outline((0.0, 0.0), 1.0)), all.len());
        assert_eq!(distinct(&|mark| mark.dashes.to_owned()), all.len());
        assert_eq!(distinct(&|mark| mark.letter.to_string()), all.len());
    }

    #[test]
    fn lines_stand_out_on_their_paper() {
        for (class, on_white, on_black) in COLOURS.into_iter().filter(|row| row.0.starts_with("s-"))
        {
            assert!(contrast(on_white, "#ffffff") >= 3.0, "{class} on white");
            assert!(contrast(on_black, "#14171b") >= 3.0, "{class} on black");
        }
    }

    #[test]
    fn the_style_sheet_needs_nothing_from_elsewhere() {
        let sheet = style_sheet();
        assert!(!sheet.contains("url(") && !sheet.contains("@import") && !sheet.contains('<'));
        assert_eq!(sheet.matches('{').count(), sheet.matches('}').count());
    }

    /// Ratio of luminances by the Web Content Accessibility Guidelines 2.1, section 1.4.3.
    fn contrast(one: &str, other: &str) -> f64 {
        let luminance = |colour: &str| -> f64 {
            let channel = |at: usize| {
                let share = f64::from(u8::from_str_radix(&colour[at..at + 2], 16).unwrap()) / 255.0;
                if share <= 0.040_45 { share / 12.92 } else { ((share + 0.055) / 1.055).powf(2.4) }
            };
            0.2126 * channel(1) + 0.7152 * channel(3) + 0.0722 * channel(5)
        };
        let (one, other) = (luminance(one) + 0.05, luminance(other) + 0.05);
        one.max(other) / one.min(other)
    }
}
