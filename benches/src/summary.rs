//! What may be printed of a histogram of times, as text and as JSON.
//!
//! A quantile stands on the samples beyond it: with fewer than ten of them it is a dash in text and
//! null in JSON, never a number.

use hdrhistogram::Histogram;
use serde_json::{Value, json};
use std::fmt;

/// Fewest samples that must lie beyond a quantile for it to be printed.
const SAMPLES_BEYOND_MIN: f64 = 10.0;

/// Quantiles of one histogram of nanoseconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Summary {
    /// Samples.
    pub count: u64,
    /// Median, ns.
    pub p50_ns: Option<u64>,
    /// 99th percentile, ns.
    pub p99_ns: Option<u64>,
    /// 99.9th percentile, ns.
    pub p99_9_ns: Option<u64>,
    /// Largest sample, ns; `None` if there is none.
    pub max_ns: Option<u64>,
}

impl Summary {
    /// The summary of `times`, a histogram of nanoseconds.
    #[must_use]
    pub fn of(times: &Histogram<u64>) -> Self {
        let count = times.len();
        let quantile = |quantile: f64| {
            is_supported(count, quantile).then(|| times.value_at_quantile(quantile))
        };
        Self {
            count,
            p50_ns: quantile(0.5),
            p99_ns: quantile(0.99),
            p99_9_ns: quantile(0.999),
            max_ns: (count > 0).then(|| times.max()),
        }
    }

    /// How often a second `times` things happen that take the median time together.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "times of a benchmark stay far below 2^53 ns")]
    pub fn rate_per_s(&self, times: u32) -> Option<f64> {
        self.p50_ns.map(|ns| f64::from(times) * 1e9 / ns as f64)
    }

    /// The summary as a JSON object, in ns.
    #[must_use]
    pub fn to_json(self) -> Value {
        json!({
            "unit": "ns",
            "n": self.count,
            "p50": self.p50_ns,
            "p99": self.p99_ns,
            "p99.9": self.p99_9_ns,
            "max": self.max_ns,
        })
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            formatter,
            "p50 {}   p99 {}   p99.9 {}   max {}   n {}",
            Microseconds(self.p50_ns),
            Microseconds(self.p99_ns),
            Microseconds(self.p99_9_ns),
            Microseconds(self.max_ns),
            self.count
        )
    }
}

/// Whether `quantile` of `count` samples rests on enough of them.
#[expect(clippy::cast_precision_loss, reason = "counts of samples stay far below 2^53")]
fn is_supported(count: u64, quantile: f64) -> bool {
    // The tolerance admits the exact border (1,000 samples for p99), which 1 - q misses in binary.
    count as f64 * (1.0 - quantile) > SAMPLES_BEYOND_MIN - 1e-6
}

/// A time in ns, printed in us; a dash where there is none.
struct Microseconds(Option<u64>);

impl fmt::Display for Microseconds {
    #[expect(clippy::cast_precision_loss, reason = "times of a benchmark stay far below 2^53 ns")]
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some(ns) => write!(formatter, "{:.2} us", ns as f64 / 1_000.0),
            None => formatter.write_str("-"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Summary;
    use hdrhistogram::Histogram;

    fn summary_of(count: u64) -> Summary {
        let mut times = Histogram::new_with_bounds(1, 1_000_000, 3).unwrap();
        (1..=count).for_each(|time_ns| times.record(time_ns).unwrap());
        Summary::of(&times)
    }

    #[test]
    fn a_quantile_needs_ten_samples_beyond_it() {
        assert_eq!(summary_of(19).p50_ns, None);
        assert_eq!(summary_of(20).p50_ns, Some(10));
        assert_eq!(summary_of(999).p99_ns, None);
        assert!(summary_of(1_000).p99_ns.is_some());
        assert_eq!(summary_of(9_999).p99_9_ns, None);
        assert!(summary_of(10_000).p99_9_ns.is_some());
    }

    #[test]
    fn a_rate_is_of_the_median() {
        // The median of 1..=20 is 10 ns.
        assert_eq!(summary_of(20).rate_per_s(5), Some(5e8));
        assert_eq!(summary_of(19).rate_per_s(5), None);
    }

    #[test]
    fn what_is_not_supported_is_a_dash_and_null() {
        let empty = summary_of(0);
        assert_eq!(empty.to_string(), "p50 -   p99 -   p99.9 -   max -   n 0");
        assert!(empty.to_json()["p50"].is_null());
        assert!(empty.to_json()["max"].is_null());
    }
}
