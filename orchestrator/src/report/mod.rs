//! How results are shown: tables, JSON and CSV, from records alone.
//!
//! Nothing here runs a craft or reads a clock; whatever a report says can be said again from the
//! results directory. Each report is one file; each has the three forms of [`Report`], and each
//! number of its tables is a figure that the other two forms carry as well.

pub mod campaign;
mod capacities;
pub mod compare;
mod details;
pub mod diff;
mod document;
pub mod explain;
mod incidents;
mod loads;
pub mod map;
pub mod networks;
pub mod page;
mod pairs;
pub mod pictures;
pub mod published;
pub mod ranges;
pub mod reproduce;
pub mod run;
pub mod simulated;
pub mod solve;
pub mod svg;
pub mod sweep;
pub mod table;

use table::Colour;

/// How much a table shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Look {
    /// Whether to mark what needs attention with colour.
    pub colour: Colour,
    /// Everything, instead of the first screen.
    pub all: bool,
}

/// Something that can be shown in every form.
pub trait Report {
    /// For people; no line is longer than [`table::WIDTH`], apart from paths.
    fn table(&self, look: Look) -> String;

    /// One document, with every figure.
    fn json(&self) -> String;

    /// One row a figure.
    fn csv(&self) -> String;
}

#[cfg(test)]
mod tests;
