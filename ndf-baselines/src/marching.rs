//! Marching cubes with what the supplement puts after it: intrinsic Delaunay refinement (Sharp, Soliman and Crane 2019) or
//! isotropic remeshing (Botsch and Kobbelt 2004). Composed of the workspace's own.

use ndf_core::{Cancelled, ImplicitField, Progress};
use ndf_intrinsic::{IntrinsicMesh, IntrinsicTriangulation, RefinementOptions, RefinementReport};
use ndf_meshing::{
    Isosurface, IsosurfaceError, IsotropicError, IsotropicOptions, MarchingCubesOptions, marching_cubes,
    remesh_isotropically,
};

/// Rounds of isotropic remeshing, as many as the supplement's program has.
const ROUNDS: u32 = 10;

/// Why there is no mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MarchingError {
    /// Marching cubes failed.
    #[error(transparent)]
    Isosurface(#[from] IsosurfaceError),
    /// Remeshing failed.
    #[error(transparent)]
    Remeshing(#[from] IsotropicError),
    /// The observer asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// An isosurface with a triangulation of it for computations.
#[derive(Clone, Debug)]
pub struct RefinedIsosurface {
    /// The isosurface.
    pub surface: Isosurface,
    /// The refined triangulation of the same surface. Its first vertices are those of the isosurface, so that values on it
    /// are read there; sources at vertices keep their numbers.
    pub intrinsic: IntrinsicMesh,
    /// What refinement did.
    pub report: RefinementReport,
}

/// Marching cubes and intrinsic Delaunay refinement.
///
/// # Errors
/// If marching cubes fail, or the observer asks to stop.
pub fn refined_marching_cubes(
    field: &dyn ImplicitField,
    options: &MarchingCubesOptions,
    refinement: &RefinementOptions,
    progress: &dyn Progress,
) -> Result<RefinedIsosurface, MarchingError> {
    let surface = marching_cubes(field, options, progress)?;
    progress.check()?;
    progress.report("refinement", 0.0);
    let mut triangulation = IntrinsicTriangulation::new(&surface.mesh);
    let report = triangulation.refine_delaunay(refinement);
    let intrinsic = triangulation.mesh().clone();
    progress.report("refinement", 1.0);
    Ok(RefinedIsosurface { surface, intrinsic, report })
}

/// Marching cubes and isotropic remeshing to edges as long as a side of a cell, on the surface of the isosurface.
///
/// # Errors
/// If either fails, or the observer asks to stop.
pub fn remeshed_marching_cubes(
    field: &dyn ImplicitField,
    options: &MarchingCubesOptions,
    progress: &dyn Progress,
) -> Result<Isosurface, MarchingError> {
    let surface = marching_cubes(field, options, progress)?;
    let isotropic = IsotropicOptions { rounds: ROUNDS, ..IsotropicOptions::with_edges_of(surface.cell) };
    let mesh = remesh_isotropically(&surface.mesh, None, &isotropic, progress)?;
    Ok(Isosurface { mesh, ..surface })
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndf_core::analytic::Torus;
    use ndf_core::{DVec3, NoProgress};
    use ndf_meshing::triangle_shape::smallest_angles;

    const TORUS: Torus = Torus { center: DVec3::ZERO, ring: 1.0, tube: 0.4 };
    const OPTIONS: MarchingCubesOptions = MarchingCubesOptions { grid: 30, bounds: None, refinement: 8 };

    #[test]
    fn refinement_keeps_the_surface_and_bounds_its_angles() {
        let found =
            refined_marching_cubes(&TORUS, &OPTIONS, &RefinementOptions::default(), &NoProgress).unwrap();
        let plain = smallest_angles(&found.surface.mesh)[0];
        assert!(plain.to_degrees() < 10.0 && found.report.min_angle.to_degrees() > 24.9);
        assert!(found.intrinsic.is_delaunay());
        assert!((found.intrinsic.total_area() / found.surface.mesh.area() - 1.0).abs() < 1e-9);
        assert_eq!(
            found.intrinsic.vertex_count(),
            found.surface.mesh.vertex_count() + found.report.insertions - found.report.removals
        );
    }

    #[test]
    fn remeshing_makes_edges_as_long_as_a_cell() {
        let found = remeshed_marching_cubes(&TORUS, &OPTIONS, &NoProgress).unwrap();
        let topology = found.mesh.topology();
        assert_eq!(topology.euler_characteristic(), 0);
        let length = |e| {
            let [a, b] = topology.edge_vertices(e).map(|v| found.mesh.positions()[v.index()]);
            a.distance(b)
        };
        let mean = topology.edges().map(length).sum::<f64>() / topology.edge_count() as f64;
        assert!((mean / found.cell - 1.0).abs() < 0.1, "{}", mean / found.cell);
        let angles = smallest_angles(&found.mesh);
        assert!(angles[angles.len() / 100].to_degrees() > 30.0);
        let mut distances = vec![0.0; found.mesh.vertex_count()];
        TORUS.values(found.mesh.positions(), &mut distances);
        assert!(distances.iter().all(|d| d.abs() < 0.1 * found.cell));
    }
}
