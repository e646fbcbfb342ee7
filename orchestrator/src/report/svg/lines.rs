//! Lines over two axes: points with intervals, joined or apart, named at their right ends.
//!
//! Names stand in the right margin at the height of the last point, pushed apart until none overlaps,
//! so that no name ever lies on data. A point outside the axes leaves a gap; an interval that reaches
//! beyond them ends at the frame.

use super::axis::Axis;
use super::element::{Element, group, line, path_through, rectangle};
use super::frame::{Frame, size};
use super::look::Mark;
use super::text::{Anchor, fitted, label, width_of};

/// One point of a series.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Its value along the lower axis.
    pub x: f64,
    /// Its value along the left axis.
    pub y: f64,
    /// Lower and upper end of the interval of `y`.
    pub interval: Option<(f64, f64)>,
    /// Whether a marker stands there.
    pub is_marked: bool,
}

/// Points that belong together.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// How it is drawn.
    pub mark: Mark,
    /// Its name in the margin.
    pub name: String,
    /// In the order in which they are joined.
    pub points: Vec<Point>,
    /// Whether its points are hollow, apart and without a name: what others said.
    pub is_reference: bool,
}

impl Series {
    /// Where its points and the ends of their intervals stand along the left axis.
    pub fn heights(&self) -> impl Iterator<Item = f64> {
        self.points.iter().flat_map(|point| {
            let ends = point.interval.map(|(low, high)| [low, high]);
            std::iter::once(point.y).chain(ends.into_iter().flatten())
        })
    }
}

/// A chart of lines.
#[derive(Clone, Debug, PartialEq)]
pub struct LineChart {
    /// Above it.
    pub title: String,
    /// Along its lower side.
    pub x: Axis,
    /// Along its left side.
    pub y: Axis,
    /// Drawn in this order.
    pub series: Vec<Series>,
    /// Pixels between points of neighbouring series that have the same `x`.
    pub dodge: f64,
    /// Height of the frame, in pixels.
    pub height: f64,
}

/// Room between the frame and the signs of names.
const LEADER: f64 = 18.0;
/// Farthest distance from the frame's side at which a point is joined to its name.
const LEADER_MAX: f64 = 64.0;
/// Room of the marker before a name.
const MARKER: f64 = 16.0;
/// Widest name.
const NAME_MAX: f64 = 190.0;
/// Least distance of two names.
const NAMES_APART: f64 = 15.5;
/// Half the width of the bars at both ends of an interval.
const CAP: f64 = 3.0;

impl LineChart {
    /// Height with its axis.
    #[must_use]
    pub fn full_height(&self) -> f64 {
        self.height + Axis::ROOM_BELOW
    }

    /// Draws it within `width` from `(left, top)` on; `id` is of its clip path.
    #[must_use]
    pub fn draw(&self, id: &str, left: f64, top: f64, width: f64) -> Element {
        let names = self.series.iter().filter(|series| !series.is_reference);
        let names = names.map(|series| width_of(&series.name, size::TEXT)).fold(0.0, f64::max);
        let room_right = LEADER + MARKER + names.min(NAME_MAX);
        let room_left = self.y.room_left();
        let frame = Frame {
            left: left + room_left,
            top,
            width: width - room_left - room_right,
            height: self.height,
        };
        let mut chart = group("lines");
        chart.push(frame.clip(id));
        chart.push(self.x.draw_below(frame));
        chart.push(self.y.draw_left(frame));
        let mut data = group("data").with("clip-path", format!("url(#{id})"));
        // What others said lies below, so that it never hides what was measured.
        for is_reference in [true, false] {
            for (place, series) in self.series.iter().enumerate() {
                if series.is_reference == is_reference {
                    data.push(self.draw_series(series, self.offset(place), frame));
                }
            }
        }
        chart.push(data);
        chart.holding(self.draw_names(frame))
    }

    /// How far the points of the series at `place` stand beside their value.
    fn offset(&self, place: usize) -> f64 {
        let mark = self.series[place].mark;
        // A reference stands where the series of the same look does.
        let looks = self.series.iter().filter(|series| !series.is_reference);
        let position = looks.clone().position(|series| series.mark == mark).unwrap_or(place);
        let count = looks.count().max(1);
        let (position, count) = (position.min(count), count - 1);
        let steps = |count: usize| u32::try_from(count).map_or(0.0, f64::from);
        (steps(position) - steps(count) / 2.0) * self.dodge
    }

