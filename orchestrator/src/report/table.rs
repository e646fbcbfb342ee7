//! Plain tables of fixed-width text that stay within a terminal of 80 columns.
//!
//! A column is as wide as its widest cell; a column that holds nothing but dashes is left out.
//! Cells are ASCII. Numbers are shortened to a given number of signs by [`short`]; exact numbers
//! are in the JSON and CSV forms of the same report.

use super::svg::element::Element;
use std::borrow::Cow;

/// Width that every table, legend and sentence keeps to.
pub const WIDTH: usize = 80;

/// What stands where a number cannot be given.
pub const DASH: &str = "-";

/// Whether tables are drawn with colour. Only marks that need attention are coloured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Colour {
    /// Plain text: for files, pipes, and whoever sets `NO_COLOR`.
    #[default]
    Never,
    /// ANSI sequences.
    Always,
}

impl Colour {
    /// Colour only on a terminal whose user does not object (<https://no-color.org>).
    #[must_use]
    pub fn detect(is_terminal: bool, no_color: Option<&std::ffi::OsStr>) -> Self {
        let objects = no_color.is_some_and(|value| !value.is_empty());
        if is_terminal && !objects { Self::Always } else { Self::Never }
    }

    /// `text` as a heading.
    #[must_use]
    pub fn heading(self, text: &str) -> String {
        self.paint("1", text)
    }

    /// `text` as something that is wrong.
    #[must_use]
    pub fn alarm(self, text: &str) -> String {
        self.paint("1;31", text)
    }

    fn paint(self, code: &str, text: &str) -> String {
        match self {
            Self::Always => format!("\u{1b}[{code}m{text}\u{1b}[0m"),
            Self::Never => text.to_owned(),
        }
    }
}

/// One column: what stands above it, and above which group of columns it stands.
#[derive(Clone, Debug)]
pub struct Column {
    /// Its own head.
    pub head: Cow<'static, str>,
    /// Head over this and its neighbours of the same group; empty for none.
    pub group: &'static str,
}

/// A column under `group`.
#[must_use]
pub const fn column(group: &'static str, head: &'static str) -> Column {
    Column { head: Cow::Borrowed(head), group }
}

/// A column without a group, under a head that is known only at run time.
#[must_use]
pub fn head(head: &str) -> Column {
    Column { head: Cow::Owned(head.to_owned()), group: "" }
}

/// A line of a table.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Line {
    /// One cell a column.
    Cells(Vec<String>),
    /// A heading between rows, over the whole width.
    Section(String),
}

/// A table under construction. The first column is aligned to the left, the others to the right.
#[derive(Clone, Debug)]
pub struct Table {
    columns: Vec<Column>,
    lines: Vec<Line>,
}

impl Table {
    /// An empty table.
    #[must_use]
    pub fn new(columns: &[Column]) -> Self {
        Self { columns: columns.to_vec(), lines: Vec::new() }
    }

    /// Adds a row.
    ///
    /// # Panics
    /// If it has not one cell a column.
    pub fn row(&mut self, cells: Vec<String>) {
        assert_eq!(cells.len(), self.columns.len(), "invariant: one cell a column");
        self.lines.push(Line::Cells(cells));
    }

    /// Adds a heading between rows.
    pub fn section(&mut self, heading: impl Into<String>) {
        self.lines.push(Line::Section(heading.into()));
    }

