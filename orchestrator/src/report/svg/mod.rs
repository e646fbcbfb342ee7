//! A small kit for drawing charts as SVG: scales, axes, lines, rows of bars, heat maps.
//!
//! A [`picture::Picture`] is a title, panels and notes; each panel is laid out from measured text, so
//! that labels stand beside data and never on it. Everything is plain vectors with a handful of style
//! classes; colours follow the reader's colour scheme, and markers, dashes and letters carry the same
//! meaning without any colour. Coordinates come from [`scale::Scale`] alone, which has no place for a
//! value that is not finite or lies outside its axis. The same input gives the same bytes.
//! Not here: what is drawn, see [`super::pictures`]; scripts, animation, external resources.

pub mod axis;
pub mod element;
pub mod frame;
pub mod heat;
pub mod legend;
pub mod lines;
pub mod look;
pub mod number;
pub mod picture;
pub mod rows;
pub mod scale;
pub mod text;

#[cfg(test)]
mod tests;
