//! From points of the intrinsic triangulation to points of the input.

use ndf_core::SurfacePoint;
use ndf_core::sampling::FaceSample;

use crate::intrinsic_triangulation::IntrinsicTriangulation;
use crate::normal_coordinates::Region;
use crate::planar::{
    Point, barycentric_clamped, distance, dot, from_barycentric, in_frame, minus, orientation, third_corner,
};
use crate::tracing::{Frame, Strip};

/// A point of an intrinsic face, as seen from the input.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Located {
    /// Where it lies among the curves.
    pub(crate) region: Region,
    /// Where it lies on the input.
    pub(crate) place: FaceSample,
}

impl IntrinsicTriangulation<'_> {
    /// The point of the input at a point of this triangulation. O(1) apart from tracing.
    ///
    /// # Panics
    /// If the element does not exist.
    pub fn to_input(&self, point: SurfacePoint) -> SurfacePoint {
        match point {
            SurfacePoint::Vertex(v) => self.location(v),
            SurfacePoint::Edge { edge, t } => {
                let (_, place) = self.locate_on_halfedge(self.mesh().edge_halfedge(edge), t.clamp(0.0, 1.0));
                self.surface_point(place)
            }
            SurfacePoint::Face { face, barycentric } => {
                self.surface_point(self.locate(face, barycentric).place)
            }
        }
    }

    /// Where the point at parameter `t` of a half-edge lies: after how many crossings, and in which input face.
    pub(crate) fn locate_on_halfedge(&self, halfedge: u32, t: f64) -> (i32, FaceSample) {
        let mut strip = Strip::default();
        self.coordinates.strip(&self.base, halfedge, &mut strip);
        let segment = (0..strip.crossings()).take_while(|&q| strip.crossing(q).along < t).count();
        (segment as i32, place_in_frame(&strip.frames[segment], strip.point(t)))
    }

    /// Where a point of a face lies among the curves and on the input.
    pub(crate) fn locate(&self, face: u32, barycentric: [f64; 3]) -> Located {
        let sides = self.mesh().sides(face);
        let (a, b) = ([0.0, 0.0], [sides[0], 0.0]);
        let corners = [a, b, third_corner(a, b, sides)];
        let point = from_barycentric(corners, barycentric);
        let arcs = self.coordinates.arcs_from(3 * face);
        // Each side's strip of input faces, and the point where the strip continues into this face.
        let unfold = |side: usize| {
            let strip = self.strip_of(3 * face + side as u32);
            let local = coordinates_along(corners[side], corners[(side + 1) % 3], point);
            let unfolded = in_frame(strip.tail, strip.tip, local);
            (strip, unfolded)
        };
        let needed = |side: usize| arcs.cutting[side] > 0 || arcs.emanating[(side + 2) % 3] > 0;
        let strips = [0, 1, 2].map(|side| needed(side).then(|| unfold(side)));
        // Whether the point is on the side of the start of `side`, seen from the curve that is its crossing `q`.
        // Asked of the curve's line, not of its hits on two sides, which may be one point.
        let before = |side: usize, q: i32| {
            let (strip, unfolded) = strips[side].as_ref().expect("laid out where needed");
            let [a, b, _] = strip.frames[q as usize].corners;
            orientation(a, b, *unfolded) > 0.0
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
        let laid_out = strips.into_iter().nth(region.side).flatten();
        let (strip, unfolded) = laid_out.unwrap_or_else(|| unfold(region.side));
        Located { region, place: place_in_frame(&strip.frames[region.segment as usize], unfolded) }
    }

    fn strip_of(&self, halfedge: u32) -> Strip {
        let mut strip = Strip::default();
        self.coordinates.strip(&self.base, halfedge, &mut strip);
        strip
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

/// Coordinates of `p` in the frame with its origin at `a` and its x axis towards `b`.
fn coordinates_along(a: Point, b: Point, p: Point) -> Point {
    let length = distance(a, b);
    let u = if length > 0.0 { minus(b, a).map(|x| x / length) } else { [1.0, 0.0] };
    let d = minus(p, a);
    [dot(d, u), u[0] * d[1] - u[1] * d[0]]
}

/// A point of the plane as one of a face laid out there.
pub(crate) fn place_in_frame(frame: &Frame, point: Point) -> FaceSample {
    let weights = barycentric_clamped(frame.corners, point);
    let first = frame.halfedge as usize % 3;
    let mut barycentric = [0.0; 3];
    for (c, w) in weights.into_iter().enumerate() {
        barycentric[(first + c) % 3] = w;
    }
    FaceSample { face: frame.halfedge / 3, barycentric }
}
