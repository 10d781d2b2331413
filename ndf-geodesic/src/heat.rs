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
//! decays by e an edge underflows: [`HeatDistances::out_of_reach`] counts the vertices beyond.
//!
//! # When to use which
//! [Exact windows](crate::exact_distances) where distances are measured, compared or followed back to paths:
//! exact on any triangulation, slivers included. Heat where the same surface is queried many times from
//! different sources, where a smooth field is wanted, or where errors of about one per cent do not matter: so
//! much on fine, even meshes, more on coarse and uneven ones.
//!
//! # Delaunay
//! On other triangulations cotangents may be negative and heat may fall below zero. The solver therefore works
//! on the intrinsic Delaunay triangulation, which it flips to (Bobenko and Springborn 2007): the surface and
//! its vertices stay the same.
//!
//! ```
//! use ndf_geodesic::HeatSolver;
//! use ndf_intrinsic::IntrinsicMesh;
//! use ndf_mesh::{ManifoldMesh, SurfacePoint, Vertex, shapes};
//!
//! let sphere = ManifoldMesh::try_from(shapes::icosphere(3)).expect("a sphere is a manifold");
//! let solver = HeatSolver::new(&IntrinsicMesh::from_mesh(&sphere))?;
//! for source in [0, 17].map(Vertex) {
//!     let distances = solver.distances(&[SurfacePoint::Vertex(source)])?.values;
//!     let farthest = distances.iter().copied().fold(0.0, f64::max);
//!     assert!((farthest - std::f64::consts::PI).abs() < 0.1);
//! }
//! # Ok::<(), ndf_geodesic::GeodesicError>(())
//! ```

use ndf_core::{NoProgress, Progress};
use ndf_intrinsic::{IntrinsicMesh, triangle};
use ndf_mesh::SurfacePoint;
use ndf_spectral::{Cholesky, Components, LaplaceBeltrami, Mass, MetricTriangles, SymbolicCholesky};

use crate::error::GeodesicError;
use crate::sources::Place;

/// Faces without area are widened by this fraction of the mean edge length: cotangents must be finite.
const MOLLIFICATION: f64 = 1e-8;

/// Heat below this part of the hottest loses digits, and soon all of them.
const UNDERFLOW: f64 = 1e-290;

/// The factorised heat method of a mesh; see the [module](self).
#[derive(Clone, Debug)]
pub struct HeatSolver {
    /// The mesh as given, whose points sources are.
    given: IntrinsicMesh,
    /// The same vertices, mollified where faces had no area, and flipped to Delaunay.
    mesh: IntrinsicMesh,
    time: f64,
    /// Of `L + M/t`.
    heat: Cholesky,
    /// Of `L`, with one vertex of every component held at 0.
    poisson: Cholesky,
    components: Components,
}

/// Approximate distances.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct HeatDistances {
    /// Of every vertex from the nearest source, in the unit of the mesh's lengths: +∞ in components without a source,
    /// never negative, 0 at sources that are vertices, by a fraction of an edge's length off at others.
    pub values: Vec<f64>,
    /// Vertices of components with a source that heat does not reach in double precision. Their distances are too
    /// short; a larger time step reaches farther, in proportion to its root.
    pub out_of_reach: usize,
}

impl HeatSolver {
    /// Factorises for the authors' time step, the square of the mean edge length. O(n^1.5) for meshes of
    /// practice.
    ///
    /// # Errors
    /// If a vertex has no area around it, or the matrices are not positive definite to double precision.
    pub fn new(mesh: &IntrinsicMesh) -> Result<Self, GeodesicError> {
        Self::with_time(mesh, 1.0, &NoProgress)
    }

    /// Factorises for `time` times the square of the mean edge length. The observer can stop it between the steps, of which
    /// the factorisations are the longest.
    ///
    /// # Errors
    /// As [`new`](Self::new); also if `time` is not positive, or the observer asks to stop.
    pub fn with_time(
        mesh: &IntrinsicMesh,
        time: f64,
        progress: &dyn Progress,
    ) -> Result<Self, GeodesicError> {
        progress.check()?;
        let given = mesh.clone();
        let mut mesh = mesh.clone();
        mesh.mollify(MOLLIFICATION);
        mesh.flip_to_delaunay();
        let mean = mesh.lengths().iter().sum::<f64>() / mesh.edge_count().max(1) as f64;
        let step = time * mean * mean;
        if !(step.is_finite() && step > 0.0) {
            return Err(GeodesicError::TimeStep(time));
        }
        progress.check()?;
        let operator = LaplaceBeltrami::from_lengths(&MetricTriangles::from(&mesh), Mass::Barycentric)?;
        let components = operator.components().clone();
        // Scaled by 1/t, which changes no direction of a gradient.
        let heat = operator.laplacian().plus(step.recip(), operator.mass());
        progress.check()?;
        let symbolic = SymbolicCholesky::new(&heat)?;
        progress.check()?;
        let heat = symbolic.cholesky(&heat)?;
        progress.check()?;
        let poisson = symbolic.cholesky(&operator.grounded())?;
        Ok(Self { given, mesh, time: step, heat, poisson, components })
    }

