//! Normal coordinates and roundabouts: the integers that say how curves run through a triangulation.
//!
//! The curves are the inner edges of the input mesh, drawn on the intrinsic triangulation. They end at vertices,
//! do not cross each other, and cross every intrinsic edge as seldom as their homotopy class allows. Then
//!
//! * the **normal coordinate** of an edge counts its crossings with curves, or is [`COINCIDENT`] where the edge
//!   runs along a curve;
//! * the **roundabout** of a half-edge names the first curve at or counter-clockwise after it among those that
//!   end at its tail
//!
//! determine all curves (Gillespie, Sharp and Crane 2021, §3). Curves meet vertices of the input only: a vertex
//! inserted on a curve counts as lying on one side of it, so that every inserted vertex is inside an input face.
//! Boundary edges are no curves: the boundary of the triangulation always is that of the input.

/// Normal coordinate of an edge that runs along a curve.
pub const COINCIDENT: i32 = -1;

/// The arcs into which curves are cut by one triangle, counted by kind. Sides and corners are numbered as in
/// a face: side `c` runs from corner `c` to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Arcs {
    /// Crossings of each side; 0 where the side runs along a curve.
    pub crossings: [i32; 3],
    /// Arcs that cut off each corner.
    pub cutting: [i32; 3],
    /// Arcs that come out of each corner and cross the opposite side. At most one of the three is not 0.
    pub emanating: [i32; 3],
}

impl Arcs {
    /// The arcs in a triangle whose sides have these normal coordinates; `None` if no curves cross the sides
    /// so often (the number of arcs would be no integer).
    pub fn checked(normal: [i32; 3]) -> Option<Self> {
        let arcs = Self::new(normal);
        let [n0, n1, n2] = arcs.crossings;
        let sum = n0 + n1 + n2 - arcs.emanating.iter().sum::<i32>();
        (normal.iter().all(|&n| n >= COINCIDENT) && sum % 2 == 0).then_some(arcs)
    }

    /// The arcs in a triangle whose sides have these normal coordinates, which must be those of curves.
    #[inline]
    pub fn new(normal: [i32; 3]) -> Self {
        let n = normal.map(|n| n.max(0));
        // Corner c has side c on its right, side c + 2 on its left and side c + 1 opposite.
        let emanating =
            [(n[1] - n[0] - n[2]).max(0), (n[2] - n[1] - n[0]).max(0), (n[0] - n[2] - n[1]).max(0)];
        let cutting = [
            ((n[0] + n[2] - n[1] - emanating[1] - emanating[2]) / 2).max(0),
            ((n[1] + n[0] - n[2] - emanating[2] - emanating[0]) / 2).max(0),
            ((n[2] + n[1] - n[0] - emanating[0] - emanating[1]) / 2).max(0),
        ];
        Self { crossings: n, cutting, emanating }
    }
}

/// What becomes of an edge when it is flipped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Flipped {
    /// Normal coordinate of the new edge from l to k.
    pub(crate) normal: i32,
    /// Curves that come out of k into the quad and end up between k → i and the new edge, exclusively.
    pub(crate) between_ki_and_kl: i32,
    /// Curves that come out of l into the quad and end up between l → j and the new edge, exclusively.
    pub(crate) between_lj_and_lk: i32,
}

