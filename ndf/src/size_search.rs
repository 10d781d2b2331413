//! The smallest model of a given error.

use ndf_train::levels::BYTES_PER_FACE;

use crate::presets::BASE_FACES;

/// Sizes that are tried at most.
pub(crate) const MAX_ATTEMPTS: usize = 6;
/// Errors from this share of the one that is wanted on are close enough to it.
const CLOSE: f64 = 0.93;
/// Where within what is close enough the next attempt aims.
const AIM: f64 = 0.97;
/// Bytes of base mesh and levels are tried from the fewest that there are to the most that are of use.
const MIN_BYTES: f64 = 300.0;
const MAX_BYTES: f64 = 2e6;
/// By what sizes change at most from one attempt to the next.
const MAX_FACTOR: f64 = 6.0;
/// Exponents of the error as a power of the size.
const SLOPES: [f64; 2] = [-4.0, -0.5];

/// A search for the smallest size with an error, in logarithms: by the secant of the last two attempts, or between the
/// closest two that enclose it. Errors are taken to fall with the reciprocal of the size at first.
#[derive(Debug)]
pub(crate) struct SizeSearch {
    wanted: f64,
    /// Bytes and errors.
    known: Vec<(f64, f64)>,
    /// Bytes that were asked for: a base mesh may need more.
    asked: Vec<f64>,
    next: Option<f64>,
}

impl SizeSearch {
    pub(crate) fn new(wanted: f64) -> Self {
        let next = Some(BYTES_PER_FACE * BASE_FACES as f64);
        Self { wanted, known: Vec::new(), asked: Vec::new(), next }
    }

    /// Bytes to try next.
    pub(crate) fn next(&self) -> Option<usize> {
        self.next.map(|bytes| bytes.round() as usize)
    }

    /// Notes an attempt: the bytes asked for, those of the result, and its error. Whether it is the best so far.
    pub(crate) fn learn(&mut self, asked: usize, bytes: usize, error: f64) -> bool {
        let error = if error.is_finite() { error.max(f64::MIN_POSITIVE) } else { f64::INFINITY };
        let new = (bytes as f64, error);
        self.asked.push(asked as f64);
        // Small ones that are close enough come first, then those that come closest.
        let rank = |(bytes, error): (f64, f64)| if error <= self.wanted { (0, bytes) } else { (1, error) };
        let is_best = self.known.iter().all(|&known| rank(new) < rank(known));
        self.known.push(new);
        let is_close = new.1 <= self.wanted && new.1 >= CLOSE * self.wanted;
        self.next = if is_close || self.known.len() == MAX_ATTEMPTS { None } else { self.guess() };
        is_best
    }

    fn guess(&self) -> Option<f64> {
        let &(bytes, error) = self.known.last()?;
        let above = self.known.iter().filter(|k| k.1 > self.wanted).max_by(|a, b| a.0.total_cmp(&b.0));
        let below = self.known.iter().filter(|k| k.1 <= self.wanted).min_by(|a, b| a.0.total_cmp(&b.0));
        let slope = |a: (f64, f64), b: (f64, f64)| {
            let slope = (b.1 / a.1).ln() / (b.0 / a.0).ln();
            if slope.is_finite() { slope.clamp(SLOPES[0], SLOPES[1]) } else { -1.0 }
        };
        let slope = match (above, below, self.known.as_slice()) {
            (Some(&above), Some(&below), _) => slope(above, below),
            (_, _, [.., a, b]) => slope(*a, *b),
            _ => -1.0,
        };
        let factor = (AIM * self.wanted / error).powf(1.0 / slope).clamp(1.0 / MAX_FACTOR, MAX_FACTOR);
        let mut next = (bytes * factor).clamp(MIN_BYTES, MAX_BYTES);
        // Between what is too far and what is close enough.
        if let (Some(above), Some(below)) = (above, below)
            && above.0 < below.0
        {
            let [low, high] =
                [above.0 * (below.0 / above.0).powf(0.1), below.0 * (above.0 / below.0).powf(0.1)];
            next = next.clamp(low, high);
        }
        // The same size has the same result.
        let is_known = self.asked.iter().any(|asked| (next / asked).ln().abs() < 0.01);
        (!is_known).then_some(next)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a base mesh takes at least.
    const FEWEST: usize = 600;

    /// Bytes and error of the best attempt, and how many there were.
    fn found(wanted: f64, error: impl Fn(f64) -> f64) -> (f64, f64, usize) {
        let mut search = SizeSearch::new(wanted);
        let (mut best, mut attempts) = ((0.0, 0.0), 0);
        while let Some(bytes) = search.next() {
            attempts += 1;
            let size = bytes.max(FEWEST);
            let error = error(size as f64);
            if search.learn(bytes, size, error) {
                best = (size as f64, error);
            }
        }
        (best.0, best.1, attempts)
    }

    /// Errors that fall as powers of the size are found, and so are those of a law that bends.
    #[test]
    fn sizes_are_found() {
        for power in [0.7, 1.0, 1.5, 3.0] {
            for wanted in [1e-4, 1e-3, 3e-3] {
                let (_, error, attempts) = found(wanted, |bytes| (bytes / 10.0).powf(-power));
                let [coarsest, finest] = [60.0, MAX_BYTES / 10.0].map(|x: f64| x.powf(-power));
                let expected = wanted.clamp(finest, coarsest);
                assert!(error <= 1.001 * expected && error > 0.9 * expected, "{power} {wanted}: {error}");
                assert!(attempts <= MAX_ATTEMPTS);
            }
        }
        let (_, error, _) = found(2e-4, |bytes| 1.0 / bytes + (500.0 / bytes).powi(4));
        assert!((1.8e-4..=2e-4).contains(&error), "{error}");
    }

    /// What cannot be reached ends with what comes closest.
    #[test]
    fn an_error_out_of_reach_ends_the_search() {
        let (_, error, attempts) = found(1e-6, |_| 1e-3);
        assert!(error == 1e-3 && attempts <= MAX_ATTEMPTS);
        let (bytes, _, attempts) = found(0.1, |_| 1e-3);
        assert!(bytes == 600.0 && attempts <= 4, "{attempts}");
    }
}
