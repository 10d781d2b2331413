//! How far two meshes are apart: two-sided distances, angles between normals, flipped faces.
//!
//! Means are over samples uniform by area, in the manner of Metro (Cignoni, Rocchini and Scopigno 1998);
//! distances are to the closest point of the other mesh, exact. A maximum is over the same samples and all
//! vertices that belong to a face, which is where the distance of a finely tessellated mesh is largest; it
//! approaches the Hausdorff distance from below.

use rayon::prelude::*;
use serde::Serialize;

use crate::FacePoint;
use crate::sampling::AreaSampler;
use crate::{TriangleMesh, TriangleTree};
use ndf_core::{Cancelled, DVec3, Hint, NoProgress, Progress};

/// How many points are measured, and which.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeasureOptions {
    /// Samples on each of the two meshes.
    pub samples: usize,
    /// Seed of the samples.
    pub seed: u64,
}

impl Default for MeasureOptions {
    fn default() -> Self {
        Self { samples: 200_000, seed: 0 }
    }
}

/// Distances from one mesh to another, in the unit of the coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Distances {
    /// Mean over the samples.
    pub mean: f64,
    /// Root of the mean square over the samples.
    pub rms: f64,
    /// Largest over the samples and the vertices.
    pub max: f64,
}

/// What [`measure`] found.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Measurement {
    /// From samples of the reference to the mesh: large where the mesh lacks something.
    pub reference_to_mesh: Distances,
    /// From samples of the mesh to the reference: large where the mesh has something of its own.
    pub mesh_to_reference: Distances,
    /// Mean angle, in radians, between the face normal of a sample and the face normal at its closest point, over
    /// the samples of both meshes.
    pub normal_angle_mean: f64,
    /// Share of the samples of the mesh whose face normal opposes that of the reference at the closest point.
    pub flipped_fraction: f64,
    /// The larger of both maxima.
    pub hausdorff: f64,
    /// Diagonal of the bounding box of the reference, to judge distances by.
    pub diagonal: f64,
}

/// A mesh on which nothing can be measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MeasureError {
    /// The reference has no area, or one that is not finite.
    #[error("the reference has no area, or coordinates that are not finite")]
    Reference,
    /// The mesh has no area, or one that is not finite.
    #[error("the mesh has no area, or coordinates that are not finite")]
    Mesh,
    /// No samples were asked for.
    #[error("at least one sample is needed")]
    NoSamples,
    /// The observer asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Measures `mesh` against `reference`. A function of its arguments alone, not of the number of threads.
/// About a microsecond a sample and vertex, over all threads.
///
/// # Errors
/// If either mesh has no area, or no sample is asked for.
pub fn measure(
    reference: &TriangleMesh,
    mesh: &TriangleMesh,
    options: &MeasureOptions,
) -> Result<Measurement, MeasureError> {
    measure_with(reference, mesh, options, &NoProgress)
}

/// The same, with an observer that can stop it.
///
/// # Errors
/// As [`measure`], and [`MeasureError::Cancelled`].
pub fn measure_with(
    reference: &TriangleMesh,
    mesh: &TriangleMesh,
    options: &MeasureOptions,
    progress: &dyn Progress,
) -> Result<Measurement, MeasureError> {
    if options.samples == 0 {
        return Err(MeasureError::NoSamples);
    }
    let reference_sampler = AreaSampler::new(reference).ok_or(MeasureError::Reference)?;
    let mesh_sampler = AreaSampler::new(mesh).ok_or(MeasureError::Mesh)?;
    let drawn = |sampler: AreaSampler, stream| sampler.sample(options.samples, options.seed, stream);
    progress.report("measuring", 0.0);
    let forth = one_sided(reference, &drawn(reference_sampler, 0), mesh, progress)?;
    progress.report("measuring", 0.5);
    let back = one_sided(mesh, &drawn(mesh_sampler, 1), reference, progress)?;
    progress.report("measuring", 1.0);
    let angles = forth.angles + back.angles;
    Ok(Measurement {
        reference_to_mesh: forth.distances(options.samples),
        mesh_to_reference: back.distances(options.samples),
        normal_angle_mean: if angles == 0 { 0.0 } else { (forth.angle_sum + back.angle_sum) / angles as f64 },
        flipped_fraction: back.flipped as f64 / options.samples as f64,
        hausdorff: forth.max_squared.max(back.max_squared).sqrt(),
        diagonal: reference.bounds().diagonal(),
    })
}

