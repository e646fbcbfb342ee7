//! The rectangle in which data is drawn.

use super::element::{Element, rectangle};

/// Sizes of type, in pixels of a picture that is 800 wide.
pub mod size {
    /// Of the picture's title.
    pub const TITLE: f64 = 18.0;
    /// Of a panel's title.
    pub const HEADING: f64 = 14.0;
    /// Of everything else.
    pub const TEXT: f64 = 12.5;
    /// Of what stands in cells of a map.
    pub const SMALL: f64 = 11.5;
}

/// A rectangle, in pixels from the top left of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Its left side.
    pub left: f64,
    /// Its upper side.
    pub top: f64,
    /// Its extent to the right.
    pub width: f64,
    /// Its extent downward.
    pub height: f64,
}

impl Frame {
    /// Its right side.
    #[must_use]
    pub const fn right(&self) -> f64 {
        self.left + self.width
    }

    /// Its lower side.
    #[must_use]
    pub const fn bottom(&self) -> f64 {
        self.top + self.height
    }

    /// Itself as a clip path with `id`, a little larger so that markers on its edge stay whole.
    #[must_use]
    pub fn clip(&self, id: &str) -> Element {
        const ROOM: f64 = 7.0;
        let area = rectangle(
            "clip",
            self.left - ROOM,
            self.top - ROOM,
            self.width + 2.0 * ROOM,
            self.height + 2.0 * ROOM,
        );
        Element::new("clipPath").with("id", id).holding(area)
    }
}
