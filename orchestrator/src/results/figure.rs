//! One number that a table shows, with everything that a reader needs to judge it.
//!
//! Figures are computed in [`super::summary`], [`super::times`] and [`super::loads`] only. Tables, JSON and
//! CSV take them from the same map, so that no format can show a number that another lacks.

use serde::Serialize;
use std::collections::BTreeMap;

/// A number of a table. `value` is `None` where the table has a dash.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Figure {
    /// The number, in `unit`; absent if too few values carry it.
    pub value: Option<f64>,
    /// How many values it was computed from.
    pub n: u64,
    /// Lower end of its interval; absent where none is computed.
    pub low: Option<f64>,
    /// Upper end of its interval; absent where none is computed.
    pub high: Option<f64>,
    /// Unit of value, low and high; `1` for ratios.
    pub unit: &'static str,
    /// Under which load it was measured; absent for counts, which depend on none.
    pub load: Option<String>,
    /// What it is, in words.
    pub label: String,
}

impl Figure {
    /// A count, or a ratio of counts: exact, under no load, without an interval.
    #[must_use]
    pub fn count(value: Option<f64>, n: u64, unit: &'static str, label: &str) -> Self {
        Self { value, n, low: None, high: None, unit, load: None, label: label.to_owned() }
    }
}

/// The figures of one row of the tables, by metric.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[serde(transparent)]
pub struct Figures(BTreeMap<String, Figure>);

impl Figures {
    /// Adds a count: exact, under no load.
    pub fn count(
        &mut self,
        metric: &str,
        value: Option<f64>,
        n: u64,
        unit: &'static str,
        label: &str,
    ) {
        self.0.insert(metric.to_owned(), Figure::count(value, n, unit, label));
    }

    /// Adds a time or cost measured in lockstep.
    pub fn lockstep(
        &mut self,
        metric: &str,
        value: Option<f64>,
        n: u64,
        unit: &'static str,
        label: &str,
    ) {
        self.under("lockstep", metric, value, n, unit, label);
    }

    /// Adds a figure that was measured under `load`.
    pub fn under(
        &mut self,
        load: &str,
        metric: &str,
        value: Option<f64>,
        n: u64,
        unit: &'static str,
        label: &str,
    ) {
        let load = Some(load.to_owned());
        let figure = Figure { load, ..Figure::count(value, n, unit, label) };
        self.0.insert(metric.to_owned(), figure);
    }

    /// Gives the figure of `metric` its interval; one that is a dash has none.
    pub fn within(&mut self, metric: &str, interval: Option<(f64, f64)>) {
        if let Some(figure) = self.0.get_mut(metric).filter(|figure| figure.value.is_some()) {
            (figure.low, figure.high) = interval.unzip();
        }
    }

    /// The figure of `metric`, if the row has it at all.
    #[must_use]
    pub fn get(&self, metric: &str) -> Option<&Figure> {
        self.0.get(metric)
    }

    /// The value of `metric`, `None` where a table has a dash.
    #[must_use]
    pub fn value(&self, metric: &str) -> Option<f64> {
        self.get(metric)?.value
    }

    /// All figures, by metric.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &Figure)> {
        self.0.iter().map(|(metric, figure)| (metric.as_str(), figure))
    }
}
