//! Meshes by intrinsic Delaunay refinement.

use ndf_core::{Cancelled, Progress};
use ndf_mesh::ManifoldMesh;

use crate::intrinsic_triangulation::IntrinsicTriangulation;
use crate::refinement::RefinementOptions;

/// Why a mesh was not refined.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RemeshError {
    /// The edge length is not a positive number.
    #[error("the edge length must be a positive number, not {0}")]
    EdgeLength(f64),
    /// More vertices than are made at most.
    #[error(
        "an edge length of {edge_length:?} needs some {vertices:.0e} vertices, and ten million are made at most; choose {shortest:.1e} \
         or more"
    )]
    TooManyVertices {
        /// The edge length.
        edge_length: f64,
        /// About how many vertices it needs.
        vertices: f64,
        /// About the shortest length that can be had.
        shortest: f64,
    },
    /// Some edges of the intrinsic triangulation join the same vertices, and have no straight counterparts.
    #[error("edges of this length join vertices twice; choose a shorter one")]
    NotSimplicial,
    /// The observer asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// The intrinsic Delaunay triangulation of a mesh, refined until no circumcircle is larger than that of an equilateral triangle with this edge
/// length and angles are at least 25° but at needles, in space: its vertices are on the mesh, its edges straight. All vertices of the mesh
/// stay, so that edges are shorter where the mesh is finer. O(n log n) for n vertices of the result.
///
/// # Errors
/// If the length is not positive, needs more than ten million vertices, or is so long that vertices are joined twice, or the observer asks
/// to stop.
pub fn remesh_intrinsically(
    mesh: &ManifoldMesh,
    edge_length: f64,
    progress: &dyn Progress,
) -> Result<ManifoldMesh, RemeshError> {
    if edge_length.is_nan() || edge_length <= 0.0 {
        return Err(RemeshError::EdgeLength(edge_length));
    }
    let max_circumradius = edge_length / 3.0_f64.sqrt();
    let options = RefinementOptions { max_circumradius, ..RefinementOptions::default() };
    // Triangles with circumradii up to that of an equilateral one have on average somewhat more than half of its area, and a vertex has two
    // faces. On tori and spheres this is up to 1.7 times too many.
    let area = mesh.area() / (0.25 * 3.0_f64.sqrt());
    let most = options.max_insertions as f64;
    let too_many = || RemeshError::TooManyVertices {
        edge_length,
        vertices: area / (edge_length * edge_length),
        shortest: (area / most).sqrt(),
    };
    if area / (edge_length * edge_length) > most {
        return Err(too_many());
    }
    let mut triangulation = IntrinsicTriangulation::new(mesh);
    let report = triangulation.refine_delaunay_with(&options, progress)?;
    if report.reached_cap {
        return Err(too_many());
    }
    progress.check()?;
    triangulation.embedded().ok_or(RemeshError::NotSimplicial)
}

#[cfg(test)]
mod tests {
    use ndf_core::NoProgress;
    use ndf_mesh::shapes;

    use super::*;

    #[test]
    fn vertices_lie_on_the_mesh_and_angles_are_large() {
        let cube = ManifoldMesh::try_from(shapes::cube(2)).unwrap();
        let found = remesh_intrinsically(&cube, 0.15, &NoProgress).unwrap();
        assert!(found.vertex_count() > 4 * cube.vertex_count());
        let on_surface = |p: &ndf_core::DVec3| (p.abs().max_element() - 1.0).abs() < 1e-9;
        assert!(found.positions().iter().all(on_surface));
        let finer = remesh_intrinsically(&cube, 0.075, &NoProgress).unwrap();
        let ratio = finer.vertex_count() as f64 / found.vertex_count() as f64;
        assert!((3.0..5.0).contains(&ratio), "{ratio}");
    }

    #[test]
    fn lengths_that_cannot_be_are_refused() {
        let cube = ManifoldMesh::try_from(shapes::cube(2)).unwrap();
        let error = |length| remesh_intrinsically(&cube, length, &NoProgress).unwrap_err();
        assert!(matches!(error(f64::NAN), RemeshError::EdgeLength(_)));
        assert!(matches!(error(-1.0), RemeshError::EdgeLength(_)));
        let RemeshError::TooManyVertices { vertices, shortest, .. } = error(1e-5) else { panic!() };
        assert!(vertices > 1e10 && shortest > 1e-4);
    }
}
