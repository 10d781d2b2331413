//! Points spread over a mesh uniformly by area.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use crate::{Face, FacePoint, TriangleMesh};

/// Draws points uniformly by area, stratified: the unit interval of cumulated area is cut into as many equal
/// strata as points are drawn, one point in each. Uniform like independent draws, with less variance; and the
/// points come ordered by face, so that neighbours in the batch are neighbours on the surface.
#[derive(Clone, Debug)]
pub struct AreaSampler {
    /// Area of all faces up to and including each.
    cumulated: Vec<f64>,
}

impl AreaSampler {
    /// A sampler of a mesh; `None` if the mesh has no area or one that is not finite.
    pub fn new(mesh: &TriangleMesh) -> Option<Self> {
        let mut total = 0.0;
        let cumulated: Vec<f64> = mesh
            .face_indices()
            .map(|f| {
                total += mesh.face_area(f);
                total
            })
            .collect();
        (total.is_finite() && total > 0.0).then_some(Self { cumulated })
    }

    /// Total area.
    pub fn area(&self) -> f64 {
        self.cumulated.last().copied().unwrap_or(0.0)
    }

    /// `count` points, a function of `(seed, stream)` alone. O(count + faces).
    pub fn sample(&self, count: usize, seed: u64, stream: u64) -> Vec<FacePoint> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(stream);
        let stratum = self.area() / count as f64;
        let mut face = 0;
        (0..count)
            .map(|i| {
                let target = (i as f64 + rng.random::<f64>()) * stratum;
                while face + 1 < self.cumulated.len() && self.cumulated[face] <= target {
                    face += 1;
                }
                // Uniform in the triangle (Osada et al. 2002).
                let (r, t) = (rng.random::<f64>().sqrt(), rng.random::<f64>());
                FacePoint { face: Face::new(face), barycentric: [1.0 - r, r * (1.0 - t), r * t] }
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;
    use ndf_core::DVec3;

    #[test]
    fn shares_follow_areas() {
        // A rectangle whose right part is cut into slivers.
        let mesh = shapes::grid(7, 3).map_positions(|p| DVec3::new(p.x * p.x, p.y, 0.0));
        let sampler = AreaSampler::new(&mesh).unwrap();
        let n = 20_000;
        let samples = sampler.sample(n, 1, 0);
        let mut counts = vec![0.0; mesh.face_count()];
        samples.iter().for_each(|s| counts[s.face.index()] += 1.0);
        for (f, count) in counts.iter().enumerate() {
            let expected = mesh.face_area(Face::new(f)) / mesh.area() * n as f64;
            assert!((count - expected).abs() <= 2.0, "face {f}: {count} instead of {expected}");
        }
        let mean = samples.iter().map(|s| s.position(&mesh)).sum::<DVec3>() / n as f64;
        assert!((mean - DVec3::new(0.5, 0.5, 0.0)).length() < 5e-3, "{mean}");
    }

    #[test]
    fn seeds_and_streams_decide() {
        let sampler = AreaSampler::new(&shapes::icosphere(1)).unwrap();
        assert_eq!(sampler.sample(100, 3, 7), sampler.sample(100, 3, 7));
        assert_ne!(sampler.sample(100, 3, 7), sampler.sample(100, 3, 8));
        assert_ne!(sampler.sample(100, 3, 7), sampler.sample(100, 4, 7));
    }

    #[test]
    fn flat_meshes_without_area_have_no_sampler() {
        let mesh = shapes::grid(2, 2).map_positions(|p| DVec3::new(p.x, 0.0, 0.0));
        assert!(AreaSampler::new(&mesh).is_none());
    }
}
