//! Geodesics in heat (Crane, Weischedel and Wardetzky 2013): smooth approximate distances by two linear
//! solves.
//!
//! Heat diffuses from the sources for a short time, `(M + t L) u = δ`; its gradient, made unit, points away
//! from them; the function whose gradient fits that best, `L φ = ∇·(−∇u/|∇u|)`, is the distance up to a
//! constant. `M` is the lumped mass, `L` the positive cotangent Laplacian. Both matrices are factorised once
//! and serve every set of sources.
//!
//! # The time step
//! `t = time · h²` with the mean edge length `h`. As `t → 0` the result tends to a distance in the *graph* of
//! the mesh; a larger `t` smooths ridges and cut loci and biases distances near them. `time = 1` is the
//! authors' choice and right for triangles of about one size; raise it on anisotropic meshes, where it takes
//! several edges to cross the length `h`, and on meshes more than some 700 edges across, where heat that
//! decays by e an edge underflows.
//!
//! # When to use which
//! [Exact windows](crate::exact_distances) where distances are measured, compared or followed back to paths:
//! exact on any triangulation, slivers included. Heat where the same surface is asked again and again from
//! other sources, where a smooth field is wanted, or where errors of about one per cent do not matter.
//!
//! # Delaunay
//! On other triangulations cotangents may be negative and heat may fall below zero. The solver therefore works
//! on the intrinsic Delaunay triangulation, which it flips to (Bobenko and Springborn 2007): the surface and
//! its vertices stay the same.

use faer::linalg::solvers::Solve;
use faer::sparse::linalg::solvers::{Llt, SymbolicLlt};
use faer::sparse::{SparseColMat, Triplet};
use faer::{Mat, Side};
use ndf_intrinsic::{IntrinsicMesh, triangle};
use ndf_mesh::SurfacePoint;

use crate::error::GeodesicError;
use crate::sources::Place;

/// Faces without area are widened by this fraction of the mean edge length: cotangents must be finite.
const MOLLIFICATION: f64 = 1e-8;

/// The factorised heat method of a mesh; see the [module](self).
#[derive(Clone, Debug)]
pub struct HeatSolver {
    /// The mesh as given, whose points sources are.
    given: IntrinsicMesh,
    /// The same vertices, mollified where faces had no area, and flipped to Delaunay.
    mesh: IntrinsicMesh,
    time: f64,
    heat: Llt<usize, f64>,
    poisson: Llt<usize, f64>,
    /// The connected component of every vertex.
    components: Vec<u32>,
}

impl HeatSolver {
    /// Factorises for the authors' time step, the square of the mean edge length. O(n^1.5) for meshes of
    /// practice.
    ///
    /// # Errors
    /// If a factorisation fails, which takes lengths that are no surface's.
    pub fn new(mesh: &IntrinsicMesh) -> Result<Self, GeodesicError> {
        Self::with_time(mesh, 1.0)
    }

    /// Factorises for `time` times the square of the mean edge length.
    ///
    /// # Errors
    /// As [`new`](Self::new); also if `time` is not positive.
    pub fn with_time(mesh: &IntrinsicMesh, time: f64) -> Result<Self, GeodesicError> {
        let given = mesh.clone();
        let mut mesh = mesh.clone();
        mesh.mollify(MOLLIFICATION);
        mesh.flip_to_delaunay();
        let mean = mesh.lengths().iter().sum::<f64>() / mesh.edge_count().max(1) as f64;
        let step = time * mean * mean;
        let failed = |reason: String| GeodesicError::Factorisation { reason };
        if !(step.is_finite() && step > 0.0) {
            return Err(GeodesicError::TimeStep(step));
        }
        let components = components(&mesh);
        let vertices = mesh.vertex_count();
        let mut mass = vec![0.0; vertices];
        // The graph Laplacian part that both matrices share, lower triangle.
        let mut laplacian = Vec::with_capacity(mesh.edge_count() + vertices);
        let mut diagonal = vec![0.0; vertices];
        for face in 0..mesh.face_count() as u32 {
            let area = mesh.area(face);
            mesh.face_vertices(face).into_iter().for_each(|v| mass[v as usize] += area / 3.0);
        }
        for edge in 0..mesh.edge_count() as u32 {
            let [a, b] = mesh.edge_vertices(edge);
            // An edge from a vertex to itself sees no difference.
            if a == b {
                continue;
            }
            let weight = 0.5 * mesh.cotangent_sum(edge);
            diagonal[a as usize] += weight;
            diagonal[b as usize] += weight;
            laplacian.push((a.max(b) as usize, a.min(b) as usize, -weight));
        }
        let matrix = |scale: f64, diagonal: Vec<f64>| {
            let below = laplacian.iter().map(|&(i, j, w)| Triplet::new(i, j, scale * w));
            let on = diagonal.into_iter().enumerate().map(|(i, w)| Triplet::new(i, i, w));
            let triplets: Vec<_> = below.chain(on).collect();
            SparseColMat::try_new_from_triplets(vertices, vertices, &triplets)
                .map_err(|e| failed(format!("{e:?}")))
        };
        let heat = matrix(step, diagonal.iter().zip(&mass).map(|(d, m)| m + step * d).collect())?;
        // A right-hand side sums to zero over a component: pulling one vertex of it towards 0 holds that
        // vertex at exactly 0 and changes nothing else, but makes the matrix definite.
        let mut pulled = diagonal;
        let mut last = u32::MAX;
        let mut by_component: Vec<usize> = (0..vertices).collect();
        by_component.sort_by_key(|&v| (components[v], v));
        for v in by_component {
            if std::mem::replace(&mut last, components[v]) != components[v] {
                pulled[v] += pulled[v].max(1.0);
            }
        }
        let poisson = matrix(1.0, pulled)?;
        let symbolic =
            SymbolicLlt::try_new(heat.symbolic(), Side::Lower).map_err(|e| failed(format!("{e:?}")))?;
        let factorise = |m: &SparseColMat<usize, f64>| {
            Llt::try_new_with_symbolic(symbolic.clone(), m.as_ref(), Side::Lower)
                .map_err(|e| failed(format!("{e:?}")))
        };
        let (heat, poisson) = (factorise(&heat)?, factorise(&poisson)?);
        Ok(Self { given, mesh, time: step, heat, poisson, components })
    }

