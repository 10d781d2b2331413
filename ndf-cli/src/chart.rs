//! How numbers are spread: quantiles, and a histogram for pages.

use std::fmt::Write as _;

/// Bars of a histogram.
const BARS: usize = 32;

/// Width and height of a histogram in the units of its picture.
const SIZE: [f64; 2] = [320.0, 96.0];

/// The ratio of the largest to the least from which on bars are of equal ratios.
const WIDE: f64 = 50.0;

/// Numbers, and how they are spread.
#[derive(Clone, Debug)]
pub struct Spread {
    /// What they are.
    pub title: String,
    /// In order, all finite.
    values: Vec<f64>,
    in_words: fn(f64) -> String,
}

impl Spread {
    /// The spread of numbers, without those that are not finite; `None` if there are no others. `in_words` writes one with its
    /// unit.
    pub fn new(
        title: impl Into<String>,
        values: impl Iterator<Item = f64>,
        in_words: fn(f64) -> String,
    ) -> Option<Self> {
        let mut values: Vec<f64> = values.filter(|value| value.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        (!values.is_empty()).then(|| Self { title: title.into(), values, in_words })
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.values.len()
    }

    /// The number that this share of them does not exceed.
    pub fn quantile(&self, share: f64) -> f64 {
        let place = (share * self.values.len() as f64).ceil() as usize;
        self.values[place.saturating_sub(1).min(self.values.len() - 1)]
    }

    /// Least, median and largest, each with its name.
    pub fn in_words(&self) -> [(&'static str, String); 3] {
        [("least", 0.0), ("median", 0.5), ("largest", 1.0)]
            .map(|(name, share)| (name, (self.in_words)(self.quantile(share))))
    }

    /// Whether they are so far apart that equal ratios have equal places, and not equal differences.
    pub fn is_logarithmic(&self) -> bool {
        let (least, largest) = (self.quantile(0.0), self.quantile(1.0));
        least > 0.0 && largest / least > WIDE
    }

    /// Where a number is between least and largest, from 0 to 1.
    fn place(&self, value: f64) -> f64 {
        let (least, largest) = (self.quantile(0.0), self.quantile(1.0));
        if least == largest {
            return 0.5;
        }
        if self.is_logarithmic() {
            return (value / least).ln() / (largest / least).ln();
        }
        (value - least) / (largest - least)
    }

    /// How many numbers there are in each of so many bars.
    fn bars(&self) -> [usize; BARS] {
        let mut bars = [0; BARS];
        for &value in &self.values {
            bars[((self.place(value) * BARS as f64) as usize).min(BARS - 1)] += 1;
        }
        bars
    }

    /// A histogram with a line at the median, as SVG in the colours of the page around it.
    pub fn svg(&self) -> String {
        let [width, height] = SIZE;
        let bars = self.bars();
        let tallest = bars.into_iter().max().unwrap_or(0).max(1) as f64;
        let step = width / BARS as f64;
        let mut svg = format!("<svg viewBox=\"0 0 {width} {height}\" role=\"img\" aria-hidden=\"true\">");
        for (k, count) in bars.into_iter().enumerate().filter(|(_, count)| *count > 0) {
            // What is there at all is seen.
            let tall = (count as f64 / tallest * (height - 2.0)).max(1.5);
            let (x, y) = (k as f64 * step + 0.75, height - tall);
            let _ = write!(
                svg,
                "<rect x=\"{x:.2}\" y=\"{y:.2}\" width=\"{:.2}\" height=\"{tall:.2}\" rx=\"1\"/>",
                step - 1.5
            );
        }
        let x = self.place(self.quantile(0.5)) * width;
        let _ = write!(svg, "<line x1=\"{x:.2}\" x2=\"{x:.2}\" y1=\"0\" y2=\"{height}\"/></svg>");
        svg
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spread(values: &[f64]) -> Option<Spread> {
        Spread::new("seconds", values.iter().copied(), |x| format!("{x} s"))
    }

    #[test]
    fn quantiles_are_numbers_of_the_list() {
        let spread = spread(&[5.0, f64::NAN, 1.0, 3.0, 2.0, f64::INFINITY, 4.0]).unwrap();
        assert_eq!(spread.count(), 5);
        assert_eq!([0.0, 0.2, 0.5, 0.8, 1.0].map(|share| spread.quantile(share)), [1.0, 1.0, 3.0, 4.0, 5.0]);
        assert_eq!(spread.in_words()[1], ("median", "3 s".to_owned()));
        assert!(self::spread(&[f64::NAN]).is_none());
    }

    #[test]
    fn every_number_is_in_a_bar() {
        for values in [&[1.0][..], &[0.0, 0.0], &[-1.0, 0.0, 7.0], &[1e-9, 1.0, 1e9], &[0.0, 1e300]] {
            let spread = spread(values).unwrap();
            assert_eq!(spread.bars().iter().sum::<usize>(), values.len());
            assert!(!spread.svg().contains("NaN"), "{values:?}");
        }
        // Ratios, where numbers are far apart: equal steps between powers.
        let places = spread(&[1.0, 1e3, 1e6]).unwrap();
        assert!((places.place(1e3) - 0.5).abs() < 1e-12);
    }
}
