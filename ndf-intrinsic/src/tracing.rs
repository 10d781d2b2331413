//! Following curves over triangles by integers alone, and laying out what an edge passes in the plane.

use crate::integer_coordinates::IntegerCoordinates;
use crate::intrinsic_mesh::IntrinsicMesh;
use crate::normal_coordinates::COINCIDENT;
use crate::planar::{Point, cross, from_barycentric, lerp, minus, third_corner};
use ndf_mesh::{Face, Halfedge, Vertex};

/// Where a curve goes from its entry into a face.
enum Step {
    /// Into the face of this half-edge, by its crossing with this index from the tail.
    Enter(Halfedge, i32),
    /// To a vertex, which it leaves, seen from there, by this half-edge of the input.
    End(Halfedge),
}

impl IntegerCoordinates<'_> {
    /// Follows the curve that enters the face of `halfedge` by crossing `index`, counted from the tail.
    #[inline]
    fn step(&self, halfedge: Halfedge, index: i32) -> Step {
        let arcs = self.arcs_from(halfedge);
        let (next, last) = (halfedge.next(), halfedge.previous());
        let twin = |h: Halfedge| self.mesh.raw_twin(h);
        if index < arcs.cutting[0] {
            Step::Enter(twin(last), index)
        } else if index >= arcs.crossings[0] - arcs.cutting[1] {
            Step::Enter(twin(next), arcs.crossings[1] - arcs.crossings[0] + index)
        } else {
            let curve = self.roundabout_within(last, index - arcs.cutting[0]);
            Step::End(self.curve(self.mesh.tail(last), curve))
        }
    }

    /// The input half-edge that crosses `halfedge` from its right to its left at crossing `index`, counted from
    /// the tail. Follows the curve both ways to its nearer end. O(crossings of the curve).
    pub(crate) fn crossing_curve(&self, halfedge: Halfedge, index: i32) -> Halfedge {
        let n = self.halfedge_normal(halfedge);
        let mut forward = (halfedge, index);
        let twin = self.mesh.twin(halfedge).expect("no curve crosses the boundary");
        let mut backward = (twin, n - 1 - index);
        loop {
            match self.step(forward.0, forward.1) {
                Step::Enter(h, q) => forward = (h, q),
                Step::End(out) => return self.input.topology().twin(out).expect("curves are inner edges"),
            }
            match self.step(backward.0, backward.1) {
                Step::Enter(h, q) => backward = (h, q),
                Step::End(out) => return out,
            }
        }
    }

    /// The input half-edges that cross `halfedge` from its right to its left, from its tail to its tip; none
    /// where it runs along an input edge or inside an input face. O(crossings of these curves).
    ///
    /// # Panics
    /// If the half-edge does not exist.
    pub fn trace(&self, halfedge: Halfedge) -> Vec<Halfedge> {
        (0..self.halfedge_normal(halfedge)).map(|q| self.crossing_curve(halfedge, q)).collect()
    }

    /// Follows an inner edge of the input over the triangulation, from the tail of input half-edge `along` to
    /// its tip: pairs of a half-edge, whose face it enters by crossing it, and the index of the crossing, counted
    /// from the half-edge's tail. Empty where an intrinsic edge runs along the input edge. O(crossings + degree).
    ///
    /// # Panics
    /// If `along` is on the boundary of the input.
    pub fn trace_input(&self, along: Halfedge) -> Vec<(Halfedge, i32)> {
        assert!(self.input.topology().twin(along).is_some(), "boundary edges are no curves");
        let v = self.input.topology().tail(along);
        let mut path = Vec::new();
        for h in self.mesh.outgoing(v) {
            if self.halfedge_normal(h) == COINCIDENT && self.curve(v, self.roundabout(h)) == along {
                return path;
            }
            let arcs = self.arcs_from(h);
            for m in 0..arcs.emanating[0] {
                if self.curve(v, self.roundabout_within(h, m)) == along {
                    let across = self.mesh.raw_twin(h.next());
                    // Counted from the other end of the side.
                    let mut at = (across, arcs.crossings[1] - 1 - arcs.cutting[1] - m);
                    loop {
                        path.push(at);
                        match self.step(at.0, at.1) {
                            Step::Enter(h, q) => at = (h, q),
                            Step::End(out) => {
                                debug_assert_eq!(
                                    Some(out),
                                    self.input.topology().twin(along),
                                    "curves keep their ends"
                                );
                                return path;
                            }
                        }
                    }
                }
            }
        }
        // The last edge of a boundary fan is on the boundary, where no curve runs.
        unreachable!("every curve leaves its tail in some corner")
    }

    /// Barycentric coordinates in input face `face` of a vertex that lies in it or at its corner, the first for
    /// the tail of `from`, a half-edge of the face.
    fn barycentric_from(&self, vertex: Vertex, from: Halfedge) -> [f64; 3] {
        let face = from.face();
        let barycentric = match self.inserted_place(vertex) {
            Some(place) => {
                debug_assert_eq!(place.face, face, "an edge begins in the face of its end");
                place.barycentric
            }
            None => self.input.topology().face_vertices(face).map(|v| f64::from(u8::from(v == vertex))),
        };
        [0, 1, 2].map(|c| barycentric[(from.corner() + c) % 3])
    }

    /// The input face that contains `segment` of a half-edge (after so many crossings from its tail), or that is
    /// on its left where it runs along an input edge.
    pub(crate) fn first_face(&self, halfedge: Halfedge) -> Face {
        if self.halfedge_normal(halfedge) == COINCIDENT {
            return self.curve(self.mesh.tail(halfedge), self.roundabout(halfedge)).face();
        }
        let ends = [self.mesh.tail(halfedge), self.mesh.tip(halfedge)];
        match (self.inserted_place(ends[0]), self.inserted_place(ends[1])) {
            (Some(place), _) => place.face,
            (None, Some(place)) if self.halfedge_normal(halfedge) == 0 => place.face,
            _ => self.wedge_face(halfedge),
        }
    }

    /// Lays out the input faces that a half-edge passes.
    pub(crate) fn strip(&self, input: &IntrinsicMesh, halfedge: Halfedge) -> Strip {
        let mut strip = Strip::default();
        self.fill_strip(input, halfedge, &mut strip);
        strip
    }

    /// [`strip`](Self::strip) into memory that is there.
    pub(crate) fn fill_strip(&self, input: &IntrinsicMesh, halfedge: Halfedge, strip: &mut Strip) {
        strip.frames.clear();
        let (tail, tip) = (self.mesh.tail(halfedge), self.mesh.tip(halfedge));
        let n = self.halfedge_normal(halfedge);
        if n <= 0 {
            let from = self.first_face(halfedge).halfedge(0);
            let from = if n == COINCIDENT { self.curve(tail, self.roundabout(halfedge)) } else { from };
            let frame = Frame::first(input, from);
            strip.tail = from_barycentric(frame.corners, self.barycentric_from(tail, from));
            strip.tip = from_barycentric(frame.corners, self.barycentric_from(tip, from));
            strip.frames.push(frame);
            return;
        }
        for q in 0..n {
            let door = self.crossing_curve(halfedge, q);
            let frame = match strip.frames.last() {
                None => Frame::first(input, door),
                Some(last) => last.across(input).turned_to(door),
            };
            strip.frames.push(frame);
        }
        let (first, last) = (strip.frames[0], strip.frames[n as usize - 1].across(input));
        strip.tail = from_barycentric(first.corners, self.barycentric_from(tail, first.halfedge));
        strip.tip = from_barycentric(last.corners, self.barycentric_from(tip, last.halfedge));
        strip.frames.push(last);
    }
}