    /// The time heat diffuses for, in squared units of the mesh's lengths.
    pub fn time_step(&self) -> f64 {
        self.time
    }

    /// Approximate distance of every vertex from the nearest of the sources, in the unit of the mesh's
    /// lengths: +∞ in components without a source, never negative, 0 at the nearest source or by a fraction
    /// of an edge's length off at sources inside faces. Two solves, O(n log n).
    ///
    /// # Errors
    /// If there is no source or one is not on the mesh.
    pub fn distances(&self, sources: &[SurfacePoint]) -> Result<Vec<f64>, GeodesicError> {
        if sources.is_empty() {
            return Err(GeodesicError::NoSource);
        }
        let vertices = self.mesh.vertex_count();
        let mut reached = vec![false; vertices];
        let mut heat = Mat::zeros(vertices, 1);
        // Each source as vertices and weights.
        let mut weights = Vec::new();
        for &source in sources {
            let point = Place::of(&self.given, source)?.as_face_point(&self.given);
            let corners = self.given.face_vertices(point.face);
            for (v, b) in corners.into_iter().zip(point.barycentric) {
                heat[(v as usize, 0)] += b;
            }
            reached[self.components[corners[0] as usize] as usize] = true;
            weights.push((corners, point.barycentric));
        }
        let heat = self.heat.solve(&heat);
        let divergence = self.unit_divergence(|v| heat[(v as usize, 0)]);
        let potential = self.poisson.solve(&divergence);
        // The constant of every component: the lowest value at its sources.
        let mut lowest = vec![f64::INFINITY; vertices];
        for (corners, barycentric) in weights {
            let value: f64 =
                corners.iter().zip(barycentric).map(|(&v, b)| b * potential[(v as usize, 0)]).sum();
            let component = self.components[corners[0] as usize] as usize;
            lowest[component] = lowest[component].min(value);
        }
        let distance = |v: usize| {
            let component = self.components[v] as usize;
            if reached[component] { (potential[(v, 0)] - lowest[component]).max(0.0) } else { f64::INFINITY }
        };
        Ok((0..vertices).map(distance).collect())
    }

    /// The integrated divergence of −∇u/|∇u| at every vertex, as the right-hand side of `L φ = …`.
    fn unit_divergence(&self, heat: impl Fn(u32) -> f64) -> Mat<f64> {
        let mut divergence = Mat::zeros(self.mesh.vertex_count(), 1);
        for face in 0..self.mesh.face_count() as u32 {
            let corners = self.mesh.face_vertices(face);
            let values = corners.map(&heat);
            // The direction of a gradient does not depend on its scale, and heat may be tiny.
            let largest = values.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
            let sides = self.mesh.sides(face);
            let [x, y] = triangle::apex(sides);
            if largest <= 0.0 || y <= 0.0 {
                continue;
            }
            let [u, v, w] = values.map(|v| v / largest);
            let length = sides[0];
            let gradient = [(v - u) / length, (w - u - (v - u) * x / length) / y];
            let norm = gradient[0].hypot(gradient[1]);
            if norm <= 0.0 {
                continue;
            }
            let away = [-gradient[0] / norm, -gradient[1] / norm];
            // Twice the area times the gradients of the hat functions: the opposite sides turned by a right
            // angle.
            let hats = [[-y, x - length], [y, -x], [0.0, length]];
            for (corner, hat) in corners.into_iter().zip(hats) {
                // The weak form of L φ = −div: ∫ ∇φ·∇ψ = ∫ X·∇ψ.
                divergence[(corner as usize, 0)] += 0.5 * (hat[0] * away[0] + hat[1] * away[1]);
            }
        }
        divergence
    }
}

