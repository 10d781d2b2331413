//! What a method needs for an error, or reaches with some bytes: the lower hull of all that was measured of it.

/// Errors are not told apart below this share: that of single precision.
const EXACT: f64 = 1e-8;

/// The lower convex hull of (bytes, error) in logarithms, as far as errors fall.
pub(super) struct Hull(Vec<[f64; 2]>);

/// Bytes at an error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Bytes {
    /// Fewer than the smallest that was measured.
    Fewer(f64),
    /// Between two that were measured.
    About(f64),
    /// More than those of the least error that was measured.
    More(f64),
}

impl Hull {
    /// The hull of (bytes, error). Points that are not finite are left out.
    pub(super) fn new(points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let is_finite = |&(bytes, error): &(f64, f64)| bytes.is_finite() && error.is_finite();
        let mut points: Vec<[f64; 2]> = points
            .into_iter()
            .filter(is_finite)
            .map(|(bytes, error)| [bytes.ln(), error.max(EXACT).ln()])
            .collect();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
        let mut hull: Vec<[f64; 2]> = Vec::new();
        for p in points {
            if hull.last().is_some_and(|last| last[1] <= p[1]) {
                continue;
            }
            // The corner before the last and this point: what lies above their line is not on the hull.
            while let [.., a, b] = hull[..]
                && (b[0] - a[0]) * (p[1] - a[1]) <= (b[1] - a[1]) * (p[0] - a[0])
            {
                hull.pop();
            }
            hull.push(p);
        }
        Self(hull)
    }

    /// Its corners, as (bytes, error).
    pub(super) fn corners(&self) -> impl Iterator<Item = (f64, f64)> {
        self.0.iter().map(|[bytes, error]| (bytes.exp(), error.exp()))
    }

    /// The bytes at an error, on straight lines of logarithms; `None` if nothing was measured.
    pub(super) fn bytes(&self, error: f64) -> Option<Bytes> {
        let error = error.max(EXACT).ln();
        let ([few, worst], [many, best]) = (*self.0.first()?, *self.0.last()?);
        if error >= worst {
            return Some(Bytes::Fewer(few.exp()));
        }
        if error < best {
            return Some(Bytes::More(many.exp()));
        }
        let k = self.0.partition_point(|corner| corner[1] > error);
        let ([x, above], [y, below]) = (self.0[k - 1], self.0[k]);
        let t = (above - error) / (above - below);
        Some(Bytes::About((x + t * (y - x)).exp()))
    }
}

impl Bytes {
    /// The ratio of other bytes to these, after these.
    pub(super) fn beside(self, other: usize) -> String {
        let (sign, turned, bytes) = match self {
            Self::Fewer(bytes) => ("< ", "> ", bytes),
            Self::About(bytes) => ("", "", bytes),
            Self::More(bytes) => ("> ", "< ", bytes),
        };
        format!("{sign}{bytes:.0} ({turned}{:.2})", other as f64 / bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn about(bytes: Option<Bytes>) -> f64 {
        match bytes {
            Some(Bytes::About(bytes)) => bytes,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn only_the_lower_hull_counts() {
        // Errors fall as the inverse of bytes from 100 to 1600; what is above the line does not count.
        let points =
            [(100.0, 0.16), (1600.0, 0.01), (400.0, 0.05), (800.0, 0.3), (3200.0, 0.02), (50.0, f64::NAN)];
        let hull = Hull::new(points);
        assert_eq!(hull.corners().count(), 2);
        assert!((about(hull.bytes(0.04)) - 400.0).abs() < 1e-9);
        assert!((about(hull.bytes(0.01)) - 1600.0).abs() < 1e-9);
        let better = Hull::new(points.into_iter().chain([(400.0, 0.03)]));
        assert_eq!(better.corners().count(), 3);
        assert!((about(better.bytes(0.03)) - 400.0).abs() < 1e-9);
    }

    #[test]
    fn beyond_the_ends_there_is_a_bound() {
        let hull = Hull::new([(100.0, 0.1), (1000.0, 0.0)]);
        assert_eq!(hull.bytes(0.2).map(|b| b.beside(50)), Some("< 100 (> 0.50)".to_owned()));
        assert_eq!(hull.bytes(0.0).map(|b| b.beside(500)), Some("1000 (0.50)".to_owned()));
        let hull = Hull::new([(100.0, 0.1), (1000.0, 0.01)]);
        assert_eq!(hull.bytes(0.001).map(|b| b.beside(500)), Some("> 1000 (< 0.50)".to_owned()));
        assert_eq!(Hull::new([]).bytes(0.1), None);
    }
}