    fn draw_series(&self, series: &Series, offset: f64, frame: Frame) -> Element {
        let (across, upward) = (self.x.across(frame), self.y.upward(frame));
        let mark = series.mark;
        let places: Vec<Option<(f64, f64)>> = series
            .points
            .iter()
            .map(|point| Some((across.place(point.x)? + offset, upward.place(point.y)?)))
            .collect();
        let mut drawn = group("series");
        if !series.is_reference {
            for part in places.split(Option::is_none).filter(|part| part.len() > 1) {
                let part: Vec<(f64, f64)> = part.iter().copied().flatten().collect();
                drawn.push(
                    Element::new("path")
                        .with("class", format!("curve {}", mark.class))
                        .with("stroke-dasharray", mark.dashes)
                        .with("d", path_through(&part, false)),
                );
            }
        }
        for (point, place) in series.points.iter().zip(&places) {
            let Some((x, _)) = *place else { continue };
            let ends = point
                .interval
                .and_then(|(low, high)| Some((upward.nearest(low)?, upward.nearest(high)?)));
            if let Some((low, high)) = ends {
                drawn.push(whisker(mark, (x, low), (x, high)));
            }
        }
        for (point, place) in series.points.iter().zip(&places) {
            if let Some(place) = place.filter(|_| point.is_marked) {
                drawn.push(mark.point(place, series.is_reference));
            }
        }
        drawn
    }

    fn draw_names(&self, frame: Frame) -> Element {
        let (across, upward) = (self.x.across(frame), self.y.upward(frame));
        let mut ends: Vec<(&Series, f64, f64)> = Vec::new();
        for (place, series) in self.series.iter().enumerate().filter(|(_, one)| !one.is_reference) {
            let end = series.points.iter().rev().find_map(|point| {
                Some((across.place(point.x)? + self.offset(place), upward.place(point.y)?))
            });
            // A series without any point is still named, at the lower end of the list.
            let (x, y) = end.unwrap_or((frame.left, frame.bottom()));
            ends.push((series, x, y));
        }
        ends.sort_by(|one, other| one.2.total_cmp(&other.2));
        let wanted: Vec<f64> = ends.iter().map(|end| end.2).collect();
        let heights = apart(&wanted, NAMES_APART, frame.top, frame.bottom());
        let mut names = group("names");
        let sign = frame.right() + LEADER;
        for ((series, x, y), height) in ends.into_iter().zip(heights) {
            // From far away a line to the name would look like data.
            if frame.right() - x < LEADER_MAX {
                let from = (x + 8.0, y);
                names.push(line(
                    &format!("leader {}", series.mark.class),
                    from,
                    (sign - 1.0, height),
                ));
            }
            let marker = (sign + MARKER / 2.0 - 2.0, height);
            names.push(series.mark.point(marker, false));
            let place = (sign + MARKER, height + size::TEXT * 0.36);
            let name = fitted(&series.name, size::TEXT, NAME_MAX);
            names.push(label("ink", size::TEXT, Anchor::Start, place, &name));
        }
        names
    }
}

/// An interval as a line with bars at both ends.
fn whisker(mark: Mark, low: (f64, f64), high: (f64, f64)) -> Element {
    let class = format!("whisker {}", mark.class);
    let cap = |(x, y): (f64, f64)| line(&class, (x - CAP, y), (x + CAP, y));
    group("interval").holding(line(&class, low, high)).holding(cap(low)).holding(cap(high))
}

/// A frame with words in it, for a chart that has nothing to show.
#[must_use]
pub fn nothing(words: &str, left: f64, top: f64, width: f64) -> Element {
    let middle = (left + width / 2.0, top + NOTHING_HEIGHT / 2.0 + size::TEXT * 0.36);
    group("nothing").holding(rectangle("void", left, top, width, NOTHING_HEIGHT)).holding(label(
        "muted",
        size::TEXT,
        Anchor::Middle,
        middle,
        &fitted(words, size::TEXT, width),
    ))
}

/// Height of such a frame.
pub const NOTHING_HEIGHT: f64 = 60.0;

/// The ascending places `wanted`, moved as little as needed to be `distance` apart and within bounds;
/// closer only if they do not fit otherwise.
fn apart(wanted: &[f64], distance: f64, low: f64, high: f64) -> Vec<f64> {
    let mut places = wanted.to_vec();
    let gaps = u32::try_from(places.len().saturating_sub(1)).map_or(0.0, f64::from);
    let distance = if gaps > 0.0 { distance.min((high - low) / gaps) } else { distance };
    let mut floor = low;
    for place in &mut places {
        *place = place.max(floor);
        floor = *place + distance;
    }
    let mut ceiling = high;
    for place in places.iter_mut().rev() {
        *place = place.min(ceiling);
        ceiling = *place - distance;
    }
    places
}

#[cfg(test)]
mod tests {
    use super::apart;

    #[test]
    fn names_are_pushed_apart_and_stay_within_bounds() {
        for wanted in [vec![], vec![5.0], vec![1.0, 1.0, 1.0], vec![98.0, 99.0, 99.5, 120.0]] {
            let places = apart(&wanted, 15.0, 0.0, 100.0);
            assert!(places.iter().all(|place| (-1e-9..=100.0).contains(place)), "{places:?}");
            let are_apart = places.windows(2).all(|pair| pair[1] - pair[0] >= 15.0 - 1e-9);
            assert!(are_apart, "{places:?}");
        }
        assert_eq!(apart(&[20.0, 60.0], 15.0, 0.0, 100.0), [20.0, 60.0]);
        let crowded = apart(&[50.0; 11], 15.0, 0.0, 100.0);
        assert!(crowded.windows(2).all(|pair| (pair[1] - pair[0] - 10.0).abs() < 1e-9));
    }
}
