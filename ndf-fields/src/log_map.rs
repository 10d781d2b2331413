//! The logarithmic map from shortest paths.

use ndf_core::Progress;
use ndf_geodesic::{ExactOptions, GeodesicError, Path, exact_distances};
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::{SurfacePoint, Vertex};
use num_complex::Complex64;
use rayon::prelude::*;

use crate::bundle::TangentBundle;
use crate::error::FieldError;

/// The logarithmic map at a vertex: for every vertex the direction and the distance at which a shortest path leaves the source, as a
/// vector of the source's plane in the [`TangentBundle`] of the mesh. Exact on the triangles, as [`exact_distances`] is; where shortest
/// paths bend around a vertex, the direction of their first piece. Zero at the source and on other components.
///
/// Cost: exact distances with their windows, and a path back from every vertex, O(n^1.5) in all on even meshes; over all threads.
///
/// # Errors
/// If the source is no vertex of the mesh, a path is lost where lengths are not those of a surface, or the observer asks to stop.
pub fn exact_log_map(
    mesh: &IntrinsicMesh,
    source: Vertex,
    progress: &dyn Progress,
) -> Result<Vec<Complex64>, FieldError> {
    let point = SurfacePoint::Vertex(source);
    let geodesics = exact_distances(mesh, &[point], &ExactOptions::with_windows(), progress)?;
    let bundle = TangentBundle::as_given(mesh.clone());
    let log = |v: Vertex| {
        if v == source || geodesics.distances()[v.index()].is_infinite() {
            return Ok(Complex64::default());
        }
        let path = geodesics.path_to(SurfacePoint::Vertex(v))?;
        let direction = departure(&bundle, source, &path).ok_or(GeodesicError::PathLost { point })?;
        Ok(Complex64::from_polar(path.length, direction))
    };
    mesh.par_vertices().map(log).collect()
}

/// The direction in which a path leaves the vertex where it ends, which is its source.
fn departure(bundle: &TangentBundle, source: Vertex, path: &Path) -> Option<f64> {
    let mesh = bundle.mesh();
    match *path.points.iter().rev().nth(1)? {
        SurfacePoint::Vertex(v) => {
            // Of several edges between the two the shortest.
            let edges = mesh.edges_at(source).filter(|&h| (mesh.tail(h) == v) != (mesh.tip(h) == v));
            let h = edges.min_by(|&a, &b| mesh.halfedge_length(a).total_cmp(&mesh.halfedge_length(b)))?;
            let is_outgoing = mesh.tail(h) == source;
            Some(if is_outgoing {
                bundle.direction(h)
            } else {
                bundle.onward_direction(h) + std::f64::consts::PI
            })
        }
        SurfacePoint::Edge { edge, t } => {
            let h = mesh.edge_halfedge(edge);
            let opposite = |h: ndf_mesh::Halfedge| mesh.tail(h.previous()) == source;
            let (h, t) = if opposite(h) { (h, t) } else { (mesh.twin(h).filter(|&h| opposite(h))?, 1.0 - t) };
            let out = h.previous();
            Some(in_corner(bundle, out, t))
        }
        SurfacePoint::Face(point) => {
            let corner = mesh.face_vertices(point.face).iter().position(|&v| v == source)?;
            let out = point.face.halfedge(corner);
            let [_, b, c] = [0, 1, 2].map(|i| point.barycentric[(corner + i) % 3]);
            Some(in_corner(bundle, out, c / (b + c)))
        }
    }
}

/// The direction from the tail of a half-edge to the point of the opposite side at the parameter t from its tip.
fn in_corner(bundle: &TangentBundle, halfedge: ndf_mesh::Halfedge, t: f64) -> f64 {
    let [length, _, last] = bundle.mesh().sides_from(halfedge);
    let corner = bundle.mesh().corner_angle(halfedge);
    let at = Complex64::from(length) * (1.0 - t) + Complex64::from_polar(last, corner) * t;
    bundle.direction_in_corner(halfedge, at.arg())
}
