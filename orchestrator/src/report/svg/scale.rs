//! From values to pixels: linear and logarithmic scales, their bounds and their ticks.

/// How values are spread along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spread {
    /// Equal differences take equal room.
    Linear,
    /// Equal ratios take equal room; only values above 0 have a place.
    Log,
}

/// Part of the range that is left free at both ends of a logarithmic axis.
const LOG_MARGIN: f64 = 0.06;

/// Fewest decades of an axis whose ticks are whole powers of ten.
const DECADES_MANY: f64 = 3.0;

/// The bounds of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// How values are spread.
    pub spread: Spread,
    /// The value at its beginning.
    pub low: f64,
    /// The value at its end, larger than `low`.
    pub high: f64,
}

impl Bounds {
    /// Bounds that hold every one of `values` that can be shown; `None` if there is none. A linear axis
    /// begins at 0.
    #[must_use]
    pub fn around(spread: Spread, values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let can_be_shown = |value: &f64| match spread {
            Spread::Linear => value.is_finite() && *value >= 0.0,
            Spread::Log => value.is_finite() && *value > 0.0,
        };
        let (mut low, mut high) = (f64::INFINITY, 0.0_f64);
        for value in values.into_iter().filter(can_be_shown) {
            (low, high) = (low.min(value), high.max(value));
        }
        if low > high {
            return None;
        }
        Some(match spread {
            Spread::Linear => {
                let high = if high > 0.0 { high } else { 1.0 };
                let step = round_step(high);
                Self { spread, low: 0.0, high: (high / step).ceil() * step }
            }
            Spread::Log => {
                // At least a factor of two, so that equal values do not look far apart.
                let margin = ((high / low).ln() * LOG_MARGIN).max((2.0 / (high / low)).ln() / 2.0);
                Self { spread, low: low / margin.exp(), high: high * margin.exp() }
            }
        })
    }

    /// Fixed bounds.
    #[must_use]
    pub const fn between(spread: Spread, low: f64, high: f64) -> Self {
        Self { spread, low, high }
    }

    /// Values to name along the axis, ascending, about five.
    #[must_use]
    pub fn ticks(&self) -> Vec<f64> {
        match self.spread {
            Spread::Linear => {
                let step = round_step(self.high - self.low);
                let first = (self.low / step).ceil();
                let count = ((self.high - self.low) / step).round();
                (0..=10_u32)
                    .map(f64::from)
                    .take_while(|&place| place <= count)
                    .map(|place| (first + place) * step)
                    .filter(|&value| value <= self.high * (1.0 + 1e-9))
                    .collect()
            }
            Spread::Log => {
                let decades = (self.high / self.low).log10();
                let within: &[f64] = if decades >= DECADES_MANY {
                    &[1.0]
                } else if decades >= 1.0 {
                    &[1.0, 2.0, 5.0]
                } else {
                    &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0]
                };
                self.log_values(within)
            }
        }
    }

    /// Values between the named ones that a thin line marks.
    #[must_use]
    pub fn minor_ticks(&self) -> Vec<f64> {
        match self.spread {
            Spread::Linear => Vec::new(),
            Spread::Log => self.log_values(&[2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]),
        }
    }

    fn log_values(&self, within: &[f64]) -> Vec<f64> {
        const EXPONENT_MAX: i32 = 30;
        let exponents = (-EXPONENT_MAX..=EXPONENT_MAX).map(|exponent| 10_f64.powi(exponent));
        exponents
            .flat_map(|decade| within.iter().map(move |&factor| factor * decade))
            .filter(|&value| (self.low..=self.high).contains(&value))
            .collect()
    }
}

/// A round number that cuts `range` into about five.
fn round_step(range: f64) -> f64 {
    let rough = range / 5.0;
    let decade = 10_f64.powf(rough.log10().floor());
    let factors = [1.0, 2.0, 2.5, 5.0, 10.0];
    let fits = factors.into_iter().find(|factor| factor * decade >= rough * (1.0 - 1e-9));
    fits.unwrap_or(10.0) * decade
}

/// Bounds laid over pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    bounds: Bounds,
    from: f64,
    to: f64,
}