    /// The time heat diffuses for, in squared units of the mesh's lengths.
    pub fn time_step(&self) -> f64 {
        self.time
    }

    /// Approximate distance of every vertex from the nearest of the sources. Two solves, O(n log n).
    ///
    /// # Errors
    /// If there is no source or one is not on the mesh.
    pub fn distances(&self, sources: &[SurfacePoint]) -> Result<HeatDistances, GeodesicError> {
        if sources.is_empty() {
            return Err(GeodesicError::NoSource);
        }
        let mut heat = vec![0.0; self.mesh.vertex_count()];
        let component_of = self.components.labels();
        // Each source as vertices and weights.
        let mut weights = Vec::new();
        for &source in sources {
            let point = Place::of(&self.given, source)?.as_face_point(&self.given);
            let corners = self.given.face_vertices(point.face);
            for (v, b) in corners.into_iter().zip(point.barycentric) {
                heat[v.index()] += b;
            }
            weights.push((corners, point.barycentric));
        }
        self.heat.solve(&mut [&mut heat]);
        let out_of_reach = self.out_of_reach(&heat);
        let mut potential = self.unit_divergence(&heat);
        self.poisson.solve(&mut [&mut potential]);
        // The constant of every component: the lowest value at its sources; infinite where there is none.
        let mut lowest = vec![f64::INFINITY; self.components.count()];
        for (corners, barycentric) in &weights {
            let value: f64 = corners.iter().zip(barycentric).map(|(v, b)| b * potential[v.index()]).sum();
            let lowest = &mut lowest[component_of[corners[0].index()] as usize];
            *lowest = lowest.min(value);
        }
        for (distance, &component) in potential.iter_mut().zip(component_of) {
            let lowest = lowest[component as usize];
            *distance = if lowest.is_finite() { (*distance - lowest).max(0.0) } else { f64::INFINITY };
        }
        for (corners, barycentric) in weights {
            if let Some(corner) = barycentric.iter().position(|b| *b == 1.0) {
                potential[corners[corner].index()] = 0.0;
            }
        }
        Ok(HeatDistances { values: potential, out_of_reach })
    }

    /// How many vertices of components with heat have none that double precision resolves.
    fn out_of_reach(&self, heat: &[f64]) -> usize {
        let labels = self.components.labels();
        let mut hottest = vec![0.0_f64; self.components.count()];
        for (u, &component) in heat.iter().zip(labels) {
            hottest[component as usize] = hottest[component as usize].max(*u);
        }
        heat.iter().zip(labels).filter(|&(u, &c)| *u < UNDERFLOW * hottest[c as usize]).count()
    }

