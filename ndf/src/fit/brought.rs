//! Base meshes that are brought.

use ndf_core::{Query, Surface, projected};
use ndf_mesh::ManifoldMesh;

use super::FitError;

/// Vertices whose distances are looked at.
const VERTICES: usize = 1000;

/// Refuses a base mesh that is farther from the surface than it or the surface is wide: one in other units or in another
/// place. What finds no foot is not counted; training says if that is too much. Costs a thousand projections.
///
/// # Errors
/// [`FitError::BaseFar`].
pub(super) fn check(mesh: &ManifoldMesh, surface: &dyn Surface) -> Result<(), FitError> {
    let every = mesh.vertex_count().div_ceil(VERTICES).max(1);
    let queries: Vec<Query> = mesh.positions().iter().step_by(every).map(|&p| Query::at(p)).collect();
    let feet = projected(surface, &queries);
    let distances: Vec<f64> =
        queries.iter().zip(feet).filter_map(|(q, foot)| Some(q.point.distance(foot.ok()?.point))).collect();
    let distance = distances.iter().sum::<f64>() / distances.len().max(1) as f64;
    let width = mesh.bounds().diagonal().min(surface.bounds().diagonal());
    if distance > width { Err(FitError::BaseFar { distance }) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use ndf_core::DVec3;
    use ndf_core::analytic::Sphere;
    use ndf_mesh::shapes;

    use super::*;

    fn is_far(change: impl Fn(DVec3) -> DVec3) -> bool {
        let mesh = ManifoldMesh::try_from(shapes::icosphere(2).map_positions(change)).unwrap();
        matches!(check(&mesh, &Sphere::UNIT), Err(FitError::BaseFar { .. }))
    }

    #[test]
    fn other_places_and_units_are_far_and_coarse_hulls_are_not() {
        assert!(is_far(|p| p + 10.0 * DVec3::X) && is_far(|p| 1000.0 * p) && is_far(|p| 0.001 * p));
        assert!(!is_far(|p| p) && !is_far(|p| 1.5 * p) && !is_far(|p| p + 0.5 * DVec3::X));
    }
}
