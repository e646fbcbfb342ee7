//! Numbers as people read them in a picture: three digits, with a unit that suits the size.

/// What a number measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// A time, given in ns.
    Time,
    /// A number of things, with decimal prefixes.
    Count,
    /// A number of things per second.
    PerSecond,
    /// A share of a hundred.
    Percent,
    /// A ratio, or a number that has no unit.
    Plain,
}

impl Unit {
    /// `value` in three digits with its unit.
    #[must_use]
    pub fn format(self, value: f64) -> String {
        match self {
            Self::Time => scaled(value, &[(1e9, " s"), (1e6, " ms"), (1e3, " us"), (1.0, " ns")]),
            Self::Count => scaled(value, &PREFIXES),
            Self::PerSecond => scaled(value, &PREFIXES) + "/s",
            Self::Percent => digits(value) + " %",
            Self::Plain => digits(value),
        }
    }
}

/// Decimal prefixes of counts.
const PREFIXES: [(f64, &str); 4] = [(1e9, " G"), (1e6, " M"), (1e3, " k"), (1.0, "")];

/// `value` by the largest scale that leaves at least one before the point.
fn scaled(value: f64, scales: &[(f64, &str)]) -> String {
    // Rounded first: 999.9 us is 1 ms.
    let rounded = rounded(value);
    let smallest = scales.len() - 1;
    let place = scales.iter().position(|&(scale, _)| rounded.abs() >= scale).unwrap_or(smallest);
    let (scale, suffix) = scales[place];
    format!("{}{suffix}", digits(value / scale))
}

/// `value` to three significant digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

/// `value` to three significant digits, without zeros at its end.
fn digits(value: f64) -> String {
    if !value.is_finite() {
        return "-".to_owned();
    }
    let text = rounded(value).to_string();
    if text == "-0" { "0".to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::Unit;

    #[test]
    fn three_digits_and_a_unit_that_suits() {
        for (unit, value, text) in [
            (Unit::Time, 0.0, "0 ns"),
            (Unit::Time, 53.64, "53.6 ns"),
            (Unit::Time, 16_400.0, "16.4 us"),
            (Unit::Time, 999_900.0, "1 ms"),
            (Unit::Time, 60e9, "60 s"),
            (Unit::Count, 0.25, "0.25"),
            (Unit::Count, 1448.0, "1.45 k"),
            (Unit::Count, 12.0, "12"),
            (Unit::PerSecond, 3_210_000.0, "3.21 M/s"),
            (Unit::Percent, 62.5, "62.5 %"),
            (Unit::Plain, 1.3179, "1.32"),
            (Unit::Plain, -0.0, "0"),
            (Unit::Plain, f64::NAN, "-"),
        ] {
            assert_eq!(unit.format(value), text);
        }
    }
}
