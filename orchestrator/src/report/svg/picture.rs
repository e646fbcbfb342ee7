//! A whole picture: title, what it shows, legend, panels one below the other, and notes.

use super::element::{Element, rectangle};
use super::frame::size;
use super::heat::{HeatMap, hatching};
use super::legend::{Entry, legend, legend_height};
use super::lines::{LineChart, NOTHING_HEIGHT, nothing};
use super::look::style_sheet;
use super::rows::RowChart;
use super::text::{Anchor, label, wrapped};

/// Width of every picture, in pixels; it scales to whatever room there is.
pub const WIDTH: f64 = 800.0;

/// Room around everything.
const MARGIN: f64 = 16.0;
/// Height of a line of text.
const LINE_HEIGHT: f64 = 17.0;
/// Room above a panel's title.
const ABOVE_PANEL: f64 = 14.0;
/// Height of a panel's title.
const PANEL_TITLE: f64 = 26.0;

/// What a panel shows.
#[derive(Clone, Debug, PartialEq)]
pub enum Panel {
    /// Lines over two axes.
    Lines(LineChart),
    /// Rows over one axis.
    Rows(RowChart),
    /// A map of cells.
    Heat(HeatMap),
    /// Why there is nothing to see.
    Nothing(String),
}

impl Panel {
    fn title(&self) -> &str {
        match self {
            Self::Lines(chart) => &chart.title,
            Self::Rows(chart) => &chart.title,
            Self::Heat(map) => &map.title,
            Self::Nothing(_) => "",
        }
    }

    fn title_height(&self) -> f64 {
        if self.title().is_empty() { 0.0 } else { PANEL_TITLE }
    }

    fn height(&self) -> f64 {
        self.title_height()
            + match self {
                Self::Lines(chart) => chart.full_height(),
                Self::Rows(chart) => chart.full_height(),
                Self::Heat(map) => map.full_height(),
                Self::Nothing(_) => NOTHING_HEIGHT,
            }
    }

    fn draw(&self, id: &str, pattern: &str, top: f64) -> Element {
        let (left, width) = (MARGIN, WIDTH - 2.0 * MARGIN);
        let mut panel = super::element::group("panel");
        if !self.title().is_empty() {
            let place = (left, top + size::HEADING);
            panel.push(label("ink strong", size::HEADING, Anchor::Start, place, self.title()));
        }
        let top = top + self.title_height();
        panel.holding(match self {
            Self::Lines(chart) => chart.draw(id, left, top, width),
            Self::Rows(chart) => chart.draw(id, left, top, width),
            Self::Heat(map) => map.draw(id, pattern, left, top, width),
            Self::Nothing(words) => nothing(words, left, top, width),
        })
    }
}

/// A picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Name of its file without extension; ids inside begin with it.
    pub name: String,
    /// Its title.
    pub title: String,
    /// What was measured, in one or two sentences.
    pub about: String,
    /// Above the panels.
    pub legend: Vec<Entry>,
    /// From the top on.
    pub panels: Vec<Panel>,
    /// Below the panels: n, load, what is left out.
    pub notes: Vec<String>,
}

impl Picture {
    /// A picture of nothing that says why.
    #[must_use]
    pub fn of_nothing(name: &str, title: impl Into<String>, why: &str) -> Self {
        Self {
            name: name.to_owned(),
            title: title.into(),
            about: String::new(),
            legend: Vec::new(),
            panels: vec![Panel::Nothing(why.to_owned())],
            notes: Vec::new(),
        }
    }

    /// The id of this picture's hatching.
    #[must_use]
    pub fn hatching_id(name: &str) -> String {
        format!("{name}-hatching")
    }

    /// The picture as a file of its own.
    #[must_use]
    pub fn document(&self) -> String {
        let style = Element::new("style").text(style_sheet());
        let mut svg = self.root();
        svg.push(style);
        let text = self.drawn(svg).with("xmlns", "http://www.w3.org/2000/svg").render();
        format!("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n{text}\n")
    }

    /// The picture as an element of a page that holds the style sheet.
    #[must_use]
    pub fn inline(&self) -> Element {
        self.drawn(self.root())
    }

    fn root(&self) -> Element {
        Element::new("svg").with("class", "picture").with("role", "img")
    }

    fn drawn(&self, mut svg: Element) -> Element {
        let pattern = Self::hatching_id(&self.name);
        svg.push(Element::new("title").text(&self.title));
        svg.push(Element::new("desc").text(&self.about));
        let has_map = self.panels.iter().any(|panel| matches!(panel, Panel::Heat(_)));
        if has_map {
            svg.push(Element::new("defs").holding(hatching(&pattern)));
        }
        let mut body = super::element::group("body");
        let mut top = MARGIN + size::TITLE;
        let text_width = WIDTH - 2.0 * MARGIN;
        for line in wrapped(&self.title, size::TITLE, text_width) {
            body.push(label("ink title", size::TITLE, Anchor::Start, (MARGIN, top), &line));
            top += size::TITLE + 4.0;
        }
        for line in wrapped(&self.about, size::TEXT, text_width) {
            body.push(label("muted", size::TEXT, Anchor::Start, (MARGIN, top), &line));
            top += LINE_HEIGHT;
        }
        if !self.legend.is_empty() {
            body.push(legend(&self.legend, MARGIN, top, text_width));
            top += legend_height(&self.legend, text_width);
        }
        for (place, panel) in self.panels.iter().enumerate() {
            top += ABOVE_PANEL;
            body.push(panel.draw(&format!("{}-panel-{place}", self.name), &pattern, top));
            top += panel.height();
        }
        top += ABOVE_PANEL;
        for line in self.notes.iter().flat_map(|note| wrapped(note, size::TEXT, text_width)) {
            body.push(label("muted", size::TEXT, Anchor::Start, (MARGIN, top), &line));
            top += LINE_HEIGHT;
        }
        let height = top + MARGIN / 2.0;
        svg.push(rectangle("paper", 0.0, 0.0, WIDTH, height));
        svg.push(body);
        let view_box = format!("0 0 {WIDTH} {}", super::element::coordinate(height));
        svg.with("viewBox", view_box)
    }
}
