//! How well a cached projection agrees with the true one.

use ndf_core::projected;
use ndf_core::{Query, Surface};

/// Distances between the feet of the same queries on two surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Agreement {
    /// Queries with a foot on both.
    pub feet: usize,
    /// Queries with a foot on one of them only.
    pub disagreeing: usize,
    /// Median distance between the feet.
    pub median: f64,
    /// Root of the mean of the squared distances.
    pub rms: f64,
    /// Largest distance. Where a query has two closest points, this can be as far as they are apart.
    pub max: f64,
}

/// Projects the queries onto both surfaces and compares.
pub fn agreement(one: &dyn Surface, other: &dyn Surface, queries: &[Query]) -> Agreement {
    let pairs = projected(one, queries).into_iter().zip(projected(other, queries));
    let (mut distances, mut disagreeing) = (Vec::new(), 0);
    for pair in pairs {
        match pair {
            (Ok(a), Ok(b)) => distances.push(a.point.distance(b.point)),
            (Err(_), Err(_)) => {}
            _ => disagreeing += 1,
        }
    }
    distances.sort_by(f64::total_cmp);
    let feet = distances.len();
    let squares: f64 = distances.iter().map(|d| d * d).sum();
    Agreement {
        feet,
        disagreeing,
        median: distances.get(feet / 2).copied().unwrap_or(0.0),
        rms: (squares / feet.max(1) as f64).sqrt(),
        max: distances.last().copied().unwrap_or(0.0),
    }
}