    /// Whether no row was added.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.rows().next().is_none()
    }

    fn rows(&self) -> impl Iterator<Item = &[String]> {
        self.lines.iter().filter_map(|line| match line {
            Line::Cells(cells) => Some(cells.as_slice()),
            Line::Section(_) => None,
        })
    }

    /// The table as text.
    #[must_use]
    pub fn render(&self, colour: Colour) -> String {
        let shown = self.shown();
        let mut widths: Vec<usize> = shown
            .iter()
            .map(|&column| {
                let cells = self.rows().map(|cells| cells[column].len()).max().unwrap_or(0);
                cells.max(self.columns[column].head.len())
            })
            .collect();
        self.widen_for_groups(&shown, &mut widths);
        let line = |cell: &dyn Fn(usize) -> String| {
            let cells = shown.iter().zip(&widths).enumerate().map(|(place, (&column, &width))| {
                let cell = cell(column);
                if place == 0 { format!("{cell:<width$}") } else { format!("{cell:>width$}") }
            });
            let text = cells.collect::<Vec<_>>().join(" ");
            format!("{}\n", text.trim_end())
        };
        let mut text = self.groups(&shown, &widths);
        text += &colour.heading(line(&|column| self.columns[column].head.to_string()).trim_end());
        text.push('\n');
        for row in &self.lines {
            match row {
                Line::Cells(cells) => text += &line(&|column| cells[column].clone()),
                Line::Section(heading) => {
                    text += &colour.heading(&clip(heading, WIDTH));
                    text.push('\n');
                }
            }
        }
        text
    }

    /// The table as an element of a page: every column that the text shows, with the heads of groups.
    #[must_use]
    pub fn html(&self) -> Element {
        let shown = self.shown();
        let cells = |name: &'static str, texts: &mut dyn Iterator<Item = String>| {
            let mut row = Element::new("tr");
            texts.for_each(|text| row.push(Element::new(name).text(text)));
            row
        };
        let mut head = Element::new("thead");
        let spans = self.spans(&shown);
        if spans.iter().any(|(group, _)| !group.is_empty()) {
            let mut groups = Element::new("tr");
            for (group, span) in spans {
                let wide = Element::new("th").with("colspan", span.len().to_string());
                groups.push(wide.text(group));
            }
            head.push(groups);
        }
        let mut names = shown.iter().map(|&column| self.columns[column].head.trim().to_owned());
        head.push(cells("th", &mut names));
        let mut body = Element::new("tbody");
        for line in &self.lines {
            body.push(match line {
                Line::Cells(texts) => {
                    cells("td", &mut shown.iter().map(|&column| texts[column].trim().to_owned()))
                }
                Line::Section(heading) => {
                    let span = Element::new("th").with("colspan", shown.len().to_string());
                    Element::new("tr").holding(span.text(heading))
                }
            });
        }
        Element::new("table").holding(head).holding(body)
    }

    /// The columns that hold anything but dashes, and the first.
    fn shown(&self) -> Vec<usize> {
        (0..self.columns.len())
            .filter(|&column| column == 0 || self.rows().any(|cells| cells[column] != DASH))
            .collect()
    }

    /// The places of `shown` at which a group begins, with the places that it spans.
    fn spans(&self, shown: &[usize]) -> Vec<(&'static str, std::ops::Range<usize>)> {
        let group_at = |place: usize| self.columns[shown[place]].group;
        let mut spans: Vec<(&'static str, std::ops::Range<usize>)> = Vec::new();
        for place in 0..shown.len() {
            match spans.last_mut() {
                Some((group, span)) if *group == group_at(place) => span.end = place + 1,
                _ => spans.push((group_at(place), place..place + 1)),
            }
        }
        spans
    }

    /// Makes room for the heads of groups that lost columns.
    fn widen_for_groups(&self, shown: &[usize], widths: &mut [usize]) {
        for (group, span) in self.spans(shown) {
            let have = widths[span.clone()].iter().sum::<usize>() + span.len() - 1;
            widths[span.start] += group.len().saturating_sub(have);
        }
    }

    /// The line of group heads, empty if there are none.
    fn groups(&self, shown: &[usize], widths: &[usize]) -> String {
        let heads = self.spans(shown).into_iter().map(|(group, span)| {
            let width = widths[span.clone()].iter().sum::<usize>() + span.len() - 1;
            format!("{group:>width$}")
        });
        let text = heads.collect::<Vec<_>>().join(" ");
        if text.trim().is_empty() { String::new() } else { format!("{}\n", text.trim_end()) }
    }
}

/// `text` cut to `width` signs.
#[must_use]
pub fn clip(text: &str, width: usize) -> String {
    text.chars().take(width).collect()
}