/// Distance of every vertex to the closest point of the mesh in `tree`; NaN for vertices that are not finite or
/// if the tree is empty.
pub fn vertex_distances(mesh: &TriangleMesh, tree: &TriangleTree) -> Vec<f64> {
    let distance =
        |&p: &DVec3| tree.closest_point(p, Hint::NONE).map_or(f64::NAN, |c| c.distance_squared.sqrt());
    mesh.positions().par_iter().map(distance).collect()
}

/// Points measured at a time. Sums over samples depend on it, so it is fixed, where the number of threads is not.
const CHUNK: usize = 1024;

/// Sums over samples of one mesh and their closest points on the other.
#[derive(Clone, Copy, Default)]
struct Sums {
    distance: f64,
    distance_squared: f64,
    max_squared: f64,
    angle_sum: f64,
    /// Pairs of normals of which both have a direction.
    angles: usize,
    flipped: usize,
}

impl Sums {
    fn distances(&self, samples: usize) -> Distances {
        Distances {
            mean: self.distance / samples as f64,
            rms: (self.distance_squared / samples as f64).sqrt(),
            max: self.max_squared.sqrt(),
        }
    }

    fn plus(self, other: Self) -> Self {
        Self {
            distance: self.distance + other.distance,
            distance_squared: self.distance_squared + other.distance_squared,
            max_squared: self.max_squared.max(other.max_squared),
            angle_sum: self.angle_sum + other.angle_sum,
            angles: self.angles + other.angles,
            flipped: self.flipped + other.flipped,
        }
    }
}

