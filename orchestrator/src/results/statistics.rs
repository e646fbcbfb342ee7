//! The few statistics that tables need, and the rule that decides whether a quantile may be shown.
//!
//! A quantile q of n values is shown only if at least ten values lie beyond it, n (1 - q) >= 10;
//! otherwise a table has a dash. Quantiles are named by "one value in how many lies beyond", so that
//! the rule is exact. Not here yet: intervals and tests, which need more than one block.

use hdrhistogram::Histogram;
use serde::{Deserialize, Serialize};

/// Values that must lie beyond a quantile for it to be shown.
pub const BEYOND_MIN: u64 = 10;

/// Largest value that a histogram of times holds, ns: a minute. Longer times count as a minute.
pub const TIME_NS_MAX: u64 = 60_000_000_000;

/// Significant decimal digits of histograms.
pub const SIGNIFICANT_DIGITS: u8 = 3;

/// A quantile: the value that all but one in `one_beyond_in` values do not exceed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Quantile {
    /// Its name in tables and files.
    pub name: &'static str,
    /// One value in this many lies beyond it.
    pub one_beyond_in: u32,
}

impl Quantile {
    /// The median.
    pub const P50: Self = Self { name: "p50", one_beyond_in: 2 };
    /// Nine in ten.
    pub const P90: Self = Self { name: "p90", one_beyond_in: 10 };
    /// 99 in 100.
    pub const P99: Self = Self { name: "p99", one_beyond_in: 100 };
    /// 999 in 1,000.
    pub const P999: Self = Self { name: "p99.9", one_beyond_in: 1000 };
    /// 9,999 in 10,000.
    pub const P9999: Self = Self { name: "p99.99", one_beyond_in: 10_000 };
    /// All quantiles that reports know, ascending.
    pub const ALL: [Self; 5] = [Self::P50, Self::P90, Self::P99, Self::P999, Self::P9999];

    /// How many values it takes to show this quantile.
    #[must_use]
    pub const fn values_needed(self) -> u64 {
        self.one_beyond_in as u64 * BEYOND_MIN
    }

    /// Whether `n` values suffice to show this quantile.
    #[must_use]
    pub const fn is_shown_for(self, n: u64) -> bool {
        n >= self.values_needed()
    }

    /// The quantile of `histogram`, `None` where a table has a dash.
    #[must_use]
    pub fn of(self, histogram: &Histogram<u64>) -> Option<u64> {
        let q = 1.0 - 1.0 / f64::from(self.one_beyond_in);
        self.is_shown_for(histogram.len()).then(|| histogram.value_at_quantile(q))
    }
}

/// An empty histogram for times in ns, with all its memory in place.
///
/// # Panics
/// Never: the bounds are constants that the library accepts.
#[must_use]
pub fn time_histogram() -> Histogram<u64> {
    Histogram::new_with_bounds(1, TIME_NS_MAX, SIGNIFICANT_DIGITS)
        .expect("invariant: the bounds are constants that the library accepts")
}

/// `times_ns` as a histogram; times beyond its bounds count as the bound.
#[must_use]
pub fn histogram_of(times_ns: impl IntoIterator<Item = u64>) -> Histogram<u64> {
    let mut histogram = time_histogram();
    times_ns.into_iter().for_each(|time_ns| histogram.saturating_record(time_ns));
    histogram
}

/// All events of `parts` together; values beyond the bounds count as the bound.
///
/// # Panics
/// Never: every value is brought within the bounds first.
#[must_use]
pub fn merged<'a>(parts: impl IntoIterator<Item = &'a Histogram<u64>>) -> Histogram<u64> {
    let mut all = time_histogram();
    for part in parts {
        if all.add(part).is_err() {
            for step in part.iter_recorded() {
                let value = step.value_iterated_to().clamp(all.low(), all.high());
                all.saturating_record_n(value, step.count_at_value());
            }
        }
    }
    all
}

/// One quantile of a distribution that may be shown.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct QuantileValue {
    /// As [`Quantile::name`].
    pub name: String,
    /// Its value, ns.
    pub value_ns: u64,
}

/// What is said of a histogram of times in a record.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Distribution {
    /// How many values.
    pub n: u64,
    /// Smallest, ns; 0 if there is none.
    pub min_ns: u64,
    /// Mean, ns; 0 if there is none.
    pub mean_ns: f64,
    /// Largest, ns; 0 if there is none.
    pub max_ns: u64,
    /// The quantiles that n values allow, ascending.
    pub quantiles: Vec<QuantileValue>,
}

impl From<&Histogram<u64>> for Distribution {
    fn from(histogram: &Histogram<u64>) -> Self {
        Self::of(histogram)
    }
}

