//! The base mesh Ω′ of a displacement field: coarse, manifold, and near the surface.

use std::time::Instant;

use ndf_core::{Progress, Surface};
use ndf_mesh::ManifoldMesh;
use ndf_mesh::repair;

use crate::decimation::{DecimationOptions, decimate};
use crate::marching_cubes::{IsosurfaceError, MarchingCubesOptions, marching_cubes};
use crate::original::OriginalMesh;
use crate::remeshing::{FinalPassOptions, Target, improve, spread_points};
use crate::triangle_shape::smallest_angles;

/// Points of the fine mesh, for each face of the base mesh, that the final pass keeps it close to.
const POINTS_PER_FACE: usize = 6;

/// What the base mesh should be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BaseMeshOptions {
    /// Number of faces to aim for.
    pub faces: usize,
    /// How to sample the field of the surface, where the base mesh comes from a field.
    pub marching_cubes: MarchingCubesOptions,
    /// How to improve the decimated mesh.
    pub final_pass: FinalPassOptions,
}

impl Default for BaseMeshOptions {
    fn default() -> Self {
        Self {
            faces: 4000,
            marching_cubes: MarchingCubesOptions::default(),
            final_pass: FinalPassOptions::default(),
        }
    }
}

/// A base mesh and how it came about.
#[derive(Clone, Debug)]
pub struct BaseMesh {
    /// The mesh.
    pub mesh: ManifoldMesh,
    /// What was done.
    pub report: BaseMeshReport,
}

/// How a base mesh came about.
#[derive(Clone, Debug, PartialEq)]
pub struct BaseMeshReport {
    /// Number of faces of the base mesh.
    pub faces: usize,
    /// Number of its vertices.
    pub vertices: usize,
    /// V − E + F: that of the largest component of the isosurface, or of the input mesh.
    pub euler_characteristic: i64,
    /// Number of edges with one face.
    pub boundary_edges: usize,
    /// Number of faces of the isosurface's largest component, or of the input mesh.
    pub faces_before: usize,
    /// False if decimation had to end above the number of faces asked for. True also if there were fewer from
    /// the start; then all are kept.
    pub reached: bool,
    /// Components of the isosurface that were left out.
    pub components_dropped: usize,
    /// Their share of its area, from 0 to 1.
    pub area_dropped: f64,
    /// Cells of the grid along each axis; `None` where there was none.
    pub grid: Option<[u32; 3]>,
    /// Number of points the field was evaluated at.
    pub evaluations: u64,
    /// Edges flipped in the final pass.
    pub flips: usize,
    /// Root-mean-square distance between mesh and surface, both ways, before and after the final pass.
    pub distance: Option<[f64; 2]>,
    /// Smallest angle of any face, in radians.
    pub smallest_angle: f64,
    /// Time spent.
    pub seconds: StageSeconds,
}

/// Wall-clock seconds of each stage.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StageSeconds {
    /// Isosurface and choice of the largest component.
    pub isosurface: f64,
    /// Decimation.
    pub decimation: f64,
    /// Final pass.
    pub final_pass: f64,
}

/// Why there is no base mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BaseMeshError {
    /// The surface offers no scalar field.
    #[error("this surface has no implicit field to extract an isosurface from; provide a base mesh instead")]
    NoField,
    /// The isosurface failed.
    #[error(transparent)]
    Isosurface(#[from] IsosurfaceError),
    /// The observer asked to stop.
    #[error("cancelled")]
    Cancelled,
}