fn one_sided(
    from: &TriangleMesh,
    samples: &[FacePoint],
    to: &TriangleMesh,
    progress: &dyn Progress,
) -> Result<Sums, Cancelled> {
    progress.check()?;
    let tree = TriangleTree::new(to);
    let of_samples = |samples: &[FacePoint]| {
        progress.check()?;
        let mut sums = Sums::default();
        // Samples come ordered by face, so the last answer is a good hint.
        let mut hint = Hint::NONE;
        for sample in samples {
            let Some(closest) = tree.closest_point(sample.position(from), hint) else { continue };
            hint = closest.hint();
            sums.distance += closest.distance_squared.sqrt();
            sums.distance_squared += closest.distance_squared;
            sums.max_squared = sums.max_squared.max(closest.distance_squared);
            let (n, m) = (from.face_normal(sample.face), to.face_normal(closest.at.face));
            if n != DVec3::ZERO && m != DVec3::ZERO {
                // Unlike the arc cosine, exact also for small angles.
                sums.angle_sum += n.cross(m).length().atan2(n.dot(m));
                sums.angles += 1;
                sums.flipped += usize::from(n.dot(m) < 0.0);
            }
        }
        Ok(sums)
    };
    let mut used = vec![false; from.vertex_count()];
    from.faces().iter().flatten().for_each(|&v| used[v as usize] = true);
    let farthest = |(positions, used): (&[DVec3], &[bool])| {
        progress.check()?;
        let used = positions.iter().zip(used).filter(|&(_, &used)| used);
        let closest = used.filter_map(|(&p, _)| tree.closest_point(p, Hint::NONE));
        Ok(closest.map(|closest| closest.distance_squared).fold(0.0, f64::max))
    };
    let vertices = from.positions().par_chunks(CHUNK).zip(used.par_chunks(CHUNK));
    let farthest_vertex = vertices.map(farthest).try_reduce(|| 0.0, |a, b| Ok::<f64, Cancelled>(a.max(b)))?;
    let chunks: Vec<Sums> = samples.par_chunks(CHUNK).map(of_samples).collect::<Result<_, Cancelled>>()?;
    let sums = chunks.into_iter().fold(Sums::default(), Sums::plus);
    Ok(Sums { max_squared: sums.max_squared.max(farthest_vertex), ..sums })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;
    use approx::assert_relative_eq;

    const FEW: MeasureOptions = MeasureOptions { samples: 20_000, seed: 1 };

    #[test]
    fn a_mesh_has_no_distance_to_itself() {
        let mesh = shapes::trefoil_knot(100, 12, 0.2);
        let m = measure(&mesh, &mesh, &FEW).unwrap();
        assert!(
            m.hausdorff < 1e-14 && m.normal_angle_mean.to_degrees() < 1e-4 && m.flipped_fraction == 0.0,
            "{m:?}"
        );
        assert_eq!(m.diagonal, mesh.bounds().diagonal());
    }

    #[test]
    fn spheres_are_as_far_apart_as_their_radii() {
        let inner = shapes::icosphere(5);
        let outer = inner.map_positions(|p| 1.25 * p);
        let m = measure(&inner, &outer, &FEW).unwrap();
        for d in [m.reference_to_mesh, m.mesh_to_reference] {
            assert_relative_eq!(d.mean, 0.25, epsilon = 1e-3);
            assert_relative_eq!(d.rms, 0.25, epsilon = 1e-3);
            assert!(d.mean <= d.rms && d.rms <= d.max);
        }
        assert_relative_eq!(m.hausdorff, 0.25, epsilon = 1e-3);
        assert!(m.normal_angle_mean.to_degrees() < 2.0 && m.flipped_fraction == 0.0, "{m:?}");
    }

    #[test]
    fn what_is_missing_shows_on_one_side_only() {
        let whole = shapes::cube(8);
        let (positions, faces) = whole.clone().into_parts();
        // Without its first side, and with a vertex that belongs to nothing.
        let mut open_positions = positions;
        open_positions.push(DVec3::splat(100.0));
        let open = TriangleMesh::new(open_positions, faces[128..].to_vec()).unwrap();
        let m = measure(&whole, &open, &FEW).unwrap();
        assert!(m.mesh_to_reference.max < 1e-14, "{m:?}");
        assert_relative_eq!(m.reference_to_mesh.max, 1.0, epsilon = 1e-12);
        assert_eq!(m.hausdorff, m.reference_to_mesh.max);
    }

    #[test]
    fn reversed_faces_are_flipped_and_opposite() {
        let mesh = shapes::icosphere(3);
        let (positions, mut faces) = mesh.clone().into_parts();
        for face in &mut faces[..320] {
            face.swap(0, 1);
        }
        let m = measure(&mesh, &TriangleMesh::new(positions, faces).unwrap(), &FEW).unwrap();
        assert_relative_eq!(m.flipped_fraction, 0.25, epsilon = 0.01);
        assert_relative_eq!(m.normal_angle_mean.to_degrees(), 45.0, epsilon = 2.0);
    }

    #[test]
    fn threads_change_nothing() {
        let (a, b) = (shapes::torus(40, 20, 1.0, 0.4), shapes::torus(31, 17, 1.0, 0.41));
        let measured = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| measure(&a, &b, &FEW).unwrap())
        };
        assert_eq!(measured(1), measured(3));
    }

    #[test]
    fn vertices_have_their_own_distances() {
        let tree = TriangleTree::new(&shapes::cube(1));
        let points = vec![DVec3::new(0.0, 0.0, 3.0), DVec3::new(1.0, 1.0, 1.0), DVec3::NAN];
        let distances = vertex_distances(&TriangleMesh::new(points, Vec::new()).unwrap(), &tree);
        assert_eq!(distances[..2], [2.0, 0.0]);
        assert!(distances[2].is_nan());
    }

    #[test]
    fn an_observer_stops_it() {
        struct Stopped;
        impl Progress for Stopped {
            fn report(&self, _stage: &str, _fraction: f64) {}
            fn cancelled(&self) -> bool {
                true
            }
        }
        let mesh = shapes::cube(1);
        assert_eq!(measure_with(&mesh, &mesh, &FEW, &Stopped), Err(MeasureError::Cancelled(Cancelled)));
    }

    #[test]
    fn nothing_to_measure_is_an_error() {
        let (mesh, nothing) = (shapes::cube(1), TriangleMesh::default());
        assert_eq!(measure(&nothing, &mesh, &FEW), Err(MeasureError::Reference));
        assert_eq!(measure(&mesh, &nothing, &FEW), Err(MeasureError::Mesh));
        let none = MeasureOptions { samples: 0, ..FEW };
        assert_eq!(measure(&mesh, &mesh, &none), Err(MeasureError::NoSamples));
    }
}
