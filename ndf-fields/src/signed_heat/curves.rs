//! Curves on an intrinsic mesh, in pieces that are straight in a face or run along an edge.

use ndf_core::Progress;
use ndf_geodesic::{ExactOptions, exact_distances};
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::{Edge, FacePoint, SurfacePoint, Vertex};
use num_complex::Complex64;

use crate::error::FieldError;
use crate::faces::Layout;
use crate::points::in_faces;

/// A piece of a curve.
#[derive(Clone, Copy, Debug)]
pub(super) enum Piece {
    /// Along an edge, from one parameter on it to another.
    Edge { edge: Edge, from: f64, to: f64 },
    /// Through the inside of a face, between two points of it.
    Face([FacePoint; 2]),
}

impl Piece {
    /// Its length.
    pub(super) fn length(&self, mesh: &IntrinsicMesh) -> f64 {
        match *self {
            Self::Edge { edge, from, to } => (to - from).abs() * mesh.length(edge),
            Self::Face([a, b]) => along(&Layout::of(mesh, a.face), [a, b]).norm(),
        }
    }

    /// The mean of a function that is linear in faces.
    pub(super) fn mean(&self, mesh: &IntrinsicMesh, values: &[f64]) -> f64 {
        match *self {
            Self::Edge { edge, from, to } => {
                let [a, b] = mesh.edge_vertices(edge).map(|v| values[v.index()]);
                a + (b - a) * 0.5 * (from + to)
            }
            Self::Face(ends) => {
                let corners = mesh.face_vertices(ends[0].face).map(|v| values[v.index()]);
                0.5 * ends.iter().map(|end| end.interpolate(corners)).sum::<f64>()
            }
        }
    }

    /// A vertex close to it.
    pub(super) fn vertex(&self, mesh: &IntrinsicMesh) -> Vertex {
        match *self {
            Self::Edge { edge, .. } => mesh.edge_vertices(edge)[0],
            Self::Face([point, _]) => mesh.face_vertices(point.face)[0],
        }
    }
}

/// The way from one point of a face to another in the layout of the face.
pub(super) fn along(layout: &Layout, ends: [FacePoint; 2]) -> Complex64 {
    let [from, to] = ends.map(|end| end.interpolate(layout.corners()));
    to - from
}

/// A curve through points, completed by shortest paths where two that follow each other are in no common face: what
/// [`signed_distances`](super::signed_distances) takes. The paths are exact, and looked for no farther than they lead.
///
/// # Errors
/// If a point is not on the mesh, no path joins two of them, or the observer asks to stop.
pub fn joined_curve(
    mesh: &IntrinsicMesh,
    points: &[SurfacePoint],
    progress: &dyn Progress,
) -> Result<Vec<SurfacePoint>, FieldError> {
    let mut curve: Vec<SurfacePoint> = points.first().copied().into_iter().collect();
    for pair in points.windows(2) {
        let (from, to) = (in_faces(mesh, pair[0])?, in_faces(mesh, pair[1])?);
        if piece(mesh, &from, &to).is_none() {
            let options = ExactOptions { targets: vec![pair[1]], ..ExactOptions::with_windows() };
            let path = exact_distances(mesh, &[pair[0]], &options, progress)?.path_to(pair[1])?;
            let between = path.points.iter().rev().skip(1);
            curve.extend(between.take(path.points.len().saturating_sub(2)));
        }
        curve.push(pair[1]);
    }
    Ok(curve)
}

/// The pieces of a curve through points of which each two that follow each other are in one face. Pieces without length are left out.
///
/// # Errors
/// If a point is not on the mesh, or two are in no common face.
pub(super) fn pieces(
    mesh: &IntrinsicMesh,
    curve: usize,
    points: &[SurfacePoint],
) -> Result<Vec<Piece>, FieldError> {
    let places = points.iter().map(|&point| in_faces(mesh, point)).collect::<Result<Vec<_>, _>>()?;
    let mut pieces = Vec::new();
    for (point, pair) in places.windows(2).enumerate() {
        let piece = piece(mesh, &pair[0], &pair[1]).ok_or(FieldError::CurveLeavesFaces { curve, point })?;
        pieces.extend((piece.length(mesh) > 0.0).then_some(piece));
    }
    Ok(pieces)
}

fn piece(mesh: &IntrinsicMesh, from: &[FacePoint], to: &[FacePoint]) -> Option<Piece> {
    let (a, b) = from.iter().find_map(|a| to.iter().find(|b| b.face == a.face).map(|b| (*a, *b)))?;
    let off = (0..3).find(|&c| a.barycentric[c] == 0.0 && b.barycentric[c] == 0.0);
    let Some(off) = off else { return Some(Piece::Face([a, b])) };
    // Both ends are on the side opposite to that corner.
    let side = a.face.halfedge((off + 1) % 3);
    let edge = mesh.halfedge_edge(side);
    let parameter = |point: FacePoint| {
        let t = point.barycentric[(off + 2) % 3];
        if mesh.edge_halfedge(edge) == side { t } else { 1.0 - t }
    };
    Some(Piece::Edge { edge, from: parameter(a), to: parameter(b) })
}