/// Integer coordinates after the flip of i → j between the faces (i, j, k) and (j, i, l), of which `left` and
/// `right` count the arcs; `coincident` says that i → j runs along a curve (Gillespie et al. 2021, §3.3).
pub(crate) fn flipped(left: &Arcs, right: &Arcs, coincident: bool) -> Flipped {
    let n = left.crossings[0];
    let ([ci, cj, ck], [ei, ej, ek]) = (left.cutting, left.emanating);
    let ([dj, di, dl], [fj, fi, fl]) = (right.cutting, right.emanating);
    // From i to j the edge meets, seen from the left, ci arcs around i, ek arcs out of k, cj arcs around j;
    // seen from the right di around i, fl out of l, dj around j.
    let overlap = (ci + ek).min(di + fl) - ci.max(di);
    let straight_through = ek > 0 && fl > 0 && overlap > 0;
    let normal = if straight_through {
        COINCIDENT
    } else {
        let across = (ci + dj - n).max(0) + (cj + di - n).max(0);
        ck + dl + ei + ej + fi + fj + across + i32::from(coincident)
    };
    Flipped {
        normal,
        between_ki_and_kl: ((ci + ek).min(di) - ci).max(0),
        between_lj_and_lk: (di + fl - (ci + ek).max(di)).max(0),
    }
}

/// A region into which arcs cut a triangle, named by how a vertex inserted there lies to them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Region {
    /// Crossings between each corner and a point of the region.
    pub(crate) crossings: [i32; 3],
    /// Of the curves that come out of each corner into the triangle, those clockwise of a point of the region:
    /// on the side of the triangle's side that begins at the corner.
    pub(crate) clockwise: [i32; 3],
    /// A side the region touches.
    pub(crate) side: usize,
    /// Where: after this many crossings from the side's start.
    pub(crate) segment: i32,
}

impl Arcs {
    /// The region cut off by corner `c` between the arcs `level − 1` and `level`, counted from the corner.
    pub(crate) fn corner_region(&self, c: usize, level: i32) -> Region {
        let (next, last) = ((c + 1) % 3, (c + 2) % 3);
        let outward = self.cutting[c] - level;
        let mut crossings = [0; 3];
        crossings[c] = level;
        // Arcs out of the third corner lie between.
        crossings[next] = outward + self.cutting[next] + self.emanating[last];
        crossings[last] = outward + self.cutting[last] + self.emanating[next];
        let mut clockwise = [0; 3];
        // Seen from the next corner, c is at the counter-clockwise end; from the last, at the clockwise end.
        clockwise[next] = self.emanating[next];
        clockwise[last] = 0;
        Region { crossings, clockwise, side: c, segment: level }
    }

    /// The region that no corner cuts off, where no curve comes out of a corner.
    pub(crate) fn central_region(&self) -> Region {
        Region { crossings: self.cutting, clockwise: [0; 3], side: 0, segment: self.cutting[0] }
    }

    /// The region between the arcs `clockwise − 1` and `clockwise` of those that come out of corner `c`, counted
    /// counter-clockwise, and not cut off by another corner.
    pub(crate) fn fan_region(&self, c: usize, clockwise: i32) -> Region {
        let (next, last) = ((c + 1) % 3, (c + 2) % 3);
        let mut crossings = [0; 3];
        crossings[next] = self.cutting[next] + clockwise;
        crossings[last] = self.cutting[last] + self.emanating[c] - clockwise;
        let mut before = [0; 3];
        before[c] = clockwise;
        Region { crossings, clockwise: before, side: next, segment: self.cutting[next] + clockwise }
    }

    /// The region that touches side `side` after `segment` crossings from its start.
    pub(crate) fn region_at_side(&self, side: usize, segment: i32) -> Region {
        let (next, last) = ((side + 1) % 3, (side + 2) % 3);
        let from_end = self.crossings[side] - segment;
        if segment < self.cutting[side] {
            self.corner_region(side, segment)
        } else if from_end < self.cutting[next] {
            Region { side, segment, ..self.corner_region(next, from_end) }
        } else if self.emanating[last] > 0 {
            self.fan_region(last, segment - self.cutting[side])
        } else if self.emanating[side] > 0 {
            // Clockwise of all curves that come out of the side's start.
            Region { side, segment, ..self.fan_region(side, 0) }
        } else if self.emanating[next] > 0 {
            Region { side, segment, ..self.fan_region(next, self.emanating[next]) }
        } else {
            Region { side, segment, ..self.central_region() }
        }
    }
}
