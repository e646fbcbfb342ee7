//! The frame of pictures with a panel a load and rows a strategy: only rows, axis and words differ.

use super::loads::{Shown, loads, no_values, shown, sizes, title, warnings};
use crate::report::svg::axis::Axis;
use crate::report::svg::legend::Entry;
use crate::report::svg::picture::{Panel, Picture};
use crate::report::svg::rows::{Row, RowChart};
use crate::results::summary::Summary;

/// What one such picture shows.
pub(super) struct RowsOfLoads {
    /// Name of the file, before the fleet size.
    pub(super) name: &'static str,
    /// Title, before the fleet size.
    pub(super) title: &'static str,
    pub(super) about: &'static str,
    pub(super) note: &'static str,
    pub(super) legend: Vec<Entry>,
    /// The rows of one strategy below its heading; none where it is not shown.
    pub(super) rows: fn(&Shown<'_>) -> Vec<Row>,
    /// The axis over all rows of a panel, `None` where they show nothing.
    pub(super) axis: fn(&[Row]) -> Option<Axis>,
}

impl RowsOfLoads {
    /// One picture a fleet size.
    pub(super) fn pictures(&self, summary: &Summary) -> Vec<Picture> {
        sizes(summary).into_iter().map(|size| self.of_size(summary, size)).collect()
    }

    fn of_size(&self, summary: &Summary, size: u32) -> Picture {
        let panels = loads(summary, size).into_iter().map(|load| {
            let title = title(summary, size, load);
            let lines = shown(summary, size, load);
            let rows: Vec<Row> = lines.iter().flat_map(|line| self.rows_of(line)).collect();
            match (self.axis)(&rows) {
                Some(x) => Panel::Rows(RowChart { title, x, rows }),
                None => Panel::Nothing(no_values(&title, &lines)),
            }
        });
        let notes = std::iter::once(self.note.to_owned()).chain(warnings(summary, size));
        Picture {
            name: format!("{}-{size}", self.name),
            title: format!("{}, {size} crafts", self.title),
            about: self.about.to_owned(),
            legend: self.legend.clone(),
            panels: panels.collect(),
            notes: notes.collect(),
        }
    }

    /// A heading with the strategy's name, then its rows.
    fn rows_of(&self, line: &Shown<'_>) -> Vec<Row> {
        let heading = Row { name: line.name.clone(), is_heading: true, ..Row::default() };
        std::iter::once(heading).chain((self.rows)(line)).collect()
    }
}
