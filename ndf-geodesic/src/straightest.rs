//! Geodesics from a point in a direction: straight through faces and over edges, with equal angles on both sides at vertices
//! (Polthier and Schmies 1998, "Straightest geodesics on polyhedral surfaces").

use ndf_intrinsic::{IntrinsicMesh, triangle};
use ndf_mesh::{FacePoint, Halfedge, SurfacePoint, Vertex};

use crate::error::GeodesicError;
use crate::sources::{Place, to_surface_point};

/// A line that passes a vertex within this part of a side's length goes through it.
const THROUGH: f64 = 1e-13;

/// Faces that a geodesic may cross before it is given up.
const MOST_FACES: usize = 10_000_000;

/// A geodesic from a point in a direction.
#[derive(Clone, Debug, PartialEq)]
pub struct StraightestGeodesic {
    /// The corners of the polyline from the start to the end: straight in a face between each two.
    pub points: Vec<SurfacePoint>,
    /// The end, as a point of the face through which it was reached.
    pub end: FacePoint,
    /// The unit direction of arrival in the plane of that face.
    pub direction: [f64; 2],
    /// The length: what was asked for, or less where the boundary ends it.
    pub length: f64,
}

/// The geodesic that leaves a point in a direction and is as long as the direction: the exponential map.
///
/// Directions are vectors of a face's plane: x along its first half-edge, and y to the left of that, into the face. At the boundary a
/// geodesic ends. O(faces crossed).
///
/// # Errors
/// If the point is not on the mesh, the direction is not finite, or the geodesic crosses ten million faces.
pub fn straightest_geodesic(
    mesh: &IntrinsicMesh,
    start: FacePoint,
    direction: [f64; 2],
) -> Result<StraightestGeodesic, GeodesicError> {
    let point = SurfacePoint::Face(start);
    Place::of(mesh, point)?;
    let length = direction[0].hypot(direction[1]);
    if !length.is_finite() {
        return Err(GeodesicError::Direction(direction));
    }
    let towards = if length > 0.0 { direction.map(|x| x / length) } else { [1.0, 0.0] };
    let halfedge = start.face.halfedge(0);
    let [_, b, c] = corners(mesh, halfedge);
    let [_, v, w] = start.barycentric;
    let at = [v * b[0] + w * c[0], w * c[1]];
    let mut ray = Ray { halfedge, at, towards, has_entered: false };
    let mut points = vec![to_surface_point(mesh, start)];
    let mut rest = length;
    for _ in 0..MOST_FACES {
        let exit = ray.exit(mesh).filter(|exit| exit.distance < rest);
        let ended = match exit {
            None => Some(rest),
            Some(exit) => {
                rest -= exit.distance;
                points.push(exit.point(mesh));
                match ray.onwards(mesh, &exit) {
                    Some(next) => {
                        ray = next;
                        None
                    }
                    None => Some(exit.distance),
                }
            }
        };
        if let Some(distance) = ended {
            let end = ray.point(mesh, distance);
            if exit.is_none() {
                points.push(to_surface_point(mesh, end));
                rest = 0.0;
            }
            let direction = ray.in_face(mesh);
            return Ok(StraightestGeodesic { points, end, direction, length: length - rest });
        }
    }
    Err(GeodesicError::PathLost { point })
}

/// The corners of a face in the frame of one of its half-edges.
fn corners(mesh: &IntrinsicMesh, halfedge: Halfedge) -> [[f64; 2]; 3] {
    let sides = mesh.sides_from(halfedge);
    [[0.0, 0.0], [sides[0], 0.0], triangle::apex(sides)]
}

/// A line in the frame of a half-edge of its face.
#[derive(Clone, Copy, Debug)]
struct Ray {
    halfedge: Halfedge,
    at: [f64; 2],
    /// Of length 1.
    towards: [f64; 2],
    /// Whether it came over the half-edge, by which it cannot leave then.
    has_entered: bool,
}

/// Where a line leaves a face.
#[derive(Clone, Copy, Debug)]
struct Exit {
    /// The side, by its half-edge.
    side: Halfedge,
    /// The side as a vector in the frame of the ray.
    along: [f64; 2],
    /// The parameter on the side, in [0, 1].
    t: f64,
    distance: f64,
}