/// The base mesh of a surface with a scalar field: the isosurface by marching cubes, its largest component by
/// area, decimated, and improved against the surface.
///
/// It has the Euler characteristic of that component, the number of faces asked for unless the report says
/// otherwise, and no face without area. Deterministic.
///
/// # Errors
/// See [`BaseMeshError`].
pub fn base_mesh(
    surface: &dyn Surface,
    options: &BaseMeshOptions,
    progress: &dyn Progress,
) -> Result<BaseMesh, BaseMeshError> {
    let begin = Instant::now();
    let field = surface.as_field().ok_or(BaseMeshError::NoField)?;
    let found = marching_cubes(field, &options.marching_cubes, progress).map_err(|error| match error {
        IsosurfaceError::Cancelled => BaseMeshError::Cancelled,
        other => BaseMeshError::Isosurface(other),
    })?;
    let all = found.mesh.into_triangle_mesh();
    let (largest, components) = repair::largest_component(&all);
    let area_dropped = if components > 1 { 1.0 - largest.area() / all.area() } else { 0.0 };
    let largest = ManifoldMesh::try_from(largest).expect("a component of a manifold is a manifold");
    let isosurface = begin.elapsed().as_secs_f64();
    let mut base = coarsen(&largest, Some(surface), options, progress)?;
    let report = &mut base.report;
    report.components_dropped = components - 1;
    report.area_dropped = area_dropped;
    report.grid = Some(found.cells);
    report.evaluations = found.evaluations;
    report.seconds.isosurface = isosurface;
    Ok(base)
}

/// The base mesh of a clean mesh: decimated with all its components, and improved against `surface`, or against
/// the mesh itself where that is `None`.
///
/// # Errors
/// [`BaseMeshError::Cancelled`] only.
pub fn base_mesh_of_manifold(
    mesh: &ManifoldMesh,
    surface: Option<&dyn Surface>,
    options: &BaseMeshOptions,
    progress: &dyn Progress,
) -> Result<BaseMesh, BaseMeshError> {
    coarsen(mesh, surface, options, progress)
}

