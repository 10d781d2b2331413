//! From points of the intrinsic triangulation to points of the input.

use ndf_mesh::{Face, FacePoint, Halfedge};

use crate::integer_coordinates::IntegerCoordinates;
use crate::intrinsic_mesh::IntrinsicMesh;
use crate::normal_coordinates::{Arcs, Region};
use crate::planar::{
    Point, barycentric_clamped, cross, distance, dot, from_barycentric, minus, orientation, third_corner,
};
use crate::tracing::{Frame, Strip};

/// A point of an intrinsic face, as seen from the input.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Located {
    /// Where it lies among the curves.
    pub(crate) region: Region,
    /// Where it lies on the input.
    pub(crate) place: FacePoint,
}

impl IntegerCoordinates<'_> {
    /// Where the point at parameter `t` of a half-edge lies: after how many crossings, and in which input face.
    pub(crate) fn locate_on_halfedge(
        &self,
        input: &IntrinsicMesh,
        halfedge: Halfedge,
        t: f64,
    ) -> (i32, FacePoint) {
        let strip = self.strip(input, halfedge);
        let segment = (0..strip.crossings()).take_while(|&q| strip.crossing(q).along < t).count();
        (segment as i32, place_in_frame(&strip.frames[segment], strip.point(t)))
    }

    /// Where a point of a face lies among the curves and on the input.
    pub(crate) fn locate(&self, input: &IntrinsicMesh, point: FacePoint) -> Located {
        FaceLayout::of(self, input, point.face).locate(point.barycentric)
    }
}

/// A face of the intrinsic triangulation in the plane, beside the input faces that its sides pass.
#[derive(Clone, Debug)]
pub(crate) struct FaceLayout {
    corners: [Point; 3],
    arcs: Arcs,
    /// The strips of the sides whose crossings tell points apart.
    strips: [Option<SideStrip>; 3],
}

/// The input faces along a side, and the motion of the plane that takes the side to where they are laid out.
#[derive(Clone, Debug)]
struct SideStrip {
    strip: Strip,
    from: Point,
    /// Cosine and sine of the motion's turn.
    turn: Point,
}

impl SideStrip {
    fn along(strip: Strip, from: Point, to: Point) -> Self {
        let direction = |a: Point, b: Point| {
            let length = distance(a, b);
            if length > 0.0 { minus(b, a).map(|x| x / length) } else { [1.0, 0.0] }
        };
        let (u, v) = (direction(from, to), direction(strip.tail, strip.tip));
        Self { from, turn: [dot(u, v), cross(u, v)], strip }
    }

    /// The point where the strip continues into the face.
    fn unfold(&self, point: Point) -> Point {
        let (d, [cos, sin], tail) = (minus(point, self.from), self.turn, self.strip.tail);
        [tail[0] + cos * d[0] - sin * d[1], tail[1] + sin * d[0] + cos * d[1]]
    }

    /// Whether an unfolded point is on the side of the start, seen from the curve that is crossing `q`. Asked of
    /// the curve's line, not of its hits on two sides, which may be one point.
    fn is_before(&self, q: i32, unfolded: Point) -> bool {
        let [a, b, _] = self.strip.frames[q as usize].corners;
        orientation(a, b, unfolded) > 0.0
    }
}

impl FaceLayout {
    pub(crate) fn of(coordinates: &IntegerCoordinates<'_>, input: &IntrinsicMesh, face: Face) -> Self {
        let sides = coordinates.mesh.sides(face);
        let (a, b) = ([0.0, 0.0], [sides[0], 0.0]);
        let corners = [a, b, third_corner(a, b, sides)];
        let arcs = coordinates.arcs_from(face.halfedge(0));
        let strips = [0, 1, 2].map(|side| {
            let by_curves = arcs.cutting[side] > 0 || arcs.emanating[(side + 2) % 3] > 0;
            // The central region touches the first side.
            (by_curves || side == 0).then(|| {
                let strip = coordinates.strip(input, face.halfedge(side));
                SideStrip::along(strip, corners[side], corners[(side + 1) % 3])
            })
        });
        Self { corners, arcs, strips }
    }

    /// Where a point of the face lies among the curves and on the input. O(log crossings).
    pub(crate) fn locate(&self, barycentric: [f64; 3]) -> Located {
        let point = from_barycentric(self.corners, barycentric);
        let arcs = &self.arcs;
        let before = |side: usize, q: i32| {
            let strip = self.strip(side);
            strip.is_before(q, strip.unfold(point))
        };
        let corner = (0..3).find(|&c| arcs.cutting[c] > 0 && before(c, arcs.cutting[c] - 1));
        let region = if let Some(c) = corner {
            arcs.corner_region(c, first(arcs.cutting[c] - 1, |level| before(c, level)))
        } else if let Some(c) = (0..3).find(|&c| arcs.emanating[c] > 0) {
            let opposite = (c + 1) % 3;
            let clockwise = |m: i32| before(opposite, arcs.cutting[opposite] + m);
            arcs.fan_region(c, first(arcs.emanating[c], clockwise))
        } else {
            arcs.central_region()
        };
        let strip = self.strip(region.side);
        let frame = &strip.strip.frames[region.segment as usize];
        Located { region, place: place_in_frame(frame, strip.unfold(point)) }
    }

    fn strip(&self, side: usize) -> &SideStrip {
        self.strips[side].as_ref().expect("laid out where needed")
    }
}

/// The smallest number below `end` for which `holds`, or `end`; it holds for all greater ones. O(log end).
fn first(end: i32, holds: impl Fn(i32) -> bool) -> i32 {
    let (mut low, mut high) = (0, end);
    while low < high {
        let middle = low + (high - low) / 2;
        if holds(middle) { high = middle } else { low = middle + 1 }
    }
    low
}

/// A point of the plane as one of a face laid out there.
pub(crate) fn place_in_frame(frame: &Frame, point: Point) -> FacePoint {
    let weights = barycentric_clamped(frame.corners, point);
    let first = frame.halfedge.corner();
    let mut barycentric = [0.0; 3];
    for (c, w) in weights.into_iter().enumerate() {
        barycentric[(first + c) % 3] = w;
    }
    FacePoint { face: frame.halfedge.face(), barycentric }
}
