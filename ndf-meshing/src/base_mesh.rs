//! The base mesh Ω′ of a displacement field: coarse, manifold, and near the surface.

use std::time::Instant;

use ndf_core::{Progress, Surface};
use ndf_mesh::repair::{Components, Parts, without_unreferenced_vertices};
use ndf_mesh::{ManifoldMesh, TriangleMesh};

use crate::decimation::{DecimationOptions, decimate};
use crate::marching_cubes::{IsosurfaceError, MarchingCubesOptions, marching_cubes};
use crate::original::OriginalMesh;
use crate::remeshing::{FinalPassOptions, Target, improve, spread_points};
use crate::triangle_shape::smallest_angles;

/// Points of the fine mesh, for each face of the base mesh, that the final pass keeps it close to.
const POINTS_PER_FACE: usize = 6;

/// The share of the area of an isosurface below which a component of it floats about and is left out.
pub const MIN_PART: f64 = 0.01;

/// What the base mesh should be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BaseMeshOptions {
    /// Number of faces to aim for.
    pub faces: usize,
    /// How to sample the field of the surface, where the base mesh comes from a field.
    pub marching_cubes: MarchingCubesOptions,
    /// Which components of an isosurface are kept.
    pub parts: Parts,
    /// Whether closed components that point inward are kept: walls of cavities. Of a density that is high on a surface only, they
    /// are the inner side of that surface once more.
    pub cavities: bool,
    /// How to improve the decimated mesh.
    pub final_pass: FinalPassOptions,
}

impl Default for BaseMeshOptions {
    fn default() -> Self {
        Self {
            faces: 4000,
            marching_cubes: MarchingCubesOptions::default(),
            parts: Parts::Above(MIN_PART),
            cavities: true,
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
    /// V − E + F: that of the components of the isosurface that are kept, or of the input mesh.
    pub euler_characteristic: i64,
    /// Number of edges with one face.
    pub boundary_edges: usize,
    /// Number of faces of these components, or of the input mesh.
    pub faces_before: usize,
    /// False if decimation had to end above the number of faces asked for. True also if there were fewer from
    /// the start; then all are kept.
    pub reached: bool,
    /// Components of the isosurface that were left out.
    pub components_dropped: usize,
    /// Their share of its area, from 0 to 1, walls of cavities that were left out apart.
    pub area_dropped: f64,
    /// Walls of cavities that were left out.
    pub cavities_dropped: usize,
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
    /// Isosurface and choice of its components.
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

/// The base mesh of a surface with a scalar field: the isosurface by marching cubes, those of its components that are
/// wanted, decimated, and improved against the surface.
///
/// It has the Euler characteristic of these components, the number of faces asked for unless the report says
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
    let (outer, cavities_dropped) = match options.cavities {
        true => (found.mesh, 0),
        false => without_cavities(found.mesh),
    };
    let kept = Components::of(&outer).kept(options.parts);
    let parts = with_faces(&outer, &kept.faces);
    let isosurface = begin.elapsed().as_secs_f64();
    let mut base = coarsen(&parts, Some(surface), options, progress)?;
    let report = &mut base.report;
    report.components_dropped = kept.left_out;
    report.area_dropped = kept.area_left_out;
    report.cavities_dropped = cavities_dropped;
    report.grid = Some(found.cells);
    report.evaluations = found.evaluations;
    report.seconds.isosurface = isosurface;
    Ok(base)
}

/// Some of the components of a manifold.
fn with_faces(mesh: &TriangleMesh, kept: &[bool]) -> ManifoldMesh {
    let faces = mesh.faces().iter().zip(kept).filter_map(|(face, kept)| kept.then_some(*face)).collect();
    let parts =
        TriangleMesh::new(mesh.positions().to_vec(), faces).expect("faces of a mesh have their vertices");
    ManifoldMesh::try_from(without_unreferenced_vertices(&parts).0)
        .expect("components of a manifold are a manifold")
}

/// A manifold without its closed components of negative volume, and how many these were.
fn without_cavities(mesh: ManifoldMesh) -> (ManifoldMesh, usize) {
    let components = Components::of(&mesh);
    let (mut volumes, center) = (vec![0.0; components.len()], mesh.bounds().center());
    for (face, &component) in mesh.face_indices().zip(&components.of_face) {
        let [a, b, c] = mesh.corner_positions(face).map(|p| p - center);
        volumes[component as usize] += a.dot(b.cross(c));
    }
    let topology = mesh.topology();
    for h in topology.halfedges().filter(|&h| topology.twin(h).is_none()) {
        volumes[components.of_face[h.face().index()] as usize] = f64::INFINITY;
    }
    let kept: Vec<bool> = components.of_face.iter().map(|&c| volumes[c as usize] >= 0.0).collect();
    let dropped = volumes.iter().filter(|volume| **volume < 0.0).count();
    // Where the inside is without bounds, all point inward.
    if dropped == 0 || dropped == volumes.len() { (mesh, 0) } else { (with_faces(&mesh, &kept), dropped) }
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
        cavities_dropped: 0,
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
    fn components_are_kept_or_dropped_and_reported() {
        let base = base_mesh(&Two, &options(400, 50), &NoProgress).unwrap();
        assert_eq!((base.report.components_dropped, base.report.area_dropped), (0, 0.0));
        assert_eq!((base.report.euler_characteristic, base.report.faces), (4, 400));
        let largest = BaseMeshOptions { parts: Parts::Largest, ..options(400, 50) };
        let base = base_mesh(&Two, &largest, &NoProgress).unwrap();
        assert_eq!(base.report.components_dropped, 1);
        assert!((base.report.area_dropped - 0.2).abs() < 0.01, "{}", base.report.area_dropped);
        assert_eq!(base.report.euler_characteristic, 2);
    }

    /// A density of 1 at the unit sphere, which is less away from it.
    struct Shell;

    impl Surface for Shell {
        fn bounds(&self) -> BoundingBox {
            BoundingBox { min: DVec3::splat(-1.3), max: DVec3::splat(1.3) }
        }
        fn project(&self, queries: &[Query], feet: &mut [Answer]) {
            Sphere { radius: 1.2, ..Sphere::UNIT }.project(queries, feet);
        }
        fn as_field(&self) -> Option<&dyn ImplicitField> {
            Some(self)
        }
    }

    impl ImplicitField for Shell {
        fn values(&self, points: &[DVec3], values: &mut [f64]) {
            for (p, v) in points.iter().zip(values) {
                *v = 1.0 - (p.length() - 1.0).abs();
            }
        }
        fn bounds(&self) -> BoundingBox {
            Surface::bounds(self)
        }
        fn level(&self) -> f64 {
            0.8
        }
        fn inside(&self) -> Inside {
            Inside::Above
        }
    }

    #[test]
    fn walls_of_cavities_stay_unless_a_density_has_them() {
        let both = base_mesh(&Shell, &options(600, 40), &NoProgress).unwrap();
        assert_eq!((both.report.euler_characteristic, both.report.cavities_dropped), (4, 0));
        let outer = BaseMeshOptions { cavities: false, ..options(600, 40) };
        let outer = base_mesh(&Shell, &outer, &NoProgress).unwrap();
        assert_eq!((outer.report.euler_characteristic, outer.report.cavities_dropped), (2, 1));
        assert_eq!((outer.report.components_dropped, outer.report.area_dropped), (0, 0.0));
        assert!(outer.mesh.positions().iter().all(|p| p.length() > 1.1));
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
