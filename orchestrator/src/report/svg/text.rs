//! How wide text will be, without a font at hand.
//!
//! Widths are those of Helvetica (Adobe's font metrics for its core fonts), which the usual substitutes
//! share, with an allowance for wider fonts. They serve to keep labels apart and inside the picture,
//! not to set type.

use super::element::Element;

/// Fonts that the widths fit, most exact first.
pub const FONTS: &str = "Helvetica, Arial, Liberation Sans, sans-serif";

/// How much wider than measured the reader's font may be.
const ALLOWANCE: f64 = 1.1;

/// Widths of the printable ASCII signs from the space on, in thousandths of the font's size.
const WIDTHS: [u16; 95] = [
    278, 278, 355, 556, 556, 889, 667, 191, 333, 333, 389, 584, 278, 333, 278, 278, // to /
    556, 556, 556, 556, 556, 556, 556, 556, 556, 556, 278, 278, 584, 584, 584, 556, // to ?
    1015, 667, 667, 722, 722, 667, 611, 778, 722, 278, 500, 667, 556, 833, 722, 778, // to O
    667, 778, 722, 667, 611, 722, 667, 944, 667, 667, 611, 278, 278, 278, 469, 556, // to _
    333, 556, 556, 500, 556, 556, 278, 556, 556, 222, 222, 500, 222, 833, 556, 556, // to o
    556, 556, 333, 500, 278, 556, 500, 722, 500, 500, 500, 334, 260, 334, 584, // to ~
];

/// Width of any other sign: as wide as it is high.
const OTHER: u16 = 1000;

/// Where text stands relative to its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    /// It begins there.
    Start,
    /// It is centred there.
    Middle,
    /// It ends there.
    End,
}

/// An upper bound of the width of `text`, in pixels.
#[must_use]
pub fn width_of(text: &str, size: f64) -> f64 {
    let thousandths: f64 = text.chars().map(width_of_sign).sum();
    thousandths * size / 1000.0 * ALLOWANCE
}

fn width_of_sign(sign: char) -> f64 {
    let place = u32::from(sign).checked_sub(u32::from(' '));
    let width = place.and_then(|place| WIDTHS.get(usize::try_from(place).ok()?));
    f64::from(*width.unwrap_or(&OTHER))
}

/// `text`, shortened with dots at its end if it is wider than `width`.
#[must_use]
pub fn fitted(text: &str, size: f64, width: f64) -> String {
    if width_of(text, size) <= width {
        return text.to_owned();
    }
    let mut short: String = text.to_owned();
    while !short.is_empty() && width_of(&short, size) + width_of("...", size) > width {
        short.pop();
    }
    short + "..."
}

/// `text` broken at spaces into lines of at most `width`; a longer word has a line of its own.
#[must_use]
pub fn wrapped(text: &str, size: f64, width: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if width_of(&format!("{line} {word}"), size) <= width => {
                line.push(' ');
                *line += word;
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// Text with its baseline at `place`.
#[must_use]
pub fn label(class: &str, size: f64, anchor: Anchor, place: (f64, f64), text: &str) -> Element {
    let element = Element::new("text").with("class", class).at("x", place.0).at("y", place.1);
    let element = match anchor {
        Anchor::Start => element,
        Anchor::Middle => element.with("text-anchor", "middle"),
        Anchor::End => element.with("text-anchor", "end"),
    };
    element.at("font-size", size).text(text)
}

#[cfg(test)]
mod tests {
    use super::{fitted, width_of, wrapped};

    #[test]
    fn wider_text_is_wider() {
        assert!(width_of("iii", 10.0) < width_of("mmm", 10.0));
        assert!((width_of("10", 20.0) - 2.0 * width_of("10", 10.0)).abs() < 1e-9);
        assert!(width_of("\u{4e16}", 10.0) >= 10.0);
    }

    #[test]
    fn long_text_is_shortened_or_wrapped_to_what_fits() {
        let text = "central-batched replication of everything that was ever known";
        for width in [40.0, 100.0, 200.0] {
            assert!(width_of(&fitted(text, 12.0, width), 12.0) <= width);
            let lines = wrapped(text, 12.0, width);
            assert_eq!(lines.join(" "), text);
            let fits = |line: &String| !line.contains(' ') || width_of(line, 12.0) <= width;
            assert!(lines.iter().all(fits), "{lines:?}");
        }
        assert_eq!(fitted("short", 12.0, 100.0), "short");
    }
}