/// `text` broken at spaces into lines of [`WIDTH`], the first after `lead`, the others indented alike.
#[must_use]
pub fn wrap(lead: &str, text: &str) -> String {
    let indent = lead.len();
    let (mut out, mut line) = (String::new(), lead.to_owned());
    for word in text.split_whitespace() {
        if line.len() > indent && line.len() + 1 + word.len() > WIDTH {
            out += line.trim_end();
            out.push('\n');
            line = " ".repeat(indent);
        } else if line.len() > indent {
            line.push(' ');
        }
        line += word;
    }
    out + line.trim_end() + "\n"
}

/// `value` in at most `signs` signs: one decimal where it fits, else whole, else in thousands (k),
/// millions (M) or more; a dash for nothing.
#[must_use]
pub fn short(value: Option<f64>, signs: usize) -> String {
    let Some(value) = value.filter(|value| value.is_finite()) else { return DASH.to_owned() };
    let scales = [(1.0, ""), (1e3, "k"), (1e6, "M"), (1e9, "G"), (1e12, "T")];
    for (scale, suffix) in scales {
        let scaled = value / scale;
        // A scale that leaves nothing before the point loses digits that a larger one cannot show.
        for text in [format!("{scaled:.1}{suffix}"), format!("{scaled:.0}{suffix}")] {
            if text.len() <= signs {
                return text;
            }
        }
    }
    format!("{value:.0e}")
}

/// `value` with `decimals` decimals; a dash for nothing.
#[must_use]
pub fn exact(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(|| DASH.to_owned(), |value| format!("{value:.decimals$}"))
}

#[cfg(test)]
mod tests {
    use super::{Colour, Table, WIDTH, column, exact, short, wrap};
    use std::ffi::OsStr;

    #[test]
    fn numbers_keep_as_many_digits_as_fit() {
        for (value, signs, text) in [
            (0.0, 4, "0.0"),
            (13.84, 4, "13.8"),
            (120.6, 4, "121"),
            (120.6, 5, "120.6"),
            (1411.6, 4, "1412"),
            (1411.6, 5, "1412"),
            (9999.6, 4, "10k"),
            (12_345.0, 5, "12345"),
            (123_456.0, 5, "123k"),
            (1_234_567.0, 4, "1.2M"),
            (-0.34, 4, "-0.3"),
            (-12.34, 4, "-12"),
            (9.96e9, 4, "10G"),
        ] {
            assert_eq!(short(Some(value), signs), text, "{value} in {signs}");
        }
        assert_eq!(short(None, 4), "-");
        assert_eq!(short(Some(f64::NAN), 4), "-");
        assert_eq!(exact(Some(1.25), 2), "1.25");
    }

    #[test]
    fn columns_of_dashes_vanish_and_groups_span_what_is_left() {
        let mut table = Table::new(&[
            column("", "name"),
            column("counts", "a"),
            column("counts", "b"),
            column("times", "p50"),
        ]);
        table.row(["full", "1.0", "2.0", "-"].map(str::to_owned).to_vec());
        table.section("two");
        table.row(["null", "10.0", "2.0", "-"].map(str::to_owned).to_vec());
        let text = table.render(Colour::Never);
        assert_eq!(text, "       counts\nname    a   b\nfull  1.0 2.0\ntwo\nnull 10.0 2.0\n");
        let html = table.html().render().replace('\n', "");
        let head = "<tr><th colspan=\"1\"></th><th colspan=\"2\">counts</th></tr>\
                    <tr><th>name</th><th>a</th><th>b</th></tr>";
        assert!(html.contains(head), "{html}");
        assert!(html.contains("<tr><th colspan=\"3\">two</th></tr><tr><td>null</td>"), "{html}");
    }

    #[test]
    fn long_sentences_wrap_under_their_lead() {
        let text = wrap("request  ", &"word ".repeat(40));
        assert!(text.lines().all(|line| line.len() <= WIDTH));
        assert!(text.lines().skip(1).all(|line| line.starts_with("         word")));
    }

    #[test]
    fn colour_needs_a_terminal_and_no_objection() {
        assert_eq!(Colour::detect(true, None), Colour::Always);
        assert_eq!(Colour::detect(true, Some(OsStr::new(""))), Colour::Always);
        assert_eq!(Colour::detect(true, Some(OsStr::new("1"))), Colour::Never);
        assert_eq!(Colour::detect(false, None), Colour::Never);
    }
}