impl Exit {
    /// The vertex that is left through, by the half-edge of the face that begins at it.
    fn vertex(&self) -> Option<Halfedge> {
        if self.t <= THROUGH {
            Some(self.side)
        } else if 1.0 - self.t <= THROUGH {
            Some(self.side.next())
        } else {
            None
        }
    }

    fn point(&self, mesh: &IntrinsicMesh) -> SurfacePoint {
        match self.vertex() {
            Some(out) => SurfacePoint::Vertex(mesh.tail(out)),
            None => {
                let edge = mesh.halfedge_edge(self.side);
                let is_canonical = mesh.edge_halfedge(edge) == self.side;
                SurfacePoint::Edge { edge, t: if is_canonical { self.t } else { 1.0 - self.t } }
            }
        }
    }
}

impl Ray {
    /// The side that the line meets first; `None` in a face without area.
    fn exit(&self, mesh: &IntrinsicMesh) -> Option<Exit> {
        let corners = corners(mesh, self.halfedge);
        let sides = [self.halfedge, self.halfedge.next(), self.halfedge.previous()];
        let mut first: Option<Exit> = None;
        for (k, side) in sides.into_iter().enumerate().skip(usize::from(self.has_entered)) {
            let (from, to) = (corners[k], corners[(k + 1) % 3]);
            let along = [to[0] - from[0], to[1] - from[1]];
            // The outer normal, as long as the side.
            let normal = [along[1], -along[0]];
            let speed = self.towards[0] * normal[0] + self.towards[1] * normal[1];
            if speed <= 0.0 {
                continue;
            }
            let gap = (from[0] - self.at[0]) * normal[0] + (from[1] - self.at[1]) * normal[1];
            let distance = (gap / speed).max(0.0);
            if first.is_none_or(|first| distance < first.distance) {
                let there = [0, 1].map(|i| self.at[i] + distance * self.towards[i] - from[i]);
                let squared = along[0] * along[0] + along[1] * along[1];
                let t = ((there[0] * along[0] + there[1] * along[1]) / squared).clamp(0.0, 1.0);
                first = Some(Exit { side, along, t, distance });
            }
        }
        first
    }

    /// The line beyond an exit; `None` at the boundary.
    fn onwards(&self, mesh: &IntrinsicMesh, exit: &Exit) -> Option<Self> {
        if let Some(out) = exit.vertex() {
            return self.through(mesh, exit, out);
        }
        let entered = mesh.twin(exit.side)?;
        let length = mesh.halfedge_length(entered);
        let [x, y] = exit.along.map(|x| x / exit.along[0].hypot(exit.along[1]));
        let along = self.towards[0] * x + self.towards[1] * y;
        let outwards = self.towards[0] * y - self.towards[1] * x;
        let towards = [-along, outwards];
        Some(Self { halfedge: entered, at: [(1.0 - exit.t) * length, 0.0], towards, has_entered: true })
    }

    /// The line beyond a vertex: half of the angle around it to either side.
    fn through(&self, mesh: &IntrinsicMesh, exit: &Exit, out: Halfedge) -> Option<Self> {
        let vertex: Vertex = mesh.tail(out);
        if mesh.is_boundary_vertex(vertex) {
            return None;
        }
        // The angle from the outgoing half-edge to the left, back to where the line comes from.
        let corner = mesh.corner_angle(out);
        let back = [-self.towards[0], -self.towards[1]];
        let [x, y] = exit.along;
        let from_side = (x * back[1] - y * back[0]).atan2(x * back[0] + y * back[1]);
        let angle = if out == exit.side {
            from_side
        } else {
            // At the tip of the side: from the side reversed, which is at the end of the corner.
            let from_reversed = (y * back[0] - x * back[1]).atan2(-x * back[0] - y * back[1]);
            corner + from_reversed
        };
        let mut angle = angle.clamp(0.0, corner) + 0.5 * mesh.angle_sum(vertex);
        let mut halfedge = out;
        for _ in 0..=2 * mesh.outgoing(vertex).count() {
            let corner = mesh.corner_angle(halfedge);
            if angle <= corner {
                break;
            }
            angle -= corner;
            halfedge = mesh.twin(halfedge.previous())?;
        }
        let towards = [angle.cos(), angle.sin()];
        Some(Self { halfedge, at: [0.0, 0.0], towards, has_entered: true })
    }