impl Scale {
    /// `bounds` with their low end at pixel `from` and their high end at pixel `to`.
    #[must_use]
    pub const fn new(bounds: Bounds, from: f64, to: f64) -> Self {
        Self { bounds, from, to }
    }

    /// Where `value` lies; `None` if that is outside the axis.
    #[must_use]
    pub fn place(&self, value: f64) -> Option<f64> {
        let share = self.share(value)?;
        // Room for what rounding does to a value that lies on a bound.
        let place = self.from + share * (self.to - self.from);
        (-1e-9..=1.0 + 1e-9).contains(&share).then_some(place)
    }

    /// Where `value` lies, at the end of the axis if it is beyond; `None` if it is not a number.
    #[must_use]
    pub fn nearest(&self, value: f64) -> Option<f64> {
        if value.is_nan() {
            return None;
        }
        let bounded = value.clamp(self.bounds.low, self.bounds.high);
        let share = self.share(bounded)?.clamp(0.0, 1.0);
        Some(self.from + share * (self.to - self.from))
    }

    fn share(&self, value: f64) -> Option<f64> {
        let Bounds { spread, low, high } = self.bounds;
        let share = match spread {
            Spread::Linear => (value - low) / (high - low),
            Spread::Log => (value / low).ln() / (high / low).ln(),
        };
        share.is_finite().then_some(share)
    }
}

#[cfg(test)]
mod tests {
    use super::{Bounds, Scale, Spread};

    #[test]
    fn linear_axes_begin_at_zero_and_end_at_a_round_number() {
        let bounds = Bounds::around(Spread::Linear, [3.0, 92.0]).unwrap();
        assert_eq!((bounds.low, bounds.high), (0.0, 100.0));
        assert_eq!(bounds.ticks(), [0.0, 20.0, 40.0, 60.0, 80.0, 100.0]);
        assert_eq!(Bounds::around(Spread::Linear, [0.0]).unwrap().high, 1.0);
    }

    #[test]
    fn logarithmic_axes_name_powers_of_ten_or_steps_between() {
        let wide = Bounds::around(Spread::Log, [3.0, 3e5]).unwrap();
        assert!(wide.low < 3.0 && wide.high > 3e5);
        assert_eq!(wide.ticks(), [10.0, 100.0, 1e3, 1e4, 1e5]);
        let narrow = Bounds::around(Spread::Log, [12.0, 90.0]).unwrap();
        assert!(narrow.ticks().len() >= 3, "{:?}", narrow.ticks());
        let equal = Bounds::around(Spread::Log, [7.0]).unwrap();
        assert!(equal.low < 7.0 && 7.0 < equal.high && !equal.ticks().is_empty());
    }

    #[test]
    fn what_cannot_be_shown_has_no_bounds_and_no_place() {
        for spread in [Spread::Linear, Spread::Log] {
            assert_eq!(Bounds::around(spread, []), None);
            assert_eq!(Bounds::around(spread, [f64::NAN, f64::INFINITY, -1.0]), None);
            let scale = Scale::new(Bounds::around(spread, [1.0, 10.0]).unwrap(), 100.0, 0.0);
            for value in [f64::NAN, f64::INFINITY, -1.0, 1e9] {
                assert_eq!(scale.place(value), None, "{value}");
            }
            assert_eq!(scale.nearest(f64::INFINITY), Some(0.0));
            assert_eq!(scale.nearest(-1.0), Some(100.0));
            assert_eq!(scale.nearest(f64::NAN), None);
        }
    }

    #[test]
    fn places_run_from_end_to_end() {
        let linear = Scale::new(Bounds::between(Spread::Linear, 0.0, 10.0), 20.0, 120.0);
        assert_eq!(linear.place(5.0), Some(70.0));
        assert_eq!((linear.place(0.0), linear.place(10.0)), (Some(20.0), Some(120.0)));
        let log = Scale::new(Bounds::between(Spread::Log, 1.0, 100.0), 0.0, 100.0);
        assert!((log.place(10.0).unwrap() - 50.0).abs() < 1e-9);
        assert_eq!(log.place(0.0), None);
    }
}