/// The connected component of every vertex, numbered by a vertex of it.
fn components(mesh: &IntrinsicMesh) -> Vec<u32> {
    let mut component = vec![u32::MAX; mesh.vertex_count()];
    let mut stack = Vec::new();
    for seed in 0..mesh.vertex_count() as u32 {
        if component[seed as usize] != u32::MAX {
            continue;
        }
        component[seed as usize] = seed;
        stack.push(seed);
        while let Some(v) = stack.pop() {
            for h in mesh.outgoing(v) {
                for u in [mesh.tip(h), mesh.tail(mesh.previous(h))] {
                    if component[u as usize] == u32::MAX {
                        component[u as usize] = seed;
                        stack.push(u);
                    }
                }
            }
        }
    }
    component
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ExactOptions, exact_distances};
    use ndf_core::NoProgress;
    use ndf_mesh::ManifoldMesh;
    use ndf_mesh::shapes;

    fn mean_error(mesh: &IntrinsicMesh, sources: &[SurfacePoint]) -> f64 {
        let exact = exact_distances(mesh, sources, &ExactOptions::default(), &NoProgress).unwrap();
        let heat = HeatSolver::new(mesh).unwrap().distances(sources).unwrap();
        let max = exact.distances().iter().copied().fold(0.0, f64::max);
        let sum: f64 = heat.iter().zip(exact.distances()).map(|(a, b)| (a - b).abs()).sum();
        sum / (max * heat.len() as f64)
    }

    #[test]
    fn close_to_exact_on_good_meshes_and_closer_on_finer_ones() {
        let errors = [3, 4, 5].map(|level| {
            let mesh = IntrinsicMesh::of_mesh(&ManifoldMesh::try_from(shapes::icosphere(level)).unwrap());
            mean_error(&mesh, &[SurfacePoint::Vertex(0)])
        });
        assert!(errors[0] < 0.03 && errors[1] < errors[0] && errors[2] < errors[1], "{errors:?}");
        let grid = IntrinsicMesh::of_mesh(&ManifoldMesh::try_from(shapes::grid(40, 30)).unwrap());
        let inside = SurfacePoint::Face { face: 1111, barycentric: [0.2, 0.3, 0.5] };
        assert!(mean_error(&grid, &[inside]) < 0.03);
        assert!(mean_error(&grid, &[SurfacePoint::Vertex(0), inside]) < 0.03);
    }

    #[test]
    fn stretched_meshes_are_flipped_first() {
        let stretched = shapes::grid(40, 40).map_positions(|p| p * ndf_core::DVec3::new(20.0, 1.0, 1.0));
        let mesh = IntrinsicMesh::of_mesh(&ManifoldMesh::try_from(stretched).unwrap());
        assert!(mean_error(&mesh, &[SurfacePoint::Vertex(17 * 41 + 20)]) < 0.05);
    }

    #[test]
    fn other_components_are_infinitely_far() {
        let sphere = shapes::icosphere(2);
        let n = sphere.vertex_count() as u32;
        let (mut positions, mut faces) = sphere.into_parts();
        positions.extend(positions.clone().iter().map(|p| *p + ndf_core::DVec3::X * 5.0));
        faces.extend(faces.clone().iter().map(|f| f.map(|v| v + n)));
        let two = ndf_mesh::TriangleMesh::new(positions, faces).unwrap();
        let mesh = IntrinsicMesh::of_mesh(&ManifoldMesh::try_from(two).unwrap());
        let solver = HeatSolver::new(&mesh).unwrap();
        let d = solver.distances(&[SurfacePoint::Vertex(n)]).unwrap();
        assert!(d[..n as usize].iter().all(|d| d.is_infinite()));
        assert!(d[n as usize..].iter().all(|d| d.is_finite()));
        assert_eq!(d[n as usize], 0.0);
        let both = solver.distances(&[SurfacePoint::Vertex(0), SurfacePoint::Vertex(n)]).unwrap();
        assert!(both.iter().zip(&both[n as usize..]).all(|(a, b)| (a - b).abs() < 1e-9));
    }

    #[test]
    fn no_source_is_an_error() {
        let mesh = IntrinsicMesh::of_mesh(&ManifoldMesh::try_from(shapes::icosphere(0)).unwrap());
        let solver = HeatSolver::new(&mesh).unwrap();
        assert_eq!(solver.distances(&[]).unwrap_err(), GeodesicError::NoSource);
        for time in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(HeatSolver::with_time(&mesh, time), Err(GeodesicError::TimeStep(_))));
        }
    }
}