    /// The point of the face at a distance.
    fn point(&self, mesh: &IntrinsicMesh, distance: f64) -> FacePoint {
        let [_, b, c] = corners(mesh, self.halfedge);
        let [x, y] = [0, 1].map(|i| self.at[i] + distance * self.towards[i]);
        let w = if c[1] > 0.0 { (y / c[1]).clamp(0.0, 1.0) } else { 0.0 };
        let v = if b[0] > 0.0 { ((x - w * c[0]) / b[0]).clamp(0.0, 1.0 - w) } else { 0.0 };
        let from_halfedge = [1.0 - v - w, v, w];
        let first = self.halfedge.corner();
        let barycentric = [0, 1, 2].map(|corner| from_halfedge[(corner + 3 - first) % 3]);
        FacePoint { face: self.halfedge.face(), barycentric }
    }

    /// The direction in the frame of the face's first half-edge.
    fn in_face(&self, mesh: &IntrinsicMesh) -> [f64; 2] {
        let corners = corners(mesh, self.halfedge.face().halfedge(0));
        let first = self.halfedge.corner();
        let (from, to) = (corners[first], corners[(first + 1) % 3]);
        let [x, y] = [to[0] - from[0], to[1] - from[1]];
        let length = x.hypot(y);
        let [x, y] = if length > 0.0 { [x / length, y / length] } else { [1.0, 0.0] };
        [self.towards[0] * x - self.towards[1] * y, self.towards[0] * y + self.towards[1] * x]
    }
}

#[cfg(test)]
mod tests {
    use approx::{assert_abs_diff_eq, assert_relative_eq};
    use ndf_core::{DVec3, NoProgress};
    use ndf_mesh::{Face, ManifoldMesh, TriangleMesh, shapes};

    use super::*;
    use crate::{ExactOptions, exact_distances};

    fn meshes(mesh: TriangleMesh) -> (ManifoldMesh, IntrinsicMesh) {
        let mesh = ManifoldMesh::try_from(mesh).unwrap();
        let intrinsic = IntrinsicMesh::from_mesh(&mesh);
        (mesh, intrinsic)
    }

    fn inside(face: u32) -> FacePoint {
        FacePoint { face: Face(face), barycentric: [0.2, 0.3, 0.5] }
    }

    /// The vector of a face's plane in space.
    fn in_space(mesh: &ManifoldMesh, face: Face, vector: [f64; 2]) -> DVec3 {
        let [a, b, _] = mesh.corner_positions(face);
        let x = (b - a).normalize();
        x * vector[0] + mesh.face_normal(face).cross(x) * vector[1]
    }

    #[test]
    fn lines_in_a_plane_are_straight_and_end_at_the_boundary() {
        let (mesh, intrinsic) = meshes(shapes::grid(12, 9));
        let start = inside(109);
        let origin = start.position(&mesh);
        let size = mesh.bounds().extent();
        for k in 0..40 {
            let angle = f64::from(k) * 0.37;
            let direction = [angle.cos(), angle.sin()].map(|x| x * 0.2 * size.x.min(size.y));
            let found = straightest_geodesic(&intrinsic, start, direction).unwrap();
            let expected = origin + in_space(&mesh, start.face, direction);
            let error = (found.end.position(&mesh) - expected).length();
            assert!(error < 1e-12 * size.length(), "{k}: {error}, {found:?}");
            let arrived = in_space(&mesh, found.end.face, found.direction);
            let unit = in_space(&mesh, start.face, [angle.cos(), angle.sin()]);
            assert_abs_diff_eq!((arrived - unit).length(), 0.0, epsilon = 1e-12);
            let far = straightest_geodesic(&intrinsic, start, direction.map(|x| 100.0 * x)).unwrap();
            let reached = far.end.position(&mesh);
            assert_relative_eq!((reached - origin).length(), far.length, max_relative = 1e-12);
            assert!(far.length < 30.0 * size.length());
            let last = far.points.last().unwrap();
            assert_abs_diff_eq!((last.position(&mesh) - reached).length(), 0.0, epsilon = 1e-12);
        }
    }