    /// The integrated divergence of −∇u/|∇u| at every vertex, as the right-hand side of `L φ = …`.
    fn unit_divergence(&self, heat: &[f64]) -> Vec<f64> {
        let mut divergence = vec![0.0; self.mesh.vertex_count()];
        for face in self.mesh.faces() {
            let corners = self.mesh.face_vertices(face);
            let values = corners.map(|v| heat[v.index()]);
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
                divergence[corner.index()] += 0.5 * (hat[0] * away[0] + hat[1] * away[1]);
            }
        }
        divergence
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ExactOptions, exact_distances};
    use ndf_core::NoProgress;
    use ndf_mesh::shapes;
    use ndf_mesh::{Face, FacePoint, ManifoldMesh, Vertex};

    fn mean_error(mesh: &IntrinsicMesh, sources: &[SurfacePoint]) -> f64 {
        let exact = exact_distances(mesh, sources, &ExactOptions::default(), &NoProgress).unwrap();
        let heat = HeatSolver::new(mesh).unwrap().distances(sources).unwrap().values;
        let max = exact.distances().iter().copied().fold(0.0, f64::max);
        let sum: f64 = heat.iter().zip(exact.distances()).map(|(a, b)| (a - b).abs()).sum();
        sum / (max * heat.len() as f64)
    }

    #[test]
    fn close_to_exact_on_good_meshes_and_closer_on_finer_ones() {
        let errors = [3, 4, 5].map(|level| {
            let mesh = IntrinsicMesh::from_mesh(&ManifoldMesh::try_from(shapes::icosphere(level)).unwrap());
            mean_error(&mesh, &[SurfacePoint::Vertex(Vertex(0))])
        });
        assert!(errors[0] < 0.03 && errors[1] < errors[0] && errors[2] < errors[1], "{errors:?}");
        let grid = IntrinsicMesh::from_mesh(&ManifoldMesh::try_from(shapes::grid(40, 30)).unwrap());
        let inside = SurfacePoint::Face(FacePoint { face: Face(1111), barycentric: [0.2, 0.3, 0.5] });
        assert!(mean_error(&grid, &[inside]) < 0.03);
        assert!(mean_error(&grid, &[SurfacePoint::Vertex(Vertex(0)), inside]) < 0.03);
    }

    #[test]
    fn stretched_meshes_are_flipped_first() {
        let stretched = shapes::grid(40, 40).map_positions(|p| p * ndf_core::DVec3::new(20.0, 1.0, 1.0));
        let mesh = IntrinsicMesh::from_mesh(&ManifoldMesh::try_from(stretched).unwrap());
        assert!(mean_error(&mesh, &[SurfacePoint::Vertex(Vertex(17 * 41 + 20))]) < 0.05);
    }

    #[test]
    fn other_components_are_infinitely_far() {
        let sphere = shapes::icosphere(2);
        let n = sphere.vertex_count() as u32;
        let (mut positions, mut faces) = sphere.into_parts();
        positions.extend(positions.clone().iter().map(|p| *p + ndf_core::DVec3::X * 5.0));
        faces.extend(faces.clone().iter().map(|f| f.map(|v| v + n)));
        let two = ndf_mesh::TriangleMesh::new(positions, faces).unwrap();
        let mesh = IntrinsicMesh::from_mesh(&ManifoldMesh::try_from(two).unwrap());
        let solver = HeatSolver::new(&mesh).unwrap();
        let d = solver.distances(&[SurfacePoint::Vertex(Vertex(n))]).unwrap().values;
        assert!(d[..n as usize].iter().all(|d| d.is_infinite()));
        assert!(d[n as usize..].iter().all(|d| d.is_finite()));
        assert_eq!(d[n as usize], 0.0);
        let both = [0, n].map(|v| SurfacePoint::Vertex(Vertex(v)));
        let both = solver.distances(&both).unwrap().values;
        assert!(both.iter().zip(&both[n as usize..]).all(|(a, b)| (a - b).abs() < 1e-9));
    }

    #[test]
    fn every_source_is_at_zero() {
        let mesh =
            IntrinsicMesh::from_mesh(&ManifoldMesh::try_from(shapes::torus(40, 20, 1.0, 0.4)).unwrap());
        let sources = [3, 500, 700];
        let points = sources.map(|v| SurfacePoint::Vertex(Vertex(v)));
        let found = HeatSolver::new(&mesh).unwrap().distances(&points).unwrap();
        assert_eq!(found.out_of_reach, 0);
        assert!(sources.iter().all(|&v| found.values[v as usize] == 0.0));
    }

    /// A strip longer than heat reaches: its vertices are counted, and a larger time step reaches them.
    #[test]
    fn what_heat_does_not_reach_is_counted() {
        let strip = shapes::grid(2000, 2).map_positions(|p| p * ndf_core::DVec3::new(2000.0, 2.0, 0.0));
        let mesh = IntrinsicMesh::from_mesh(&ManifoldMesh::try_from(strip).unwrap());
        let from = |time| {
            HeatSolver::with_time(&mesh, time, &NoProgress)
                .unwrap()
                .distances(&[SurfacePoint::Vertex(Vertex(0))])
        };
        let (short, long) = (from(1.0).unwrap(), from(16.0).unwrap());
        assert!((3000..4000).contains(&short.out_of_reach), "{}", short.out_of_reach);
        assert_eq!(long.out_of_reach, 0);
        assert!((long.values[2000] - 2000.0).abs() < 20.0, "{}", long.values[2000]);
    }

    #[test]
    fn no_source_is_an_error() {
        let mesh = IntrinsicMesh::from_mesh(&ManifoldMesh::try_from(shapes::icosphere(0)).unwrap());
        let solver = HeatSolver::new(&mesh).unwrap();
        assert_eq!(solver.distances(&[]).unwrap_err(), GeodesicError::NoSource);
        for time in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let error = HeatSolver::with_time(&mesh, time, &NoProgress).unwrap_err();
            // The number that was given, not the one in units of the mesh.
            assert!(matches!(error, GeodesicError::TimeStep(t) if t.to_bits() == time.to_bits()));
        }
    }
}