/// Decimation and final pass.
fn coarsen(
    fine: &ManifoldMesh,
    surface: Option<&dyn Surface>,
    options: &BaseMeshOptions,
    progress: &dyn Progress,
) -> Result<BaseMesh, BaseMeshError> {
    let uncancelled = || if progress.cancelled() { Err(BaseMeshError::Cancelled) } else { Ok(()) };
    let begin = Instant::now();
    let decimated = decimate(fine, &DecimationOptions::to_faces(options.faces), progress);
    uncancelled()?;
    let decimation = begin.elapsed().as_secs_f64();
    let begin = Instant::now();
    let original = surface.is_none().then(|| OriginalMesh::new(fine));
    let surface = surface.or(original.as_ref().map(|mesh| mesh as &dyn Surface));
    let points = spread_points(fine, POINTS_PER_FACE * decimated.mesh.face_count());
    let target = surface.map(|surface| Target { surface, points: &points });
    let improved = improve(&decimated.mesh, target.as_ref(), &options.final_pass, progress);
    uncancelled()?;
    let final_pass = begin.elapsed().as_secs_f64();
    let mesh = improved.mesh;
    let report = BaseMeshReport {
        faces: mesh.face_count(),
        vertices: mesh.vertex_count(),
        euler_characteristic: mesh.topology().euler_characteristic(),
        boundary_edges: mesh.topology().boundary_edge_count(),
        faces_before: fine.face_count(),
        reached: decimated.reached,
        components_dropped: 0,
        area_dropped: 0.0,
        grid: None,
        evaluations: 0,
        flips: improved.flips,
        distance: improved.distance,
        smallest_angle: smallest_angles(&mesh)[0],
        seconds: StageSeconds { isosurface: 0.0, decimation, final_pass },
    };
    Ok(BaseMesh { mesh, report })
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndf_core::analytic::{Sphere, Torus};
    use ndf_core::{Answer, BoundingBox, DVec3, ImplicitField, Inside, NoProgress, Query};
    use ndf_mesh::ValidationReport;
    use ndf_mesh::shapes;

    fn options(faces: usize, grid: u32) -> BaseMeshOptions {
        let marching_cubes = MarchingCubesOptions { grid, ..Default::default() };
        BaseMeshOptions { faces, marching_cubes, ..Default::default() }
    }

    #[test]
    fn spheres_and_tori_keep_their_topology() {
        let torus = Torus { center: DVec3::ZERO, ring: 1.0, tube: 0.35 };
        let surfaces: [(&dyn Surface, i64); 2] = [(&Sphere { radius: 2.0, ..Sphere::UNIT }, 2), (&torus, 0)];
        for (surface, euler) in surfaces {
            let base = base_mesh(surface, &options(800, 64), &NoProgress).unwrap();
            let report = ValidationReport::of(&base.mesh);
            assert_eq!((report.faces, report.euler_characteristic, report.components), (800, euler, 1));
            assert!(report.is_closed() && report.degenerate_faces.count == 0);
            assert!(base.report.reached && base.report.components_dropped == 0);
            assert!(base.report.smallest_angle.to_degrees() > 10.0, "{:?}", base.report);
            let [before, after] = base.report.distance.unwrap();
            assert!(after <= before && after < 0.01, "{:?}", base.report);
            assert!(base.mesh.signed_volume() > 0.0);
        }
    }

    #[test]
    fn fewer_faces_than_asked_for_are_kept() {
        let base = base_mesh(&Sphere::UNIT, &options(100_000, 12), &NoProgress).unwrap();
        assert!(base.report.reached);
        assert_eq!(base.report.faces, base.report.faces_before);
    }

    /// A sphere and a smaller one beside it.
    struct Two;

    impl Surface for Two {
        fn bounds(&self) -> BoundingBox {
            BoundingBox { min: DVec3::splat(-1.0), max: DVec3::new(2.5, 1.0, 1.0) }
        }
        fn project(&self, queries: &[Query], feet: &mut [Answer]) {
            Sphere::UNIT.project(queries, feet);
        }
        fn as_field(&self) -> Option<&dyn ImplicitField> {
            Some(self)
        }
    }

    impl ImplicitField for Two {
        fn values(&self, points: &[DVec3], values: &mut [f64]) {
            for (p, v) in points.iter().zip(values) {
                *v = (p.length() - 1.0).min(p.distance(DVec3::X * 2.0) - 0.5);
            }
        }
        fn bounds(&self) -> BoundingBox {
            Surface::bounds(self)
        }
        fn level(&self) -> f64 {
            0.0
        }
        fn inside(&self) -> Inside {
            Inside::Below
        }
    }

    #[test]
    fn smaller_components_are_dropped_and_reported() {
        let base = base_mesh(&Two, &options(400, 50), &NoProgress).unwrap();
        assert_eq!(base.report.components_dropped, 1);
        assert!((base.report.area_dropped - 0.2).abs() < 0.01, "{}", base.report.area_dropped);
        assert_eq!(base.report.euler_characteristic, 2);
    }

    #[test]
    fn a_manifold_is_fitted_to_itself() {
        let knot = ManifoldMesh::try_from(shapes::trefoil_knot(400, 40, 0.18)).unwrap();
        let base = base_mesh_of_manifold(&knot, None, &options(1000, 1), &NoProgress).unwrap();
        assert_eq!((base.report.faces, base.report.euler_characteristic), (1000, 0));
        let [before, after] = base.report.distance.unwrap();
        assert!(after <= before);
        let plate = ManifoldMesh::try_from(shapes::grid(20, 20)).unwrap();
        let base = base_mesh_of_manifold(&plate, None, &options(50, 1), &NoProgress).unwrap();
        assert!(base.report.reached && (base.mesh.area() - 1.0).abs() < 1e-9);
    }

    #[test]
    fn errors_are_one_sentence() {
        struct Fieldless;
        impl Surface for Fieldless {
            fn bounds(&self) -> BoundingBox {
                Surface::bounds(&Sphere::UNIT)
            }
            fn project(&self, queries: &[Query], feet: &mut [Answer]) {
                Sphere::UNIT.project(queries, feet);
            }
        }
        let error = base_mesh(&Fieldless, &options(10, 10), &NoProgress).unwrap_err();
        assert_eq!(error, BaseMeshError::NoField);
        assert!(error.to_string().contains("no implicit field"));
        struct Stop;
        impl Progress for Stop {
            fn report(&self, _: &str, _: f64) {}
            fn cancelled(&self) -> bool {
                true
            }
        }
        let cancelled = base_mesh(&Sphere::UNIT, &options(10, 10), &Stop).unwrap_err();
        assert_eq!(cancelled, BaseMeshError::Cancelled);
    }
}
