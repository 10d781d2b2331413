//! Straight walks over an intrinsic mesh, and by them the way from the input to the intrinsic triangulation.

use ndf_mesh::SurfacePoint;
use ndf_mesh::{Edge, FacePoint, Halfedge};

use crate::intrinsic_mesh::IntrinsicMesh;
use crate::intrinsic_triangulation::IntrinsicTriangulation;
use crate::locating::place_in_frame;
use crate::normal_coordinates::COINCIDENT;
use crate::planar::{Point, from_barycentric, orientation};
use crate::tracing::Frame;

/// Faces a walk may pass before it is given up; only needles by the thousand make one so long.
const MOST_FACES: usize = 100_000;

/// Where a straight walk ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum WalkEnd {
    /// At its target.
    Inside(FacePoint),
    /// At this boundary edge; the point is the one of its face that is nearest to the target, nearly.
    Boundary(Edge, FacePoint),
    /// Nowhere: the walk is too long.
    Lost,
}

/// Walks straight from a point of a face to a target, both in the plane of the frame, unfolding faces on the way.
pub(crate) fn walk(mesh: &IntrinsicMesh, frame: Frame, start: Point, target: Point) -> WalkEnd {
    let mut frame = frame;
    for _ in 0..MOST_FACES {
        let Some(side) = exit_side(&frame, start, target) else {
            return WalkEnd::Inside(place_in_frame(&frame, target));
        };
        let h = frame.halfedge.face().halfedge((frame.halfedge.corner() + side) % 3);
        if mesh.twin(h).is_none() {
            return WalkEnd::Boundary(mesh.halfedge_edge(h), place_in_frame(&frame, target));
        }
        frame = frame.turned_to(h).across(mesh);
    }
    WalkEnd::Lost
}

/// The side, counted from the frame's half-edge, by which the segment from `start` to `target` leaves a face;
/// `None` if it ends inside.
fn exit_side(frame: &Frame, start: Point, target: Point) -> Option<usize> {
    (0..3).find(|&side| {
        let (a, b) = (frame.corners[side], frame.corners[(side + 1) % 3]);
        let beyond = orientation(a, b, target) < 0.0;
        beyond && orientation(start, target, a) <= 0.0 && orientation(start, target, b) >= 0.0
    })
}

impl IntrinsicTriangulation<'_> {
    /// The point of this triangulation at a point of the input. Found by a straight walk from the nearest corner,
    /// whose direction the integers give; accurate to rounding. O(faces passed + degree).
    ///
    /// # Panics
    /// If the element does not exist in the input.
    pub fn to_intrinsic(&self, point: SurfacePoint) -> SurfacePoint {
        if let SurfacePoint::Vertex(_) = point {
            return point;
        }
        let FacePoint { face, barycentric } = point.in_some_face(self.input());
        let nearest = (0..3).max_by(|&a, &b| barycentric[a].total_cmp(&barycentric[b])).unwrap_or(0);
        let along = face.halfedge(nearest);
        let turned = [0, 1, 2].map(|c| barycentric[(nearest + c) % 3]);
        let local = from_barycentric(Frame::first(&self.base, along).corners, turned);
        let distance = local[0].hypot(local[1]);

        let (mut h, offset) = self.direction_of(along);
        let mut angle = offset + local[1].atan2(local[0]);
        let mesh = self.mesh();
        // Counter-clockwise to the corner the direction lies in. Once around is more than enough.
        for _ in 0..=mesh.outgoing(self.input().topology().tail(along)).count() {
            let corner = mesh.corner_angle(h);
            if angle <= corner {
                break;
            }
            let Some(next) = mesh.twin(h.previous()) else {
                // Beyond the boundary by rounding.
                angle = corner;
                break;
            };
            angle -= corner;
            h = next;
        }
        let target = [distance * angle.cos(), distance * angle.sin()];
        match walk(mesh, Frame::first(mesh, h), [0.0; 2], target) {
            // The target lies on the boundary at most: beyond it only by rounding.
            WalkEnd::Inside(place) | WalkEnd::Boundary(_, place) => SurfacePoint::Face(place),
            WalkEnd::Lost => SurfacePoint::Vertex(self.input().topology().tail(along)),
        }
    }

    /// The half-edge at or clockwise before an input half-edge around its tail, and the angle between the two.
    fn direction_of(&self, along: Halfedge) -> (Halfedge, f64) {
        let (mesh, coordinates) = (self.mesh(), &self.coordinates);
        let v = self.input().topology().tail(along);
        if self.input().topology().twin(along).is_none() {
            return (mesh.vertex_halfedge(v), 0.0);
        }
        let path = coordinates.trace_input(along);
        let Some(&(entry, _)) = path.first() else {
            let coincident = mesh.outgoing(v).find(|&h| {
                coordinates.halfedge_normal(h) == COINCIDENT
                    && coordinates.curve(v, coordinates.roundabout(h)) == along
            });
            return (coincident.expect("an edge without crossings is one of the triangulation"), 0.0);
        };
        let door = mesh.twin(entry).expect("curves cross inner edges");
        let h = door.previous();
        let mut frame = Frame::first(mesh, h);
        for (entry, _) in path {
            let door = mesh.twin(entry).expect("curves cross inner edges");
            frame = frame.turned_to(door).across(mesh);
        }
        let tip = frame.corners[2];
        (h, tip[1].atan2(tip[0]))
    }
}