    #[test]
    fn lines_through_vertices_go_straight_on() {
        // Along the diagonal of a grid, from vertex to vertex.
        let (mesh, intrinsic) = meshes(shapes::grid(8, 8));
        let start = FacePoint::at_corner(intrinsic.vertex_halfedge(Vertex(0)));
        let [a, b] = [Vertex(0), Vertex(10)].map(|v| mesh.positions()[v.index()]);
        let x = in_space(&mesh, start.face, [1.0, 0.0]);
        let y = in_space(&mesh, start.face, [0.0, 1.0]);
        let towards = (b - a) * 5.5;
        let found = straightest_geodesic(&intrinsic, start, [towards.dot(x), towards.dot(y)]).unwrap();
        assert_abs_diff_eq!((found.end.position(&mesh) - (a + towards)).length(), 0.0, epsilon = 1e-12);
        assert_relative_eq!(found.length, towards.length(), max_relative = 1e-12);
    }

    #[test]
    fn geodesics_of_a_cube_close_after_four_faces() {
        // Parallel to an edge around a cube.
        let (mesh, intrinsic) = meshes(shapes::cube(4));
        let side = mesh.bounds().extent().x;
        let start = inside(3);
        let x = in_space(&mesh, start.face, [1.0, 0.0]);
        let y = in_space(&mesh, start.face, [0.0, 1.0]);
        let axis = DVec3::AXES.into_iter().find(|axis| axis.dot(x).abs() + axis.dot(y).abs() > 0.5).unwrap();
        let towards = axis * 4.0 * side;
        let found = straightest_geodesic(&intrinsic, start, [towards.dot(x), towards.dot(y)]).unwrap();
        assert_abs_diff_eq!(
            (found.end.position(&mesh) - start.position(&mesh)).length(),
            0.0,
            epsilon = 1e-12
        );
    }

    #[test]
    fn short_geodesics_are_shortest_and_turn_back_to_where_they_came_from() {
        let stretched = shapes::icosphere(3).map_positions(|p| p * DVec3::new(1.0, 1.4, 0.7));
        let (mesh, intrinsic) = meshes(stretched);
        for k in 0..30 {
            let start = inside(k * 40);
            let angle = f64::from(k) * 0.9;
            let found =
                straightest_geodesic(&intrinsic, start, [0.3 * angle.cos(), 0.3 * angle.sin()]).unwrap();
            let [from, to] = [start, found.end].map(SurfacePoint::Face);
            let exact =
                exact_distances(&intrinsic, &[from], &ExactOptions::with_windows(), &NoProgress).unwrap();
            assert_relative_eq!(exact.distance_at(to).unwrap(), 0.3, max_relative = 1e-9);
            let back = found.direction.map(|x| -0.3 * x);
            let returned = straightest_geodesic(&intrinsic, found.end, back).unwrap();
            let error = (returned.end.position(&mesh) - start.position(&mesh)).length();
            assert_abs_diff_eq!(error, 0.0, epsilon = 1e-9);
        }
    }

    #[test]
    fn bad_starts_and_directions_are_refused() {
        let (_, intrinsic) = meshes(shapes::grid(2, 2));
        let refused = |start, direction| straightest_geodesic(&intrinsic, start, direction).unwrap_err();
        assert!(matches!(refused(inside(99), [1.0, 0.0]), GeodesicError::NotOnMesh { .. }));
        assert!(matches!(refused(inside(0), [f64::NAN, 0.0]), GeodesicError::Direction(_)));
        let still = straightest_geodesic(&intrinsic, inside(0), [0.0, 0.0]).unwrap();
        assert_eq!((still.length, still.end.face), (0.0, Face(0)));
    }
}
