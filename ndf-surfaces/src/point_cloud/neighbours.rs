//! Nearest neighbours, by the k-d tree of the crate `kiddo`.

use std::num::NonZero;
use std::sync::Arc;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use ndf_core::DVec3;

/// A neighbour of a query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbour {
    /// Which point it is.
    pub index: u32,
    /// Square of its distance.
    pub distance_squared: f64,
}

/// An index of points. The immutable tree of `kiddo` splits by count, so that any number of points may share a
/// coordinate; its mutable tree cannot split buckets of those. Clones share it.
#[derive(Clone)]
pub struct Neighbours {
    tree: Arc<ImmutableKdTree<f64, 3>>,
    count: usize,
}

impl Neighbours {
    /// Indexes finite points. O(n log n).
    ///
    /// # Panics
    /// If there are more than `u32::MAX` points.
    pub fn new(points: &[DVec3]) -> Self {
        let coordinates: Vec<[f64; 3]> = points.iter().map(DVec3::to_array).collect();
        let tree = ImmutableKdTree::new_from_slice(&coordinates).expect("indices fit in 32 bits");
        Self { tree: Arc::new(tree), count: points.len() }
    }

    /// The `k` points nearest to `p` (all, if there are fewer), nearest first.
    pub fn nearest(&self, p: DVec3, k: usize) -> Vec<Neighbour> {
        let Some(k) = NonZero::new(k.min(self.count)) else { return Vec::new() };
        let found = self.tree.query(&p.to_array()).nearest_n::<SquaredEuclidean<f64>>(k).execute();
        found
            .into_iter()
            .map(|item| Neighbour { index: item.item, distance_squared: item.distance })
            .collect()
    }

    /// All points within a distance of `p`, in no particular order.
    pub fn within(&self, p: DVec3, distance: f64) -> Vec<Neighbour> {
        if self.count == 0 {
            return Vec::new();
        }
        let query = p.to_array();
        let within = self.tree.query(&query).within::<SquaredEuclidean<f64>>(distance * distance);
        let found = within.unsorted().execute();
        found
            .into_iter()
            .map(|item| Neighbour { index: item.item, distance_squared: item.distance })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(points: &[DVec3]) {
        let neighbours = Neighbours::new(points);
        for (i, &p) in points.iter().enumerate().step_by(1 + points.len() / 50) {
            let q = p + DVec3::new(0.01, -0.02, 0.005) * (i % 3) as f64;
            let mut all: Vec<f64> = points.iter().map(|x| x.distance_squared(q)).collect();
            all.sort_by(f64::total_cmp);
            let found = neighbours.nearest(q, 12);
            assert_eq!(found.len(), 12.min(points.len()));
            for (neighbour, expected) in found.iter().zip(&all) {
                assert!((neighbour.distance_squared - expected).abs() <= 1e-12 * (1.0 + expected));
                let there = points[neighbour.index as usize].distance_squared(q);
                assert!((there - neighbour.distance_squared).abs() <= 1e-12 * (1.0 + there));
            }
            let near = all.iter().filter(|&&d| d <= 0.0625).count();
            assert_eq!(neighbours.within(q, 0.25).len(), near);
        }
    }

    #[test]
    fn neighbours_are_those_of_a_full_search() {
        let spread = |i: i32| (DVec3::new(0.618, 0.414, 0.732) * f64::from(i)).fract();
        check(&(0..3000).map(spread).collect::<Vec<_>>());
        check(&[DVec3::ONE]);
        assert!(Neighbours::new(&[]).nearest(DVec3::ZERO, 3).is_empty());
    }

    #[test]
    fn many_points_may_share_coordinates() {
        // All on a plane, on a line, on a grid as vertices of marching cubes are, and all in one place.
        check(&(0..3000).map(|i| DVec3::new(f64::from(i % 60), f64::from(i / 60), 0.5)).collect::<Vec<_>>());
        check(&(0..3000).map(|i| DVec3::new(1.0, f64::from(i), 2.0)).collect::<Vec<_>>());
        let grid = |i: i32| DVec3::new(f64::from(i % 4), f64::from(i / 4 % 4), 0.1 * f64::from(i / 16));
        check(&(0..3000).map(grid).collect::<Vec<_>>());
        check(&[DVec3::ZERO; 2000]);
    }
}