impl Distribution {
    /// What may be said of `histogram`.
    #[must_use]
    pub fn of(histogram: &Histogram<u64>) -> Self {
        let quantiles = Quantile::ALL
            .into_iter()
            .filter_map(|quantile| {
                let value_ns = quantile.of(histogram)?;
                Some(QuantileValue { name: quantile.name.to_owned(), value_ns })
            })
            .collect();
        Self {
            n: histogram.len(),
            min_ns: if histogram.is_empty() { 0 } else { histogram.min() },
            mean_ns: histogram.mean(),
            max_ns: histogram.max(),
            quantiles,
        }
    }

    /// The value of `quantile`, `None` where a table has a dash.
    #[must_use]
    pub fn quantile_ns(&self, quantile: Quantile) -> Option<u64> {
        self.quantiles.iter().find(|point| point.name == quantile.name).map(|point| point.value_ns)
    }
}

/// Whole numbers as a float for division; exact below 2^53, far above every count here.
#[expect(clippy::cast_precision_loss, reason = "counts stay below 2^53")]
#[must_use]
pub const fn as_float(count: u64) -> f64 {
    count as f64
}

/// Sum over sum of (numerator, denominator) pairs; `None` if the denominators sum to 0. Ratios of
/// sums weigh every request alike; means of ratios would let a trial of two requests count as much
/// as one of two hundred.
#[must_use]
pub fn ratio_of_sums(pairs: impl IntoIterator<Item = (u64, u64)>) -> Option<f64> {
    let (above, below) = pairs
        .into_iter()
        .fold((0_u64, 0_u64), |(above, below), (more, of)| (above + more, below + of));
    (below > 0).then(|| as_float(above) / as_float(below))
}

/// The mean, `None` of nothing.
#[must_use]
pub fn mean(values: impl IntoIterator<Item = u64>) -> Option<f64> {
    ratio_of_sums(values.into_iter().map(|value| (value, 1)))
}

/// The mean, `None` of nothing.
#[must_use]
pub fn mean_of(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let (sum, n) = values.into_iter().fold((0.0, 0_u64), |(sum, n), value| (sum + value, n + 1));
    (n > 0).then(|| sum / as_float(n))
}

/// The middle value, the mean of the two middle ones for an even number, `None` of nothing.
#[must_use]
pub fn median(values: &[u64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_unstable();
    let middle = sorted.len() / 2;
    let upper = as_float(*sorted.get(middle)?);
    Some(if sorted.len() % 2 == 1 { upper } else { (as_float(sorted[middle - 1]) + upper) / 2.0 })
}

/// Median of the second half of `values` (in the order of measuring) over that of the first; `None`
/// below two values, or if the first is 0. Above 1.1 a cell is not stationary.
#[must_use]
pub fn second_half_ratio(values: &[u64]) -> Option<f64> {
    let (first, second) = values.split_at(values.len() / 2);
    let below = median(first).filter(|&median| median > 0.0)?;
    Some(median(second)? / below)
}

#[cfg(test)]
mod tests {
    use super::{
        Distribution, Quantile, mean, median, ratio_of_sums, second_half_ratio, time_histogram,
    };

    fn filled(n: u64) -> hdrhistogram::Histogram<u64> {
        let mut histogram = time_histogram();
        (1..=n).for_each(|value| histogram.saturating_record(value));
        histogram
    }

    #[test]
    fn a_quantile_needs_ten_values_beyond_it() {
        for quantile in Quantile::ALL {
            let enough = 10 * u64::from(quantile.one_beyond_in);
            assert_eq!(quantile.of(&filled(enough - 1)), None, "{}", quantile.name);
            assert!(quantile.of(&filled(enough)).is_some(), "{}", quantile.name);
        }
    }

    #[test]
    fn a_distribution_says_only_what_its_values_allow() {
        let distribution = Distribution::of(&filled(1000));
        assert_eq!(distribution.quantile_ns(Quantile::P50), Some(500));
        assert_eq!(distribution.quantile_ns(Quantile::P99), Some(990));
        assert_eq!(distribution.quantile_ns(Quantile::P999), None);
        assert_eq!((distribution.n, distribution.min_ns, distribution.max_ns), (1000, 1, 1000));
        assert_eq!(Distribution::of(&time_histogram()), Distribution::default());
    }

    #[test]
    fn ratios_are_ratios_of_sums() {
        assert_eq!(ratio_of_sums([(1, 2), (99, 98)]), Some(1.0));
        assert_eq!(ratio_of_sums([(1, 0)]), None);
        assert_eq!(mean([2, 8, 0, 2]), Some(3.0));
        assert_eq!(mean([]), None);
    }

    #[test]
    fn medians_of_even_numbers_lie_between() {
        assert_eq!(median(&[]), None);
        assert_eq!(median(&[5, 1, 3]), Some(3.0));
        assert_eq!(median(&[5, 1, 3, 4]), Some(3.5));
    }

    #[test]
    fn a_slower_second_half_shows() {
        assert_eq!(second_half_ratio(&[10, 10, 20, 20]), Some(2.0));
        assert_eq!(second_half_ratio(&[10]), None);
        assert_eq!(second_half_ratio(&[0, 0, 1, 1]), None);
    }
}
