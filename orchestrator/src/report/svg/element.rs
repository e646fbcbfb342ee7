//! Elements of XML with escaped text and attributes, written out depth first.
//!
//! Every element is closed by a tag of its own, so that the same text is valid as a file of SVG and
//! inside a page of HTML.

use std::fmt::Write as _;

/// What stands inside an element.
#[derive(Clone, Debug, PartialEq)]
enum Content {
    Element(Element),
    Text(String),
}

/// An element with its attributes and what is in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Element {
    name: &'static str,
    attributes: Vec<(&'static str, String)>,
    contents: Vec<Content>,
}

impl Element {
    /// An empty element.
    #[must_use]
    pub const fn new(name: &'static str) -> Self {
        Self { name, attributes: Vec::new(), contents: Vec::new() }
    }

    /// With one more attribute.
    #[must_use]
    pub fn with(mut self, name: &'static str, value: impl Into<String>) -> Self {
        self.attributes.push((name, value.into()));
        self
    }

    /// With one more attribute, a coordinate or length in pixels.
    #[must_use]
    pub fn at(self, name: &'static str, pixels: f64) -> Self {
        self.with(name, coordinate(pixels))
    }

    /// With text at its end.
    #[must_use]
    pub fn text(mut self, text: impl Into<String>) -> Self {
        self.contents.push(Content::Text(text.into()));
        self
    }

    /// With an element at its end.
    #[must_use]
    pub fn holding(mut self, element: Self) -> Self {
        self.push(element);
        self
    }

    /// Puts an element at its end.
    pub fn push(&mut self, element: Self) {
        self.contents.push(Content::Element(element));
    }

    /// The element as text. Elements that hold elements take lines of their own.
    #[must_use]
    pub fn render(&self) -> String {
        let mut text = String::new();
        self.write(&mut text);
        text
    }

    fn write(&self, text: &mut String) {
        // Writing to a string cannot fail.
        let _ = write!(text, "<{}", self.name);
        for (name, value) in &self.attributes {
            let _ = write!(text, " {name}=\"{}\"", escaped(value));
        }
        text.push('>');
        for content in &self.contents {
            match content {
                Content::Text(words) => *text += &escaped(words),
                Content::Element(element) => {
                    // Only where a line break does not become a space of some text.
                    if element.name != "tspan" {
                        text.push('\n');
                    }
                    element.write(text);
                }
            }
        }
        let _ = write!(text, "</{}>", self.name);
    }
}

/// A group of elements that share a style class.
#[must_use]
pub fn group(class: &str) -> Element {
    Element::new("g").with("class", class)
}

/// A straight line.
#[must_use]
pub fn line(class: &str, from: (f64, f64), to: (f64, f64)) -> Element {
    Element::new("line")
        .with("class", class)
        .at("x1", from.0)
        .at("y1", from.1)
        .at("x2", to.0)
        .at("y2", to.1)
}

/// A rectangle.
#[must_use]
pub fn rectangle(class: &str, left: f64, top: f64, width: f64, height: f64) -> Element {
    Element::new("rect")
        .with("class", class)
        .at("x", left)
        .at("y", top)
        .at("width", width)
        .at("height", height)
}

/// The data of a path through `points`, closed if asked for.
#[must_use]
pub fn path_through(points: &[(f64, f64)], is_closed: bool) -> String {
    let mut data = String::new();
    for (place, &(x, y)) in points.iter().enumerate() {
        let step = if place == 0 { 'M' } else { 'L' };
        let _ = write!(data, "{step}{} {}", coordinate(x), coordinate(y));
    }
    if is_closed {
        data.push('Z');
    }
    data
}

/// `pixels` with at most two decimals.
///
/// # Panics
/// If it is not finite: coordinates come from scales, which place nothing that is not.
#[must_use]
pub fn coordinate(pixels: f64) -> String {
    assert!(pixels.is_finite(), "invariant: a coordinate is finite");
    let text = format!("{pixels:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// `text` for use between tags and inside quotes; signs that XML cannot hold become `?`.
#[must_use]
pub fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for sign in text.chars() {
        match sign {
            '&' => escaped += "&amp;",
            '<' => escaped += "&lt;",
            '>' => escaped += "&gt;",
            '"' => escaped += "&quot;",
            '\'' => escaped += "&#39;",
            '\n' | '\t' => escaped.push(sign),
            '\u{fffe}' | '\u{ffff}' => escaped.push('?'),
            sign if sign.is_control() => escaped.push('?'),
            sign => escaped.push(sign),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::{Element, coordinate, escaped, path_through};

    #[test]
    fn text_and_attributes_are_escaped() {
        let element = Element::new("a").with("b", "\"<&>'").text("<&>\u{1}\u{ffff}");
        let text = "<a b=\"&quot;&lt;&amp;&gt;&#39;\">&lt;&amp;&gt;??</a>";
        assert_eq!(element.render(), text);
        assert_eq!(escaped("plain"), "plain");
    }

    #[test]
    fn coordinates_are_short() {
        for (pixels, text) in [
            (1.0, "1"),
            (1.005, "1"),
            (1.5, "1.5"),
            (-0.001, "0"),
            (1234.567, "1234.57"),
            (100.0, "100"),
        ] {
            assert_eq!(coordinate(pixels), text);
        }
        assert_eq!(path_through(&[(1.0, 2.0), (3.0, 4.5)], true), "M1 2L3 4.5Z");
    }

    #[test]
    #[should_panic(expected = "a coordinate is finite")]
    fn no_coordinate_is_not_a_number() {
        let _ = coordinate(f64::NAN);
    }
}
