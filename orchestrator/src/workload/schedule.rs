//! When bursts are due: at random times, independently of each other (a Poisson process).

use shared_types::rng::Stream;

/// The times of a Poisson process, in ns, ascending.
#[derive(Debug)]
pub(super) struct Schedule {
    stream: Stream,
    mean_gap_ns: f64,
    at_ns: f64,
    until_ns: f64,
}

impl Schedule {
    /// `per_s` times a second on average, from 0 up to `duration_s`; never if `per_s` is 0.
    pub(super) fn new(stream: Stream, per_s: f64, duration_s: f64) -> Self {
        let until_ns = if per_s > 0.0 { duration_s * 1e9 } else { 0.0 };
        Self { stream, mean_gap_ns: 1e9 / per_s, at_ns: 0.0, until_ns }
    }
}

impl Iterator for Schedule {
    type Item = u64;

    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a year in ns fits; times are not negative"
    )]
    fn next(&mut self) -> Option<u64> {
        if self.until_ns <= self.at_ns {
            return None;
        }
        self.at_ns += exponential(&mut self.stream) * self.mean_gap_ns;
        (self.at_ns < self.until_ns).then_some(self.at_ns as u64)
    }
}

/// A draw from the exponential distribution of mean 1, by comparisons alone (von Neumann 1951,
/// "Various techniques used in connection with random digits"): a logarithm's last bit would be the
/// host's choice. Of a falling run of uniform numbers that starts with x, the length is odd with
/// chance exp(-x); each run that is not adds 1.
fn exponential(stream: &mut Stream) -> f64 {
    let mut whole = 0.0;
    loop {
        let first = stream.unit();
        let mut last = first;
        let mut is_odd = false;
        loop {
            is_odd = !is_odd;
            let next = stream.unit();
            if next >= last {
                break;
            }
            last = next;
        }
        if is_odd {
            return whole + first;
        }
        whole += 1.0;
    }
}