/// A face in the plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    /// A half-edge of the face; in strips the one by which the edge leaves it.
    pub(crate) halfedge: Halfedge,
    /// The face's corners, from the tail of the half-edge.
    pub(crate) corners: [Point; 3],
}

impl Frame {
    /// The face of `halfedge` with the half-edge on the x axis.
    pub(crate) fn first(mesh: &IntrinsicMesh, halfedge: Halfedge) -> Self {
        let sides = mesh.sides_from(halfedge);
        let (a, b) = ([0.0, 0.0], [sides[0], 0.0]);
        Self { halfedge, corners: [a, b, third_corner(a, b, sides)] }
    }

    /// The face across the half-edge, seen from its twin.
    pub(crate) fn across(&self, mesh: &IntrinsicMesh) -> Self {
        let twin = mesh.twin(self.halfedge).expect("crossed edges have two faces");
        let [b, a, _] = self.corners;
        Self { halfedge: twin, corners: [a, b, third_corner(a, b, mesh.sides_from(twin))] }
    }

    /// The same face seen from another of its half-edges.
    pub(crate) fn turned_to(&self, halfedge: Halfedge) -> Self {
        debug_assert_eq!(self.halfedge.face(), halfedge.face());
        let turn = (3 + halfedge.corner() - self.halfedge.corner()) % 3;
        Self { halfedge, corners: [0, 1, 2].map(|c| self.corners[(c + turn) % 3]) }
    }
}

/// The input faces that an intrinsic edge passes, unfolded into the plane.
#[derive(Clone, Debug, Default)]
pub(crate) struct Strip {
    /// One more face than crossings; each but the last is seen from the half-edge the edge leaves by.
    pub(crate) frames: Vec<Frame>,
    /// Where the edge starts.
    pub(crate) tail: Point,
    /// Where it ends.
    pub(crate) tip: Point,
}

/// A crossing of an intrinsic and an input edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// The input half-edge, which crosses from right to left.
    pub input_halfedge: Halfedge,
    /// Where on the input half-edge, 0 at its tail, 1 at its tip.
    pub along_input: f64,
    /// Where on the intrinsic edge, 0 at its tail, 1 at its tip.
    pub along: f64,
}

impl Strip {
    /// Number of crossings.
    pub(crate) fn crossings(&self) -> usize {
        self.frames.len() - 1
    }

    /// Crossing `q` of the straight line from tail to tip. Both parameters lie in `[0, 1]`; if the strip is that
    /// of a geodesic, only rounding can make them leave it.
    pub(crate) fn crossing(&self, q: usize) -> Crossing {
        let Frame { halfedge, corners: [a, b, _] } = self.frames[q];
        let (d, door) = (minus(self.tip, self.tail), minus(b, a));
        let denominator = cross(d, door);
        let from = minus(a, self.tail);
        // Parallel only if both are tiny or the line runs along the door: any point of it will do.
        let (along, along_input) = if denominator == 0.0 {
            (0.5, 0.5)
        } else {
            (cross(from, door) / denominator, cross(from, d) / denominator)
        };
        let clamped = |t: f64| if t.is_nan() { 0.5 } else { t.clamp(0.0, 1.0) };
        Crossing { input_halfedge: halfedge, along_input: clamped(along_input), along: clamped(along) }
    }

    /// The point at parameter `t` of the straight line.
    pub(crate) fn point(&self, t: f64) -> Point {
        lerp(self.tail, self.tip, t)
    }
}
